//! A fast speed over distance from standstill to standstill, within limits of speed, acceleration and jerk.
//!
//! A run is a row of stretches, each with a speed that may not be exceeded. Between two speeds the car
//! changes by an S: the acceleration rises at the limit of jerk, stays at its own limit, and falls as it rose.
//! Where a stretch slows the car down, it drives through it at that stretch's speed; where it is too short to
//! be felt, because the car cannot come near that speed before it has to stop, it is joined with its neighbours.

/// What limits a run beside the speeds of its stretches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rates {
    /// Largest acceleration and braking, m/s².
    pub acceleration: f64,
    /// Largest change of the acceleration, m/s³.
    pub jerk: f64,
}

/// What takes less is rounding, seconds.
pub(super) const INSTANT: f64 = 1e-10;

/// A part of a run and the speed that may not be exceeded on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    /// Metres.
    pub length: f64,
    /// m/s.
    pub speed: f64,
}

/// A part of a profile with constant jerk. Everything is that where it begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Interval {
    /// Seconds.
    pub duration: f64,
    /// m/s.
    pub speed: f64,
    /// m/s².
    pub acceleration: f64,
    /// m/s³.
    pub jerk: f64,
}

impl Interval {
    /// Distance driven after `t` seconds, metres.
    pub fn driven(&self, t: f64) -> f64 {
        t * (self.speed + t * (self.acceleration / 2.0 + t * self.jerk / 6.0))
    }

    /// Speed after `t` seconds, m/s.
    pub fn speed_after(&self, t: f64) -> f64 {
        self.speed + t * (self.acceleration + t * self.jerk / 2.0)
    }

    /// Acceleration after `t` seconds, m/s².
    pub fn acceleration_after(&self, t: f64) -> f64 {
        self.acceleration + t * self.jerk
    }

    /// When `distance` is driven, seconds.
    pub fn time_at(&self, distance: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.duration);
        // As often as halving tells two numbers apart.
        for _ in 0..64 {
            let middle = f64::midpoint(low, high);
            *(if self.driven(middle) < distance { &mut low } else { &mut high }) = middle;
        }
        f64::midpoint(low, high)
    }
}

impl Rates {
    /// How long a change between two speeds takes, seconds.
    fn time(&self, from: f64, to: f64) -> f64 {
        let (change, rise) = ((to - from).abs(), self.acceleration / self.jerk);
        if change >= self.acceleration * rise {
            change / self.acceleration + rise
        } else {
            2.0 * (change / self.jerk).sqrt()
        }
    }

    /// How far the car drives meanwhile, metres: as far as at the mean speed.
    fn distance(&self, from: f64, to: f64) -> f64 {
        f64::midpoint(from, to) * self.time(from, to)
    }

