//! What is trained on: parking problems drawn from a seed.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::planners::Problem;
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;
use crate::world::cell::{Cell, Grid};
use crate::world::generate::{GeneratorConfig, generate, wide};
use crate::world::{Level, ParkingType};

/// Where an agent learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "plan", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// In abstracted environments: a lane, a spot, walls around. The paper's RL Simple.
    Simple,
    /// In generated scenes, of other seeds than those that evaluate: half of them like those, half with
    /// sizes drawn far wider. The paper's RL Eval.
    Eval,
}

/// A kind of problems of their own difficulty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stratum {
    /// The parking type, one of the paper's: no course has angled bays.
    pub kind: ParkingType,
    /// The level: of generated scenes, or of the sizes that cells are drawn with.
    pub level: Level,
}

impl Stratum {
    /// How many there are: of the paper's three types.
    pub const COUNT: usize = 9;

    /// The stratum of an index below [`Stratum::COUNT`].
    pub fn nth(index: usize) -> Self {
        Self { kind: ParkingType::SQUARE[index / 3], level: Level::ALL[index % 3] }
    }
}

impl Course {
    /// The name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simple => "simple",
            Self::Eval => "eval",
        }
    }

    /// The course of a name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Simple, Self::Eval].into_iter().find(|c| c.name() == name)
    }

    /// The problem `index` of a seed: the same arguments give the same problem.
    #[allow(clippy::missing_panics_doc, reason = "generated scenes have free ends")]
    pub fn problem(self, vehicle: &Vehicle, stratum: Stratum, seed: u64, index: u64) -> Problem {
        match self {
            Self::Simple => cell_problem(vehicle, stratum, &mut rng(seed, Stream::Course, index)),
            Self::Eval => {
                let (config, Stratum { kind, level }) = (GeneratorConfig::default(), stratum);
                let usual = || generate(&config, vehicle, kind, level, seed, index);
                let is_wide = index.is_multiple_of(2);
                let wide = is_wide.then(|| wide(vehicle, kind, seed, index).ok()).flatten();
                let scene = wide.unwrap_or_else(usual);
                Problem::as_given(&scene).expect("generated scenes have free ends")
            }
        }
    }
}

/// A cell with the sizes that the generator draws for the level, and a start in its lane where
/// the generator would put it.
fn cell_problem(vehicle: &Vehicle, stratum: Stratum, rng: &mut ChaCha8Rng) -> Problem {
    /// Metres; around the generator's 6 m, less where cars stand across.
    const LANE_WIDTH: [f64; 2] = [5.0, 7.0];
    const DRAWS: usize = 1000;
    let generator = GeneratorConfig::default();
    let sizes = generator.level(stratum.level);
    let mut between = |[min, max]: [f64; 2]| rng.random_range(min..=max);
    let grid = Grid::default();
    // Starts lie as far behind as in generated scenes, with the car's own length behind them.
    let start_x = generator.start_x(vehicle);
    let grid = grid.with_lane_behind(vehicle.length - start_x[0] - grid.back);
    loop {
        let lane_width = between(LANE_WIDTH);
        let kind = stratum.kind;
        let widths = if kind.is_bay() { sizes.bay_spot_width } else { sizes.parallel_spot_width };
        let spot_width = between(widths);
        let closed = between([0.0, 1.0]) < sizes.dead_end_probability;
        let dead_end = if closed { between(sizes.dead_end) } else { grid.dead_end.max };
        let stance = grid.stances(kind)[0];
        let cell = Cell { stance, lane_width, spot_width, dead_end };
        let goal = grid.goal(stance, vehicle);
        let Ok(mut problem) = Problem::in_cell(&grid, &cell, *vehicle, goal) else { continue };
        let lane = grid.lane(&cell);
        let start = (0..DRAWS).find_map(|_| {
            let x = between([start_x[0], start_x[1].min(lane.max.x)]);
            let y = between([lane.min.y, lane.max.y]);
            let heading = generator.start_heading;
            let start = Pose::new(x, y, between([-heading, heading]));
            problem.collision.pose_is_free(start).then_some(start)
        });
        if let Some(start) = start {
            problem.start = start;
            return problem;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, segment_in_box};

    /// Nothing stands between a start and the spot's own part of the lane, least of all its dead end.
    #[test]
    fn starts_in_cells_lie_on_this_side_of_the_dead_end() {
        let mut beyond = 0;
        for i in 0..300 {
            let stratum = Stratum::nth(i as usize % Stratum::COUNT);
            let problem = Course::Simple.problem(&Vehicle::default(), stratum, 8, i);
            let Pose { x, y, .. } = problem.start;
            let way = Aabb::new(x.min(0.0), y, x.max(0.0), y);
            let is_blocked = problem.obstacles.edges().any(|(a, b)| segment_in_box(a, b, &way));
            assert!(!is_blocked, "{stratum:?} {i}: {x} {y}");
            beyond += usize::from(x > 0.0);
        }
        assert!(beyond > 30, "{beyond} starts beyond the spot");
    }

    #[test]
    fn problems_depend_on_their_arguments_alone_and_have_free_ends() {
        let vehicle = Vehicle::default();
        for course in [Course::Simple, Course::Eval] {
            for i in 0..90 {
                let stratum = Stratum::nth(i as usize % Stratum::COUNT);
                let draw = |seed, index| course.problem(&vehicle, stratum, seed, index);
                let p = draw(5, i);
                assert_eq!((p.start, &p.obstacles), (draw(5, i).start, &draw(5, i).obstacles));
                assert_ne!(p.start, draw(6, i).start);
                assert_ne!(p.start, draw(5, i + 1).start);
                assert!(p.collision.pose_is_free(p.start) && p.collision.pose_is_free(p.goal));
                assert_eq!(p.kind, Some(stratum.kind));
            }
        }
    }
}
