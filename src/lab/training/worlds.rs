//! Manoeuvres learnt in many worlds: generated scenes whose sizes are drawn far wider than those of
//! any level.
//!
//! Cells are two rectangles; scenes are not. World by world a teacher, Hybrid A* that takes the best
//! of several solutions and improves it, is asked for a path. Where nothing known costs about as
//! little, the end of the teacher's path is learnt. Then all worlds are planned once more with
//! everything that is known: what hardly any plan uses is forgotten, and what many use comes first.

use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};

use super::library::Source;
use super::{TrainingError, settings};
use crate::curves::Segment;
use crate::geometry::signed_angle;
use crate::lab::dataset::Metadata;
use crate::lab::progress;
use crate::planners::cost::CostModel;
use crate::planners::library::{Library, LibrarySearch, Verdicts};
use crate::planners::{Budget, Effort, HybridAStar, Planner, Problem};
use crate::selectors::fleet::scaled;
use crate::world::generate::wide;
use crate::world::{Scene, Stance};

/// A plan that costs at most so many times the teacher's will do.
const GOOD: f64 = 1.05;
/// Solutions that the teacher takes the best of.
const SOLUTIONS: usize = 5;
/// What fewer than one plan in so many uses is forgotten: each manoeuvre costs some microseconds when a
/// library is made ready, and these help hardly ever.
const RARE: u32 = 20_000;

/// Worlds to learn in. Every setting may be left out of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WorldsConfig {
    /// How many of each parking type, 0 to 10⁶.
    #[serde(rename = "worlds")]
    pub count: u32,
    /// What they are drawn from.
    pub seed: u64,
}

impl Default for WorldsConfig {
    fn default() -> Self {
        Self { count: 48_000, seed: 1 }
    }
}

impl WorldsConfig {
    /// Checks every setting.
    pub fn validate(&self) -> Result<(), TrainingError> {
        let within = self.count <= 1_000_000;
        settings::check("worlds", within, self.count.to_string(), "0 to 1000000")
    }

    /// What is learnt of each of `kinds`, side by side, with a bar that counts the worlds.
    pub(super) fn learn<K: Sync, T: Send>(
        &self,
        kinds: &[K],
        of_kind: impl Fn(&K, &Worlds) -> T + Sync,
    ) -> Vec<T> {
        let progress = progress::bar(2 * u64::from(self.count) * kinds.len() as u64, "worlds");
        let worlds = Worlds { config: *self, progress: &progress };
        let learnt = std::thread::scope(|scope| {
            let (of_kind, worlds) = (&of_kind, &worlds);
            let begin = |kind| scope.spawn(move || of_kind(kind, worlds));
            let running: Vec<_> = kinds.iter().map(begin).collect();
            running.into_iter().map(|r| r.join().expect("learning does not panic")).collect()
        });
        progress.finish_and_clear();
        learnt
    }
}

/// Worlds that are being learnt in.
pub(super) struct Worlds<'a> {
    config: WorldsConfig,
    /// Counts each of them twice.
    progress: &'a ProgressBar,
}

