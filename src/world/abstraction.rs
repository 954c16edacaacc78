//! Scene → cell: an inner approximation of the free space around the spot.
//!
//! The paper's abstraction (section IV): the largest obstacle-free rectangle of lane next
//! to the spot, and the spot. No obstacle ever reaches into the region found, so a path
//! that is valid in a stored cell ≤ the one found is valid in the scene.
//!
//! Everything is read off the obstacle edges in the spot frame. The region is connected
//! and contains the parked car, so if no edge enters it, no obstacle's inside does.

use std::ops::Range;

use super::cell::{Cell, Grid};
use super::{Obstacles, ParkingType};
use crate::geometry::{Aabb, Vec2};

/// What the abstraction found in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Abstraction {
    /// The environment as measured, before rounding.
    pub measured: Cell,
    /// The grid cell used: `measured` rounded down.
    pub cell: Cell,
    /// Its index in the grid.
    pub index: usize,
    /// How far the cell's frame lies along +y of the spot frame, metres: bays whose
    /// neighbours protrude into the lane begin their lane further out.
    pub shift: f64,
}

impl Abstraction {
    /// The free lane and spot rectangles of the cell used, in the spot frame.
    pub fn regions(&self, grid: &Grid) -> [Aabb; 2] {
        grid.regions(&self.cell).map(|r| {
            let up = Vec2::new(0.0, self.shift);
            Aabb { min: r.min + up, max: r.max + up }
        })
    }
}

/// Obstacles that only touch a region's border do not enter it.
const TOUCH: f64 = 1e-6;

/// The farthest a bay's lane may begin beyond its usual boundary, of the bay's depth: a car parked
/// at the bottom of a bay 9 m deep, or pillars and kerbs that reach as far into the lane.
const MAX_SHIFT: f64 = 4.0 / 5.5;
/// The same for the lane beside a parallel spot, of the spot's depth.
const KERB: f64 = 0.3 / 2.4;
/// The same where only what stands out farthest in the row is asked for.
const USUAL_SHIFT: f64 = 1.0 / 5.5;
/// Farther out the lane is looked for in steps, of the bay's depth.
const SHIFT_STEP: f64 = 0.25 / 5.5;

/// The cells found around the spot, largest lane first; none where the scene has no such
/// structure or lies below the grid.
///
/// `obstacles` in the spot frame. Several cells are maximal when an obstacle can either
/// shorten the lane or narrow it; none of those returned contains another.
pub fn abstractions(obstacles: &Obstacles, kind: ParkingType, grid: &Grid) -> Vec<Abstraction> {
    Surroundings::new(obstacles).abstractions(kind, grid)
}

/// Obstacles as bare edges, in one frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Surroundings {
    /// Those of polygons and polylines first, then points as edges of length zero.
    edges: Vec<(Vec2, Vec2)>,
    /// Which edges are those of one polygon or polyline.
    polygons: Vec<Range<usize>>,
}

impl Surroundings {
    fn new(obstacles: &Obstacles) -> Self {
        let mut all = Self::default();
        obstacles.polygons().iter().for_each(|p| all.add_polygon(p.edges()));
        obstacles.polylines().iter().for_each(|p| all.add_polygon(p.edges()));
        obstacles.points().iter().for_each(|&p| all.add_point(p));
        all
    }

    /// Adds the edges of a polygon or a polyline. Points come after all of them.
    pub fn add_polygon(&mut self, edges: impl Iterator<Item = (Vec2, Vec2)>) {
        let first = self.edges.len();
        debug_assert_eq!(first, self.points_begin(), "points come after all polygons");
        self.edges.extend(edges);
        self.polygons.push(first..self.edges.len());
    }

    fn points_begin(&self) -> usize {
        self.polygons.last().map_or(0, |p| p.end)
    }

    /// How far from `from` along the unit vector `along` the first obstacle is within `width` of that
    /// ray on either side, at most `most`. A ray without width would pass between scanned points.
    pub fn free_along(&self, from: Vec2, along: Vec2, width: f64, most: f64) -> f64 {
        let across = Vec2::new(-along.y, along.x);
        let seen = |p: Vec2| Vec2::new((p - from).dot(&along), (p - from).dot(&across));
        let within = |&(a, b): &(Vec2, Vec2)| clip(seen(a), seen(b), 1, -width, width);
        let ahead = self.edges.iter().filter_map(within).filter(|(a, b)| a.x.max(b.x) >= 0.0);
        ahead.fold(most, |free, (a, b)| free.min(a.x.min(b.x).max(0.0)))
    }

    /// How far from x = 0 nothing stands between `low` and `high` in y, toward the side where that is
    /// farther.
    pub fn free_in_band(&self, [low, high]: [f64; 2]) -> f64 {
        let (mut left, mut right) = (f64::INFINITY, f64::INFINITY);
        for &(a, b) in &self.edges {
            let Some((a, b)) = clip(a, b, 1, low, high) else { continue };
            let (x_min, x_max) = (a.x.min(b.x), a.x.max(b.x));
            if x_min > 0.0 {
                right = right.min(x_min);
            } else {
                left = left.min(-x_max.min(0.0));
            }
        }
        left.max(right)
    }

