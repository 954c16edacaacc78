//! One turn or straight of a path to be made smooth.

use crate::curves::Clothoid;

/// A straight, or a turn to one side: a clothoid in, an arc, a clothoid out.
///
/// Its one unknown is `value`: the length of a straight, metres, or how far a turn turns, radians; never
/// negative. A turn that turns too little for its clothoids peaks at a smaller curvature instead.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// +1 forward, −1 backward.
    pub gear: f64,
    /// Signed curvature of the arc, 1/m: 0 for a straight.
    pub curvature: f64,
    /// |Curvature| at which the turn begins and ends; `None` where that is up to the turn.
    pub ends: [Option<f64>; 2],
    /// |Change of curvature| per metre on the clothoids, 1/m².
    pub sharpness: f64,
    /// The least length of a straight, metres.
    pub floor: f64,
    /// The unknown.
    pub value: f64,
}

/// Where a motion leads, seen from its start: metres ahead and to the left, radians turned.
pub(super) type Way = [f64; 3];

/// `b` driven after `a`.
pub(super) fn then(a: Way, b: Way) -> Way {
    then_turned(a, a[2].sin_cos(), b)
}

/// [`then`] where sine and cosine of what `a` turned are known.
pub(super) fn then_turned(a: Way, (sin, cos): (f64, f64), b: Way) -> Way {
    [a[0] + cos * b[0] - sin * b[1], a[1] + sin * b[0] + cos * b[1], a[2] + b[2]]
}

impl Piece {
    pub fn is_straight(&self) -> bool {
        self.curvature == 0.0
    }

    /// The clothoids that it has: how many, and the sum of the squares of where they begin or end.
    fn clothoids(&self) -> (f64, f64) {
        let given = self.ends.iter().flatten();
        given.fold((0.0, 0.0), |(n, sum), end| (n + 1.0, sum + end * end))
    }

    /// How far the clothoids alone turn where the arc has curvature `peak`.
    fn turned_by_clothoids(&self, peak: f64) -> f64 {
        let (n, squares) = self.clothoids();
        (n * peak * peak - squares) / (2.0 * self.sharpness)
    }

    /// The least `value` there can be.
    pub fn least(&self) -> f64 {
        if self.is_straight() {
            return self.floor;
        }
        let least = self.ends.iter().flatten().fold(0.0_f64, |a, &b| a.max(b));
        self.turned_by_clothoids(least)
    }

    /// |Curvature| and length of the arc.
    fn arc(&self) -> (f64, f64) {
        let most = self.curvature.abs();
        let beyond = self.value - self.turned_by_clothoids(most);
        if beyond >= 0.0 {
            return (most, beyond / most);
        }
        let (n, squares) = self.clothoids();
        (((2.0 * self.sharpness * self.value + squares) / n).max(0.0).sqrt().min(most), 0.0)
    }

    /// The motions that it is made of.
    pub fn motions(&self) -> [Clothoid; 3] {
        if self.is_straight() {
            let length = self.gear * self.value;
            return [
                Clothoid { length, ..Clothoid::default() },
                Clothoid::default(),
                Clothoid::default(),
            ];
        }
        let (peak, length) = self.arc();
        let [begin, end] = self.ends.map(|end| end.unwrap_or(peak));
        let motion = |from: f64, to: f64, length: f64| Clothoid {
            from: from.copysign(self.curvature),
            to: to.copysign(self.curvature),
            length: self.gear * length,
        };
        let ramp = |from: f64, to: f64| motion(from, to, (to - from).abs() / self.sharpness);
        [ramp(begin, peak), motion(peak, peak, length), ramp(peak, end)]
    }

    /// Where it leads, and how that changes with `value`. `clothoids` are those of the whole curvature, which do
    /// not change: they are kept there from one call to the next.
    pub fn way(&self, clothoids: &mut Option<[Way; 2]>) -> (Way, Way) {
        if self.is_straight() {
            return ([self.gear * self.value, 0.0, 0.0], [self.gear, 0.0, 0.0]);
        }
        let (peak, _) = self.arc();
        if peak < self.curvature.abs() {
            const H: f64 = 1e-6;
            let way = self.whole_way();
            let longer = Self { value: self.value + H, ..*self }.whole_way();
            return (way, [0, 1, 2].map(|i| (longer[i] - way[i]) / H));
        }
        let [begin, arc, end] = self.motions();
        let [begin, end] = *clothoids.get_or_insert_with(|| [begin.way(), end.way()]);
        let until = then(begin, arc.way());
        // The arc is longer: what follows moves along, and turns about where the arc ends.
        let (sin, cos) = until[2].sin_cos();
        let way = then_turned(until, (sin, cos), end);
        let length = self.gear / peak;
        let turn = self.gear.copysign(self.curvature * self.gear);
        let rest = [way[0] - until[0], way[1] - until[1]];
        (way, [length * cos - turn * rest[1], length * sin + turn * rest[0], turn])
    }

    fn whole_way(&self) -> Way {
        self.motions().into_iter().fold([0.0; 3], |way, motion| then(way, motion.way()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_turns_as_far_as_told_and_knows_how_it_changes() {
        for ends in
            [[None, None], [Some(0.0), None], [Some(0.1), Some(0.0)], [Some(0.0), Some(0.0)]]
        {
            for (gear, curvature) in [(1.0, 0.25), (-1.0, 0.25), (1.0, -0.25), (-1.0, -0.25)] {
                for more in [0.02, 0.1, 0.7, 2.0] {
                    let piece =
                        Piece { gear, curvature, ends, sharpness: 0.3, floor: 0.0, value: 0.0 };
                    let piece = Piece { value: piece.least() + more, ..piece };
                    let (way, change) = piece.way(&mut None);
                    let sign = gear * curvature.signum();
                    assert!((way[2] - sign * piece.value).abs() < 1e-12, "{piece:?} {way:?}");
                    let h = 1e-5;
                    let (longer, _) = Piece { value: piece.value + h, ..piece }.way(&mut None);
                    let (shorter, _) = Piece { value: piece.value - h, ..piece }.way(&mut None);
                    for i in 0..3 {
                        let expected = (longer[i] - shorter[i]) / (2.0 * h);
                        assert!(
                            (change[i] - expected).abs() < 1e-3,
                            "{piece:?} {i} {expected} {change:?}"
                        );
                    }
                }
            }
        }
    }
}
