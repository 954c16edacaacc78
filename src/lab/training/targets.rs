//! Which preparatory pose a network is to learn for which start.
//!
//! The stored poses ([`Targets::Stored`]) are ends of single solutions: for starts a
//! hand's breadth apart they jump between several good answers, and a network that
//! averages these gives a bad one. [`Targets::PerCell`] replaces them by one pose for all
//! starts of a cell. In nearly every cell a single pose is one free curve away from as many
//! starts as all poses together, so little is lost (docs/design-notes.md has the numbers).
//! This is ours; the paper learns the stored pose.
//!
//! The pose of a cell is that of least *expected price* ([`Judge::price`]): the cost of the
//! whole path and the search it takes, averaged over starts in the lane and behind it and over
//! small errors of the network. Stored poses compete first; then a few passes over the grid
//! try poses around the best so far and those of neighbouring cells, which are drawn
//! together, for what is smooth in the cell's parameters is learnt sooner.
//!
//! Lengths in metres, angles in radians, poses in the spot frame. The result depends on
//! samples, settings and seed alone, not on the number of threads.

use std::collections::HashMap;
use std::ops::Range;

use indicatif::ProgressBar;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{MlpConfig, Targets};
use crate::geometry::{Aabb, Pose, Vec2, signed_angle, wrap_angle};
use crate::lab::dataset::{Metadata, Sample};
use crate::lab::progress;
use crate::planners::hybrid_astar::GoalSet;
use crate::planners::{HybridAStar, Problem};
use crate::rng::{Stream, rng};
use crate::world::cell::{Cell, Grid};

/// Stored poses of a cell to begin with, at most.
const POOL: usize = 12;
/// Radius of the trials around the best pose so far, pass by pass, metres.
const RADII: [f64; 4] = [0.6, 0.3, 0.15, 0.07];
/// Trials around a cell's pose, and around the mean of its neighbours', in each pass.
const TRIALS: [usize; 2] = [6, 2];
/// Starts that a pose is judged by: of the cell's samples, and behind its lane.
const STARTS: [usize; 2] = [4, 24];
/// Headings weigh as much as positions at this lever, metres per radian.
const LEVER: f64 = 2.0;
/// Price per square metre of mean distance to the neighbouring cells' poses.
const APART: f64 = 10.0;
/// Price of an expanded node; the other prices are those of [`crate::planners::cost`].
const NODE: f64 = 0.1;
/// Price of having to search at all: what a search prepares takes as long as some nodes.
const SEARCH: f64 = 3.0;
/// Expansions after which the search for an approach is given up.
const MOST_NODES: usize = 800;
/// Of the starts without a direct approach, so many are searched for one; the others are
/// taken to cost as much.
const SEARCHED: usize = 4;
/// Price where no path is found.
const LOST: f64 = 100.0;
/// Errors of the network that a pose is judged with: along, across, turned.
const ERRORS: [(f64, f64, f64); 7] = [
    (0.0, 0.0, 0.0),
    (0.03, 0.0, 0.0),
    (-0.03, 0.0, 0.0),
    (0.0, 0.03, 0.0),
    (0.0, -0.03, 0.0),
    (0.0, 0.0, 0.01),
    (0.0, 0.0, -0.01),
];
/// Draws before a start counts as impossible.
const MAX_DRAWS: usize = 200;

/// One row to learn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Example {
    pub cell: Cell,
    pub cell_index: u32,
    pub sample_index: u32,
    /// Rear-axle start.
    pub start: Pose,
    /// The preparatory pose wanted.
    pub target: Pose,
}

