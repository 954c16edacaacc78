//! Cells: the abstracted environments 𝓔 = {W_lane, W_spot, D_deadend, γ} of the paper.
//!
//! A cell is a closed region of free space in the spot frame: a lane rectangle
//! `x ∈ [m − back, m + D]`, `y ∈ [y_b, y_b + W_lane]` and the spot, a strip W_spot wide about the
//! way out of it, from its closed end (depth/2 behind the centre) to the lane at `y = y_b`. Where the
//! middle of the strip meets the lane, x is m: 0 but for angled bays. Larger parameters give a
//! larger region, so whatever is drivable in a cell is drivable in every scene whose
//! free space contains the cell.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::{ObstacleError, Obstacles, ParkingType, Stance};
use crate::geometry::{Aabb, Polygon, Pose, Vec2};
use crate::vehicle::Vehicle;

/// One abstracted environment; continuous or rounded down to a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Parking type γ, and how the parked car stands.
    pub stance: Stance,
    /// W_lane, metres.
    pub lane_width: f64,
    /// W_spot, metres.
    pub spot_width: f64,
    /// D_deadend: from the middle of the spot's mouth along +x to the end of the lane, metres.
    pub dead_end: f64,
}

impl Cell {
    /// Parking type γ.
    pub fn kind(&self) -> ParkingType {
        self.stance.kind()
    }
}

/// An evenly spaced axis of a grid: `min`, `min + step`, … up to `max`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Distance between values.
    pub step: f64,
}

impl Axis {
    /// Guards against 2.3 + 4·0.5 = 4.3 − ε losing its last value.
    const SLACK: f64 = 1e-9;

    /// Number of values.
    pub fn len(&self) -> usize {
        ((self.max - self.min) / self.step + Self::SLACK).floor() as usize + 1
    }

    /// Whether the axis holds no value (never, once validated).
    pub fn is_empty(&self) -> bool {
        self.max < self.min
    }

    /// The value at `index`, metres.
    pub fn value(&self, index: usize) -> f64 {
        self.min + index as f64 * self.step
    }

    /// Index of the value that is `v`, give or take a rounding.
    fn index_of(&self, v: f64) -> Option<usize> {
        const ROUNDING: f64 = 1e-6;
        let nearest = self.floor(v + self.step / 2.0)?;
        ((self.value(nearest) - v).abs() < ROUNDING).then_some(nearest)
    }

    /// Index of the largest value ≤ `v`; `None` below the smallest.
    pub fn floor(&self, v: f64) -> Option<usize> {
        let steps = (v - self.min) / self.step + Self::SLACK;
        if steps < 0.0 || steps.is_nan() {
            None
        } else {
            Some((steps as usize).min(self.len() - 1))
        }
    }

    fn validate(&self, field: &str) -> Result<(), GridError> {
        let ok = [self.min, self.max, self.step].iter().all(|v| v.is_finite() && *v > 0.0)
            && self.max >= self.min
            && (self.max - self.min) / self.step <= 1000.0;
        if ok {
            return Ok(());
        }
        Err(GridError {
            field: field.to_owned(),
            value: format!("min {}, max {}, step {}", self.min, self.max, self.step),
            expected: "positive numbers with min ≤ max and at most 1000 steps",
        })
    }
}

/// A grid setting outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("grid.{field} is {value}; expected {expected}")]
pub struct GridError {
    /// Name of the field.
    pub field: String,
    /// Its value.
    pub value: String,
    /// What would be right.
    pub expected: &'static str,
}

/// The discretisation of cells, and the constants every cell shares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Grid {
    /// W_lane values, metres.
    pub lane_width: Axis,
    /// W_spot values of bays, metres.
    pub bay_spot_width: Axis,
    /// W_spot values of parallel spots, metres.
    pub parallel_spot_width: Axis,
    /// D_deadend values, metres; the largest also stands for "no dead end".
    pub dead_end: Axis,
    /// How far a cell's lane reaches behind the spot's centre (−x), metres.
    pub back: f64,
    /// Depth of a bay spot, metres.
    pub bay_depth: f64,
    /// Depth of a parallel spot, metres.
    pub parallel_depth: f64,
    /// Slants of angled bays: from the direction of travel to the way out, degrees. 90 is left out.
    /// Left out of files that say nothing else, as all were before there were angled bays.
    #[serde(skip_serializing_if = "is_usual")]
    pub slant_deg: Axis,
}

