//! A limit of jerk as bounds of a rate.

/// Halvings of an interval of rates: to rounding.
const HALVINGS: usize = 50;

/// One joint at the start of a tick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving {
    /// Length of a tick \[s\].
    pub dt: f64,
    /// Limits, infinite where there are none.
    pub speed: f64,
    pub acceleration: f64,
    pub jerk: f64,
    /// Rates of the last tick, and of that before.
    pub before: f64,
    pub earlier: f64,
}

impl Moving {
    /// The part of an interval of rates that a limit of jerk leaves, never empty: as much acceleration as keeps the room, above and below, that it takes to
    /// come to rest with this jerk. Where the interval has no such part, its end that is nearest to one.
    #[inline(never)]
    pub fn narrow(&self, (low, high): (f64, f64), (below, above): (f64, f64)) -> (f64, f64) {
        let (even, step) = (2.0 * self.before - self.earlier, self.jerk * self.dt * self.dt);
        let (low, high) = ((even - step).min(high).max(low), (even + step).max(low).min(high));
        let high = self.fastest(low, high, above);
        let mirrored = Self { before: -self.before, earlier: -self.earlier, ..*self };
        (-mirrored.fastest(-high, -low, below), high)
    }

    /// The greatest rate of an interval from which the joint can come to rest within `room`, and stay below its speed; the least where there is none.
    #[inline(never)]
    fn fastest(&self, low: f64, high: f64, room: f64) -> f64 {
        if self.can_stop(high, room) {
            return high;
        }
        let (mut good, mut bad) = (low, high);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (good + bad);
            if self.can_stop(middle, room) { good = middle } else { bad = middle }
        }
        good
    }

    /// Whether a joint that moves with `rate` in this tick can brake within `room`: the acceleration falls at the largest jerk, to the largest deceleration
    /// at most, until the joint stands.
    fn can_stop(&self, rate: f64, room: f64) -> bool {
        let (mut v, mut a, j) = (rate, (rate - self.before) / self.dt, self.jerk);
        let mut way = v * self.dt;
        if a > 0.0 {
            // Until the acceleration is nothing it grows faster yet.
            let t = a / j;
            way += t * (v + a * t / 3.0);
            v += 0.5 * a * t;
            a = 0.0;
            if v > self.speed {
                return false;
            }
        }
        if v > 0.0 {
            let t = (self.acceleration + a) / j;
            let slower = v + t * (a - 0.5 * j * t);
            if t > 0.0 && slower > 0.0 {
                way += t * (v + t * (0.5 * a - j * t / 6.0)) + 0.5 * slower * slower / self.acceleration;
            } else {
                let t = (a + (a * a + 2.0 * j * v).sqrt()) / j;
                way += t * (v + t * (0.5 * a - j * t / 6.0));
            }
        }
        way <= room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_driven_at_a_limit_stops_in_front_of_it_without_more_jerk_than_it_has() {
        for dt in [1e-3, 5e-3] {
            for acceleration in [3.0, f64::INFINITY] {
                let mut joint = Moving { dt, speed: 0.8, acceleration, jerk: 20.0, before: 0.0, earlier: 0.0 };
                let (mut q, mut fastest) = (0.0, 0.0f64);
                for _ in 0..(4.0 / dt) as usize {
                    let change = joint.acceleration * dt;
                    let whole = ((joint.before - change).max(-joint.speed), (joint.before + change).min(joint.speed));
                    let (low, high) = joint.narrow(whole, (1.0 + q, 1.0 - q));
                    assert!(low <= high);
                    let jerk = (high - 2.0 * joint.before + joint.earlier) / (dt * dt);
                    assert!(jerk.abs() <= 20.0 * (1.0 + 1e-6), "{jerk} at {q}");
                    (joint.earlier, joint.before) = (joint.before, high);
                    q += dt * high;
                    fastest = fastest.max(high);
                    assert!(q <= 1.0 + 1e-12);
                }
                assert!(q > 1.0 - 5e-3 && fastest > 0.79, "{q} {fastest}");
            }
        }
    }

    #[test]
    fn never_empty() {
        let joint = Moving { dt: 1e-3, speed: 1.0, acceleration: 2.0, jerk: 1.0, before: 0.9, earlier: 0.5 };
        assert_eq!(joint.narrow((-0.1, 0.0), (1.0, 0.0)), (0.0, 0.0));
    }
}
