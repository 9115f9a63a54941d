//! How fast a joint may move within a tick: limits of position, speed and acceleration as bounds of its rate.

use crate::qp::DenseRow;
use crate::robot::{AT_LIMIT, Limits};

/// Largest motion of a joint in one step of a search [rad or m].
const LARGEST_MOTION: f64 = 0.3;
/// A joint beyond a limit comes back at this part of its speed limit at least: without haste, and within seconds.
const RETURN_SHARE: f64 = 0.25;
/// The same where it has no limit of speed [rad/s or m/s].
const RETURN_SPEED: f64 = 0.5;
/// Part of the acceleration of its joints together that a combination brakes with: the rest is for what they do beside.
const BRAKES: f64 = 0.5;
/// Part of the greatest rate within the bounds of joints that a combination which comes back has at most: the rest is for rounding.
const FEASIBLE: f64 = 0.999;

/// How far a joint at `q` is beyond a limit, above zero beyond the upper and below zero beyond the lower one; zero within, and for numbers that
/// are not finite.
pub(super) fn beyond(limits: &Limits, i: usize, q: f64) -> f64 {
    let (low, high) = (limits.q_min[i], limits.q_max[i]);
    outside(q, low, high, AT_LIMIT)
}

/// How far a value is outside of two limits by more than what is on them, with its sign.
fn outside(x: f64, low: f64, high: f64, at: f64) -> f64 {
    let counts = |by: f64| by > at && by.is_finite();
    if counts(x - high) {
        x - high
    } else if counts(low - x) {
        x - low
    } else {
        0.0
    }
}

/// The rows that keep combinations of joints within their limits in a tick, as bounds of their rates; how many there are, and whether one is beyond and
/// has to come back. `low` and `high` bound the rates of joints.
#[cold]
#[inline(never)]
pub(super) fn coupled_rows<const C: usize>(
    limits: &Limits,
    q: &[f64],
    dt: f64,
    low: &[f64],
    high: &[f64],
    rows: &mut [DenseRow<C>],
) -> (usize, bool) {
    let mut back = false;
    for (it, out) in limits.coupled.iter().zip(rows) {
        let (low, high, returns) = coupled_interval(limits, &it.row, (it.value(q), it.low, it.high), dt, low, high);
        out.a[..q.len()].copy_from_slice(&it.row);
        (out.lower, out.upper) = (low, high);
        back |= returns;
    }
    (limits.coupled.len(), back)
}

/// Least and greatest rate of a combination whose value lies among its limits.
#[inline(never)]
fn coupled_interval(
    limits: &Limits,
    row: &[f64],
    (value, least, most): (f64, f64, f64),
    dt: f64,
    low: &[f64],
    high: &[f64],
) -> (f64, f64, bool) {
    let sum = |of: &dyn Fn(usize) -> f64| (0..row.len()).filter(|&i| row[i] != 0.0).map(of).sum::<f64>();
    let acceleration = BRAKES * sum(&|i| row[i].abs() * limits.qdd_max[i]);
    let (slowest, fast) = (-fastest(value - least, acceleration, dt), fastest(most - value, acceleration, dt));
    let norm = row.iter().map(|c| c * c).sum::<f64>().sqrt();
    let by = outside(value, least, most, AT_LIMIT * norm);
    if by == 0.0 {
        return (slowest, fast, false);
    }
    // The greatest rate towards the limit that the joints are free for.
    let towards = |i: usize| if (row[i] > 0.0) == (by > 0.0) { -row[i].abs() * low[i] } else { row[i].abs() * high[i] };
    let speed = sum(&|i| row[i].abs() * limits.qd_max[i]);
    let (slowest, fast) = returning(by, speed, dt, None, slowest, fast);
    let free = sum(&towards);
    let free = if free > 0.0 { FEASIBLE * free } else { free };
    if by > 0.0 { (slowest.min(-free), fast.max(-free), true) } else { (slowest.min(free), fast.max(free), true) }
}

/// Least and greatest rates of all joints at `q` within limits of position and speed, never empty: a joint never crosses a position limit within the
/// tick, and comes back from beyond one. Whether one has to.
#[inline(always)]
pub(super) fn speed_bounds(limits: &Limits, q: &[f64], dt: f64, low: &mut [f64], high: &mut [f64]) -> bool {
    let n = q.len();
    let (least, most, speed) = (&limits.q_min[..n], &limits.q_max[..n], &limits.qd_max[..n]);
    let (low, high) = (&mut low[..n], &mut high[..n]);
    let mut any = false;
    for i in 0..n {
        low[i] = ((least[i] - q[i]) / dt).min(0.0).max(-speed[i]);
        high[i] = ((most[i] - q[i]) / dt).max(0.0).min(speed[i]);
        any |= (q[i] < least[i]) | (q[i] > most[i]);
    }
    any && take_back(limits, q, dt, low, high)
}

/// The rates of joints that are beyond a limit; whether any is, by more than rounding.
#[cold]
#[inline(never)]
fn take_back(limits: &Limits, q: &[f64], dt: f64, low: &mut [f64], high: &mut [f64]) -> bool {
    let mut any = false;
    for i in 0..q.len() {
        let by = beyond(limits, i, q[i]);
        if by != 0.0 {
            (low[i], high[i]) = returning(by, limits.qd_max[i], dt, None, low[i], high[i]);
            any = true;
        }
    }
    any
}