/// The slants of a grid that says nothing else.
const USUAL_SLANTS: Axis = Axis { min: 30.0, max: 150.0, step: 15.0 };

fn is_usual(slants: &Axis) -> bool {
    *slants == USUAL_SLANTS
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            lane_width: Axis { min: 4.0, max: 7.0, step: 0.5 },
            bay_spot_width: Axis { min: 2.3, max: 4.3, step: 0.25 },
            parallel_spot_width: Axis { min: 6.0, max: 8.0, step: 0.25 },
            dead_end: Axis { min: 4.0, max: 12.0, step: 1.0 },
            back: 7.0,
            bay_depth: 5.5,
            parallel_depth: 2.4,
            slant_deg: USUAL_SLANTS,
        }
    }
}

impl Grid {
    /// Checks every field.
    pub fn validate(&self) -> Result<(), GridError> {
        self.lane_width.validate("lane_width")?;
        self.bay_spot_width.validate("bay_spot_width")?;
        self.parallel_spot_width.validate("parallel_spot_width")?;
        self.dead_end.validate("dead_end")?;
        for (field, v) in [
            ("back", self.back),
            ("bay_depth", self.bay_depth),
            ("parallel_depth", self.parallel_depth),
        ] {
            if !(v.is_finite() && v > 0.0 && v <= 100.0) {
                return Err(GridError {
                    field: field.to_owned(),
                    value: v.to_string(),
                    expected: "a number above 0 and at most 100 metres",
                });
            }
        }
        self.slant_deg.validate("slant_deg")?;
        let (min, max) = (self.slant_deg.min, self.slant_deg.max);
        if min < 15.0 || max > 165.0 || self.stance_count(ParkingType::Angled) == 0 {
            return Err(GridError {
                field: "slant_deg".to_owned(),
                value: format!("min {min}, max {max}, step {}", self.slant_deg.step),
                expected: "degrees from 15 to 165, not 90 alone",
            });
        }
        Ok(())
    }

    /// The grid of the same cells with lanes `behind` metres longer at the back.
    pub fn with_lane_behind(&self, behind: f64) -> Grid {
        Grid { back: self.back + behind, ..*self }
    }

    /// The grid for vehicles `factor` times as long.
    pub fn scaled(&self, factor: f64) -> Grid {
        let axis =
            |a: Axis| Axis { min: a.min * factor, max: a.max * factor, step: a.step * factor };
        Grid {
            lane_width: axis(self.lane_width),
            bay_spot_width: axis(self.bay_spot_width),
            parallel_spot_width: axis(self.parallel_spot_width),
            dead_end: axis(self.dead_end),
            back: self.back * factor,
            bay_depth: self.bay_depth * factor,
            parallel_depth: self.parallel_depth * factor,
            slant_deg: self.slant_deg,
        }
    }

    /// The W_spot axis of a parking type.
    pub fn spot_width(&self, kind: ParkingType) -> &Axis {
        if kind.is_bay() { &self.bay_spot_width } else { &self.parallel_spot_width }
    }

    /// Spot depth of a parking type, metres.
    pub fn depth(&self, kind: ParkingType) -> f64 {
        if kind.is_bay() { self.bay_depth } else { self.parallel_depth }
    }

    /// How cars of a type may stand parked: tail in and nose in at each of the slants of angled bays,
    /// one way only otherwise.
    pub fn stances(&self, kind: ParkingType) -> Vec<Stance> {
        (0..self.stance_count(kind)).map(|i| self.stance(kind, i)).collect()
    }

