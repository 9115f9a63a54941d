//! What the doors of kinematics and indices refuse and answer, and what does not depend on the length.

use redundancy::error::Error;
use redundancy::index::{Answers, Index, Kind, Objective, Order, Rows, differences, length_of_least_condition};
use redundancy::kinematics::{
    first_derivative, forward, forward_into, jacobian, jacobian_into, jacobian_rate, link_frames, second_derivative,
};
use redundancy::robot::{Convention, DhTable, Robot};

use crate::common::{Rng, fanuc, iiwa, indices};

fn of(index: Index) -> Objective {
    Objective::new(vec![(1.0, index)]).unwrap()
}

/// No call with arrays of a wrong length gets further than an error that says so.
#[test]
fn wrong_lengths_are_refused() {
    for robot in [fanuc(), iiwa(), Rng(1).robot(3, true, 0), Rng(2).robot(12, true, 0)] {
        let n = robot.n();
        let objective = of(Index::of(Kind::ConditionNumber, Rows::new(&[3, 4, 5], 0.5).unwrap(), false));
        let good = vec![0.3; n];
        let refused = |result: Result<(), Error>| assert!(matches!(result, Err(Error::Shape { .. })), "{n}: {result:?}");
        for count in [0, 1, n - 1, n + 1, 17, 40] {
            let q = &vec![0.3; count][..];
            refused(forward(&robot, q).map(drop));
            refused(jacobian(&robot, q).map(drop));
            refused(link_frames(&robot, q).map(drop));
            refused(length_of_least_condition(&robot, q, &Rows::all(1.0).unwrap()).map(drop));
            refused(objective.evaluate(&robot, q, Order::Hessian, true).map(drop));
            refused(objective.value(&robot, q).map(drop));
            refused(differences(&objective, &robot, q, Order::Value, 1e-4).map(drop));
            refused(jacobian_rate(&robot, &good, q, &mut vec![0.0; 6 * n]));
            let out = &mut vec![0.0; 6 * count.max(n + 1)][..];
            refused(forward_into(&robot, &good, out));
            refused(jacobian_into(&robot, &good, out));
            refused(first_derivative(&robot, &good, out));
            refused(second_derivative(&robot, &good, out));
            refused(jacobian_rate(&robot, &good, &good, out));
            if count > 0 {
                refused(objective.evaluate_into(&robot, &good, false, &mut vec![0.0; count], &mut []).map(drop));
                refused(objective.evaluate_into(&robot, &good, false, &mut [], &mut vec![0.0; n * count]).map(drop));
            }
            let out = &mut Answers { values: &mut [0.0; 3], gradients: &mut vec![0.0; 3 * n], hessians: &mut [] };
            if count % n != 0 || count != 3 * n {
                refused(objective.evaluate_many(&robot, q, false, out));
            }
            refused(objective.evaluate_many(&robot, &good.repeat(3), true, out));
        }
        refused(objective.evaluate_into(&robot, &good, true, &mut vec![0.0; n], &mut []).map(drop));
    }
}

/// Straight into the caller's memory stands what the owned answer holds.
#[test]
fn written_and_owned_answers_agree() {
    for n in [2, 6, 7, 11] {
        let rng = &mut Rng(n as u64);
        let robot = rng.robot(n, true, 0);
        let q: Vec<f64> = (0..n).map(|_| rng.within(-0.9, 0.9)).collect();
        let rows = rng.rows(n.min(4));
        for index in indices(Rows::new(&rows, 0.4).unwrap()) {
            let objective = of(index);
            for extra in [0, 1] {
                let size = n + extra;
                let owned = objective.evaluate(&robot, &q, Order::Hessian, extra == 1).unwrap();
                let (mut gradient, mut hessian) = (vec![0.0; size], vec![0.0; size * size]);
                let (value, status) = objective.evaluate_into(&robot, &q, extra == 1, &mut gradient, &mut hessian).unwrap();
                assert_eq!((value, status), (owned.value, owned.status));
                assert_eq!(gradient[..n], owned.gradient[..n]);
                for k in 0..n {
                    assert_eq!(hessian[k * size..k * size + n], owned.hessian[k][..n]);
                }
                if extra == 1 {
                    assert_eq!((gradient[n], hessian[size * size - 1]), (owned.length_slope, owned.length_curvature));
                }
            }
        }
    }
}

/// The length scales all rows in use or none: what does not depend on it has derivatives of exactly 0 in it.
#[test]
fn lengths_that_do_not_matter() {
    let robot = iiwa();
    let q = [0.3, -0.6, 0.4, 1.1, -0.2, 0.8, 0.5];
    let length_free = |index: Index| {
        let got = of(index).evaluate(&robot, &q, Order::Hessian, true).unwrap();
        assert!(got.value.is_finite());
        got.length_slope == 0.0 && got.length_curvature == 0.0 && got.length_gradient.iter().all(|x| *x == 0.0)
    };
    for squared in [false, true] {
        for length in [1e-6, 0.37, 30.0] {
            for kind in Kind::ALL {
                let of_rows = |rows: &[usize]| Index::of(*kind, Rows::new(rows, length).unwrap(), squared);
                let scale_free = matches!(kind, Kind::ConditionNumber | Kind::SpectralConditionNumber);
                assert_eq!(length_free(of_rows(&[0, 1, 2])), scale_free, "{kind:?} {length}");
                assert_eq!(length_free(of_rows(&[1])), scale_free, "{kind:?} {length}");
                assert!(length_free(of_rows(&[3, 4, 5])), "{kind:?} {length}");
                assert!(!length_free(of_rows(&[0, 1, 2, 3, 4, 5])), "{kind:?} {length}");
            }
        }
    }
}

#[test]
fn indices_by_name() {
    let rows = Rows::all(0.5).unwrap();
    for (name, of_jacobian) in Index::names() {
        let index = Index::named(name, rows, true).unwrap();
        assert_eq!(index.name(), name);
        assert_eq!(matches!(index, Index::OfJacobian(_)), of_jacobian);
    }
    assert!(Index::named("volume", rows, false).unwrap_err().to_string().contains("manipulability"));
}

#[test]
fn rows_in_use() {
    assert_eq!(fanuc().rows_in_use(), [0, 1, 2, 3, 4, 5]);
    assert_eq!(iiwa().rows_in_use(), [0, 1, 2, 3, 4, 5]);
    let chain = |letters: &str, alpha: f64| {
        let n = letters.len();
        let table =
            DhTable { convention: Convention::Standard, a: vec![0.4; n], d: vec![0.0; n], alpha: vec![alpha; n], theta: vec![0.0; n] };
        Robot::from_dh("chain", table, letters).unwrap()
    };
    assert_eq!(chain("RRR", 0.0).rows_in_use(), [2, 3, 4]);
    assert_eq!(chain("RPR", 0.0).rows_in_use(), [2, 3, 4, 5]);
    assert_eq!(chain("P", 0.0).rows_in_use(), [5]);
    assert_eq!(chain("PPP", std::f64::consts::FRAC_PI_2).rows_in_use(), [4, 5]);
}
