//! Parking environments, many at once: what `n3p.gym` is made of.

use std::sync::{Arc, Mutex};
use std::thread;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyString;

use n3p::environment::courses::{Course, Stratum};
use n3p::environment::parking_env::{End, EnvConfig, ParkingEnv};
use n3p::environment::{Action, BEAMS, MASK, Observation, TARGET};
use n3p::planners::Problem;
use n3p::world::{Level, ParkingType, Scene};

use crate::errors::{Fault, guarded};
use crate::plan::table;
use crate::vehicle::vehicle;
use crate::{inputs, scene};

/// Parking environments that step together. Use them through `n3p.gym`.
#[pyclass(frozen, module = "n3p._n3p", name = "Environments")]
pub struct Environments {
    count: usize,
    source: Source,
    vehicle: n3p::Vehicle,
    config: EnvConfig,
    autoreset: Autoreset,
    slots: Mutex<Slots>,
}

/// When an environment whose episode has ended begins the next one.
#[derive(Clone, Copy, PartialEq)]
enum Autoreset {
    /// In no step: stepping on is an error.
    Never,
    /// In the next step, whose action is ignored.
    NextStep,
    /// In the same step.
    SameStep,
}

/// Where problems come from.
enum Source {
    Course(Course, Vec<Stratum>),
    Scenes(Vec<Arc<Scene>>),
}

struct Slots {
    seed: u64,
    all: Vec<Slot>,
}

/// One environment.
struct Slot {
    /// Index of its first problem; the next ones are as many further as there are environments.
    next: u64,
    env: Option<ParkingEnv>,
    /// Whether its episode has ended.
    ended: bool,
}

/// What one step of one environment comes to.
struct Outcome {
    seen: Observation,
    reward: f64,
    end: Option<End>,
    scripted: bool,
    driven: Action,
    /// What was seen last, where `seen` belongs to the next episode.
    last: Option<Box<Observation>>,
}

/// Observations: lidar (N, 120), target (N, 5), mask (N, 42).
type Seen<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>);
/// Rewards, ends, scripted, driven.
type Told<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i8>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray2<f32>>,
);

