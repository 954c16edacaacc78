//! What every manoeuvre of a library is worth in generated worlds, and what the best plan costs.

use std::num::NonZero;
use std::sync::Arc;

use indicatif::ProgressBar;
use rand::RngExt;

use super::ForesightConfig;
use crate::curves::{Path, Segment};
use crate::lab::progress;
use crate::n3p::guided::known::Prepared;
use crate::planners::cost::CostModel;
use crate::planners::library::{LibrarySearch, Verdicts};
use crate::planners::{Budget, HybridAStar, HybridAStarConfig, Planner, Problem};
use crate::rng::{Stream, rng};
use crate::selectors::PoseSelector;
use crate::selectors::foresight::{MANOEUVRE, SCENE, least_cost, scene_values};
use crate::selectors::model::Model;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;
use crate::world::generate::wide;

/// Solutions that the teacher takes the best of.
const SOLUTIONS: usize = 5;
/// Its expansions.
const BUDGET: Budget = Budget::new(20_000);
/// Manoeuvres that cost more than so many times the best one are as good as none.
const TIMES: f64 = 1.5;

/// A library and the vehicle that it is scaled to.
pub(super) struct Source {
    pub model: String,
    pub vehicle: Vehicle,
    pub kind: ParkingType,
    selector: Arc<dyn PoseSelector>,
    /// Worlds to learn in.
    worlds: usize,
}

impl Source {
    /// The libraries of all `models`: for the vehicle of each, or every one of a fleet.
    pub fn all(models: impl Iterator<Item = Model>, config: &ForesightConfig) -> Vec<Source> {
        let mut sources = Vec::new();
        for model in models {
            let name = model.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
            let (vehicles, worlds) = match &model {
                Model::Fleet(fleet) => (fleet.header().fleet.clone(), config.fleet_worlds),
                _ => (model.vehicle().into_iter().copied().collect(), config.worlds),
            };
            let kinds = model.kinds();
            let selector = model.into_selector();
            for vehicle in vehicles {
                for &kind in kinds.iter().filter(|kind| ParkingType::SQUARE.contains(kind)) {
                    let (model, selector) = (name.clone(), selector.clone());
                    sources.push(Source { model, vehicle, kind, selector, worlds });
                }
            }
        }
        sources
    }
}

/// One scene.
pub(super) struct Example {
    /// Which library it is about.
    pub library: usize,
    pub scene: [f32; SCENE],
    /// What each manoeuvre is estimated to cost more than the least estimate, turning radii.
    pub estimates: Vec<f32>,
    /// Manoeuvres that lead to a plan, and what it costs more than the best of these, turning radii.
    pub costs: Vec<(u32, f32)>,
    /// ln of what the best plan costs over the least estimate ([`least_cost`]).
    pub value: f32,
}

/// Examples, and the manoeuvres of the libraries that they are about.
pub(super) struct Examples {
    pub libraries: Arc<Vec<Vec<[f32; MANOEUVRE]>>>,
    pub examples: Vec<Example>,
}

/// Examples to learn from, and others to validate with.
pub(super) fn collect(sources: &[Source], config: &ForesightConfig) -> [Examples; 2] {
    let held_back = |s: &Source| ((s.worlds as f64 * config.validation_share).ceil()) as usize;
    let all: u64 = sources.iter().map(|s| (s.worlds + held_back(s)) as u64).sum();
    let bar = progress::bar(all, "worlds");
    let (mut libraries, mut train, mut validation) = (Vec::new(), Vec::new(), Vec::new());
    for (library, source) in sources.iter().enumerate() {
        let (of_train, values) = collect_of(library, source, config, false, source.worlds, &bar);
        let (held, _) = collect_of(library, source, config, true, held_back(source), &bar);
        train.extend(of_train);
        validation.extend(held);
        libraries.push(values);
    }
    bar.finish_and_clear();
    let libraries = Arc::new(libraries);
    [train, validation].map(|examples| Examples { libraries: libraries.clone(), examples })
}

