//! The fastest speed from standstill to standstill over a given length.

/// Speed over distance on one run: up at the acceleration limit, along at the speed limit, down
/// as it went up. Short runs never reach the speed limit. Everything is positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Profile {
    length: f64,
    acceleration: f64,
    /// The highest speed reached, m/s.
    peak: f64,
    /// Length of speeding up, and of braking, metres.
    ramp: f64,
}

impl Profile {
    pub fn new(length: f64, speed_limit: f64, acceleration: f64) -> Self {
        let peak = speed_limit.min((acceleration * length).sqrt());
        let ramp = (peak * peak / (2.0 * acceleration)).min(length / 2.0);
        Self { length, acceleration, peak, ramp }
    }

    /// The whole time, seconds.
    pub fn duration(&self) -> f64 {
        2.0 * self.peak / self.acceleration + (self.length - 2.0 * self.ramp) / self.peak
    }

    /// The distances at which the acceleration changes.
    pub fn changes(&self) -> [f64; 2] {
        [self.ramp, self.length - self.ramp]
    }

    /// When `distance` is reached.
    pub fn time(&self, distance: f64) -> f64 {
        let [rise, fall] = self.changes();
        if distance <= rise {
            (2.0 * distance / self.acceleration).sqrt()
        } else if distance <= fall {
            self.peak / self.acceleration + (distance - rise) / self.peak
        } else {
            self.duration() - (2.0 * (self.length - distance) / self.acceleration).sqrt()
        }
    }

    /// The speed at `distance`.
    pub fn speed(&self, distance: f64) -> f64 {
        let to_standstill = distance.min(self.length - distance).max(0.0);
        (2.0 * self.acceleration * to_standstill).sqrt().min(self.peak)
    }

    /// The acceleration around `distance`, which is not one of [`Profile::changes`].
    pub fn acceleration(&self, distance: f64) -> f64 {
        let [rise, fall] = self.changes();
        match distance {
            d if d < rise => self.acceleration,
            d if d > fall => -self.acceleration,
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_and_short_runs_take_the_time_of_the_textbook() {
        let long = Profile::new(10.0, 2.0, 1.0);
        assert!((long.duration() - (10.0 / 2.0 + 2.0 / 1.0)).abs() < 1e-12);
        assert_eq!(long.changes(), [2.0, 8.0]);
        assert_eq!([1.0, 5.0, 9.0].map(|d| long.acceleration(d)), [1.0, 0.0, -1.0]);
        let short = Profile::new(1.0, 2.0, 1.0);
        assert!((short.duration() - 2.0).abs() < 1e-12);
        assert!((short.speed(0.5) - 1.0).abs() < 1e-12);
        assert_eq!((short.speed(0.0), short.speed(1.0)), (0.0, 0.0));
    }

    #[test]
    fn time_and_speed_fit_together() {
        for (length, limit, acceleration) in [(10.0, 2.0, 1.0), (0.3, 1.0, 2.0), (7.0, 1.0, 0.1)] {
            let p = Profile::new(length, limit, acceleration);
            let h = 1e-6 * length;
            for i in 1..100 {
                let d = length * f64::from(i) / 100.0;
                let speed = 2.0 * h / (p.time(d + h) - p.time(d - h));
                assert!((speed - p.speed(d)).abs() < 1e-4, "{p:?} at {d}: {speed}");
            }
            assert!((p.time(length) - p.duration()).abs() < 1e-12);
        }
    }
}