#[pymethods]
impl Environments {
    #[new]
    #[pyo3(signature = (count, *, course="eval", r#type=None, level=None, scenes=None, vehicle=None, horizon=200, reward_scale=0.1, autoreset="never"))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn new(
        count: i64,
        course: &str,
        r#type: Option<&Bound<'_, PyAny>>,
        level: Option<&Bound<'_, PyAny>>,
        scenes: Option<&Bound<'_, PyAny>>,
        vehicle: Option<&Bound<'_, PyAny>>,
        horizon: i64,
        reward_scale: f64,
        autoreset: &str,
    ) -> Result<Self, Fault> {
        let Some(count) = usize::try_from(count).ok().filter(|n| (1..=65_536).contains(n)) else {
            return Err(Fault::bad(format!("num_envs: is {count}; expected 1 to 65536")));
        };
        let Some(horizon) = u32::try_from(horizon).ok().filter(|h| *h > 0) else {
            return Err(Fault::bad(format!("horizon: is {horizon}; expected 1 or more")));
        };
        if !reward_scale.is_finite() {
            return Err(Fault::bad(format!("reward_scale: is {reward_scale}; expected a number")));
        }
        let autoreset = match autoreset {
            "never" => Autoreset::Never,
            "next_step" => Autoreset::NextStep,
            "same_step" => Autoreset::SameStep,
            other => return Err(Fault::bad(format!("autoreset: unknown {other:?}"))),
        };
        let vehicle = self::vehicle(vehicle)?;
        let source = match scenes {
            None => course_of(course, r#type, level, &vehicle)?,
            Some(scenes) => Source::Scenes(given(scenes)?),
        };
        let config = EnvConfig { horizon, reward_scale, ..EnvConfig::default() };
        let all = (0..count).map(|i| Slot { next: i as u64, env: None, ended: true }).collect();
        let slots = Mutex::new(Slots { seed: 0, all });
        Ok(Self { count, source, vehicle, config, autoreset, slots })
    }

    /// Begins anew: with a seed from its first problem on, else with the next problems.
    #[pyo3(signature = (seed=None, only=None))]
    fn reset<'py>(
        &self,
        py: Python<'py>,
        seed: Option<i128>,
        only: Option<Vec<bool>>,
    ) -> Result<Seen<'py>, Fault> {
        let seed = seed.map(scene::seed_of).transpose()?;
        if only.as_ref().is_some_and(|only| only.len() != self.count) {
            return Err(Fault::bad(format!("reset_mask: expected shape ({},)", self.count)));
        }
        let seen = self.locked(py, |Slots { seed: known, all }| {
            if let Some(seed) = seed {
                *known = seed;
                (0..).zip(all.iter_mut()).for_each(|(i, slot)| slot.next = i);
            }
            let chosen = |i: usize| only.as_ref().is_none_or(|only| only[i]);
            for (i, slot) in all.iter_mut().enumerate() {
                if chosen(i) || slot.env.is_none() {
                    self.begin(slot, *known);
                }
            }
            Ok(all.iter().map(|slot| slot.env().observe()).collect::<Vec<_>>())
        })?;
        Ok(arrays(py, &seen))
    }

    /// Steps all: actions (N, 2), steer and speed, each from -1 to 1.
    #[expect(clippy::type_complexity, reason = "a tuple for Python to take apart")]
    fn step<'py>(
        &self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
    ) -> Result<(Seen<'py>, Told<'py>, Vec<(usize, Seen<'py>)>), Fault> {
        let actions = inputs::rows::<2>(actions).map_err(|w| w.of("actions"))?;
        if actions.len() != self.count {
            let text =
                format!("actions: has shape ({}, 2); expected ({}, 2)", actions.len(), self.count);
            return Err(Fault::bad(text));
        }
        if let Some(i) = actions.iter().position(|a| a.iter().any(|v| !v.is_finite())) {
            let text = format!("actions[{i}]: is {:?}; expected numbers from -1 to 1", actions[i]);
            return Err(Fault::bad(text));
        }
        let outcomes = self.locked(py, |Slots { seed, all }| {
            if all.iter().any(|slot| slot.env.is_none()) {
                return Err(Fault::Bug("reset() was not called; call it before step()".to_owned()));
            }
            if self.autoreset == Autoreset::Never && all.iter().any(|slot| slot.ended) {
                return Err(Fault::Bug("the episode has ended; call reset()".to_owned()));
            }
            Ok(self.step_all(all, &actions, *seed))
        })?;
        let seen: Vec<Observation> = outcomes.iter().map(|o| o.seen).collect();
        let code = |o: &Outcome| match o.end {
            None => 0,
            Some(End::Parked) => 1,
            Some(End::OutOfBounds) => 2,
            Some(End::OutOfTime) => 3,
        };
        let driven = outcomes.iter().flat_map(|o| [o.driven.steer as f32, o.driven.speed as f32]);
        let told = (
            PyArray1::from_iter(py, outcomes.iter().map(|o| o.reward)),
            PyArray1::from_iter(py, outcomes.iter().map(code)),
            PyArray1::from_iter(py, outcomes.iter().map(|o| o.scripted)),
            table(py, driven.collect(), self.count, 2),
        );
        let lasts = outcomes.iter().enumerate().filter_map(|(i, o)| Some((i, o.last.as_deref()?)));
        let lasts = lasts.map(|(i, seen)| (i, arrays(py, std::slice::from_ref(seen)))).collect();
        Ok((arrays(py, &seen), told, lasts))
    }
}

impl Slot {
    fn env(&self) -> &ParkingEnv {
        self.env.as_ref().expect("reset comes first")
    }
}

impl Environments {
    /// Does `work` while other Python threads run. The lock is taken within the guard, so that a
    /// panic poisons it: what is left half done is not used again.
    fn locked<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Slots) -> Result<T, Fault> + Send,
    ) -> Result<T, Fault> {
        let locked = || {
            let mut slots = self.slots.lock().map_err(|_| {
                let text = "an earlier step failed by a bug of n3p; make new environments";
                Fault::Bug(text.to_owned())
            })?;
            work(&mut slots)
        };
        py.detach(|| guarded(locked)).flatten()
    }

    /// Begins the next episode.
    fn begin(&self, slot: &mut Slot, seed: u64) {
        let index = slot.next;
        let problem = match &self.source {
            Source::Course(course, strata) => {
                // Environments go through the strata one after the other, each from another one on.
                let (own, round) = (index % self.count as u64, index / self.count as u64);
                let stratum = strata[((own + round) % strata.len() as u64) as usize];
                course.problem(&self.vehicle, stratum, seed, index)
            }
            Source::Scenes(scenes) => {
                let scene = &scenes[(index % scenes.len() as u64) as usize];
                Problem::as_given(scene).expect("it was one before")
            }
        };
        slot.next = index.wrapping_add(self.count as u64);
        slot.ended = false;
        match &mut slot.env {
            Some(env) => env.enter(problem),
            none => *none = Some(ParkingEnv::new(problem, self.config)),
        }
    }

    /// One step of every environment, by all cores.
    fn step_all(&self, all: &mut [Slot], actions: &[[f64; 2]], seed: u64) -> Vec<Outcome> {
        /// Fewer are not worth a thread.
        const LEAST: usize = 8;
        let cores = thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let threads = cores.min(self.count / LEAST).max(1);
        let each = self.count.div_ceil(threads);
        let steps = |(slots, actions): (&mut [Slot], &[[f64; 2]])| -> Vec<Outcome> {
            slots.iter_mut().zip(actions).map(|(slot, a)| self.step_one(slot, *a, seed)).collect()
        };
        thread::scope(|scope| {
            let mut parts = all.chunks_mut(each).zip(actions.chunks(each));
            let first = parts.next();
            let others: Vec<_> = parts.map(|part| scope.spawn(move || steps(part))).collect();
            let mut outcomes = first.map(steps).unwrap_or_default();
            for other in others {
                outcomes.extend(other.join().expect("steps do not panic"));
            }
            outcomes
        })
    }

    fn step_one(&self, slot: &mut Slot, [steer, speed]: [f64; 2], seed: u64) -> Outcome {
        if slot.ended {
            self.begin(slot, seed);
            let (seen, driven) = (slot.env().observe(), Action::default());
            return Outcome { seen, reward: 0.0, end: None, scripted: false, driven, last: None };
        }
        let env = slot.env.as_mut().expect("reset comes first");
        let step = env.step(Action { steer, speed });
        let mut seen = env.observe();
        let mut scripted = env.is_scripted();
        let mut last = None;
        slot.ended = step.end.is_some();
        if slot.ended && self.autoreset == Autoreset::SameStep {
            last = Some(Box::new(seen));
            self.begin(slot, seed);
            (seen, scripted) = (slot.env().observe(), false);
        }
        Outcome { seen, reward: step.reward, end: step.end, scripted, driven: step.action, last }
    }
}

