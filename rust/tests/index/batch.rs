//! Many postures at once: every lane answers bit for bit what the posture alone answers, whatever its neighbours are.

use proptest::prelude::*;
use redundancy::index::{Answers, Index, Kind, Objective, Order, Rows, Status};
use redundancy::robot::Robot;

use crate::common::{Rng, fanuc, indices, rngs};

fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

/// The indices that go side by side.
fn smooth(rows: Rows) -> Vec<Index> {
    indices(rows)
        .into_iter()
        .filter(|index| matches!(index, Index::OfJacobian(index) if [Kind::ConditionNumber, Kind::Manipulability].contains(&index.kind)))
        .collect()
}

/// Every answer against the posture alone; how many postures were singular.
fn compare(objective: &Objective, robot: &Robot, q: &[f64], order: Order) -> Result<usize, TestCaseError> {
    let n = robot.n();
    let count = q.len() / n;
    let room = |least: Order, width: usize| vec![0.0; if order >= least { count * width } else { 0 }];
    let (mut values, mut gradients, mut hessians) = (vec![0.0; count], room(Order::Gradient, n), room(Order::Hessian, n * n));
    let mut out = Answers { values: &mut values, gradients: &mut gradients, hessians: &mut hessians };
    objective.evaluate_many(robot, q, false, &mut out).unwrap();
    let mut singular = 0;
    for (i, q) in q.chunks_exact(n).enumerate() {
        let alone = objective.evaluate(robot, q, order, false).unwrap();
        singular += usize::from(alone.status == Status::Singular);
        prop_assert!(same(values[i], alone.value), "{i}: {} {}", values[i], alone.value);
        for k in 0..n {
            prop_assert!(order < Order::Gradient || same(gradients[i * n + k], alone.gradient[k]), "{i} {k}");
            for l in 0..n {
                prop_assert!(order < Order::Hessian || same(hessians[(i * n + k) * n + l], alone.hessian[k][l]), "{i} {k} {l}");
            }
        }
    }
    Ok(singular)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn lanes_do_not_see_their_neighbours(seed in rngs(), n in 1usize..=12, count in 0usize..=11) {
        let rng = &mut Rng(seed);
        let robot = rng.robot(n, true, 0);
        let mut q: Vec<f64> = (0..n * count).map(|_| rng.within(-3.0, 3.0)).collect();
        // Stretched out, folded, and turned far beyond what the fast sines bear.
        for row in q.chunks_exact_mut(n) {
            match rng.below(4) {
                0 => row.fill(0.0),
                1 => row[rng.below(n)] = rng.within(-1e9, 1e9),
                _ => {}
            }
        }
        let count = 1 + rng.below(n.min(6));
        let (full, some) = (rng.rows(n.min(6)), rng.rows(count));
        for rows in [full, some] {
            let rows = Rows::new(&rows, rng.within(0.1, 2.0)).unwrap();
            let sum = smooth(rows).into_iter().map(|index| (rng.within(-2.0, 2.0), index)).collect();
            let alone = smooth(rows).into_iter().map(|index| vec![(1.0, index)]);
            for terms in alone.chain([sum]) {
                let objective = Objective::new(terms).unwrap();
                for order in [Order::Value, Order::Gradient, Order::Hessian] {
                    compare(&objective, &robot, &q, order)?;
                }
            }
        }
    }
}

/// A singular posture among regular ones: its own lane says so, the others do not.
#[test]
fn singular_lanes() {
    let regular = [0.3, 0.4, -0.5, 0.6, 0.9, 0.2];
    let wrist_singular = [0.3, 0.4, -0.5, 0.6, 0.0, 0.2];
    let q: Vec<f64> = [regular, wrist_singular, regular, regular, wrist_singular].concat();
    for index in smooth(Rows::all(0.5).unwrap()) {
        let objective = Objective::new(vec![(1.0, index)]).unwrap();
        assert_eq!(compare(&objective, &fanuc(), &q, Order::Gradient).unwrap(), 2);
    }
}
