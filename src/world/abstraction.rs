//! Scene → cell: an inner approximation of the free space around the spot.
//!
//! The paper's abstraction (section IV): the largest obstacle-free rectangle of lane next
//! to the spot, and the spot. No obstacle ever reaches into the region found, so a path
//! that is valid in a stored cell ≤ the one found is valid in the scene.
//!
//! Everything is read off the obstacle edges in the spot frame. The region is connected
//! and contains the parked car, so if no edge enters it, no obstacle's inside does.
//!
//! An angled bay need not have one of the grid's slants. Its cell's frame is then turned until the
//! parked car stands at one of them, and the lane is what is free along that direction: a little less
//! than along its own, and as truly free.

use std::f64::consts::PI;
use std::ops::Range;

use super::cell::{Cell, Grid};
use super::{Obstacles, ParkingType, Stance};
use crate::geometry::{Polygon, Pose, Vec2, wrap_angle};

/// What the abstraction found in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Abstraction {
    /// The environment as measured, before rounding.
    pub measured: Cell,
    /// The grid cell used: `measured` rounded down.
    pub cell: Cell,
    /// Its index in the grid.
    pub index: usize,
    /// How far the cell's frame lies out of the spot, metres: bays whose neighbours protrude into the
    /// lane begin their lane further out.
    pub shift: f64,
    /// How far the cell's frame is turned about the parked centre, radians: 0 but for angled bays.
    pub turn: f64,
}

impl Abstraction {
    /// The origin and the direction of the cell's frame, in the spot frame.
    fn frame(&self) -> Pose {
        let out = self.cell.stance.out() * self.shift;
        let at = Pose::new(0.0, 0.0, self.turn).point_to_parent(out);
        Pose::new(at.x, at.y, self.turn)
    }

    /// A pose of the spot frame, seen from the cell's frame.
    pub fn in_cell(&self, pose: Pose) -> Pose {
        if self.turn == 0.0 {
            // To the last digit.
            let Pose { x, y, .. } = self.frame();
            return Pose { x: pose.x - x, y: pose.y - y, ..pose };
        }
        self.frame().relative(pose)
    }

    /// A pose of the cell's frame, in the spot frame; undoes [`Abstraction::in_cell`].
    pub fn from_cell(&self, pose: Pose) -> Pose {
        if self.turn == 0.0 {
            let Pose { x, y, .. } = self.frame();
            return Pose { x: pose.x + x, y: pose.y + y, ..pose };
        }
        self.frame().compose(pose)
    }

    /// The free lane and the spot of the cell used, in the spot frame.
    pub fn regions(&self, grid: &Grid) -> [Polygon; 2] {
        let frame = self.frame();
        grid.regions(&self.cell).map(|region| region.map(|v| frame.point_to_parent(v)))
    }