    /// Adds a point.
    pub fn add_point(&mut self, p: Vec2) {
        self.edges.push((p, p));
    }

    /// The same obstacles with every point mapped by `f`.
    pub fn map(&self, f: impl Fn(Vec2) -> Vec2) -> Self {
        let edges = self.edges.iter().map(|&(a, b)| (f(a), f(b))).collect();
        Self { edges, polygons: self.polygons.clone() }
    }

    /// [`abstractions`] among these obstacles.
    pub fn abstractions(&self, kind: ParkingType, grid: &Grid) -> Vec<Abstraction> {
        let mut found = self.lanes(kind, grid);
        // No straight leads from a lane farther out into a parallel spot: a cell's manoeuvre fits where
        // it is hardly farther out, as kerbs are nearer to some cars than to others.
        if found.is_empty() && kind.is_bay() {
            found = self.lanes_farther_out(kind, grid);
        }
        found.retain(|lane| kind.is_bay() || lane.shift <= KERB * grid.parallel_depth);
        found
    }

    /// The lanes that begin about where they usually do beside a spot, largest first.
    pub fn lanes(&self, kind: ParkingType, grid: &Grid) -> Vec<Abstraction> {
        let edges = self.near(kind, grid);
        let low = bottom_shift(&edges, kind, grid);
        let most = USUAL_SHIFT * grid.bay_depth;
        for shift in [low, self.protrusion(kind, grid).max(low)] {
            if shift <= most {
                let found = at_shift(&edges, kind, grid, shift);
                if !found.is_empty() {
                    return found;
                }
            }
        }
        Vec::new()
    }

    /// The lanes that begin as little farther out as there is one, largest first.
    pub fn lanes_farther_out(&self, kind: ParkingType, grid: &Grid) -> Vec<Abstraction> {
        let edges = self.near(kind, grid);
        let low = bottom_shift(&edges, kind, grid);
        let shifts = farther_out(&edges, kind, grid, low).into_iter();
        let mut found = shifts.map(|shift| at_shift(&edges, kind, grid, shift));
        found.find(|lanes| !lanes.is_empty()).unwrap_or_default()
    }

    /// What could enter a cell, or bounds the spot.
    fn near(&self, kind: ParkingType, grid: &Grid) -> Vec<(Vec2, Vec2)> {
        let floor = -grid.lane_boundary(kind);
        let top = grid.lane_boundary(kind) + MAX_SHIFT * grid.bay_depth + grid.lane_width.max;
        let is_near = |(a, b): &(Vec2, Vec2)| a.y.max(b.y) > floor && a.y.min(b.y) < top;
        self.edges.iter().copied().filter(is_near).collect()
    }

    /// How far polygons and points of the spot's own row stand out into the lane.
    fn protrusion(&self, kind: ParkingType, grid: &Grid) -> f64 {
        let boundary = grid.lane_boundary(kind);
        let (x_min, x_max) = (-grid.back, grid.dead_end.max);
        let mut top = boundary;
        for polygon in &self.polygons {
            let edges = &self.edges[polygon.clone()];
            if edges.iter().all(|(a, _)| a.y >= boundary) {
                continue;
            }
            for &(a, b) in edges {
                if let Some((a, b)) = clip(a, b, 0, x_min, x_max) {
                    top = top.max(a.y.max(b.y));
                }
            }
        }
        for (p, _) in &self.edges[self.points_begin()..] {
            if p.x > x_min && p.x < x_max && p.y < boundary + USUAL_SHIFT * grid.bay_depth {
                top = top.max(p.y);
            }
        }
        top - boundary
    }
}

/// How far out a lane may begin, farther than `low`, nearest first: just beyond something.
fn farther_out(edges: &[(Vec2, Vec2)], kind: ParkingType, grid: &Grid, low: f64) -> Vec<f64> {
    let boundary = grid.lane_boundary(kind);
    let (step, most) = (SHIFT_STEP * grid.bay_depth, MAX_SHIFT * grid.bay_depth);
    // The farthest end of something in every step.
    let mut ends = [f64::NEG_INFINITY; (MAX_SHIFT / SHIFT_STEP) as usize + 2];
    for &(a, b) in edges {
        let beside = a.x.max(b.x) < -grid.back || a.x.min(b.x) > grid.dead_end.max;
        for end in [a.y - boundary, b.y - boundary] {
            if !beside && end > low && end <= most {
                let end_of_step = &mut ends[(end / step) as usize];
                *end_of_step = end_of_step.max(end);
            }
        }
    }
    ends.into_iter().filter(|end| end.is_finite()).collect()
}

