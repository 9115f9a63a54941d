//! What the tests share: random robots, the robot of the thesis, numbers of every kind, numerical derivatives.
#![allow(dead_code, clippy::unwrap_used, missing_docs)]

use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;
use redundancy::index::{Index, JointLimits, Kind, LimitBarrier, Objective, Order, Rows};
use redundancy::internals::index::Evaluation;
use redundancy::internals::linalg::Svd;
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::{norm, scale};
use redundancy::qp::Row;
use redundancy::robot::{Convention, DhTable, Joint, Limits, Mimic, MovingJoint, Robot};

/// splitmix64.
pub struct Rng(pub u64);

impl Rng {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Any number at all, with those that break things more often than their share.
    pub fn wild(&mut self) -> f64 {
        const ODD: [f64; 16] = [
            0.0,
            -0.0,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MIN_POSITIVE,
            5e-324,
            -5e-324,
            f64::MAX,
            f64::MIN,
            1e154,
            -1e-154,
            FRAC_PI_2,
            -PI,
            1.0,
            1e16,
        ];
        match self.below(4) {
            0 => ODD[self.below(ODD.len())],
            1 => self.within(-4.0, 4.0),
            _ => f64::from_bits(self.bits()),
        }
    }

    /// Any finite number, of any size.
    pub fn finite(&mut self) -> f64 {
        loop {
            let x = self.wild();
            if x.is_finite() {
                return x;
            }
        }
    }

    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [self.within(-1.0, 1.0), self.within(-1.0, 1.0), self.within(-1.0, 1.0)];
            let length = norm(v);
            if length > 0.1 && length < 1.0 {
                return scale(1.0 / length, v);
            }
        }
    }

    pub fn frame(&mut self) -> Frame {
        let turned = Frame::rotation(self.direction(), self.within(-PI, PI));
        Frame { origin: [self.within(-0.5, 0.5), self.within(-0.5, 0.5), self.within(-0.5, 0.5)], ..turned }
    }

    /// A robot of `n` joints, one in four of them prismatic when asked for, with limits on every joint but the first of `free`.
    pub fn robot(&mut self, n: usize, prismatic: bool, free: usize) -> Robot {
        let mut column = |low: f64, high: f64| (0..n).map(|_| self.within(low, high)).collect::<Vec<_>>();
        let (a, d, mut alpha, theta) = (column(-0.6, 0.6), column(-0.6, 0.6), column(-PI, PI), column(-PI, PI));
        for angle in &mut alpha {
            if self.below(2) == 0 {
                *angle = (*angle / FRAC_PI_2).round() * FRAC_PI_2;
            }
        }
        let convention = if self.below(2) == 0 { Convention::Standard } else { Convention::Modified };
        let letters: String = (0..n).map(|_| if prismatic && self.below(4) == 0 { 'P' } else { 'R' }).collect();
        let robot = Robot::from_dh("random", DhTable { convention, a, d, alpha, theta }, &letters).unwrap();
        let (tool, base) = (self.frame(), self.frame());
        let mut limits = Limits::none(n);
        for i in free..n {
            limits.q_min[i] = self.within(-3.2, -1.0);
            limits.q_max[i] = self.within(1.0, 3.2);
            limits.qd_max[i] = self.within(0.5, 6.0);
        }
        robot.with_tool(tool).with_base(base).with_limits(limits).unwrap()
    }

    /// A robot of `m` joints of which all but `n` follow others.
    pub fn coupled(&mut self, m: usize, n: usize) -> Robot {
        let mut joints = Vec::new();
        for i in 0..m {
            let mimic = (i >= n).then(|| Mimic {
                driver: self.below(n).to_string(),
                factor: self.within(-1.5, 1.5),
                offset: self.within(-0.5, 0.5),
            });
            let kind = if self.below(4) == 0 { Joint::Prismatic } else { Joint::Revolute };
            joints.push(MovingJoint { name: i.to_string(), kind, limits: [-9.0, 9.0, 4.0, f64::INFINITY], mimic });
        }
        let links: Vec<Frame> = (0..m).map(|_| self.frame()).collect();
        Robot::new_coupled("coupled", &joints, &links, self.frame()).unwrap()
    }

    /// `count` different rows in increasing order.
    pub fn rows(&mut self, count: usize) -> Vec<usize> {
        let mut rows: Vec<usize> = (0..6).collect();
        while rows.len() > count {
            rows.remove(self.below(rows.len()));
        }
        rows
    }
}

/// [`Objective::evaluate`] by capacity, compiled once in place of at every call: it is large.
#[inline(never)]
pub fn evaluate<const N: usize>(objective: &Objective, robot: &Robot, q: &[f64], order: Order, with_length: bool) -> Evaluation<N> {
    redundancy::internals::index::evaluate::<N>(objective, robot, q, order, with_length)
}