    fn stance_count(&self, kind: ParkingType) -> usize {
        match kind {
            ParkingType::Angled => {
                2 * (self.slant_deg.len() - usize::from(self.square_slant().is_some()))
            }
            _ => 1,
        }
    }

    /// The stance with `index` in `0..stance_count`.
    fn stance(&self, kind: ParkingType, index: usize) -> Stance {
        let slant = index / 2;
        let skipped = usize::from(self.square_slant().is_some_and(|square| slant >= square));
        let heading = self.slant_deg.value(slant + skipped).to_radians();
        Stance::new(kind, if index.is_multiple_of(2) { heading } else { heading - PI })
    }

    /// The index of a stance that is one of the grid's; undoes [`Grid::stance`].
    fn stance_index(&self, stance: Stance) -> Option<usize> {
        if stance.kind() != ParkingType::Angled {
            return Some(0);
        }
        let nose_in = stance.heading() < 0.0;
        let slant = if nose_in { stance.heading() + PI } else { stance.heading() }.to_degrees();
        let index = self.slant_deg.index_of(slant)?;
        let square = self.square_slant();
        if square == Some(index) {
            return None;
        }
        let skipped = usize::from(square.is_some_and(|square| index > square));
        Some(2 * (index - skipped) + usize::from(nose_in))
    }

    /// Which of the slants is square, and left out.
    fn square_slant(&self) -> Option<usize> {
        self.slant_deg.index_of(90.0)
    }

    /// y of the boundary between spot and lane, metres: of a slanted bay that of its farthest corner
    /// where the bay is as wide as the narrowest.
    pub fn lane_boundary(&self, stance: Stance) -> f64 {
        let half = self.depth(stance.kind()) / 2.0;
        match stance.kind() {
            ParkingType::Angled => {
                let out = stance.out();
                half * out.y + self.bay_spot_width.min / 2.0 * out.x.abs()
            }
            _ => half,
        }
    }

    /// x where the middle of the spot meets the lane that begins at `boundary`, metres.
    pub fn mouth(&self, stance: Stance, boundary: f64) -> f64 {
        let out = stance.out();
        out.x / out.y * boundary
    }

    /// Number of cells of a type.
    pub fn cell_count(&self, kind: ParkingType) -> usize {
        let of_stance = self.lane_width.len() * self.spot_width(kind).len() * self.dead_end.len();
        self.stance_count(kind) * of_stance
    }

    /// The cell with `index` in `0..cell_count`: dead end fastest, then spot, then lane, then stance.
    pub fn cell(&self, kind: ParkingType, index: usize) -> Cell {
        let [stance, lane, spot, dead_end] = self.place(kind, index);
        Cell {
            stance: self.stance(kind, stance),
            lane_width: self.lane_width.value(lane),
            spot_width: self.spot_width(kind).value(spot),
            dead_end: self.dead_end.value(dead_end),
        }
    }

    /// Indices of stance, lane width, spot width and dead end of the cell with `index`.
    pub fn place(&self, kind: ParkingType, index: usize) -> [usize; 4] {
        let (nd, ns) = (self.dead_end.len(), self.spot_width(kind).len());
        let (per_lane, nl) = (nd * ns, self.lane_width.len());
        [index / (per_lane * nl), index / per_lane % nl, index / nd % ns, index % nd]
    }

    /// Index of the cell at `place`; undoes [`Grid::place`].
    pub fn index(&self, kind: ParkingType, [stance, lane, spot, dead_end]: [usize; 4]) -> usize {
        let lane = stance * self.lane_width.len() + lane;
        (lane * self.spot_width(kind).len() + spot) * self.dead_end.len() + dead_end
    }

