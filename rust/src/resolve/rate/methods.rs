//! One step of the methods that resolve redundancy at the level of rates (Huo 2009): twist decomposition, the subject of that thesis, and its
//! rivals, each as `h + x` with h the motion that the secondary task asks for and x the shortest solution of the method's own system.

use crate::kinematics::sized::{Jacobian, jacobian};
use crate::linalg::damped::damped_step;
use crate::linalg::frame::Frame;
use crate::linalg::householder::Householder;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::vector::{halves, scale};
use crate::linalg::with_capacity;
use crate::linalg::{MAX_JOINTS, Row6, Rows6};
use crate::robot::Robot;
use crate::task::{Directions, Task};

/// A method of redundancy resolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// `J^+ t` (2.24): every component of the twist, no redundancy used but the intrinsic.
    ResolvedRate,
    /// `J^+ T t + J^+ (1 - T) J h` (3.8), and what the null space of J takes of h.
    TwistDecomposition,
    /// `J^+ t + (1 - J^+ J) h` (2.25) on the task's own Jacobian.
    GradientProjection,
    /// The same with lengths weighted joint by joint (2.38, 2.39).
    WeightedInverse,
    /// The rest of the twist as a task of second priority, h after it (2.37).
    TaskPriority,
    /// (2.25) by Householder reflections (2.44 to 2.50).
    Householder,
    /// (2.25) after the free velocities have been eliminated from the six equations (2.74, 2.75).
    Elimination,
    /// (2.25) for the robot with a virtual joint along every free direction (2.76 to 2.79).
    VirtualJoint,
}

/// What a motion starts from.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// The robot; with the virtual joints of the method it has at most 16.
    pub robot: &'a Robot,
    /// Its posture.
    pub q: &'a [f64],
    /// The task.
    pub task: &'a Task,
    /// Length that weighs angles against distances \[m\].
    pub length: f64,
    /// Below this ratio of the shortest to the longest orthogonal row a system is solved with damping.
    pub damping: f64,
    /// Weights of the joints, for [`Method::WeightedInverse`].
    pub weights: &'a [f64],
}

/// A [`Situation`] whose Jacobian is known.
pub(super) struct Posed<'a, const C: usize> {
    pub task: &'a Task,
    pub tool: &'a Frame,
    pub jacobian: &'a Jacobian<'a, C>,
    /// The task's.
    pub directions: &'a Directions,
    pub length: f64,
    pub damping: f64,
    pub weights: &'a [f64; C],
}

/// Shortest solutions of the systems of a step, and whether one of them had to be damped.
struct Shortest {
    damping: f64,
    damped: bool,
}

impl Shortest {
    /// Solved exactly by `solve` where the rows are well apart, and with damping near a singularity: never longer than `|b| / (damping |A|)`.
    #[inline(always)]
    fn guarded<const C: usize>(
        &mut self,
        a: &Rows6<C>,
        b: &Row6,
        n: usize,
        m: usize,
        spread: f64,
        solve: impl Fn(&Row6) -> [f64; C],
    ) -> [f64; C] {
        if m == 0 {
            return [0.0; C];
        }
        if m <= n && spread >= self.damping {
            return solve(b);
        }
        self.damped = true;
        let size: f64 = a.iter().take(m).flatten().map(|x| x * x).sum();
        let closeness = (spread / self.damping).min(1.0);
        let least = f64::EPSILON * size;
        damped_step(a, b, self.damping * self.damping * size * (1.0 - closeness * closeness) + least, n, m)
    }

    #[inline(never)]
    fn of<const C: usize>(&mut self, a: &Rows6<C>, b: &Row6, n: usize, m: usize) -> [f64; C] {
        let factors = Orthogonal::new(a, n, m);
        let spread = if m > n { 0.0 } else { factors.spread() };
        self.guarded(a, b, n, m, spread, |b| factors.solve(b))
    }
}

/// b - A x.
#[inline(always)]
fn remainder<const C: usize>(b: &Row6, a: &Rows6<C>, x: &[f64; C], m: usize) -> Row6 {
    let mut out = *b;
    for r in 0..m {
        for i in 0..C {
            out[r] -= a[r][i] * x[i];
        }
    }
    out
}