/// The maximal cells whose frame lies `shift` metres along +y.
fn at_shift(
    edges: &[(Vec2, Vec2)],
    kind: ParkingType,
    grid: &Grid,
    shift: f64,
) -> Vec<Abstraction> {
    let boundary = grid.lane_boundary(kind) + shift;
    let floor = shift - grid.lane_boundary(kind);
    let Some(spot_width) = spot_width(edges, floor, boundary) else { return Vec::new() };
    let axis = &grid.dead_end;
    // The lane's width for every dead end of the grid: nothing enters [−back, D].
    let mut widths = vec![grid.lane_width.max; axis.len()];
    for &(a, b) in edges {
        let Some((a, b)) = clip(a, b, 1, boundary + TOUCH, f64::INFINITY) else { continue };
        let (x_min, x_max) = (a.x.min(b.x), a.x.max(b.x));
        if x_max <= -grid.back + TOUCH {
            continue;
        }
        let lowest = a.y.min(b.y) - boundary;
        for (i, width) in widths.iter_mut().enumerate() {
            let dead_end = axis.value(i);
            if x_min >= dead_end - TOUCH || lowest >= *width {
                continue;
            }
            if let Some((a, b)) = clip(a, b, 0, -grid.back + TOUCH, dead_end - TOUCH) {
                *width = width.min(a.y.min(b.y) - boundary);
            }
        }
    }
    let mut found: Vec<Abstraction> = Vec::new();
    for (i, &lane_width) in widths.iter().enumerate().rev() {
        let found_at = Cell { kind, lane_width, spot_width, dead_end: axis.value(i) };
        let Some(index) = grid.floor(&found_at) else { continue };
        let cell = grid.cell(kind, index);
        if found.last().is_some_and(|f| f.cell.lane_width >= cell.lane_width) {
            continue;
        }
        let dead_end = dead_end(edges, boundary, lane_width, &found_at, axis.max);
        let measured = Cell { dead_end, ..found_at };
        found.push(Abstraction { measured, cell, index, shift });
    }
    found.sort_by(|a, b| {
        let area = |f: &Abstraction| f.cell.lane_width * (f.cell.dead_end + grid.back);
        area(b).total_cmp(&area(a))
    });
    found
}

/// Twice the smaller gap beside the spot's centre line; `None` when something stands on it.
fn spot_width(edges: &[(Vec2, Vec2)], floor: f64, boundary: f64) -> Option<f64> {
    let (mut left, mut right) = (f64::INFINITY, f64::INFINITY);
    for &(a, b) in edges {
        let Some((a, b)) = clip(a, b, 1, floor + TOUCH, boundary - TOUCH) else { continue };
        let (x_min, x_max) = (a.x.min(b.x), a.x.max(b.x));
        if x_min > 0.0 {
            right = right.min(x_min);
        } else if x_max < 0.0 {
            left = left.min(-x_max);
        } else {
            return None;
        }
    }
    Some(2.0 * left.min(right))
}

/// Where the lane really ends: the nearest x beyond the cell's dead end at which something
/// enters a lane of this width, at most `max`.
fn dead_end(edges: &[(Vec2, Vec2)], boundary: f64, width: f64, cell: &Cell, max: f64) -> f64 {
    let top = boundary + width;
    let entering = edges.iter().filter_map(|&(a, b)| {
        let (a, b) = clip(a, b, 1, boundary + TOUCH, top - TOUCH)?;
        let (a, b) = clip(a, b, 0, cell.dead_end - TOUCH, f64::INFINITY)?;
        Some(a.x.min(b.x))
    });
    entering.fold(max, f64::min).max(cell.dead_end)
}

/// How far the cell must move out so that nothing at the spot's closed end enters it.
fn bottom_shift(edges: &[(Vec2, Vec2)], kind: ParkingType, grid: &Grid) -> f64 {
    let floor = -grid.lane_boundary(kind);
    let smallest = grid.spot_width(kind).min / 2.0;
    let tops = edges.iter().filter_map(|&(a, b)| {
        let (a, b) = clip(a, b, 0, -smallest + TOUCH, smallest - TOUCH)?;
        let (a, b) = clip(a, b, 1, floor + TOUCH, 0.0)?;
        Some(a.y.max(b.y) - floor)
    });
    tops.fold(0.0, f64::max)
}

/// The part of `a`–`b` with `low ≤ coordinate ≤ high` on one axis (0 is x, 1 is y).
fn clip(a: Vec2, b: Vec2, axis: usize, low: f64, high: f64) -> Option<(Vec2, Vec2)> {
    let (pa, pb) = (a[axis], b[axis]);
    if (pa < low && pb < low) || (pa > high && pb > high) {
        return None;
    }
    let at = |limit: f64| a + (b - a) * ((limit - pa) / (pb - pa));
    let cut = |p: Vec2, v: f64| {
        if v < low {
            at(low)
        } else if v > high {
            at(high)
        } else {
            p
        }
    };
    Some((cut(a, pa), cut(b, pb)))
}
