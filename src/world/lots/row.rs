//! One row of spots beside a lane, and the cars in it.

use std::f64::consts::FRAC_PI_2;

use super::draw::Draw;
use super::road::Road;
use super::things::{Things, around};
use crate::geometry::Pose;

/// How spots lie beside the lane.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Style {
    /// Bays whose axis is `slant` from the lane, radians; π/2 is square to it.
    Bays { slant: f64 },
    /// One behind the other along the lane.
    Parallel,
}

impl Style {
    pub const SQUARE: Style = Style::Bays { slant: FRAC_PI_2 };
}

/// A row of spots: at the edge of a lane, reaching away from it.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub style: Style,
    /// Offset of its edge to the lane, metres.
    pub edge: f64,
    /// +1 where it lies to the left of that edge, −1 to the right.
    pub away: f64,
    /// Of a spot: width of a bay, length of a parallel spot, metres.
    pub width: f64,
    /// Of a spot: length of a bay, width of a parallel spot, metres.
    pub depth: f64,
    /// Share of taken spots.
    pub occupancy: f64,
    /// How far cars may reach over the edge, metres.
    pub stick_out: f64,
    /// Pillars: one every so many bays, this thick (metres).
    pub pillars: Option<(u32, f64)>,
}

/// The least room between two obstacles, metres.
const APART: f64 = 0.12;

impl Row {
    /// Length of a spot along the lane, metres.
    pub fn step(&self) -> f64 {
        match self.style {
            Style::Bays { slant } => self.width / slant.sin(),
            Style::Parallel => self.width,
        }
    }

    /// From the row's edge to its back, metres.
    pub fn across(&self) -> f64 {
        match self.style {
            Style::Bays { slant } => self.depth * slant.sin() + self.width * slant.cos().abs(),
            Style::Parallel => self.depth,
        }
    }

    /// Offset of its back, metres.
    pub fn back(&self) -> f64 {
        self.edge + self.away * self.across()
    }

    /// The middle of the spot whose mouth is at the station `s`; of a bay the heading points out
    /// of it, of a parallel spot along the road.
    pub fn spot(&self, road: &Road, s: f64) -> Pose {
        match self.style {
            Style::Bays { slant } => {
                let mouth = road.at(s, self.edge, -self.away * slant);
                // So far in that no corner of the rectangle is in the lane.
                mouth
                    .shifted(-self.depth / 2.0 - self.width / 2.0 * slant.cos().abs() / slant.sin())
            }
            Style::Parallel => road.at(s, self.edge + self.away * self.depth / 2.0, 0.0),
        }
    }

    /// Fills the row from the station `from` to `to`, in either direction. Returns where the last
    /// spot ends.
    pub fn fill(
        &self,
        road: &Road,
        from: f64,
        to: f64,
        draw: &mut Draw,
        things: &mut Things,
    ) -> f64 {
        match self.style {
            Style::Bays { .. } => self.fill_bays(road, from, to, draw, things),
            Style::Parallel => self.fill_parallel(road, from, to, draw, things),
        }
    }

    fn fill_bays(
        &self,
        road: &Road,
        from: f64,
        to: f64,
        draw: &mut Draw,
        things: &mut Things,
    ) -> f64 {
        let (side, step) = ((to - from).signum(), self.step());
        let mut line = from;
        for n in 0.. {
            if let Some((_, thick)) = self.pillars.filter(|(every, _)| n % every == 0) {
                let body = around(thick, thick);
                let inward = thick / 2.0 + 0.3;
                let at = road.at(line + side * thick / 2.0, self.edge + self.away * inward, 0.0);
                things.put(at, body, 0.0);
                line += side * thick;
            }
            if (line + side * step - to) * side > 0.0 {
                break;
            }
            let is_taken = draw.chance(if n == 0 { 0.9 } else { self.occupancy });
            if is_taken {
                self.park_in_bay(self.spot(road, line + side * step / 2.0), draw, things);
            }
            line += side * step;
        }
        line
    }

    /// A car in the bay at `spot`: mostly well within, now and then aslant or over its line.
    fn park_in_bay(&self, spot: Pose, draw: &mut Draw, things: &mut Things) {
        let [length, width] = draw.car();
        let length = length.min(self.depth + self.stick_out - 0.15);
        let slack = (self.depth - length) / 2.0;
        let out = draw.between(0.1 - slack, slack.min(0.6) + self.stick_out);
        let beside = ((self.width - width) / 2.0).max(0.0);
        let beside = if draw.chance(0.07) {
            draw.sign() * (beside + draw.between(0.0, 0.25))
        } else {
            draw.about(beside.min(0.25))
        };
        let turn = slant(draw);
        // Turned about its middle the car reaches further out.
        let out = out - turn.sin().abs() * width / 2.0;
        let at = spot.compose(Pose::new(out, beside, turn));
        things.put(at, around(length, width), APART);
    }

    fn fill_parallel(
        &self,
        road: &Road,
        from: f64,
        to: f64,
        draw: &mut Draw,
        things: &mut Things,
    ) -> f64 {
        let side = (to - from).signum();
        let mut end = from;
        for n in 0.. {
            let [length, width] = draw.car();
            // The first stands at the target's end.
            let gap = if n == 0 { draw.between(0.0, 0.2) } else { draw.between(0.5, 1.4) };
            let next = end + side * (gap + length);
            if (next - to) * side > 0.0 {
                break;
            }
            let turn = slant(draw);
            // Beside the kerb, as far as the lane allows.
            let half = (width + length * turn.sin().abs()) / 2.0;
            let inward = (self.depth - half - draw.between(0.1, 0.4)).max(half - self.stick_out);
            let at = road.at(end + side * (gap + length / 2.0), self.edge, 0.0);
            let at = at.compose(Pose::new(0.0, self.away * inward, turn));
            let is_taken = draw.chance(if n == 0 { 0.9 } else { self.occupancy });
            if is_taken && inward + half < self.depth {
                things.put(at, around(length, width), APART);
            }
            end = next;
        }
        end
    }
}

/// Mostly straight, now and then aslant; radians.
fn slant(draw: &mut Draw) -> f64 {
    let most: f64 = if draw.chance(0.1) { 6.0 } else { 2.0 };
    draw.about(most.to_radians())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Aabb;
    use crate::rng::{Stream, rng};

    #[test]
    fn cars_keep_within_their_row() {
        for style in [Style::SQUARE, Style::Bays { slant: 0.9 }, Style::Parallel] {
            let (width, depth) = if style == Style::Parallel { (6.0, 2.4) } else { (2.5, 5.2) };
            let row = Row {
                style,
                edge: -1.0,
                away: -1.0,
                width,
                depth,
                occupancy: 1.0,
                stick_out: 0.0,
                pillars: None,
            };
            let (road, mut things) = (Road { curvature: 0.0 }, Things::default());
            let mut draw = Draw::new(rng(1, Stream::Lot, 0));
            let end = row.fill(&road, 0.0, 40.0, &mut draw, &mut things);
            assert!((33.0..=40.0).contains(&end), "{end}");
            assert!(things.solids.len() > 5);
            let extent = Aabb::around(things.solids.iter().flat_map(|p| p.vertices().to_vec()));
            assert!(extent.max.y < -0.9 && extent.min.y > row.back() - 0.2, "{extent:?}");
        }
    }
}