fn arrays<'py>(py: Python<'py>, seen: &[Observation]) -> Seen<'py> {
    let count = seen.len();
    (
        table(py, seen.iter().flat_map(|o| o.lidar).collect(), count, BEAMS),
        table(py, seen.iter().flat_map(|o| o.target).collect(), count, TARGET),
        table(py, seen.iter().flat_map(|o| o.mask).collect(), count, MASK),
    )
}

/// The strata of a course that are of these types and levels; both may be one name or several.
fn course_of(
    course: &str,
    types: Option<&Bound<'_, PyAny>>,
    levels: Option<&Bound<'_, PyAny>>,
    vehicle: &n3p::Vehicle,
) -> Result<Source, Fault> {
    let named = Course::named(course).ok_or_else(|| {
        Fault::bad(format!("course: unknown course {course:?}; expected one of simple, eval"))
    })?;
    let config = n3p::world::generate::GeneratorConfig::default();
    config.validate(vehicle).map_err(|e| Fault::bad(format!("vehicle: {e}")))?;
    let kinds: Vec<ParkingType> = words(types, "type")?;
    let levels: Vec<Level> = words(levels, "level")?;
    let of_these = |s: &Stratum| {
        (kinds.is_empty() || kinds.contains(&s.kind))
            && (levels.is_empty() || levels.contains(&s.level))
    };
    let strata: Vec<Stratum> = (0..Stratum::COUNT).map(Stratum::nth).filter(of_these).collect();
    if strata.is_empty() {
        return Err(Fault::bad("type: no course has angled bays; give them as scenes"));
    }
    Ok(Source::Course(named, strata))
}

/// One word or several; none where nothing is given.
fn words<T: std::str::FromStr<Err: std::fmt::Display>>(
    given: Option<&Bound<'_, PyAny>>,
    name: &str,
) -> Result<Vec<T>, Fault> {
    let Some(given) = given else { return Ok(Vec::new()) };
    if given.is_instance_of::<PyString>() {
        return Ok(vec![inputs::text(given, name)?]);
    }
    let wrong = || Fault::bad(format!("{name}: expected a name, or a list of names"));
    let items = given.try_iter().map_err(|_| wrong())?;
    let words: Vec<T> =
        items.map(|item| inputs::text(&item?, name)).collect::<Result<_, Fault>>()?;
    if words.is_empty() { Err(wrong()) } else { Ok(words) }
}

/// Scenes to park in, all of which have free ends.
fn given(scenes: &Bound<'_, PyAny>) -> Result<Vec<Arc<Scene>>, Fault> {
    let wrong = || Fault::bad("scenes: expected a list of scenes, at least one");
    if scenes.is_instance_of::<PyString>() {
        return Err(wrong());
    }
    let items = scenes.try_iter().map_err(|_| wrong())?;
    let of = |item: PyResult<Bound<'_, PyAny>>| {
        let (scene, _) = scene::scene(&item?)?;
        Problem::as_given(&scene)
            .map_err(|e| Fault::bad(format!("scene {:?}: {e}", scene.name)))?;
        Ok(scene)
    };
    let scenes: Vec<_> = items.map(of).collect::<Result<_, Fault>>()?;
    if scenes.is_empty() { Err(wrong()) } else { Ok(scenes) }
}
