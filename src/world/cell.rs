//! Cells: the abstracted environments 𝓔 = {W_lane, W_spot, D_deadend, γ} of the paper.
//!
//! A cell is a closed region of free space in the spot frame: a lane rectangle
//! `x ∈ [−back, D]`, `y ∈ [y_b, y_b + W_lane]` and a spot rectangle
//! `x ∈ [−W_spot/2, W_spot/2]`, `y ∈ [−depth/2, y_b]`. Larger parameters give a
//! larger region, so whatever is drivable in a cell is drivable in every scene whose
//! free space contains the cell.

use serde::{Deserialize, Serialize};

use super::{ObstacleError, Obstacles, ParkingType};
use crate::geometry::{Aabb, Polygon, Pose};
use crate::vehicle::Vehicle;

/// One abstracted environment; continuous or rounded down to a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Parking type γ.
    pub kind: ParkingType,
    /// W_lane, metres.
    pub lane_width: f64,
    /// W_spot, metres.
    pub spot_width: f64,
    /// D_deadend: from the spot's centre along +x to the end of the lane, metres.
    pub dead_end: f64,
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

    /// y of the boundary between spot and lane, metres.
    pub fn lane_boundary(&self, kind: ParkingType) -> f64 {
        self.depth(kind) / 2.0
    }

    /// Number of cells of a type.
    pub fn cell_count(&self, kind: ParkingType) -> usize {
        self.lane_width.len() * self.spot_width(kind).len() * self.dead_end.len()
    }

    /// The cell with `index` in `0..cell_count`: dead end fastest, then spot, then lane.
    pub fn cell(&self, kind: ParkingType, index: usize) -> Cell {
        let [lane, spot, dead_end] = self.place(kind, index);
        Cell {
            kind,
            lane_width: self.lane_width.value(lane),
            spot_width: self.spot_width(kind).value(spot),
            dead_end: self.dead_end.value(dead_end),
        }
    }

    /// Indices of lane width, spot width and dead end of the cell with `index`.
    pub fn place(&self, kind: ParkingType, index: usize) -> [usize; 3] {
        let (nd, ns) = (self.dead_end.len(), self.spot_width(kind).len());
        [index / (nd * ns), index / nd % ns, index % nd]
    }

    /// Index of the cell at `place`; undoes [`Grid::place`].
    pub fn index(&self, kind: ParkingType, [lane, spot, dead_end]: [usize; 3]) -> usize {
        (lane * self.spot_width(kind).len() + spot) * self.dead_end.len() + dead_end
    }

    /// Index of the largest grid cell ≤ `cell` in every parameter (paper, eq. 8):
    /// `min + ⌊(v − min)/Δ⌋·Δ`, clamped to the maximum. `None` when some parameter lies
    /// below the grid.
    pub fn floor(&self, cell: &Cell) -> Option<usize> {
        let lane = self.lane_width.floor(cell.lane_width)?;
        let spot = self.spot_width(cell.kind).floor(cell.spot_width)?;
        let dead_end = self.dead_end.floor(cell.dead_end)?;
        Some(self.index(cell.kind, [lane, spot, dead_end]))
    }

    /// The parked rear-axle pose in the spot frame.
    pub fn goal(&self, kind: ParkingType, vehicle: &Vehicle) -> Pose {
        vehicle.rear_axle(Pose::new(0.0, 0.0, kind.goal_heading()))
    }

    /// The free lane and spot rectangles of a cell, in the spot frame.
    pub fn regions(&self, cell: &Cell) -> [Aabb; 2] {
        let y_b = self.lane_boundary(cell.kind);
        let half = cell.spot_width / 2.0;
        [
            Aabb::new(-self.back, y_b, cell.dead_end, y_b + cell.lane_width),
            Aabb::new(-half, -y_b, half, y_b),
        ]
    }

    /// The complement of a cell's free space near it, as solid walls in the spot frame.
    pub fn walls(&self, cell: &Cell) -> Result<Obstacles, ObstacleError> {
        const T: f64 = 1.0;
        let [lane, spot] = self.regions(cell);
        let boxes = [
            Aabb::new(lane.min.x - T, spot.min.y - T, spot.min.x, lane.min.y),
            Aabb::new(spot.max.x, spot.min.y - T, lane.max.x.max(spot.max.x) + T, lane.min.y),
            Aabb::new(spot.min.x, spot.min.y - T, spot.max.x, spot.min.y),
            Aabb::new(lane.min.x - T, lane.max.y, lane.max.x + T, lane.max.y + T),
            Aabb::new(lane.min.x - T, lane.min.y, lane.min.x, lane.max.y),
            Aabb::new(lane.max.x, lane.min.y, lane.max.x + T, lane.max.y),
        ];
        let polygons = boxes.map(|b| Polygon::rectangle(Pose::default(), b)).to_vec();
        Obstacles::new(polygons, Vec::new(), Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_toward_the_smaller_cell() {
        let g = Grid::default();
        let kind = ParkingType::Reverse;
        for i in 0..g.cell_count(kind) {
            assert_eq!(g.floor(&g.cell(kind, i)), Some(i));
            assert_eq!(g.index(kind, g.place(kind, i)), i);
        }
        let c = Cell { kind, lane_width: 6.49, spot_width: 2.54, dead_end: 99.0 };
        let f = g.cell(kind, g.floor(&c).unwrap());
        assert_eq!((f.lane_width, f.spot_width, f.dead_end), (6.0, 2.3, 12.0));
        assert_eq!(g.floor(&Cell { lane_width: 3.99, ..c }), None);
    }
}