/// The examples of one library in the order of their worlds, and its manoeuvres.
fn collect_of(
    library: usize,
    source: &Source,
    config: &ForesightConfig,
    held_back: bool,
    worlds: usize,
    bar: &ProgressBar,
) -> (Vec<Example>, Vec<[f32; MANOEUVRE]>) {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    let of_thread = |thread: usize| {
        let mut pupil = Pupil::new(source);
        let mut found = Vec::new();
        for index in (thread..worlds).step_by(threads) {
            bar.inc(1);
            // Worlds of another seed: half of all seeds are for nothing else.
            let seed = config.seed << 1 | u64::from(held_back);
            let example = pupil.example(library, source, seed, index as u64, config.on_the_way);
            found.extend(example.map(|example| (index, example)));
        }
        let values = pupil
            .prepared
            .as_ref()
            .map(|prepared| prepared.values(&prepared.library, &source.vehicle));
        let values = values.unwrap_or_default();
        (found, values)
    };
    let parts: Vec<_> = std::thread::scope(|scope| {
        let of_thread = &of_thread;
        let running: Vec<_> =
            (0..threads).map(|thread| scope.spawn(move || of_thread(thread))).collect();
        running.into_iter().map(|r| r.join().expect("collecting does not panic")).collect()
    });
    let values = parts.iter().map(|(_, values)| values.clone()).find(|v| !v.is_empty());
    let mut found: Vec<_> = parts.into_iter().flat_map(|(found, _)| found).collect();
    found.sort_by_key(|(index, _)| *index);
    (found.into_iter().map(|(_, example)| example).collect(), values.unwrap_or_default())
}

/// Who tries everything.
struct Pupil {
    teacher: HybridAStar,
    model: CostModel,
    prepared: Option<Prepared>,
    search: LibrarySearch,
    verdicts: Verdicts,
}

impl Pupil {
    fn new(source: &Source) -> Self {
        let teacher = HybridAStar::hold(HybridAStarConfig::default(), SOLUTIONS);
        let model = teacher.cost(&source.vehicle);
        let (prepared, search, verdicts) = Default::default();
        Self { teacher, model, prepared, search, verdicts }
    }

    fn example(
        &mut self,
        library: usize,
        source: &Source,
        seed: u64,
        index: u64,
        on_the_way: f64,
    ) -> Option<Example> {
        let scene = wide(&source.vehicle, source.kind, seed, index).ok()?;
        let mut problem = Problem::new(&scene).ok()?;
        if self.prepared.is_none() {
            self.prepared = Prepared::new(source.selector.as_ref(), &self.teacher, &problem, None);
        }
        if !self.prepared.as_ref()?.library.fits(&problem) {
            return None;
        }
        let path = self.teacher.plan(&problem, BUDGET).outcome.ok()?;
        let mut rng = rng(seed, Stream::Foresight, index);
        let rest = match rng.random_bool(on_the_way) {
            false => path,
            true => rest(&path, rng.random_range(0.05..0.95) * path.length()),
        };
        problem.start = rest.start;
        self.seen(library, &problem, &rest)
    }

    /// What is to be seen from the start of a problem, for which a path is known.
    fn seen(&mut self, library: usize, problem: &Problem, path: &Path) -> Option<Example> {
        let Self { teacher, model, prepared, search, verdicts } = self;
        let prepared = prepared.as_ref()?;
        let stance = problem.stance()?;
        let (vehicle, any) = (&problem.vehicle, f64::INFINITY);
        let mut best = model.path(vehicle, &path.segments);
        let goal = teacher.goal_set(problem);
        if let Some(leg) = teacher.direct_below(problem, problem.start, &goal, best) {
            best = leg.cost;
        }
        verdicts.clear();
        let mut look_up = search.look_up(&prepared.library, verdicts, problem, model, any);
        // What `n3p` knows when it looks.
        let least: [f64; 2] = look_up.least_estimates(prepared.straights).into();
        let estimates = look_up.estimates().to_vec();
        let costs = look_up.costs_within(TIMES);
        let known = costs.iter().map(|(_, cost)| *cost).fold(any, f64::min);
        best = best.min(known);
        verdicts.clear();
        let mut look_up = search.look_up(&prepared.rare, verdicts, problem, model, best);
        if let Some(plan) = look_up.cheapest_of(best, usize::MAX) {
            best = plan.cost;
        }
        let unit = vehicle.turning_radius();
        let least_of_all = least[0].min(least[1]) as f32;
        Some(Example {
            library,
            scene: scene_values(problem, stance, least),
            estimates: estimates.iter().map(|e| (e - least_of_all) / unit as f32).collect(),
            costs: costs.iter().map(|(i, c)| (*i as u32, ((c - known) / unit) as f32)).collect(),
            value: (best / least_cost(vehicle, least)).ln() as f32,
        })
    }
}

/// What is left of a path after so many metres.
fn rest(path: &Path, mut driven: f64) -> Path {
    for (i, (from, segment)) in path.legs().enumerate() {
        let length = segment.length.abs();
        if driven < length {
            let done = driven.copysign(segment.length);
            let first = Segment { length: segment.length - done, ..segment };
            let rest = std::iter::once(first).chain(path.segments[i + 1..].iter().copied());
            return Path::new(segment.at(from, done), rest);
        }
        driven -= length;
    }
    Path::new(path.end(), [])
}