/// Least and greatest rate of joint `i` at `q` within limits of acceleration too, and whether it has to come back. `before` is its rate in the tick
/// before, where accelerations count.
///
/// With a limit of acceleration a joint keeps the room that it needs to come to rest. Where the acceleration that a limit of position takes is more
/// than the joint has, position comes first; on the way back from beyond one, acceleration does.
#[inline(always)]
pub(super) fn rate_interval(limits: &Limits, i: usize, q: f64, dt: f64, before: Option<f64>) -> (f64, f64, bool) {
    let (speed, acceleration) = (limits.qd_max[i], limits.qdd_max[i]);
    let change = before.filter(|_| acceleration.is_finite()).map(|before| (before, acceleration * dt));
    let mut high = speed.min(fastest(limits.q_max[i] - q, acceleration, dt));
    let mut low = -speed.min(fastest(q - limits.q_min[i], acceleration, dt));
    let mut back = false;
    if q < limits.q_min[i] || q > limits.q_max[i] {
        let by = beyond(limits, i, q);
        back = by != 0.0;
        if back {
            (low, high) = returning(by, speed, dt, change, low, high);
        }
    }
    match change {
        Some((before, change)) => ((before - change).min(high).max(low), (before + change).max(low).min(high), back),
        None => (low, high, back),
    }
}

/// Least and greatest rate of a joint that is beyond a limit by `by`: back at a share of its speed at least, or as fast as takes it within the
/// limit in this tick, as far as its acceleration and the other limit allow.
#[cold]
#[inline(never)]
fn returning(by: f64, speed: f64, dt: f64, change: Option<(f64, f64)>, low: f64, high: f64) -> (f64, f64) {
    let least = if speed.is_finite() { RETURN_SHARE * speed } else { RETURN_SPEED };
    let least = least.min(by.abs() / dt);
    let back = |before: f64, change: f64| least.min((change - by.signum() * before).max(0.0));
    let least = change.map_or(least, |(before, change)| back(before, change));
    if by > 0.0 { (low, high.min(-least).max(low)) } else { (low.max(least).min(high), high) }
}

/// Least and greatest motion of joint `i` in one step of a search: as far as its position limits allow, if they hold, and never far.
pub(super) fn motion_interval(limits: Option<&Limits>, i: usize, q: f64) -> (f64, f64) {
    let (low, high) = limits.map_or((f64::INFINITY, f64::INFINITY), |limits| (q - limits.q_min[i], limits.q_max[i] - q));
    (-low.clamp(0.0, LARGEST_MOTION), high.clamp(0.0, LARGEST_MOTION))
}

/// The greatest rate towards a limit that is `room` away: `v dt + v^2 / 2a <= room`, so that ticks of the greatest deceleration come to rest in
/// front of it.
#[inline(always)]
pub(super) fn fastest(room: f64, acceleration: f64, dt: f64) -> f64 {
    if room <= 0.0 {
        0.0
    } else if acceleration.is_finite() && room.is_finite() {
        // The root without cancellation.
        2.0 * room / (dt + (dt * dt + 2.0 * room / acceleration).sqrt())
    } else {
        room / dt
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(acceleration: f64) -> Limits {
        Limits { q_min: vec![-1.0], q_max: vec![1.0], qd_max: vec![2.0], qdd_max: vec![acceleration], coupled: Vec::new() }
    }

    #[test]
    fn a_joint_driven_at_a_limit_stops_in_front_of_it_without_braking_harder_than_it_can() {
        for dt in [1e-3, 1e-2] {
            let (limits, mut q, mut rate, mut closest) = (limits(5.0), 0.0, 0.0, f64::INFINITY);
            for _ in 0..(5.0 / dt) as usize {
                let (low, high, _) = rate_interval(&limits, 0, q, dt, Some(rate));
                assert!(low <= high && low >= rate - 5.0 * dt - 1e-12);
                rate = high;
                q += rate * dt;
                closest = closest.min(1.0 - q);
                assert!(q <= 1.0 + 1e-15);
            }
            assert!(closest < 1e-4, "it reaches the limit: {closest}");
        }
    }

    #[test]
    fn beyond_a_limit_a_joint_comes_back() {
        assert_eq!(rate_interval(&limits(f64::INFINITY), 0, 1.5, 1e-3, None), (-2.0, -0.5, true));
        assert_eq!(rate_interval(&limits(f64::INFINITY), 0, -1.5, 1e-3, None), (0.5, 2.0, true));
        // On its way outwards it stops first, then takes up speed as fast as it can.
        assert_eq!(rate_interval(&limits(1.0), 0, 1.5, 1e-3, Some(1.0)), (0.0, 0.0, true));
        let (_, high, _) = rate_interval(&limits(1.0), 0, 1.5, 1e-3, Some(-0.1));
        assert!((high + 0.101).abs() < 1e-15, "{high}");
        let (low, high, _) = rate_interval(&limits(f64::INFINITY), 0, 1.0 + 1e-4, 1e-3, None);
        assert!(low == -2.0 && (high + 0.1).abs() < 1e-8, "as far as the limit: {high}");
    }

    #[test]
    fn a_joint_without_limits_or_with_numbers_that_are_none_is_not_taken_back() {
        let open = Limits {
            q_min: vec![f64::NAN],
            q_max: vec![f64::INFINITY],
            qd_max: vec![f64::INFINITY],
            qdd_max: vec![f64::NAN],
            coupled: Vec::new(),
        };
        for q in [0.0, 1e300, f64::INFINITY, f64::NAN] {
            assert_eq!(beyond(&open, 0, q), 0.0);
            let (low, high, _) = rate_interval(&open, 0, q, 1e-3, Some(0.0));
            assert!(low <= 0.0 && high >= 0.0, "{low} {high}");
        }
    }
}
