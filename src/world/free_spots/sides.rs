//! Sides of obstacles: edges of polygons and walls, and lines that points lie on.

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::geometry::Vec2;
use crate::world::{Scene, Shape};

/// A straight side of something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub middle: Vec2,
    /// Unit vector.
    pub along: Vec2,
    pub length: f64,
}

/// Of each square of this size one point is kept, metres for the default vehicle.
const THIN: f64 = 0.1;
/// Shorter than this nothing is a side, metres for the default vehicle.
const LEAST: f64 = 0.7;
/// Along an outline with shorter edges, as squares of a grid have, points are taken as far apart as this.
const SAMPLE: f64 = 0.25;
/// Points within this belong to one line.
const REACH: f64 = 0.8;
/// Points of a line are this far off it at most, and most of them less.
const OFF: f64 = 0.12;
const ROUGH: f64 = 0.06;
/// A line has so many points at least, and is followed no farther than this.
const FEWEST: usize = 4;
const FARTHEST: f64 = 12.0;

type Cell = (i64, i64);

fn cell(p: Vec2, size: f64) -> Cell {
    ((p.x / size).floor() as i64, (p.y / size).floor() as i64)
}

/// One point of each small square, in order.
pub(super) fn thinned(points: &[[f64; 2]], scale: f64) -> Vec<[f64; 2]> {
    let mut taken = HashSet::new();
    let is_first = |p: &&[f64; 2]| taken.insert(cell(Vec2::new(p[0], p[1]), THIN * scale));
    points.iter().filter(is_first).copied().collect()
}

/// Sides of what stands in a scene, without what is low.
pub(super) fn sides(scene: &Scene, scale: f64) -> Vec<Side> {
    let mut sides = Vec::new();
    let mut dots: Vec<[f64; 2]> = Vec::new();
    for outline in scene.high_outlines() {
        if outline.shape == Shape::Point {
            dots.extend(outline.vertices);
            continue;
        }
        let edges = || outline.edges().filter(|(a, b)| a != b);
        let is_long = |&(a, b): &(Vec2, Vec2)| (b - a).norm() >= LEAST * scale;
        sides.extend(edges().filter(is_long).map(|(a, b)| Side {
            middle: (a + b) / 2.0,
            along: (b - a).normalize(),
            length: (b - a).norm(),
        }));
        if edges().any(|edge| !is_long(&edge)) {
            for (a, b) in edges() {
                let count = ((b - a).norm() / (SAMPLE * scale)).ceil().clamp(1.0, 1e4);
                let at = |i: u32| a + (b - a) * (f64::from(i) / count);
                dots.extend((0..count as u32).map(at).map(|p| [p.x, p.y]));
            }
        }
    }
    let dots = thinned(&dots, scale).into_iter().map(|[x, y]| Vec2::new(x, y)).collect();
    sides.extend(Dots::new(dots, scale).lines());
    sides
}

/// Points, found by where they are.
struct Dots {
    all: Vec<Vec2>,
    scale: f64,
    cells: HashMap<Cell, Vec<u32>>,
}

/// A line through the middle of some points.
struct Line {
    middle: Vec2,
    along: Vec2,
    /// How far they are off it: the root of the mean square.
    off: f64,
}

impl Dots {
    fn new(all: Vec<Vec2>, scale: f64) -> Self {
        let mut cells: HashMap<Cell, Vec<u32>> = HashMap::new();
        for (i, &p) in all.iter().enumerate() {
            cells.entry(cell(p, REACH * scale)).or_default().push(i as u32);
        }
        Self { all, scale, cells }
    }

    /// Lines that points lie on; every point begins at most one.
    fn lines(&self) -> Vec<Side> {
        let mut used = vec![false; self.all.len()];
        let mut lines = Vec::new();
        for seed in 0..self.all.len() {
            if used[seed] {
                continue;
            }
            let Some((side, members)) = self.line(seed) else { continue };
            members.iter().for_each(|&i| used[i as usize] = true);
            lines.push(side);
        }
        lines
    }

    fn within(&self, of: Vec2) -> impl Iterator<Item = u32> + '_ {
        let reach = REACH * self.scale;
        let (x, y) = cell(of, reach);
        let cells = (-1..=1).flat_map(move |i| (-1..=1).map(move |j| (x + i, y + j)));
        let dots = cells.filter_map(|cell| self.cells.get(&cell)).flatten().copied();
        dots.filter(move |&i| (self.all[i as usize] - of).norm() <= reach)
    }

    /// The line around a point, as far as it goes.
    fn line(&self, seed: usize) -> Option<(Side, BTreeSet<u32>)> {
        let mut members: BTreeSet<u32> = self.within(self.all[seed]).collect();
        let mut line = self.fit(&members)?;
        if line.off > ROUGH * self.scale {
            return None;
        }
        loop {
            let [low, high] = self.extent(&line, &members);
            let far = [low, high].map(|at| line.middle + line.along * at);
            let before = members.len();
            let on_line = |&i: &u32| {
                let from = self.all[i as usize] - line.middle;
                from.perp(&line.along).abs() <= OFF * self.scale
            };
            for end in far {
                members.extend(self.within(end).filter(on_line));
            }
            line = self.fit(&members)?;
            let [low, high] = self.extent(&line, &members);
            let length = high - low;
            if members.len() == before || length > FARTHEST * self.scale {
                let middle = line.middle + line.along * f64::midpoint(low, high);
                let is_side = length >= LEAST * self.scale && line.off <= ROUGH * self.scale;
                let side = Side { middle, along: line.along, length };
                return is_side.then_some((side, members));
            }
        }
    }

    /// From where to where along a line its points lie.
    fn extent(&self, line: &Line, members: &BTreeSet<u32>) -> [f64; 2] {
        let along = members.iter().map(|&i| (self.all[i as usize] - line.middle).dot(&line.along));
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    }

    /// The line that is nearest to these points.
    fn fit(&self, members: &BTreeSet<u32>) -> Option<Line> {
        if members.len() < FEWEST {
            return None;
        }
        let count = members.len() as f64;
        let dots = || members.iter().map(|&i| self.all[i as usize]);
        let middle = dots().sum::<Vec2>() / count;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for d in dots().map(|p| p - middle) {
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
        }
        let (sin, cos) = ((2.0 * xy).atan2(xx - yy) / 2.0).sin_cos();
        let along = Vec2::new(cos, sin);
        let off = dots().map(|p| (p - middle).perp(&along).powi(2)).sum::<f64>() / count;
        Some(Line { middle, along, off: off.sqrt() })
    }
}