/// A generator seeded by proptest, which prints the seed of a failure.
pub fn rngs() -> impl Strategy<Value = u64> {
    any::<u64>().no_shrink()
}

/// The FANUC M-710iC/50 with the milling tool of the thesis, within its limits.
pub fn fanuc() -> Robot {
    let degrees = |values: &[f64]| values.iter().map(|x| x.to_radians()).collect::<Vec<_>>();
    let table = DhTable {
        convention: Convention::Standard,
        a: vec![0.15, 0.87, 0.17, 0.0, 0.0, -0.287692],
        d: vec![0.0, 0.0, 0.0, -1.016, 0.0, -0.607777],
        alpha: degrees(&[-90.0, 180.0, -90.0, 90.0, -90.0, 180.0]),
        theta: degrees(&[0.0, -90.0, 0.0, 0.0, 0.0, 0.0]),
    };
    let limits = Limits {
        q_min: degrees(&[-180.0, -60.0, -131.8, -360.0, -125.0, -360.0]),
        q_max: degrees(&[180.0, 75.0, 230.0, 360.0, 125.0, 360.0]),
        qd_max: degrees(&[175.0, 175.0, 175.0, 250.0, 250.0, 355.0]),
        ..Limits::none(6)
    };
    let robot = Robot::from_dh("fanuc", table, "RRRRRR").unwrap();
    robot.with_tool(Frame::rotation([0.0, 1.0, 0.0], 120f64.to_radians())).with_limits(limits).unwrap()
}

/// Seven revolute joints as of the KUKA iiwa, within its limits.
pub fn iiwa() -> Robot {
    let quarter = |values: &[f64]| values.iter().map(|x| x * FRAC_PI_2).collect::<Vec<_>>();
    let table = DhTable {
        convention: Convention::Standard,
        a: vec![0.0; 7],
        d: vec![0.36, 0.0, 0.42, 0.0, 0.4, 0.0, 0.126],
        alpha: quarter(&[-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 0.0]),
        theta: vec![0.0; 7],
    };
    let bound: Vec<f64> = [170.0f64, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0].iter().map(|x| x.to_radians()).collect();
    let limits = Limits { q_min: bound.iter().map(|x| -x).collect(), q_max: bound, qd_max: vec![1.7; 7], ..Limits::none(7) };
    Robot::from_dh("iiwa", table, "RRRRRRR").unwrap().with_limits(limits).unwrap()
}

/// Every index, plain and squared, for one choice of rows.
pub fn indices(rows: Rows) -> Vec<Index> {
    let mut all = vec![Index::JointLimits(JointLimits::new(&[]).unwrap()), Index::LimitBarrier(LimitBarrier::new(&[]).unwrap())];
    for squared in [false, true] {
        all.extend(Kind::ALL.iter().map(|kind| Index::of(*kind, rows, squared)));
    }
    all
}

/// Singular values of the rows in use.
pub fn singular_values(robot: &Robot, rows: &Rows, q: &[f64]) -> Vec<f64> {
    let (_, columns) = redundancy::kinematics::jacobian(robot, q).unwrap();
    let svd = Svd::<16>::new(&rows.normalised(&columns), robot.n(), rows.count());
    svd.sigma[..rows.count()].to_vec()
}

pub fn length(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

/// The derivative of a vector function of one variable at 0 by central differences of fourth order, with steps from `widest` downwards by
/// factors of 4: the one that differs least from its neighbour, and that difference.
pub fn derivative(mut f: impl FnMut(f64) -> Vec<f64>, widest: f64) -> (Vec<f64>, f64) {
    let mut last: Option<Vec<f64>> = None;
    let mut best: Option<(Vec<f64>, f64)> = None;
    for step in 0..9 {
        let h = widest / 4f64.powi(step);
        let (far, near, back, farther) = (f(2.0 * h), f(h), f(-h), f(-2.0 * h));
        let now: Vec<f64> = (0..near.len()).map(|i| (8.0 * (near[i] - back[i]) - (far[i] - farther[i])) / (12.0 * h)).collect();
        if let Some(last) = &last {
            let change = distance(&now, last);
            if change.is_finite() && best.as_ref().is_none_or(|(_, least)| change < *least) {
                best = Some((now.clone(), change));
            }
        }
        last = Some(now);
    }
    best.unwrap()
}

/// A row that owns its coefficients, in an array of a test's choice.
#[derive(Debug, Clone, Copy)]
pub struct OwnRow<const N: usize> {
    pub a: [f64; N],
    pub lower: f64,
    pub upper: f64,
}

/// The rows as a programme of `n` variables takes them.
pub fn views<const N: usize>(rows: &[OwnRow<N>], n: usize) -> Vec<Row<'_>> {
    rows.iter().map(|row| Row { a: &row.a[..n], lower: row.lower, upper: row.upper }).collect()
}