/// A row for each of the `solved` samples, which are ordered by cell; `threads` at a time.
pub(super) fn examples(
    metadata: &Metadata,
    solved: &[&Sample],
    config: &MlpConfig,
    threads: usize,
) -> Vec<Example> {
    let mut rows: Vec<Example> = solved.iter().map(|s| Example::stored(s)).collect();
    if config.targets == Targets::Stored {
        return rows;
    }
    let work = || {
        let groups: Vec<&[&Sample]> =
            solved.chunk_by(|a, b| a.cell_index == b.cell_index).collect();
        let poses = Choice { metadata, config, groups: &groups }.poses();
        let chunks: Vec<&mut [Example]> =
            rows.chunk_by_mut(|a, b| a.cell_index == b.cell_index).collect();
        chunks.into_par_iter().zip(poses).for_each(|(rows, pose)| {
            if let Some(pose) = pose {
                retarget(rows, pose, metadata, config);
            }
        });
        rows
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads can be started").install(work)
}

/// How far behind a cell's lane any start may lie, metres.
fn lane_behind(metadata: &Metadata, config: &MlpConfig) -> f64 {
    config.behind.max(metadata.start_behind)
}

/// Gives the rows of a cell their target, and every other one a new start behind the lane.
fn retarget(rows: &mut [Example], pose: Pose, metadata: &Metadata, config: &MlpConfig) {
    let world = CellWorld::new(metadata, &rows[0].cell, lane_behind(metadata, config));
    for row in rows {
        row.target = pose;
        if let Some(world) = &world
            && config.behind > 0.0
            && row.sample_index % 2 == 1
        {
            let index = u64::from(row.cell_index) << 32 | u64::from(row.sample_index);
            let mut rng = rng(config.seed, Stream::Targets, index);
            row.start = world.draw_behind(metadata, config.behind, &mut rng).unwrap_or(row.start);
        }
    }
}

impl Example {
    /// The sample with its own pose.
    pub fn stored(s: &Sample) -> Self {
        Self {
            cell: s.cell,
            cell_index: s.cell_index,
            sample_index: s.sample_index,
            start: s.start,
            target: s.rs_start,
        }
    }
}

/// A cell ready to be planned in.
pub(super) struct CellWorld {
    cell: Problem,
    /// The same with a longer lane behind.
    behind: Problem,
    /// Of the cell itself.
    goal: GoalSet,
    /// Where starts behind the lane are drawn.
    lane_behind: Aabb,
}

impl CellWorld {
    /// `None` where the car does not fit the spot.
    pub fn new(metadata: &Metadata, cell: &Cell, behind: f64) -> Option<Self> {
        let Metadata { grid, vehicle, .. } = metadata;
        let parked = grid.goal(cell.stance, vehicle);
        // Beyond the draws there is room for the car's rear.
        let longer = Grid { back: grid.back + behind + vehicle.length, ..*grid };
        let problem = |grid: &Grid| Problem::in_cell(grid, cell, *vehicle, parked).ok();
        let (cell_problem, behind_problem) = (problem(grid)?, problem(&longer)?);
        let lane = grid.lane(cell);
        let lane_behind =
            Aabb::new(lane.min.x - behind, lane.min.y, lane.min.x.min(parked.x), lane.max.y);
        let goal = HybridAStar::new(metadata.planner).goal_set(&cell_problem);
        Some(Self { cell: cell_problem, behind: behind_problem, goal, lane_behind })
    }

    /// A free start at most `behind` metres behind the cell's lane.
    fn draw_behind(&self, metadata: &Metadata, behind: f64, rng: &mut ChaCha8Rng) -> Option<Pose> {
        let mut area = self.lane_behind;
        area.min.x = area.min.x.max(area.max.x - behind);
        let turn = metadata.start_heading_max / 2.0;
        let draw = |_| {
            let mut between = |a: f64, b: f64| a + (b - a) * rng.random::<f64>();
            let x = between(area.min.x, area.max.x);
            Pose::new(x, between(area.min.y, area.max.y), between(-turn, turn))
        };
        (0..MAX_DRAWS).map(draw).find(|p| self.behind.collision.pose_is_free(*p))
    }

    /// The problem that a start lies in.
    fn around(&self, start: Pose) -> &Problem {
        if start.x < self.lane_behind.max.x { &self.behind } else { &self.cell }
    }

    /// Cost of the cheapest free curve (and straight) from `pose` into the spot.
    pub fn finish(&self, planner: &mut HybridAStar, pose: Pose) -> Option<f64> {
        if !self.cell.collision.pose_is_free(pose) {
            return None;
        }
        planner.connect(&self.cell, pose, &self.goal).map(|c| c.cost)
    }

    /// Whether one free curve leads from `start` to `pose`, which must be free.
    pub fn approach_is_direct(&self, planner: &mut HybridAStar, start: Pose, pose: Pose) -> bool {
        planner.direct(self.around(start), start, &GoalSet::single(pose)).is_some()
    }
}

/// What a pose is worth in one cell.
struct Judge<'a> {
    world: CellWorld,
    planner: &'a mut HybridAStar,
    starts: Vec<Pose>,
}