#[inline(always)]
fn plus<const C: usize>(a: &[f64; C], b: &[f64; C]) -> [f64; C] {
    std::array::from_fn(|i| a[i] + b[i])
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 8] = [
        Self::TwistDecomposition,
        Self::VirtualJoint,
        Self::GradientProjection,
        Self::Householder,
        Self::Elimination,
        Self::WeightedInverse,
        Self::TaskPriority,
        Self::ResolvedRate,
    ];

    /// Whether the method can keep a tool in a volume: those whose answer depends on the task's own components alone.
    pub(super) fn takes_volumes(self) -> bool {
        matches!(self, Self::TwistDecomposition | Self::GradientProjection | Self::WeightedInverse | Self::Householder)
    }

    /// The columns that the method's system adds to those of the joints.
    pub fn extra_columns(self, task: &Task) -> usize {
        if self == Self::VirtualJoint { 6 - task.dimension() } else { 0 }
    }

    /// The columns that its kernels need room for, with those of the virtual joints. Six of them are the capacity that takes all for joints:
    /// with fewer joints, the next one.
    pub(super) fn columns(self, n: usize, task: &Task) -> usize {
        let extra = self.extra_columns(task);
        if extra == 0 { n } else { (n + extra).max(7) }
    }

    /// Writes the joint motion for a twist with the secondary motion `h`, one number a joint each; whether it was damped. To arrays of another
    /// size the answer is no motion.
    pub fn motion(self, at: &Situation<'_>, twist: &Row6, h: &[f64], out: &mut [f64]) -> bool {
        let n = at.robot.n();
        if [at.q.len(), h.len(), out.len()] != [n; 3] || n + self.extra_columns(at.task) > MAX_JOINTS {
            out.fill(0.0);
            return true;
        }
        with_capacity!(self.columns(n, at.task), motion(self, at, twist, h, out))
    }

    /// The joint motion for a twist with the secondary motion `h`, and whether it was damped.
    #[inline(never)]
    pub(super) fn motion_at<const C: usize>(self, at: &Posed<'_, C>, twist: &Row6, h: &[f64; C]) -> ([f64; C], bool) {
        let (w, v) = halves(twist);
        let n = at.jacobian.n();
        let directions = at.directions;
        let m = directions.dimension();
        let mut systems = Shortest { damping: at.damping, damped: false };
        let own = |directions: &Directions| (directions.rows(at.jacobian), directions.reduce(w, v));
        let dq = match self {
            Self::ResolvedRate | Self::TwistDecomposition => {
                let full = Directions::all(at.length);
                let (rows, t) = own(&full);
                let left = remainder(&t, &rows, h, 6);
                let wanted = if self == Self::ResolvedRate { left } else { projected(directions, &left, at.length) };
                plus(h, &systems.of(&rows, &wanted, n, 6))
            }
            Self::GradientProjection => {
                let (rows, t) = own(directions);
                plus(h, &systems.of(&rows, &remainder(&t, &rows, h, m), n, m))
            }
            Self::Householder => {
                let (rows, t) = own(directions);
                let factors = Householder::new(&rows, n, m);
                let left = remainder(&t, &rows, h, m);
                plus(h, &systems.guarded(&rows, &left, n, m, factors.spread(), |b| factors.solve(b)))
            }
            Self::WeightedInverse => {
                let (mut rows, t) = own(directions);
                let left = remainder(&t, &rows, h, m);
                let shrink: [f64; C] = at.weights.map(|weight| 1.0 / weight.sqrt());
                for row in rows.iter_mut().take(m) {
                    for i in 0..C {
                        row[i] *= shrink[i];
                    }
                }
                let x = systems.of(&rows, &left, n, m);
                std::array::from_fn(|i| h[i] + shrink[i] * x[i])
            }
            Self::TaskPriority => {
                let rest = at.task.complement().directions(at.tool, at.length);
                priority(&mut systems, own(directions), own(&rest), h, n, (m, 6 - m))
            }
            Self::Elimination => {
                let (rows, t) = own(&Directions::all(at.length));
                let (rows, t) = eliminate(&rows, &t, &free_twists(at), 6 - m);
                plus(h, &systems.of(&rows, &remainder(&t, &rows, h, m), n, m))
            }
            Self::VirtualJoint => {
                let (mut rows, t) = own(&Directions::all(at.length));
                let left = remainder(&t, &rows, h, 6);
                for (i, free) in free_twists(at).iter().enumerate().take(6 - m) {
                    for r in 0..6 {
                        rows[r][n + i] = free[r];
                    }
                }
                let x = systems.of(&rows, &left, n + 6 - m, 6);
                std::array::from_fn(|i| if i < n { h[i] + x[i] } else { 0.0 })
            }
        };
        (dq, systems.damped)
    }
}

