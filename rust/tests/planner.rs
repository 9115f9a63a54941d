//! The planner from Rust alone: the helix of the thesis, the caller's hooks, and that the number of threads does not matter.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use redundancy::index::{Index, Kind, Objective, Rows};
use redundancy::plan::{Aim, FailedJoint, FailureCause, Hooks, Path, Plan, PlanError, PlanFailure, PlanSettings, Planner, point_weights};
use redundancy::resolve::SolveStatus;
use redundancy::task::Task;

use crate::common::fanuc;

fn helix(points: usize) -> Path {
    Path::helix(0.25, 0.5 / PI, (0.0, FRAC_PI_2), PI, [1.3, 1.0, 0.0], points).unwrap()
}

fn planner(path: Path, settings: PlanSettings) -> Planner {
    let task = Task::axisymmetric([0.0, 0.0, 1.0]).unwrap();
    let kappa = Index::of(Kind::ConditionNumber, Rows::all(0.4855933).unwrap(), false);
    let objective = Objective::new(vec![(1.0, kappa)]).unwrap();
    Planner::new(Arc::new(fanuc()), path, task, Some(objective), settings).unwrap()
}

#[test]
fn helix_of_the_thesis() {
    let plan = planner(helix(101), PlanSettings::default()).plan(&mut Hooks::default()).unwrap();
    assert!((plan.worst() - 2.542252).abs() < 1e-6);
    assert!(plan.refined && plan.failure.is_none() && (plan.worst() - plan.bound).abs() < 1e-6);
    assert!(plan.status.iter().all(|status| *status == SolveStatus::Converged));
}

#[test]
fn threads_do_not_matter() {
    let settings = PlanSettings { criterion: Aim::Integral, bound: Some(true), n_angles: 24, effort: Some(2), ..PlanSettings::default() };
    let planner = planner(helix(60), settings);
    let plans = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| planner.plan(&mut Hooks::default())).unwrap()
    });
    let numbers = |plan: &Plan| [&plan.q[..], &plan.value, &[plan.cost, plan.bound, plan.residual]].concat();
    assert_eq!(numbers(&plans[0]), numbers(&plans[1]));
}

#[test]
fn hooks_are_asked_and_told() {
    let planner = planner(helix(31), PlanSettings { n_angles: 24, effort: Some(1), ..PlanSettings::default() });
    let free = planner.plan(&mut Hooks::default()).unwrap();
    let ceiling = free.q.chunks_exact(6).map(|q| q[4]).fold(f64::NEG_INFINITY, f64::max) - 0.05;
    let mut told = 0;
    let mut below = |q: &[f64]| Ok(q.chunks_exact(6).map(|q| q[4] < ceiling).collect());
    let mut progress = |points: usize| told += points;
    let plan = planner.plan(&mut Hooks { feasible: Some(&mut below), progress: Some(&mut progress), cancelled: None }).unwrap();
    assert!(plan.failure.is_some() || plan.q.chunks_exact(6).all(|q| q[4] < ceiling));
    assert!(told >= 31);
}

#[test]
fn a_plan_ends_when_it_is_told_to() {
    let planner = planner(helix(31), PlanSettings::default());
    for patience in [0, 1, 5] {
        let mut asked = 0;
        let mut impatient = || {
            asked += 1;
            asked > patience
        };
        let ended = planner.plan(&mut Hooks { cancelled: Some(&mut impatient), ..Hooks::default() });
        assert!(matches!(ended, Err(PlanError::Cancelled)));
        assert_eq!(asked, patience + 1);
    }
    let mut broken = |_: &[f64]| Err("no scene".into());
    let ended = planner.plan(&mut Hooks { feasible: Some(&mut broken), ..Hooks::default() });
    assert!(matches!(ended, Err(PlanError::Predicate(error)) if error.to_string() == "no scene"));
    let mut short = |_: &[f64]| Ok(vec![true]);
    let ended = planner.plan(&mut Hooks { feasible: Some(&mut short), ..Hooks::default() });
    assert!(matches!(ended, Err(PlanError::Input(_))));
}

#[test]
fn a_failure_is_told_in_the_units_that_people_read() {
    let text = |cause, excess, slides| {
        PlanFailure { point: 7, cause, joint: Some(FailedJoint { number: 2, slides, excess, combination: None }), pins: vec![] }.to_string()
    };
    let limit = FailureCause::JointLimit;
    assert_eq!(text(limit, 0.0123, false), "point 7: joint limit of joint 3, which would have to go about 0.705 deg beyond it");
    assert_eq!(text(limit, 0.0123, true), "point 7: joint limit of joint 3, which would have to go about 12.3 mm beyond it");
    assert_eq!(text(FailureCause::StepLimit, 2.5, false), "point 7: step limit of joint 3, 2.5 times it would be needed");
    assert_eq!(text(FailureCause::SpeedLimit, 1234.5, false), "point 7: speed limit of joint 3, 1.23e+03 times it would be needed");
    let failure = |cause| PlanFailure { point: 0, cause, joint: None, pins: vec![] }.to_string();
    assert_eq!(failure(FailureCause::Unreachable), "point 0: unreachable");
    assert!(FailureCause::ALL.into_iter().all(|cause| failure(cause).contains(cause.name())));
}

#[test]
fn shares_sum_to_one_by_time_or_by_length() {
    let timed = helix(11).with_time((0..11).map(|i| f64::from(i * i)).collect()).unwrap();
    for (path, last) in [(helix(11), 0.1), (timed, 0.19)] {
        let shares = path.shares();
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-14 && (shares[9] - last).abs() < 1e-12);
        assert!((point_weights(&shares, false).iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert_eq!(point_weights(&shares, true)[10], 0.0);
    }
    assert!(helix(11).with_time(vec![0.0; 11]).is_err());
    assert!(Path::new(vec![[0.0; 3]], vec![[0.0; 3]], None, None).is_err());
}