impl Judge<'_> {
    /// Expected price of planning by way of `pose`; infinite where it has no curve into the
    /// spot, and given up where it exceeds `bound`.
    fn price(&mut self, pose: Pose, bound: f64) -> f64 {
        let Self { world, planner, starts } = self;
        let mut aims = [(pose, f64::NAN); ERRORS.len()];
        for (aim, &(along, across, turn)) in aims.iter_mut().zip(&ERRORS) {
            let p = pose.point_to_parent(Vec2::new(along, across));
            let p = Pose::new(p.x, p.y, pose.heading + turn);
            *aim = (p, world.finish(planner, p).unwrap_or(f64::INFINITY));
        }
        if aims[0].1.is_infinite() {
            return f64::INFINITY;
        }
        let n = starts.len() as f64;
        let mut price = 0.0;
        let mut missed = Vec::new();
        for (i, &start) in starts.iter().enumerate() {
            let (aim, rest) = aims[i % aims.len()];
            if rest.is_infinite() {
                price += LOST;
                continue;
            }
            let goal = GoalSet::single(aim);
            match planner.connect(world.around(start), start, &goal) {
                Some(c) => price += c.cost + rest,
                None => {
                    price += rest;
                    missed.push((start, goal));
                }
            }
        }
        let searched = missed.len().min(SEARCHED);
        for i in 0..searched {
            if price > bound * n {
                break;
            }
            let (start, goal) = &missed[i * missed.len() / searched];
            let mut left = MOST_NODES;
            let leg = planner.search(world.around(*start), *start, goal, None, &mut left);
            let approach =
                leg.map_or(LOST, |leg| leg.cost + SEARCH + NODE * (MOST_NODES - left) as f64);
            price += approach * missed.len() as f64 / searched as f64;
        }
        price / n
    }
}

/// The choice of a pose for each cell with samples.
struct Choice<'a> {
    metadata: &'a Metadata,
    config: &'a MlpConfig,
    /// The samples, cell by cell.
    groups: &'a [&'a [&'a Sample]],
}

impl Choice<'_> {
    /// `None` where no stored pose has a curve into the spot.
    fn poses(&self) -> Vec<Option<Pose>> {
        let group_of: HashMap<u32, usize> =
            self.groups.iter().enumerate().map(|(i, g)| (g[0].cell_index, i)).collect();
        let steps = (self.groups.len() * (1 + RADII.len())) as u64;
        let bar = progress::bar(steps, self.groups[0][0].cell.kind().name());
        bar.set_message("one pose per cell");
        let mut chosen = self.each(&bar, |i, judge| {
            let group = self.groups[i];
            best(judge, None, spread(group, POOL).map(|s| s.rs_start), &[])
        });
        for (pass, &radius) in RADII.iter().enumerate() {
            chosen = self.each(&bar, |i, judge| {
                let (grid, sample) = (&self.metadata.grid, &self.groups[i][0]);
                let near = neighbours(grid, &sample.cell, sample.cell_index);
                let near: Vec<Pose> =
                    near.filter_map(|c| Some(chosen[*group_of.get(&c)?]?.pose)).collect();
                // Bit 63: apart from the rows' streams, whose high half is a cell.
                let index = (pass as u64 + 1) << 32 | u64::from(sample.cell_index);
                let mut rng = rng(self.config.seed, Stream::Targets, 1 << 63 | index);
                let (own, middle) = (chosen[i].map(|c| c.pose), mean(&near));
                let mut trials: Vec<Pose> = near.iter().copied().chain(middle).collect();
                for (centre, count) in [own, middle].into_iter().zip(TRIALS) {
                    let Some(centre) = centre else { continue };
                    trials.extend((0..count).map(|_| around(centre, radius, &mut rng)));
                }
                best(judge, chosen[i], trials.into_iter(), &near)
            });
        }
        bar.finish_and_clear();
        chosen.into_iter().map(|c| Some(c?.pose)).collect()
    }

    /// `choose` for every group, in their order.
    fn each(
        &self,
        bar: &ProgressBar,
        choose: impl Fn(usize, &mut Judge) -> Option<Chosen> + Sync,
    ) -> Vec<Option<Chosen>> {
        let one = |planner: &mut HybridAStar, i: usize| {
            let group = self.groups[i];
            let behind = lane_behind(self.metadata, self.config);
            let world = CellWorld::new(self.metadata, &group[0].cell, behind)?;
            let starts = self.starts(&world, group);
            let pose = choose(i, &mut Judge { world, planner, starts });
            bar.inc(1);
            pose
        };
        let planner = || HybridAStar::new(self.metadata.planner);
        let groups: Range<usize> = 0..self.groups.len();
        groups.into_par_iter().map_init(planner, one).collect()
    }

    /// The starts that a cell's poses are judged by.
    fn starts(&self, world: &CellWorld, group: &[&Sample]) -> Vec<Pose> {
        let index = u64::from(group[0].cell_index);
        let mut rng = rng(self.config.seed, Stream::Targets, 1 << 63 | index);
        let behind = if self.config.behind > 0.0 { STARTS[1] } else { 0 };
        let behind = (0..behind)
            .filter_map(|_| world.draw_behind(self.metadata, self.config.behind, &mut rng));
        spread(group, STARTS[0]).map(|s| s.start).chain(behind).collect()
    }
}