fn motion<const C: usize>(method: Method, at: &Situation<'_>, twist: &Row6, h: &[f64], out: &mut [f64]) -> bool {
    let (tool, columns) = jacobian::<C>(at.robot, at.q);
    let wide = |values: &[f64], rest: f64| -> [f64; C] { std::array::from_fn(|i| values.get(i).copied().unwrap_or(rest)) };
    let (weights, h) = (wide(at.weights, 1.0), wide(h, 0.0));
    let directions = at.task.directions(&tool, at.length);
    let posed = Posed {
        task: at.task,
        tool: &tool,
        jacobian: &columns,
        directions: &directions,
        length: at.length,
        damping: at.damping,
        weights: &weights,
    };
    let (dq, damped) = method.motion_at(&posed, twist, &h);
    out.copy_from_slice(&dq[..out.len()]);
    damped
}

/// `T t` of a twist whose angular part is multiplied by the length.
#[inline(always)]
fn projected(directions: &Directions, t: &Row6, length: f64) -> Row6 {
    let (w, v) = directions.project(scale(1.0 / length, [t[0], t[1], t[2]]), [t[3], t[4], t[5]]);
    [length * w[0], length * w[1], length * w[2], v[0], v[1], v[2]]
}

/// The free twists, of unit length, angular part times the length.
#[inline(never)]
fn free_twists<const C: usize>(at: &Posed<'_, C>) -> [Row6; 6] {
    let free = at.task.complement().directions(at.tool, 1.0);
    let mut out = [[0.0; 6]; 6];
    for (i, twist) in out.iter_mut().enumerate().take(free.dimension()) {
        let mut unit = [0.0; 6];
        unit[i] = 1.0;
        // A free motion turns about, or slides along, the point that the task speaks of.
        let (w, v) = free.motion_of(&unit);
        let w = scale(at.length, w);
        *twist = [w[0], w[1], w[2], v[0], v[1], v[2]];
    }
    out
}

/// Two tasks in order of priority, then h in what both leave (2.37).
#[inline(never)]
fn priority<const C: usize>(
    systems: &mut Shortest,
    (first, t1): (Rows6<C>, Row6),
    (second, t2): (Rows6<C>, Row6),
    h: &[f64; C],
    n: usize,
    (m1, m2): (usize, usize),
) -> [f64; C] {
    let q1 = systems.of(&first, &t1, n, m1);
    if n <= m1 || systems.damped {
        return q1;
    }
    let basis = Orthogonal::new(&first, n, m1).null_space();
    let free = n - m1;
    // The second task and h in coordinates of the null space of the first.
    let mut reduced = [[0.0; C]; 6];
    let mut inner = [0.0; C];
    for z in 0..free {
        for r in 0..m2 {
            reduced[r][z] = (0..n).map(|i| second[r][i] * basis[z][i]).sum();
        }
        inner[z] = (0..n).map(|i| h[i] * basis[z][i]).sum();
    }
    let left = remainder(&remainder(&t2, &second, &q1, m2), &reduced, &inner, m2);
    let u = plus(&inner, &systems.of(&reduced, &left, free, m2));
    let mut out = q1;
    for z in 0..free {
        for i in 0..n {
            out[i] += u[z] * basis[z][i];
        }
    }
    out
}

/// Gauss elimination of the free velocities from `J qd = t + E s`, pivoting by size: the equations that are left, in order.
#[inline(never)]
fn eliminate<const C: usize>(rows: &Rows6<C>, t: &Row6, free: &[Row6; 6], count: usize) -> (Rows6<C>, Row6) {
    let (mut rows, mut t, mut free) = (*rows, *t, *free);
    let mut used = [false; 6];
    for k in 0..count {
        let mut pivot = 0;
        let mut largest = -1.0;
        for r in 0..6 {
            if !used[r] && free[k][r].abs() > largest {
                (pivot, largest) = (r, free[k][r].abs());
            }
        }
        used[pivot] = true;
        for r in 0..6 {
            if used[r] {
                continue;
            }
            let factor = free[k][r] / free[k][pivot];
            for i in 0..C {
                rows[r][i] -= factor * rows[pivot][i];
            }
            t[r] -= factor * t[pivot];
            for other in free.iter_mut().take(count).skip(k + 1) {
                other[r] -= factor * other[pivot];
            }
        }
    }
    let (mut kept, mut wanted, mut next) = ([[0.0; C]; 6], [0.0; 6], 0);
    for r in 0..6 {
        if !used[r] {
            (kept[next], wanted[next]) = (rows[r], t[r]);
            next += 1;
        }
    }
    (kept, wanted)
}
