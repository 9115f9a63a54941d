//! The condition number of the oracle postures: value, gradient and Hessian in (q, L), within multiples of 2.2e-16 kappa.

use redundancy::index::{Index, Kind, Objective, Order, Rows};
use redundancy::linalg::frame::Frame;
use redundancy::robot::{Convention, DhTable, Robot};
use serde_json::Value;

use crate::common::evaluate;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_str().unwrap().parse().unwrap()).collect()
}

fn case_errors<const C: usize>(case: &Value) -> (bool, [f64; 3]) {
    let model = &case["model"];
    let column = |name: &str| numbers(&model[name]);
    let table =
        DhTable { convention: Convention::Standard, a: column("a"), d: column("d"), alpha: column("alpha"), theta: column("theta") };
    let robot = Robot::from_dh("oracle", table, model["joints"].as_str().unwrap()).unwrap();
    let robot = match model.get("tool_offset") {
        Some(offset) => {
            let offset = numbers(offset);
            robot.with_tool(Frame::translation([offset[0], offset[1], offset[2]]))
        }
        None => robot,
    };
    let rows: Vec<usize> = model["rows"].as_array().unwrap().iter().map(|x| x.as_u64().unwrap() as usize).collect();
    let length: f64 = case["L"].as_str().unwrap().parse().unwrap();
    let q = numbers(&case["q"]);
    let n = q.len();
    let index = Index::of(Kind::ConditionNumber, Rows::new(&rows, length).unwrap(), true);
    let objective = Objective::new(vec![(1.0, index)]).unwrap();
    let got = evaluate::<C>(&objective, &robot, &q, Order::Hessian, true);

    let kappa: f64 = case["kappa"].as_str().unwrap().parse().unwrap();
    let gradient = numbers(&case["grad"]);
    let hessian: Vec<Vec<f64>> = case["hess"].as_array().unwrap().iter().map(numbers).collect();
    let unit = f64::EPSILON * kappa;
    let entry = |k: usize, l: usize| match (k < n, l < n) {
        (true, true) => got.hessian[k][l],
        (true, false) => got.length_gradient[k],
        (false, true) => got.length_gradient[l],
        (false, false) => got.length_curvature,
    };
    let (mut dg, mut g2, mut dh, mut h2) = (0.0, 0.0, 0.0, 0.0);
    for k in 0..=n {
        let mine = if k < n { got.gradient[k] } else { got.length_slope };
        dg += (mine - gradient[k]).powi(2);
        g2 += gradient[k].powi(2);
        for l in 0..=n {
            dh += (entry(k, l) - hessian[k][l]).powi(2);
            h2 += hessian[k][l].powi(2);
        }
    }
    let value = (got.value.sqrt() - kappa).abs() / kappa / unit;
    (rows.len() == n, [value, (dg / g2).sqrt() / unit, (dh / h2).sqrt() / unit])
}

#[test]
fn oracle_postures() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/condition_number.json")).unwrap();
    let data: Value = serde_json::from_str(&text).unwrap();
    let mut worst = [[0.0f64; 3]; 2];
    for case in data["cases"].as_array().unwrap() {
        // The specialised and the general path must both hold.
        let general = case_errors::<16>(case);
        let special = match case["q"].as_array().unwrap().len() {
            6 => case_errors::<6>(case),
            7 => case_errors::<7>(case),
            _ => general,
        };
        for (square, errors) in [general, special] {
            for i in 0..3 {
                worst[usize::from(!square)][i] = worst[usize::from(!square)][i].max(errors[i]);
            }
        }
    }
    println!("worst error / (2.2e-16 kappa): square {:?}, redundant {:?}", worst[0], worst[1]);
    for i in 0..3 {
        assert!(worst[0][i] <= [10.0, 20.0, 40.0][i], "square: {worst:?}");
        assert!(worst[1][i] <= [20.0, 40.0, 100.0][i], "redundant: {worst:?}");
    }
}