/// A cell's pose, and its price without what draws it to the neighbours.
#[derive(Clone, Copy)]
struct Chosen {
    pose: Pose,
    price: f64,
}

/// The best of `known` and `trials`, the first of equals, drawn towards `near`.
fn best(
    judge: &mut Judge,
    known: Option<Chosen>,
    trials: impl Iterator<Item = Pose>,
    near: &[Pose],
) -> Option<Chosen> {
    let apart = |pose| {
        let sum = near.iter().map(|n| distance_sq(pose, *n)).sum::<f64>();
        APART * sum / near.len().max(1) as f64
    };
    let mut best = known;
    let mut least = known.map_or(f64::INFINITY, |c| c.price + apart(c.pose));
    for pose in trials {
        let bound = least - apart(pose);
        if bound > 0.0 {
            let price = judge.price(pose, bound);
            if price < bound {
                (best, least) = (Some(Chosen { pose, price }), price + apart(pose));
            }
        }
    }
    best
}

/// At most `most` of the samples, evenly spread.
fn spread<'a>(group: &'a [&'a Sample], most: usize) -> impl Iterator<Item = &'a Sample> {
    let count = group.len().min(most);
    (0..count).map(move |i| group[i * group.len() / count])
}

fn distance_sq(a: Pose, b: Pose) -> f64 {
    let turned = LEVER * signed_angle(a.heading, b.heading);
    a.distance(b).powi(2) + turned * turned
}

/// The mean of some poses.
fn mean(poses: &[Pose]) -> Option<Pose> {
    let n = poses.len() as f64;
    let sum = |f: fn(&Pose) -> f64| poses.iter().map(f).sum::<f64>();
    let heading = sum(|p| p.heading.sin()).atan2(sum(|p| p.heading.cos()));
    (!poses.is_empty()).then(|| Pose::new(sum(|p| p.x) / n, sum(|p| p.y) / n, heading))
}

/// A pose within `radius` of `pose` in each direction, headings by [`LEVER`].
fn around(pose: Pose, radius: f64, rng: &mut ChaCha8Rng) -> Pose {
    let mut off = || radius * (2.0 * rng.random::<f64>() - 1.0);
    let (x, y) = (pose.x + off(), pose.y + off());
    Pose::new(x, y, wrap_angle(pose.heading + off() / LEVER))
}

/// Indices of the up to six cells one step of the grid away, where the parked car stands alike.
fn neighbours(grid: &Grid, cell: &Cell, index: u32) -> impl Iterator<Item = u32> {
    let sizes = [grid.dead_end.len(), grid.spot_width(cell.kind()).len(), grid.lane_width.len()];
    let strides = [1, sizes[0], sizes[0] * sizes[1]];
    let index = index as usize;
    (0..3).flat_map(move |axis| {
        let (stride, size) = (strides[axis], sizes[axis]);
        let at = index / stride % size;
        let below = (at > 0).then(|| index - stride);
        let above = (at + 1 < size).then(|| index + stride);
        below.into_iter().chain(above).map(|i| i as u32)
    })
}

#[cfg(test)]
mod tests {
    use super::super::quality::reach;
    use super::*;
    use crate::lab::dataset::sampler::Sampler;
    use crate::lab::dataset::{CollectConfig, Status};
    use crate::world::ParkingType;
    use crate::world::cell::Axis;

    const KIND: ParkingType = ParkingType::Reverse;

    /// Roomy bays: a row of three cells.
    fn collected() -> (Metadata, Vec<Sample>) {
        let config = CollectConfig {
            grid: Grid {
                lane_width: Axis { min: 6.0, max: 6.0, step: 1.0 },
                bay_spot_width: Axis { min: 3.1, max: 3.5, step: 0.2 },
                dead_end: Axis { min: 10.0, max: 10.0, step: 1.0 },
                ..Grid::default()
            },
            solutions: 1,
            samples_per_cell: 10,
            ..CollectConfig::default()
        };
        let mut sampler = Sampler::new(&config);
        let all = (0..30).map(|i| sampler.sample(KIND, i / 10, i % 10));
        let samples = all.filter(|s| s.status == Status::Solved).collect();
        (config.metadata(), samples)
    }

    #[test]
    fn one_pose_per_cell_spares_the_search_on_any_number_of_threads() {
        let (metadata, samples) = collected();
        let solved: Vec<&Sample> = samples.iter().collect();
        let config = MlpConfig::default();
        let rows = examples(&metadata, &solved, &config, 1);
        assert_eq!(rows, examples(&metadata, &solved, &config, 3), "threads change nothing");
        let reseeded = MlpConfig { seed: 2, ..config.clone() };
        assert_ne!(rows, examples(&metadata, &solved, &reseeded, 1));

        for cell in rows.chunk_by(|a, b| a.cell_index == b.cell_index) {
            assert!(cell.iter().all(|e| e.target == cell[0].target));
        }
        let behind = rows.iter().filter(|e| e.start.x < -metadata.grid.back).count();
        assert!(behind >= rows.iter().filter(|e| e.sample_index % 2 == 1).count(), "{behind}");
        let wanted: Vec<Pose> = rows.iter().map(|e| e.target).collect();
        let got = reach(&metadata, &rows, &wanted);
        assert_eq!((got.rows, got.to_goal, got.wanted_to_goal), (rows.len(), 1.0, 1.0));
        assert!(got.direct > 0.8 && got.direct == got.wanted_direct, "{got:?}");
        // Neighbours are drawn together.
        let (first, last) = (wanted[0], wanted[wanted.len() - 1]);
        assert!(first.distance(last) < 1.0, "{first:?} {last:?}");
    }

    #[test]
    fn stored_poses_stay() {
        let (metadata, samples) = collected();
        let solved: Vec<&Sample> = samples.iter().collect();
        let config = MlpConfig { targets: Targets::Stored, ..MlpConfig::default() };
        for (row, s) in examples(&metadata, &solved, &config, 2).iter().zip(&samples) {
            assert_eq!((row.start, row.target), (s.start, s.rs_start));
        }
    }

    #[test]
    fn a_price_is_infinite_only_without_a_way_into_the_spot() {
        let (metadata, samples) = collected();
        let world = CellWorld::new(&metadata, &samples[0].cell, 8.0).unwrap();
        let mut planner = HybridAStar::new(metadata.planner);
        let starts = vec![Pose::new(-9.0, 5.0, 0.0), Pose::new(-3.0, 5.0, 0.1)];
        let mut judge = Judge { world, planner: &mut planner, starts };
        let good = judge.price(samples[0].rs_start, f64::INFINITY);
        assert!(good > 5.0 && good < LOST, "{good}");
        assert!(judge.price(Pose::new(5.0, 0.0, 0.0), f64::INFINITY).is_infinite());
        let far = Pose::new(-40.0, 5.0, 0.0);
        assert!(judge.price(far, f64::INFINITY).is_infinite(), "outside the lane");
    }

    #[test]
    fn neighbours_are_one_step_away() {
        let grid = Grid::default();
        let apart = |a: &Cell, b: &Cell| {
            let steps = [
                (a.lane_width - b.lane_width) / grid.lane_width.step,
                (a.spot_width - b.spot_width) / grid.bay_spot_width.step,
                (a.dead_end - b.dead_end) / grid.dead_end.step,
            ];
            steps.map(f64::abs).iter().sum::<f64>().round() as usize
        };
        let count = grid.cell_count(KIND);
        for index in [0, 1, 40, count / 2, count - 1] {
            let cell = grid.cell(KIND, index);
            let mut got: Vec<u32> = neighbours(&grid, &cell, index as u32).collect();
            got.sort_unstable();
            let near = |i: &usize| apart(&cell, &grid.cell(KIND, *i)) == 1;
            let expected: Vec<u32> = (0..count).filter(near).map(|i| i as u32).collect();
            assert_eq!(got, expected, "of cell {index}");
        }
    }
}
