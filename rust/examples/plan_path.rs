//! Plans the milled helix of Leger (2014, section 4.3.4) for its FANUC M-710iC/50: the spin of the tool at every point, so that the worst
//! condition number is the least. Prints that number.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use redundancy::error::Result;
use redundancy::index::{Index, Kind, Objective, Rows};
use redundancy::linalg::frame::Frame;
use redundancy::plan::{Hooks, Path, PlanSettings, Planner};
use redundancy::robot::{Convention, DhTable, Limits, Robot};
use redundancy::task::Task;

/// Characteristic length [m].
const LENGTH: f64 = 0.4855933;

/// The robot with its milling tool: DH table, limits, and the tool frame whose z axis is the milling axis.
fn robot() -> Result<Robot> {
    let radians = |degrees: [f64; 6]| degrees.map(f64::to_radians).to_vec();
    let table = DhTable {
        a: vec![0.15, 0.87, 0.17, 0.0, 0.0, -0.287692],
        d: vec![0.0, 0.0, 0.0, -1.016, 0.0, -0.607777],
        alpha: radians([-90.0, 180.0, -90.0, 90.0, -90.0, 180.0]),
        theta: radians([0.0, -90.0, 0.0, 0.0, 0.0, 0.0]),
        convention: Convention::Standard,
    };
    let limits = Limits {
        q_min: radians([-180.0, -60.0, -131.8, -360.0, -125.0, -360.0]),
        q_max: radians([180.0, 75.0, 230.0, 360.0, 125.0, 360.0]),
        ..Limits::none(6)
    };
    let tool = Frame::rotation([0.0, 1.0, 0.0], 120f64.to_radians());
    Robot::from_dh("fanuc_m710ic50_milling", table, "RRRRRR")?.with_tool(tool).with_limits(limits)
}

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let path = Path::helix(0.25, 0.5 / PI, (0.0, FRAC_PI_2), PI, [1.3, 1.0, 0.0], 101)?;
    let kappa = Index::of(Kind::ConditionNumber, Rows::all(LENGTH)?, false);
    let objective = Objective::new(vec![(1.0, kappa)])?;
    let task = Task::axisymmetric([0.0, 0.0, 1.0])?;
    let planner = Planner::new(Arc::new(robot()?), path, task, Some(objective), PlanSettings::default())?;
    let plan = planner.plan(&mut Hooks::default())?;
    if let Some(failure) = &plan.failure {
        println!("{failure}");
    }
    println!("worst condition number {:.6}, no path below {:.6}", plan.worst(), plan.bound);
    Ok(())
}