    fn lane_area(&self, grid: &Grid) -> f64 {
        self.cell.lane_width * (self.cell.dead_end + grid.back)
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
pub fn abstractions(obstacles: &Obstacles, stance: Stance, grid: &Grid) -> Vec<Abstraction> {
    let seen = Surroundings::new(obstacles);
    if stance.kind() != ParkingType::Angled {
        return seen.abstractions(stance, grid);
    }
    let turned = |on_grid: Stance| {
        let turn = wrap_angle(stance.heading() - on_grid.heading());
        if turn.abs() < SAME_SLANT {
            return seen.abstractions(on_grid, grid);
        }
        let frame = Pose::new(0.0, 0.0, turn);
        let mut found = seen.map(|p| frame.point_to_local(p)).abstractions(on_grid, grid);
        found.iter_mut().for_each(|f| f.turn = turn);
        found
    };
    let mut found: Vec<_> = near_slants(stance, grid).into_iter().flat_map(turned).collect();
    found.sort_by(|a, b| b.lane_area(grid).total_cmp(&a.lane_area(grid)));
    found
}

/// What is turned by less than this has the slant of the grid, radians.
const SAME_SLANT: f64 = 1e-9;
/// Slants of the grid within this are held against a bay, radians.
const NEAR_SLANT: f64 = 15.001 * PI / 180.0;

/// The grid's stances that are nearest to that of an angled bay to either side; the very one where
/// there is one.
fn near_slants(stance: Stance, grid: &Grid) -> Vec<Stance> {
    let turn = |s: &Stance| wrap_angle(stance.heading() - s.heading());
    let all = grid.stances(stance.kind());
    if let Some(same) = all.iter().find(|s| turn(s).abs() < SAME_SLANT) {
        return vec![*same];
    }
    let nearest = |side: f64| {
        let beside = all.iter().filter(|s| (0.0..NEAR_SLANT).contains(&(turn(s) * side)));
        beside.min_by(|a, b| turn(a).abs().total_cmp(&turn(b).abs())).copied()
    };
    [1.0, -1.0].into_iter().filter_map(nearest).collect()
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

    /// Whether some obstacle is within `most` of `from` along the unit vector `along`, and within `width`
    /// of that ray on either side. A ray without width would pass between scanned points.
    pub fn ends_within(&self, most: f64, from: Vec2, along: Vec2, width: f64) -> bool {
        self.ahead(from, along, width).any(|free| free <= most)
    }

    /// How far along a ray every edge is that it meets.
    fn ahead(&self, from: Vec2, along: Vec2, width: f64) -> impl Iterator<Item = f64> {
        let across = Vec2::new(-along.y, along.x);
        let seen = move |p: Vec2| Vec2::new((p - from).dot(&along), (p - from).dot(&across));
        let within = move |&(a, b): &(Vec2, Vec2)| clip(seen(a), seen(b), 1, -width, width);
        let ahead = self.edges.iter().filter_map(within).filter(|(a, b)| a.x.max(b.x) >= 0.0);
        ahead.map(|(a, b)| a.x.min(b.x).max(0.0))
    }

    /// How far from x = `from` nothing stands between `low` and `high` in y, toward the side where
    /// that is farther.
    pub fn free_in_band(&self, from: f64, [low, high]: [f64; 2]) -> f64 {
        let (mut left, mut right) = (f64::INFINITY, f64::INFINITY);
        for &(a, b) in &self.edges {
            let Some((a, b)) = clip(a, b, 1, low, high) else { continue };
            let (x_min, x_max) = (a.x.min(b.x) - from, a.x.max(b.x) - from);
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

    /// [`abstractions`] among these obstacles; an angled bay has one of the grid's slants.
    pub fn abstractions(&self, stance: Stance, grid: &Grid) -> Vec<Abstraction> {
        let is_bay = stance.kind().is_bay();
        let mut found = self.lanes(stance, grid);
        // No straight leads from a lane farther out into a parallel spot: a cell's manoeuvre fits where
        // it is hardly farther out, as kerbs are nearer to some cars than to others.
        if found.is_empty() && is_bay {
            found = self.lanes_farther_out(stance, grid);
        }
        found.retain(|lane| is_bay || lane.shift <= KERB * grid.parallel_depth);
        found
    }

    /// The lanes that begin about where they usually do beside a spot, largest first.
    pub fn lanes(&self, stance: Stance, grid: &Grid) -> Vec<Abstraction> {
        let near = Near::new(self, stance, grid);
        let low = near.bottom_shift();
        let most = USUAL_SHIFT * grid.bay_depth;
        let at = |shift: f64| if shift <= most { near.at_shift(shift) } else { Vec::new() };
        let found = at(low);
        if !found.is_empty() {
            return found;
        }
        let protrusion = self.protrusion(stance, grid);
        if protrusion > low { at(protrusion) } else { found }
    }

    /// The lanes that begin as little farther out as there is one, largest first.
    pub fn lanes_farther_out(&self, stance: Stance, grid: &Grid) -> Vec<Abstraction> {
        let near = Near::new(self, stance, grid);
        let shifts = near.farther_out(near.bottom_shift()).into_iter();
        let mut found = shifts.map(|shift| near.at_shift(shift));
        found.find(|lanes| !lanes.is_empty()).unwrap_or_default()
    }

    /// How far the cell must move out so that polygons and points of the spot's own row do not stand
    /// out into its lane.
    fn protrusion(&self, stance: Stance, grid: &Grid) -> f64 {
        let boundary = grid.lane_boundary(stance);
        let mouth = grid.mouth(stance, boundary);
        let (x_min, x_max) = (mouth - grid.back, mouth + grid.dead_end.max);
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
        (top - boundary) / stance.out().y
    }
}

/// What could enter a cell with a car that stands so, or bounds the spot.
struct Near<'a> {
    edges: Vec<(Vec2, Vec2)>,
    stance: Stance,
    grid: &'a Grid,
    /// From the spot's centre to its closed end, metres.
    half_depth: f64,
    /// y of the lane's beginning where the cell is not shifted.
    boundary: f64,
}

impl<'a> Near<'a> {
    fn new(all: &Surroundings, stance: Stance, grid: &'a Grid) -> Self {
        let (boundary, half_depth) = (grid.lane_boundary(stance), grid.depth(stance.kind()) / 2.0);
        let slanted = stance.out().x.abs() * grid.spot_width(stance.kind()).max / 2.0;
        let floor = -(half_depth + slanted);
        let top = boundary + MAX_SHIFT * grid.bay_depth + grid.lane_width.max;
        let is_near = |(a, b): &(Vec2, Vec2)| a.y.max(b.y) > floor && a.y.min(b.y) < top;
        let mut edges = Vec::with_capacity(all.edges.len());
        edges.extend(all.edges.iter().copied().filter(is_near));
        Self { edges, stance, grid, half_depth, boundary }
    }

    /// A point of the spot frame by how far it lies to the right of the way out and along it.
    fn in_strip(&self, p: Vec2) -> Vec2 {
        let out = self.stance.out();
        Vec2::new(p.x * out.y - p.y * out.x, p.x * out.x + p.y * out.y)
    }

    /// How far the cell must move out so that nothing at the spot's closed end enters it.
    fn bottom_shift(&self) -> f64 {
        let floor = -self.half_depth;
        let smallest = self.grid.spot_width(self.stance.kind()).min / 2.0;
        let tops = self.edges.iter().filter_map(|&(a, b)| {
            let (a, b) = (self.in_strip(a), self.in_strip(b));
            let (a, b) = clip(a, b, 0, -smallest + TOUCH, smallest - TOUCH)?;
            let (a, b) = clip(a, b, 1, floor + TOUCH, 0.0)?;
            Some(a.y.max(b.y) - floor)
        });
        tops.fold(0.0, f64::max)
    }

    /// How far out a lane may begin, farther than `low`, nearest first: just beyond something.
    fn farther_out(&self, low: f64) -> Vec<f64> {
        let (grid, boundary, slope) = (self.grid, self.boundary, self.stance.out().y);
        let (step, most) = (SHIFT_STEP * grid.bay_depth, MAX_SHIFT * grid.bay_depth);
        let mouth = grid.mouth(self.stance, boundary);
        let (x_min, x_max) = (mouth - grid.back, mouth + grid.dead_end.max);
        // The farthest end of something in every step.
        let mut ends = [f64::NEG_INFINITY; (MAX_SHIFT / SHIFT_STEP) as usize + 2];
        for &(a, b) in &self.edges {
            let beside = a.x.max(b.x) < x_min || a.x.min(b.x) > x_max;
            for end in [(a.y - boundary) / slope, (b.y - boundary) / slope] {
                if !beside && end > low && end <= most {
                    let end_of_step = &mut ends[(end / step) as usize];
                    *end_of_step = end_of_step.max(end);
                }
            }
        }
        ends.into_iter().filter(|end| end.is_finite()).collect()
    }

    /// The maximal cells whose frame lies `shift` metres out of the spot.
    fn at_shift(&self, shift: f64) -> Vec<Abstraction> {
        let Self { grid, stance, .. } = *self;
        let kind = stance.kind();
        let boundary = self.boundary + shift * stance.out().y;
        let mouth = grid.mouth(stance, boundary);
        let begin = mouth - grid.back;
        let floor = shift - self.half_depth;
        let Some(spot_width) = self.spot_width(floor, boundary) else { return Vec::new() };
        let axis = &grid.dead_end;
        // The lane's width for every dead end of the grid: nothing enters [−back, D].
        let mut widths = vec![grid.lane_width.max; axis.len()];
        for &(a, b) in &self.edges {
            let Some((a, b)) = clip(a, b, 1, boundary + TOUCH, f64::INFINITY) else { continue };
            let (x_min, x_max) = (a.x.min(b.x), a.x.max(b.x));
            if x_max <= begin + TOUCH {
                continue;
            }
            let lowest = a.y.min(b.y) - boundary;
            for (i, width) in widths.iter_mut().enumerate() {
                let end = mouth + axis.value(i);
                if x_min >= end - TOUCH || lowest >= *width {
                    continue;
                }
                if let Some((a, b)) = clip(a, b, 0, begin + TOUCH, end - TOUCH) {
                    *width = width.min(a.y.min(b.y) - boundary);
                }
            }
        }
        let mut found: Vec<Abstraction> = Vec::new();
        for (i, &lane_width) in widths.iter().enumerate().rev() {
            let found_at = Cell { stance, lane_width, spot_width, dead_end: axis.value(i) };
            let Some(index) = grid.floor(&found_at) else { continue };
            let cell = grid.cell(kind, index);
            if found.last().is_some_and(|f| f.cell.lane_width >= cell.lane_width) {
                continue;
            }
            let dead_end = self.dead_end(boundary, mouth, &found_at);
            let measured = Cell { dead_end, ..found_at };
            found.push(Abstraction { measured, cell, index, shift, turn: 0.0 });
        }
        found.sort_by(|a, b| b.lane_area(grid).total_cmp(&a.lane_area(grid)));
        found
    }

    /// Twice the smaller gap beside the spot's centre line; `None` when something stands on it.
    fn spot_width(&self, floor: f64, boundary: f64) -> Option<f64> {
        let (mut left, mut right) = (f64::INFINITY, f64::INFINITY);
        for &(a, b) in &self.edges {
            let Some((a, b)) = self.clip_to_spot(a, b, floor, boundary) else { continue };
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

    /// The part of `a`–`b` between the spot's closed end and its lane, as [`Near::in_strip`] has it.
    fn clip_to_spot(&self, a: Vec2, b: Vec2, floor: f64, boundary: f64) -> Option<(Vec2, Vec2)> {
        if self.stance.kind() != ParkingType::Angled {
            return clip(a, b, 1, floor + TOUCH, boundary - TOUCH);
        }
        let (a, b) = clip(a, b, 1, f64::NEG_INFINITY, boundary - TOUCH)?;
        clip(self.in_strip(a), self.in_strip(b), 1, floor + TOUCH, f64::INFINITY)
    }

    /// Where the lane really ends: the nearest x beyond the cell's dead end at which something
    /// enters a lane of this width, at most the grid's largest; from the `mouth`.
    fn dead_end(&self, boundary: f64, mouth: f64, cell: &Cell) -> f64 {
        let top = boundary + cell.lane_width;
        let entering = self.edges.iter().filter_map(|&(a, b)| {
            let (a, b) = clip(a, b, 1, boundary + TOUCH, top - TOUCH)?;
            let (a, b) = clip(a, b, 0, mouth + cell.dead_end - TOUCH, f64::INFINITY)?;
            Some(a.x.min(b.x) - mouth)
        });
        entering.fold(self.grid.dead_end.max, f64::min).max(cell.dead_end)
    }
}

/// The part of `a`–`b` with `low ≤ coordinate ≤ high` on one axis (0 is x, 1 is y).
pub(super) fn clip(a: Vec2, b: Vec2, axis: usize, low: f64, high: f64) -> Option<(Vec2, Vec2)> {
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