    /// Index of the largest grid cell ≤ `cell` in every parameter (paper, eq. 8):
    /// `min + ⌊(v − min)/Δ⌋·Δ`, clamped to the maximum. `None` when some parameter lies
    /// below the grid, or the car stands at a slant that is none of the grid's.
    pub fn floor(&self, cell: &Cell) -> Option<usize> {
        let kind = cell.kind();
        let stance = self.stance_index(cell.stance)?;
        let lane = self.lane_width.floor(cell.lane_width)?;
        let spot = self.spot_width(kind).floor(cell.spot_width)?;
        let dead_end = self.dead_end.floor(cell.dead_end)?;
        Some(self.index(kind, [stance, lane, spot, dead_end]))
    }

    /// The parked rear-axle pose in the spot frame.
    pub fn goal(&self, stance: Stance, vehicle: &Vehicle) -> Pose {
        vehicle.rear_axle(Pose::new(0.0, 0.0, stance.heading()))
    }

    /// The free lane of a cell, in the spot frame.
    pub fn lane(&self, cell: &Cell) -> Aabb {
        let y_b = self.lane_boundary(cell.stance);
        let mouth = self.mouth(cell.stance, y_b);
        Aabb::new(mouth - self.back, y_b, mouth + cell.dead_end, y_b + cell.lane_width)
    }

    /// The free lane and the spot of a cell, in the spot frame. The corners of the spot: its closed
    /// end, then its mouth.
    #[allow(clippy::missing_panics_doc, reason = "a spot has four corners")]
    pub fn regions(&self, cell: &Cell) -> [Polygon; 2] {
        let polygon = |corners: [Vec2; 4]| Polygon::new(corners.to_vec()).expect("four points");
        let lane = Polygon::rectangle(Pose::default(), self.lane(cell));
        [lane, polygon(self.spot_corners(cell))]
    }

    /// The spot's corners: the closed end from left to right, the mouth from right to left.
    fn spot_corners(&self, cell: &Cell) -> [Vec2; 4] {
        let y_b = self.lane_boundary(cell.stance);
        let (out, half) = (cell.stance.out(), cell.spot_width / 2.0);
        let across = Vec2::new(out.y, -out.x);
        let end = out * (-self.depth(cell.kind()) / 2.0);
        let to_lane = |p: Vec2| p + out * ((y_b - p.y) / out.y);
        let (left, right) = (end - across * half, end + across * half);
        [left, right, to_lane(right), to_lane(left)]
    }

    /// The complement of a cell's free space near it, as solid walls in the spot frame.
    pub fn walls(&self, cell: &Cell) -> Result<Obstacles, ObstacleError> {
        const T: f64 = 1.0;
        let lane = self.lane(cell);
        let beside = match cell.kind() {
            ParkingType::Angled => self.beside_slanted(cell, T),
            _ => {
                let half = cell.spot_width / 2.0;
                let spot = Aabb::new(-half, -lane.min.y, half, lane.min.y);
                let right = lane.max.x.max(spot.max.x) + T;
                [
                    Aabb::new(lane.min.x - T, spot.min.y - T, spot.min.x, lane.min.y),
                    Aabb::new(spot.max.x, spot.min.y - T, right, lane.min.y),
                    Aabb::new(spot.min.x, spot.min.y - T, spot.max.x, spot.min.y),
                ]
                .map(|b| Polygon::rectangle(Pose::default(), b))
            }
        };
        let around = [
            Aabb::new(lane.min.x - T, lane.max.y, lane.max.x + T, lane.max.y + T),
            Aabb::new(lane.min.x - T, lane.min.y, lane.min.x, lane.max.y),
            Aabb::new(lane.max.x, lane.min.y, lane.max.x + T, lane.max.y),
        ]
        .map(|b| Polygon::rectangle(Pose::default(), b));
        Obstacles::new([beside, around].concat(), Vec::new(), Vec::new())
    }

