//! Postures chosen for their own sake: of minimum condition number, with the characteristic length (Leger 2014, 2.2, 4.1 to 4.4).

use nalgebra::{DMatrix, DVector};

use crate::error::{Error, Result, check_positive, check_vector};
use crate::index::{Index, Kind, Objective, Order, Rows, length_of_least_condition};
use crate::kinematics::jacobian;
use crate::linalg::vector::norm;
use crate::optimize::{Minimum, Smooth, Stop, bfgs, trust_region_newton};
use crate::robot::{Joint, Robot};

/// What is done with the length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Length {
    /// It is given.
    Fixed(f64),
    /// It takes its best value at every posture, in closed form.
    Eliminated,
    /// It is one more variable (its logarithm), from this start.
    Variable(f64),
}

/// Which method minimises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Trust-region Newton on the exact Hessian.
    Newton,
    /// BFGS on the exact gradient.
    Bfgs,
}

/// A posture of (locally) minimum condition number.
#[derive(Debug, Clone)]
pub struct MinimumCondition {
    /// The joints.
    pub q: Vec<f64>,
    /// The length.
    pub length: f64,
    /// kappa_F there.
    pub condition_number: f64,
    /// How the minimisation went.
    pub minimum: Minimum,
}

struct ConditionOver<'a> {
    robot: &'a Robot,
    rows: Rows,
    length: Length,
}

impl ConditionOver<'_> {
    fn length_at(&self, x: &DVector<f64>) -> f64 {
        let n = self.robot.n();
        match self.length {
            Length::Fixed(length) => length,
            Length::Variable(_) => x[n].exp(),
            Length::Eliminated => length_of_least_condition(self.robot, &x.as_slice()[..n], &self.rows).ok().flatten().unwrap_or(f64::NAN),
        }
    }

    fn at(&self, x: &DVector<f64>, order: Order) -> (f64, DVector<f64>, DMatrix<f64>) {
        let n = self.robot.n();
        let size = x.len();
        let nan = || (f64::NAN, DVector::repeat(size, f64::NAN), DMatrix::repeat(size, size, f64::NAN));
        let length = self.length_at(x);
        if !(length > 0.0 && length.is_finite()) {
            return nan();
        }
        let index = Index::of(Kind::ConditionNumber, self.rows.with_length(length), true);
        let evaluated = Objective::new(vec![(1.0, index)]).and_then(|o| o.evaluate(self.robot, &x.as_slice()[..n], order, true));
        let Ok(got) = evaluated else { return nan() };
        let mut gradient = DVector::zeros(size);
        let mut hessian = DMatrix::zeros(size, size);
        for k in 0..n {
            gradient[k] = got.gradient[k];
            for l in 0..n {
                hessian[(k, l)] = got.hessian[k][l];
                if self.length == Length::Eliminated {
                    // At the best length the slope in q is the total one; the curvature loses what the length gives way.
                    hessian[(k, l)] -= got.length_gradient[k] * got.length_gradient[l] / got.length_curvature;
                }
            }
        }
        if let Length::Variable(_) = self.length {
            gradient[n] = length * got.length_slope;
            hessian[(n, n)] = length * length * got.length_curvature + length * got.length_slope;
            for k in 0..n {
                hessian[(k, n)] = length * got.length_gradient[k];
                hessian[(n, k)] = hessian[(k, n)];
            }
        }
        (got.value, gradient, hessian)
    }
}

impl Smooth for ConditionOver<'_> {
    fn gradient(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>) {
        let (value, gradient, _) = self.at(x, Order::Gradient);
        (value, gradient)
    }

    fn hessian(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
        self.at(x, Order::Hessian)
    }
}

/// Minimises kappa_F over the joints, and over the length unless it is fixed, from `q0`. Joint limits are not considered.
pub fn minimum_condition(robot: &Robot, q0: &[f64], rows: Rows, length: Length, method: Method, stop: Stop) -> Result<MinimumCondition> {
    let n = robot.n();
    check_vector("q0", q0, n)?;
    let free = length != Length::Fixed(rows.length);
    if rows.count() > n {
        return Err(Error::value("rows", format!("{:?}", rows.indices()), &format!("at most {n} rows, the number of joints")));
    }
    if free && (rows.angular() == 0 || rows.angular() == rows.count()) {
        return Err(Error::value(
            "rows",
            format!("{:?}", rows.indices()),
            "angular and linear rows, or a fixed length: there is nothing to homogenise",
        ));
    }
    let mut x = q0.to_vec();
    if let Length::Variable(start) = length {
        x.push(check_positive("length0", start)?.ln());
    }
    let mut function = ConditionOver { robot, rows, length };
    let x = DVector::from_vec(x);
    let minimum = match method {
        Method::Newton => trust_region_newton(&mut function, x, stop),
        Method::Bfgs => bfgs(&mut function, x, stop),
    };
    let length = function.length_at(&minimum.x);
    Ok(MinimumCondition { q: minimum.x.as_slice()[..n].to_vec(), length, condition_number: minimum.value.sqrt(), minimum })
}

/// The length that minimises kappa_F at `q`, in closed form; `None` at a singularity.
pub fn characteristic_length(robot: &Robot, q: &[f64], rows: Rows) -> Result<Option<f64>> {
    check_vector("q", q, robot.n())?;
    length_of_least_condition(robot, q, &rows)
}

/// The root mean square of the distances of the revolute axes to the operation point: the length of an isotropic robot (2.5 to 2.7).
pub fn rms_length(robot: &Robot, q: &[f64]) -> Result<f64> {
    check_vector("q", q, robot.n())?;
    let columns = jacobian(robot, q)?.1;
    let revolute = (0..robot.n()).filter(|i| robot.joints()[*i] == Joint::Revolute);
    let squares: Vec<f64> = revolute.map(|i| norm(columns.v[i]).powi(2)).collect();
    Ok((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}
