//! What the tool has to do, and what it is free to do.
//!
//! ```
//! use redundancy::kinematics::forward;
//! use redundancy::robot::{Convention, DhTable, Robot};
//! use redundancy::task::{Target, Task};
//!
//! let quarter = std::f64::consts::FRAC_PI_2;
//! let table = DhTable {
//!     convention: Convention::Standard,
//!     a: vec![0.0, 0.4, 0.0, 0.0, 0.0, 0.0],
//!     d: vec![0.3, 0.0, 0.0, 0.4, 0.0, 0.1],
//!     alpha: vec![quarter, 0.0, quarter, -quarter, quarter, 0.0],
//!     theta: vec![0.0; 6],
//! };
//! let robot = Robot::from_dh("six joints", table, "RRRRRR")?;
//! // A milling tool may spin about its axis: five of six components of its twist matter.
//! let task = Task::axisymmetric([0.0, 0.0, 1.0])?;
//! assert_eq!((task.dimension(), task.redundancy(&robot)), (5, (0, 1)));
//! // Spun by the last joint, which turns about that axis, the tool is where it has to be.
//! let tool = forward(&robot, &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6])?;
//! let spun = forward(&robot, &[0.1, 0.2, 0.3, 0.4, 0.5, 1.6])?;
//! let (w, v) = task.error(&tool, &Target { position: spun.origin, axis: None, frame: spun.axes });
//! assert!(w.iter().chain(&v).all(|x| x.abs() < 1e-12));
//! # Ok::<(), redundancy::error::Error>(())
//! ```

mod constraint;
mod directions;
mod error;
mod projector;
mod redundancy;
mod suited;
pub mod volume;

pub use constraint::Constraint;
pub use directions::Directions;
pub use projector::Projector;
pub use volume::OrientationVolume;

use crate::error::Result;
use crate::linalg::Mat6;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, halves, sub};

/// In which frame, and at which point, the motion of a task is decomposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reference {
    /// The tool frame, at the tool point: the symmetry of a tool.
    Tool,
    /// The base frame, at the tool point.
    Base,
    /// A frame fixed in the base, at its origin: the symmetry of a part.
    Part(Frame),
}

/// A task: which motions matter, angular and linear, one of 16 twist projectors (Huo 2009, table 3.6).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task {
    /// Of the angular velocity.
    pub angular: Projector,
    /// Of the linear velocity.
    pub linear: Projector,
    /// Frame of both.
    pub reference: Reference,
}

/// Where the tool has to be; the parts a task does not ask for are not looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Position of the tool point \[m\].
    pub position: Vec3,
    /// Direction of the tool's axis (unit), for an axisymmetric tool; that of `frame` if not given.
    pub axis: Option<Vec3>,
    /// Axes of the tool frame.
    pub frame: [Vec3; 3],
}

impl Task {
    /// Position and orientation.
    pub const FULL: Self = Self { angular: Projector::All, linear: Projector::All, reference: Reference::Tool };

    /// Position.
    pub const POSITION: Self = Self { angular: Projector::None, linear: Projector::All, reference: Reference::Tool };

    /// A tool that may spin about `axis` (tool frame, any length).
    pub fn axisymmetric(axis: Vec3) -> Result<Self> {
        Ok(Self { angular: Projector::plane(axis)?, ..Self::FULL })
    }

    /// The axis about which the tool may spin, if that is what is free.
    #[inline(always)]
    pub fn spin_axis(&self) -> Option<Vec3> {
        match (self.angular, self.linear, self.reference) {
            (Projector::Plane(axis), Projector::All, Reference::Tool) => Some(axis),
            _ => None,
        }
    }

    /// "axisymmetric", "full" or "position", or "general" for the other projectors.
    pub fn kind(&self) -> &'static str {
        match (self.angular, self.linear) {
            (Projector::All, Projector::All) => "full",
            (Projector::None, Projector::All) => "position",
            _ if self.spin_axis().is_some() => "axisymmetric",
            _ => "general",
        }
    }

    /// Number of components of the twist that matter.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        self.angular.dimension() + self.linear.dimension()
    }

    /// The task that asks for what this one leaves free.
    pub fn complement(&self) -> Self {
        Self { angular: self.angular.complement(), linear: self.linear.complement(), ..*self }
    }

    /// The twist projector T (Huo 2009, eq. 3.6) in the base frame, at the point that the task speaks of.
    pub fn projector(&self, tool: &Frame) -> Mat6 {
        let directions = Directions { arm: [0.0; 3], ..self.directions(tool, 1.0) };
        let mut out = [[0.0; 6]; 6];
        for c in 0..6 {
            let mut unit = [0.0; 6];
            unit[c] = 1.0;
            let (w, v) = halves(&unit);
            let (w, v) = directions.project(w, v);
            for r in 0..3 {
                (out[r][c], out[r + 3][c]) = (w[r], v[r]);
            }
        }
        out
    }

    /// The twist directions that matter when the tool is at `tool`.
    #[inline(never)] // one copy, so that a tick with cold caches fetches it once
    pub fn directions(&self, tool: &Frame, length: f64) -> Directions {
        let (turned, arm) = match &self.reference {
            Reference::Tool => (tool, [0.0; 3]),
            Reference::Base => (&Frame::IDENTITY, [0.0; 3]),
            Reference::Part(part) => (part, sub(part.origin, tool.origin)),
        };
        Directions {
            angular: self.angular.basis(|e| turned.rotate(e)),
            linear: self.linear.basis(|e| turned.rotate(e)),
            counts: (self.angular.dimension(), self.linear.dimension()),
            arm,
            length,
        }
    }
}