    /// What is solid left and right of a slanted bay and at its closed end, `thick` at least.
    fn beside_slanted(&self, cell: &Cell, thick: f64) -> [Polygon; 3] {
        let lane = self.lane(cell);
        let [left, right, mouth_right, mouth_left] = self.spot_corners(cell);
        let out = cell.stance.out();
        let low = left.y.min(right.y) - thick;
        let to_low = |p: Vec2| p + out * ((low - p.y) / out.y);
        let (low_left, low_right) = (to_low(left), to_low(right));
        let from = lane.min.x.min(low_left.x) - thick;
        let to = lane.max.x.max(low_right.x).max(mouth_right.x) + thick;
        let corner = |x: f64| (Vec2::new(x, low), Vec2::new(x, lane.min.y));
        let ((a, b), (c, d)) = (corner(from), corner(to));
        [
            vec![a, low_left, mouth_left, b],
            vec![low_right, c, d, mouth_right],
            vec![low_left, low_right, right, left],
        ]
        .map(|corners| Polygon::new(corners).expect("four points"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_toward_the_smaller_cell() {
        let g = Grid::default();
        for kind in ParkingType::ALL {
            for i in 0..g.cell_count(kind) {
                assert_eq!(g.floor(&g.cell(kind, i)), Some(i));
                assert_eq!(g.index(kind, g.place(kind, i)), i);
            }
        }
        let kind = ParkingType::Reverse;
        let stance = g.stances(kind)[0];
        let c = Cell { stance, lane_width: 6.49, spot_width: 2.54, dead_end: 99.0 };
        let f = g.cell(kind, g.floor(&c).unwrap());
        assert_eq!((f.lane_width, f.spot_width, f.dead_end), (6.0, 2.3, 12.0));
        assert_eq!(g.floor(&Cell { lane_width: 3.99, ..c }), None);
    }

    #[test]
    fn larger_parameters_give_a_larger_region_and_walls_leave_just_that() {
        let g = Grid::default();
        let kind = ParkingType::Angled;
        let count = g.cell_count(kind);
        for i in (0..count).step_by(37) {
            let cell = g.cell(kind, i);
            let place = g.place(kind, i);
            let next = |axis: usize| {
                let mut place = place;
                place[axis] += 1;
                let larger = g.index(kind, place);
                (larger < count && g.place(kind, larger) == place).then(|| g.cell(kind, larger))
            };
            let (regions, walls) = (g.regions(&cell), g.walls(&cell).unwrap());
            let larger: Vec<Cell> = (1..4).filter_map(next).collect();
            for (x, y) in (0..60).flat_map(|x| (0..40).map(move |y| (x, y))) {
                let p = Vec2::new(f64::from(x) * 0.501 - 15.03, f64::from(y) * 0.401 - 5.02);
                let inside = |regions: &[Polygon]| regions.iter().any(|r| r.contains(p));
                let is_free = inside(&regions);
                assert!(!is_free || !inside(walls.polygons()), "{cell:?} {p:?}");
                for cell in &larger {
                    assert!(!is_free || inside(&g.regions(cell)), "{cell:?} {p:?}");
                }
                // Just beyond its border everything is solid.
                let near = |r: &Polygon| {
                    r.edges().any(|(a, b)| {
                        let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                        (p - a - (b - a) * t).norm() < 0.5
                    })
                };
                let solid = inside(walls.polygons());
                assert!(is_free || solid || !regions.iter().any(near), "{cell:?} {p:?}");
            }
        }
    }

    #[test]
    fn what_says_nothing_of_slants_stays_as_it_was() {
        let usual = serde_json::to_string(&Grid::default()).unwrap();
        assert!(!usual.contains("slant"), "{usual}");
        assert_eq!(serde_json::from_str::<Grid>(&usual).unwrap(), Grid::default());
        let slant_deg = Axis { min: 45.0, max: 60.0, step: 15.0 };
        let other = Grid { slant_deg, ..Grid::default() };
        let text = serde_json::to_string(&other).unwrap();
        assert_eq!(serde_json::from_str::<Grid>(&text).unwrap(), other);
        let square = Grid { slant_deg: Axis { min: 90.0, max: 90.0, step: 1.0 }, ..other };
        assert!(square.validate().unwrap_err().to_string().contains("slant_deg"));
    }
}