    /// The highest speed up to `most` for which `fits` holds, which holds for `least` and below some speed.
    fn highest(least: f64, most: f64, fits: impl Fn(f64) -> bool) -> f64 {
        if fits(most) {
            return most;
        }
        let (mut low, mut high) = (least, most);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            *(if fits(middle) { &mut low } else { &mut high }) = middle;
        }
        low
    }

    fn change(&self, from: f64, to: f64, out: &mut Vec<Interval>) {
        let change = (to - from).abs();
        if change == 0.0 {
            return;
        }
        let sign = (to - from).signum();
        let duration = self.time(from, to);
        let rise = (self.acceleration / self.jerk).min(duration / 2.0);
        let peak = sign * (self.jerk * rise).min(self.acceleration);
        let jerk = sign * self.jerk;
        let first = Interval { duration: rise, speed: from, acceleration: 0.0, jerk };
        let steady = Interval {
            duration: duration - 2.0 * rise,
            speed: first.speed_after(rise),
            acceleration: peak,
            jerk: 0.0,
        };
        let speed = steady.speed_after(steady.duration);
        let last = Interval { duration: rise, speed, acceleration: peak, jerk: -jerk };
        out.extend([first, steady, last].into_iter().filter(|i| i.duration > INSTANT));
    }

    /// From one speed to another over `length`, as fast as `limit` lets it.
    fn over(&self, length: f64, [from, to]: [f64; 2], limit: f64, out: &mut Vec<Interval>) {
        let needs = |peak: f64| self.distance(from, peak) + self.distance(peak, to);
        let peak =
            Self::highest(from.max(to), limit.max(from).max(to), |peak| needs(peak) <= length);
        self.change(from, peak, out);
        let left = length - needs(peak);
        let duration = left / peak;
        if duration > INSTANT {
            out.push(Interval { duration, speed: peak, ..Interval::default() });
        }
        self.change(peak, to, out);
    }

    /// Over all stretches from one speed to another, both no higher than that of any stretch.
    fn along(&self, stretches: &[Stretch], [from, to]: [f64; 2], out: &mut Vec<Interval>) {
        let length = |part: &[Stretch]| part.iter().map(|s| s.length).sum::<f64>();
        let by_speed =
            |a: &(usize, &Stretch), b: &(usize, &Stretch)| a.1.speed.total_cmp(&b.1.speed);
        let Some((slowest, &Stretch { speed, .. })) = stretches.iter().enumerate().min_by(by_speed)
        else {
            return;
        };
        if stretches.iter().all(|s| s.speed <= speed) {
            return self.over(length(stretches), [from, to], speed, out);
        }
        let (before, after) = (&stretches[..slowest], &stretches[slowest + 1..]);
        let (here, [lead, rest]) = (stretches[slowest].length, [before, after].map(length));
        let reaches = self.distance(from, speed) <= lead;
        let leaves = self.distance(speed, to) <= rest;
        if reaches && leaves {
            self.along(before, [from, speed], out);
            out.push(Interval { duration: here / speed, speed, ..Interval::default() });
            return self.along(after, [speed, to], out);
        }
        // Never faster than on the slowest stretch; or so only until its end, or from where it begins,
        // and with the others as fast as they let.
        let mut whole = Vec::new();
        self.over(lead + here + rest, [from, to], speed, &mut whole);
        let mut parted = Vec::new();
        if leaves || (!reaches && rest >= lead) {
            let fits = |then: f64| self.distance(from, then) <= lead + here;
            let then = Self::highest(from, speed, fits);
            if self.distance(then, to) <= rest {
                self.over(lead + here, [from, then], speed, &mut parted);
                self.along(after, [then, to], &mut parted);
            }
        } else {
            let fits = |first: f64| self.distance(first, to) <= here + rest;
            let first = Self::highest(to, speed, fits);
            if self.distance(from, first) <= lead {
                self.along(before, [from, first], &mut parted);
                self.over(here + rest, [first, to], speed, &mut parted);
            }
        }
        let duration = |part: &[Interval]| part.iter().map(|i| i.duration).sum::<f64>();
        let is_faster = !parted.is_empty() && duration(&parted) < duration(&whole);
        out.append(if is_faster { &mut parted } else { &mut whole });
    }

    /// The speed over a whole run, from standstill to standstill.
    pub fn profile(&self, stretches: &[Stretch]) -> Vec<Interval> {
        let mut out = Vec::new();
        self.along(stretches, [0.0, 0.0], &mut out);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, rng};
    use rand::RngExt;

    const RATES: Rates = Rates { acceleration: 1.0, jerk: 2.0 };

    fn duration(profile: &[Interval]) -> f64 {
        profile.iter().map(|i| i.duration).sum()
    }

    #[test]
    fn one_stretch_takes_the_time_of_the_textbook() {
        // v/a + a/j to come up to speed and to stop, and the rest at that speed.
        let profile = RATES.profile(&[Stretch { length: 10.0, speed: 2.0 }]);
        assert!((duration(&profile) - (10.0 / 2.0 + 2.0 + 0.5)).abs() < 1e-9, "{profile:?}");
        // Too short for the limit of acceleration: four times the jerk, l = 2 j t³.
        let profile = RATES.profile(&[Stretch { length: 0.02, speed: 2.0 }]);
        assert!((duration(&profile) - 4.0 * (0.02_f64 / 4.0).cbrt()).abs() < 1e-9, "{profile:?}");
    }

    #[test]
    fn no_limit_is_exceeded_and_the_way_is_driven_whole() {
        let mut rng = rng(5, Stream::Start, 0);
        for _ in 0..5_000 {
            let count = rng.random_range(1..9);
            let stretches: Vec<Stretch> = (0..count)
                .map(|_| Stretch {
                    length: rng.random_range(0.01..4.0),
                    speed: rng.random_range(0.05..2.0),
                })
                .collect();
            let rates = Rates {
                acceleration: rng.random_range(0.2..3.0),
                jerk: rng.random_range(0.2..20.0),
            };
            let profile = rates.profile(&stretches);
            let whole: f64 = stretches.iter().map(|s| s.length).sum();
            let (mut driven, mut speed, mut acceleration) = (0.0, 0.0, 0.0);
            for i in &profile {
                assert!(
                    (i.speed - speed).abs() < 1e-6 && i.jerk.abs() <= rates.jerk * (1.0 + 1e-9)
                );
                assert!((i.acceleration - acceleration).abs() < 1e-6, "{profile:?}");
                for k in 0..=10 {
                    let t = i.duration * f64::from(k) / 10.0;
                    let mut at = driven + i.driven(t);
                    let on = stretches.iter().find(|s| {
                        at -= s.length;
                        at < -1e-6
                    });
                    let limit = on.map_or(stretches[count - 1].speed, |s| s.speed);
                    assert!(i.speed_after(t) <= limit + 1e-6, "{stretches:?} {profile:?}");
                    assert!(i.acceleration_after(t).abs() <= rates.acceleration + 1e-9);
                }
                driven += i.driven(i.duration);
                speed = i.speed_after(i.duration);
                acceleration = i.acceleration_after(i.duration);
            }
            assert!((driven - whole).abs() < 1e-6 && speed.abs() < 1e-6, "{stretches:?} {driven}");
        }
    }

    #[test]
    fn time_and_distance_fit_together() {
        let i = Interval { duration: 2.0, speed: 0.3, acceleration: -0.1, jerk: 0.2 };
        for t in [0.0, 0.5, 1.9] {
            assert!((i.time_at(i.driven(t)) - t).abs() < 1e-9);
        }
    }
}