impl Worlds<'_> {
    /// What is worth keeping of `manoeuvres` and of those learnt here, for spots in which the car stands as
    /// in `stance`; lengths in the sources' units, the most used first. World by world the sources'
    /// vehicles take turns. With no worlds, `manoeuvres` come back as they are.
    pub fn learn(
        &self,
        stance: Stance,
        mut manoeuvres: Vec<Vec<Segment>>,
        sources: &[Source],
    ) -> Vec<Vec<Segment>> {
        if self.config.count == 0 {
            return manoeuvres;
        }
        let mut pupils: Vec<Pupil> = sources.iter().map(|s| Pupil::new(s, &manoeuvres)).collect();
        self.for_each(stance, sources, |at, problem| {
            if let Some(learnt) = pupils[at].lesson(problem) {
                let learnt = scaled(&learnt, 1.0 / sources[at].unit);
                for (pupil, source) in pupils.iter_mut().zip(sources) {
                    pupil.library.add(scaled(&learnt, source.unit), &pupil.model);
                }
                manoeuvres.push(learnt);
            }
        });
        let (mut uses, mut plans) = (vec![0_u32; manoeuvres.len()], 0);
        self.for_each(stance, sources, |at, problem| {
            plans += 1;
            if let Some(used) = pupils[at].used(problem) {
                uses[used] += 1;
            }
        });
        let least = (plans / RARE).max(1);
        let mut order: Vec<usize> = (0..manoeuvres.len()).filter(|&i| uses[i] >= least).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(uses[i]));
        order.into_iter().map(|i| std::mem::take(&mut manoeuvres[i])).collect()
    }

    /// Calls `each` for every world of `stance`, with the source whose vehicle it is for. A world with an
    /// angled bay counts for the nearest of the grid's stances only.
    fn for_each(&self, stance: Stance, sources: &[Source], mut each: impl FnMut(usize, &Problem)) {
        for index in 0..self.config.count {
            let at = index as usize % sources.len();
            let Metadata { vehicle, grid, .. } = sources[at].metadata;
            let scene = wide(vehicle, stance.kind(), self.config.seed, u64::from(index));
            let apart =
                |scene: &Scene, s: Stance| signed_angle(scene.goal.heading, s.heading()).abs();
            let of = grid.stances(stance.kind());
            let is_other =
                |scene: &Scene| of.iter().any(|&other| apart(scene, other) < apart(scene, stance));
            if scene.as_ref().is_ok_and(is_other) {
                continue;
            }
            self.progress.inc(1);
            if let Some(problem) = scene.ok().and_then(|scene| Problem::new(&scene).ok()) {
                each(at, &problem);
            }
        }
    }
}

/// A vehicle that learns.
struct Pupil {
    model: CostModel,
    budget: Budget,
    teacher: HybridAStar,
    library: Library,
    search: LibrarySearch,
    verdicts: Verdicts,
}

impl Pupil {
    fn new(source: &Source, manoeuvres: &[Vec<Segment>]) -> Self {
        let Metadata { vehicle, planner, max_expansions, .. } = source.metadata;
        let (search, verdicts) = Default::default();
        Self {
            model: planner.cost.scaled(vehicle.scale()),
            budget: Budget { max_expansions: *max_expansions, effort: Effort::Usual },
            teacher: HybridAStar::hold(*planner, SOLUTIONS),
            library: source.library(manoeuvres),
            search,
            verdicts,
        }
    }

    /// The end of the teacher's path, where nothing known does as well.
    fn lesson(&mut self, problem: &Problem) -> Option<Vec<Segment>> {
        if !self.library.fits(problem) {
            return None;
        }
        let path = self.teacher.plan(problem, self.budget).outcome.ok()?;
        let cost = self.model.path(&problem.vehicle, &path.segments);
        let goal = self.teacher.goal_set(problem);
        if self.teacher.direct_below(problem, problem.start, &goal, GOOD * cost).is_some() {
            return None;
        }
        self.verdicts.clear();
        let Self { library, search, verdicts, model, .. } = self;
        match search.plan(library, verdicts, problem, model, GOOD * cost) {
            Some(_) => None,
            None => self.teacher.manoeuvre(problem, &path),
        }
    }

    /// The manoeuvre that is planned with.
    fn used(&mut self, problem: &Problem) -> Option<usize> {
        if !self.library.fits(problem) {
            return None;
        }
        self.verdicts.clear();
        let Self { library, search, verdicts, model, .. } = self;
        let goal = self.teacher.goal_set(problem);
        let direct = self.teacher.direct(problem, problem.start, &goal).map(|leg| leg.cost);
        let any = direct.unwrap_or(f64::INFINITY);
        let mut look_up = search.look_up(library, verdicts, problem, model, any);
        look_up.cheapest(None, any, usize::MAX).map(|plan| plan.manoeuvre)
    }
}
