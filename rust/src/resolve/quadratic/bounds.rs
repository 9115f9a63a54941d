//! How fast a joint may move within a tick: limits of position, speed and acceleration as bounds of its rate.

use crate::robot::Limits;

/// Largest motion of a joint in one step of a search [rad or m].
const LARGEST_MOTION: f64 = 0.3;

/// Least and greatest rate of joint `i` at `q`, never empty. `before` is its rate in the tick before, where accelerations count.
///
/// A joint never crosses a position limit within the tick; with a limit of acceleration it keeps the room that it needs to come to rest. Beyond a
/// limit it may only stand or move back. Where the acceleration that this takes is more than the joint has, position comes first.
pub(super) fn rate_interval(limits: &Limits, i: usize, q: f64, dt: f64, before: Option<f64>) -> (f64, f64) {
    let (speed, acceleration) = (limits.qd_max[i], limits.qdd_max[i]);
    let high = speed.min(fastest(limits.q_max[i] - q, acceleration, dt));
    let low = -speed.min(fastest(q - limits.q_min[i], acceleration, dt));
    match before {
        Some(before) if acceleration.is_finite() => {
            let change = acceleration * dt;
            ((before - change).clamp(low, high), (before + change).clamp(low, high))
        }
        _ => (low, high),
    }
}

/// Least and greatest motion of joint `i` in one step of a search: as far as its position limits allow, if they hold, and never far.
pub(super) fn motion_interval(limits: Option<&Limits>, i: usize, q: f64) -> (f64, f64) {
    let (low, high) = limits.map_or((f64::INFINITY, f64::INFINITY), |limits| (q - limits.q_min[i], limits.q_max[i] - q));
    (-low.clamp(0.0, LARGEST_MOTION), high.clamp(0.0, LARGEST_MOTION))
}

/// The greatest rate towards a limit that is `room` away: `v dt + v^2 / 2a <= room`, so that ticks of the greatest deceleration come to rest in
/// front of it.
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
        Limits { q_min: vec![-1.0], q_max: vec![1.0], qd_max: vec![2.0], qdd_max: vec![acceleration] }
    }

    #[test]
    fn a_joint_driven_at_a_limit_stops_in_front_of_it_without_braking_harder_than_it_can() {
        for dt in [1e-3, 1e-2] {
            let (limits, mut q, mut rate, mut closest) = (limits(5.0), 0.0, 0.0, f64::INFINITY);
            for _ in 0..(5.0 / dt) as usize {
                let (low, high) = rate_interval(&limits, 0, q, dt, Some(rate));
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
    fn beyond_a_limit_a_joint_may_only_move_back() {
        assert_eq!(rate_interval(&limits(f64::INFINITY), 0, 1.5, 1e-3, None), (-2.0, 0.0));
        assert_eq!(rate_interval(&limits(f64::INFINITY), 0, -1.5, 1e-3, None), (0.0, 2.0));
        let (low, high) = rate_interval(&limits(1.0), 0, 1.5, 1e-3, Some(1.0));
        assert_eq!((low, high), (0.0, 0.0));
    }
}
