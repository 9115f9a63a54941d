//! Twist decomposition in a loop of its own at 1 kHz: prints what its ticks take.
//!
//! cargo run --release --example control_loop -- [seconds]
//!
//! The milling tool of a FANUC M-710iC/50 goes round a circle; its spin, which the task leaves free, keeps the arm well conditioned and away from its
//! limits. The loop sleeps until shortly before each tick and spins the rest of the time, as a loop without a real-time kernel has to.

use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use redundancy::index::{Index, Kind, LimitBarrier, Objective, Rows};
use redundancy::resolve::{Memory, Method, OrthogonalSqp, RateSettings, RateSolver, Resolver, Scaling, Secondary, SqpSettings, StepStatus};
use redundancy::robot::{Convention, DhTable, Limits, Robot};
use redundancy::task::{Target, Task};

const DT: f64 = 1e-3;
/// Length that weighs angles against distances [m].
const LENGTH: f64 = 0.485_593_3;
/// Circle [m].
const RADIUS: f64 = 0.1;
/// Speed along it [rad/s].
const OMEGA: f64 = 0.8;
/// Rate at which errors of position and axis are closed [1/s].
const FEEDBACK: f64 = 20.0;
/// The loop wakes up this long before its tick.
const EARLY: Duration = Duration::from_micros(200);

fn degrees<const N: usize>(values: [f64; N]) -> Vec<f64> {
    values.map(f64::to_radians).to_vec()
}

fn robot() -> Result<Robot, redundancy::error::Error> {
    let table = DhTable {
        convention: Convention::Standard,
        a: vec![0.15, 0.87, 0.17, 0.0, 0.0, -0.287_692],
        d: vec![0.0, 0.0, 0.0, -1.016, 0.0, -0.607_777],
        alpha: degrees([-90.0, 180.0, -90.0, 90.0, -90.0, 180.0]),
        theta: degrees([0.0, -90.0, 0.0, 0.0, 0.0, 0.0]),
    };
    let limits = Limits {
        q_min: degrees([-180.0, -60.0, -131.8, -360.0, -125.0, -360.0]),
        q_max: degrees([180.0, 75.0, 230.0, 360.0, 125.0, 360.0]),
        qd_max: degrees([175.0, 175.0, 175.0, 250.0, 250.0, 355.0]),
        ..Limits::none(6)
    };
    Robot::from_dh("fanuc_m710ic50", table, "RRRRRR")?.with_limits(limits)
}

/// Where the tool point is wanted after some time, and how fast it moves there.
fn circle(time: f64) -> (Target, [f64; 2]) {
    let (sine, cosine) = (OMEGA * time).sin_cos();
    let position = [1.3 + RADIUS * cosine, RADIUS * sine, 0.2];
    (Target { position, axis: Some([0.0, 1.0, 0.0]), frame: [[0.0; 3]; 3] }, [-RADIUS * OMEGA * sine, RADIUS * OMEGA * cosine])
}

fn main() -> Result<(), Box<dyn Error>> {
    let seconds: f64 = std::env::args().nth(1).map_or(Ok(10.0), |given| given.parse())?;
    let (robot, task) = (Arc::new(robot()?), Task::axisymmetric([0.0, 0.0, 1.0])?);
    let condition = Index::of(Kind::ConditionNumber, Rows::all(LENGTH)?, true);
    let objective = Objective::new(vec![(1.0, condition), (0.1, Index::LimitBarrier(LimitBarrier::new(&[])?))])?;
    let search = OrthogonalSqp::new(robot.clone(), task, objective.clone(), SqpSettings { length: LENGTH, ..SqpSettings::default() })?;
    let secondary = Secondary::Objective(objective, Scaling::Gradient);
    let settings = RateSettings { length: LENGTH, gain: 2.0, dt: DT, ..RateSettings::default() };
    let solver = RateSolver::new(robot, task, Method::TwistDecomposition, secondary, None, settings)?;

    let start = search.solve_best(&circle(0.0).0, 24, 0).ok_or("the circle is out of reach")?;
    println!("start: {}", start.status.name());
    let (mut q, mut rates, mut memory) = (start.q[..6].to_vec(), [0.0; 6], Memory::default());
    let ticks = (seconds / DT) as u32;
    let (mut took, mut regular, mut farthest) = (Vec::with_capacity(ticks as usize), 0, 0.0f64);
    let begin = Instant::now();
    for tick in 0..ticks {
        let (target, [vx, vy]) = circle(DT * f64::from(tick));
        let error = solver.error(&target, &q);
        let mut twist = error.map(|component| FEEDBACK * component);
        (twist[3], twist[4]) = (twist[3] + vx, twist[4] + vy);

        let before = Instant::now();
        let status = solver.step(&q, &twist, &mut memory, &mut rates);
        took.push(before.elapsed().as_nanos());

        regular += u32::from(status == StepStatus::Regular);
        farthest = farthest.max(error[3..].iter().map(|x| x * x).sum::<f64>().sqrt());
        for (q, rate) in q.iter_mut().zip(&rates) {
            *q += DT * rate;
        }
        let next = begin + Duration::from_secs_f64(DT * f64::from(tick + 1));
        std::thread::sleep(next.saturating_duration_since(Instant::now()).saturating_sub(EARLY));
        while Instant::now() < next {
            std::hint::spin_loop();
        }
    }
    took.sort_unstable();
    let at = |part: f64| took.get((part * (took.len().saturating_sub(1)) as f64) as usize).map_or(f64::NAN, |nanos| *nanos as f64 / 1e3);
    println!("{ticks} ticks in {:.2} s, {regular} of them regular", begin.elapsed().as_secs_f64());
    println!("a step: {:.2} us (median), {:.2} us (99.9 %), {:.2} us (worst)", at(0.5), at(0.999), at(1.0));
    println!("largest error of position {:.1} um", 1e6 * farthest);
    Ok(())
}
