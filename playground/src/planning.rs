//! A scene planned by one method, as the page shows it.

use std::ops::RangeInclusive;

use n3p::curves::smoothing::StandstillSteering;
use n3p::curves::{Path, Segment, TrajectoryLimits};
use n3p::episode::{SpotReport, clearance};
use n3p::geometry::{Frame, Pose};
use n3p::output::{Driven, PathFile};
use n3p::planners::goals::{self, Planned, Terms};
use n3p::planners::library::{Fate, Tried};
use n3p::planners::{Budget, Effort, Planner, Problem};
use n3p::world::Scene;
use n3p::{Method, Models};
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::ask::Failure;
use crate::clock::now_us;
use crate::desk::Desk;

/// How a scene is to be planned, and what is to be told of the plan.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wish {
    /// Clearance where start and goal allow it, metres.
    margin: f64,
    /// Where the wheels may turn while the car stands.
    standstill_steering: StandstillSteering,
    /// How long the planner goes on once it has a path.
    effort: Effort,
    /// So many rounds of plans are timed, 1 to 9: the median counts.
    rounds: usize,
    /// Whether the path is also told in time.
    motion: bool,
    /// Whether it is also told what was tried, by `n3p`.
    explain: bool,
    /// Whether the path is told with all its digits, as path files have it.
    file: bool,
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            margin: Problem::MARGIN,
            standstill_steering: StandstillSteering::default(),
            effort: Effort::default(),
            rounds: 5,
            motion: false,
            explain: false,
            file: false,
        }
    }
}

/// Expansions of a request, shared by the problems that its goals are.
const EXPANSIONS: usize = 200_000;
/// Corners and points of a scene, at most: more would take seconds a plan.
const CORNERS: usize = 200_000;
/// From start to goal, at most, in vehicle lengths.
const LENGTHS: f64 = 200.0;
/// A plan is made again and again for so long, microseconds, or so many times: one alone is too short for
/// the clock of a browser. The median of some such rounds counts: other programs want to run, too.
const ROUND_US: f64 = 1_000.0;
const TIMES: usize = 20;
const ROUNDS: RangeInclusive<usize> = 1..=9;
/// A first plan that takes longer than this, microseconds, is not made again.
const SLOW_US: f64 = 200_000.0;
/// Poses of a path that are told, at most.
const POSES: usize = 4_000;
/// Manoeuvres that are told of as tried, at most.
const TRIED: usize = 400;
/// Poses of a manoeuvre lie so far apart, metres for a usual car.
const COARSE: f64 = 0.25;

/// The plan of `scene` by `method`. That there is no path is a plan, too.
pub fn plan(scene: &Scene, method: &str, wish: &Wish, desk: &mut Desk) -> Result<Value, Failure> {
    let method: Method = method.parse().map_err(|e| Failure::of(Some("method"), e))?;
    check_size(scene)?;
    if !ROUNDS.contains(&wish.rounds) {
        let message = format!("rounds is {}; expected 1 to {}", wish.rounds, ROUNDS.end());
        return Err(Failure::of(Some("rounds"), message));
    }
    let terms =
        Terms { margin: wish.margin, standstill: wish.standstill_steering, ..Terms::default() };
    let problems = scene.all_goals().len() * if scene.goal_tolerance.is_some() { 16 } else { 1 };
    let budget = Budget { max_expansions: EXPANSIONS / problems, effort: wish.effort };
    let planner = desk.planner(method, &scene.vehicle)?;
    let (planned, took_us, times) = timed(planner, scene, terms, budget, wish.rounds)?;
    let models = desk.models(&scene.vehicle)?;
    let mut told = tell(scene, method, &planned, wish, models);
    told.insert("plan_us".to_owned(), rounded(took_us, 10.0));
    told.insert("timed".to_owned(), json!(times));
    if wish.explain
        && method == Method::N3P
        && let Some(telling) = desk.telling(&scene.vehicle)?
    {
        let problem = &planned.problem;
        let (_, tried) = telling.plan_and_tell(problem, budget);
        let told_of = tried.iter().take(TRIED).map(|one| attempt(problem, one));
        told.insert("tried".to_owned(), told_of.collect());
        told.insert("tried_in_all".to_owned(), json!(tried.len()));
    }
    Ok(Value::Object(told))
}

fn check_size(scene: &Scene) -> Result<(), Failure> {
    let corners = scene.points.len() + scene.obstacles.iter().map(Vec::len).sum::<usize>();
    if corners > CORNERS {
        let message =
            format!("the scene has {corners} corners and points; the playground takes {CORNERS}");
        return Err(Failure::of(Some("obstacles"), message));
    }
    let most = LENGTHS * scene.vehicle.length;
    let is_far = |goal: &&Pose| scene.start.distance(**goal) > most;
    if let Some(goal) = scene.all_goals().iter().find(is_far) {
        let apart = scene.start.distance(*goal);
        let message = format!(
            "the goal lies {apart:.0} m from the start; the playground plans up to {most:.0} m"
        );
        return Err(Failure::of(Some("goal"), message));
    }
    Ok(())
}

/// The plan, the time that it takes, microseconds, and of how many plans that is known. The first one, which
/// may have to prepare the planner, only counts where it is long.
fn timed(
    planner: &mut dyn Planner,
    scene: &Scene,
    terms: Terms,
    budget: Budget,
    most_rounds: usize,
) -> Result<(Planned, f64, usize), Failure> {
    let begun = now_us();
    let planned = goals::plan(planner, scene, terms, budget)?;
    let first = now_us() - begun;
    if first >= SLOW_US {
        return Ok((planned, first, 1));
    }
    let (mut rounds, mut plans) = (Vec::new(), 0);
    while rounds.len() < most_rounds {
        let begun = now_us();
        let mut times = 0;
        let mut took = 0.0;
        while took < ROUND_US && times < TIMES {
            goals::plan(planner, scene, terms, budget)?;
            times += 1;
            took = now_us() - begun;
        }
        rounds.push(took / times as f64);
        plans += times;
        // What takes long needs no second opinion.
        if took > 10.0 * ROUND_US {
            break;
        }
    }
    rounds.sort_by(f64::total_cmp);
    Ok((planned, rounds[rounds.len() / 2], plans))
}

fn tell(
    scene: &Scene,
    method: Method,
    planned: &Planned,
    wish: &Wish,
    models: &Models,
) -> Map<String, Value> {
    let Planned { goal_index, problem, result, .. } = planned;
    let mut told = Map::new();
    let mut put = |key: &str, value: Value| told.insert(key.to_owned(), value);
    put("method", json!(method.name()));
    put("expansions", json!(result.expansions));
    put("parking_type", json!(problem.kind));
    put("spot", json!(SpotReport::of(method, problem, result, models)));
    let (path, driven) = match (&result.outcome, result.driven()) {
        (Ok(path), Some(driven)) => (path, driven),
        (Err(reason), _) => {
            put("no_path", json!(reason.to_string()));
            return told;
        }
        (Ok(_), None) => unreachable!("a path can be driven"),
    };
    let scene = scene.with_goal(scene.all_goals()[*goal_index]);
    let file = PathFile::of_smooth(&scene, &problem.frame, &driven, method.name());
    let near = clearance::of(&scene, &file);
    let metres = |value: f64| if value.is_finite() { rounded(value, 1e3) } else { Value::Null };
    put("length_m", metres(path.length()));
    put("direction_changes", json!(path.direction_changes()));
    put("clearance_m", metres(near.least));
    put("way_clearance_m", near.on_the_way.map_or(Value::Null, metres));
    put("margin_m", metres(problem.margin));
    put("goal_index", json!(goal_index));
    put("path", if wish.file { json!(file) } else { coarse(&file) });
    if wish.motion {
        put("motion", motion(&scene, problem, planned));
    }
    told
}

/// A path of at most about [`POSES`] poses, rounded, with every change of gear.
fn coarse(file: &PathFile) -> Value {
    let (last, step) =
        (file.poses.len().saturating_sub(1), file.poses.len().div_ceil(POSES).max(1));
    let keeps = |i: &usize| {
        i.is_multiple_of(step) || *i == last || (*i > 0 && file.gears[*i] != file.gears[*i - 1])
    };
    let kept: Vec<usize> = (0..file.poses.len()).filter(keeps).collect();
    json!({
        "poses": kept.iter().map(|&i| pose(file.poses[i])).collect::<Value>(),
        "gears": kept.iter().map(|&i| file.gears[i]).collect::<Value>(),
        "steer": kept.iter().map(|&i| rounded(file.steer[i], 1e4)).collect::<Value>(),
    })
}

/// The path in time: the car stops wherever its wheels must turn at standstill.
fn motion(scene: &Scene, problem: &Problem, planned: &Planned) -> Value {
    let limits = TrajectoryLimits { stop_to_steer: true, ..TrajectoryLimits::of(&scene.vehicle) };
    let Some(driven) = planned.result.driven() else { return Value::Null };
    let ends = [scene.start, scene.goal];
    let Ok(Driven { report, moments }) =
        Driven::new(ends, &scene.vehicle, &problem.frame, &driven, &limits)
    else {
        return Value::Null;
    };
    let column = |value: &dyn Fn(&n3p::curves::trajectory::Moment) -> Value| {
        moments.iter().map(value).collect::<Value>()
    };
    json!({
        "duration_s": rounded(report.duration_s, 1e2),
        "stops": report.stops,
        "time": column(&|m| rounded(m.time, 1e3)),
        "pose": column(&|m| pose(m.pose.into())),
        "steer": column(&|m| rounded(m.steer, 1e4)),
        "speed": column(&|m| rounded(m.speed, 1e3)),
        "gear": column(&|m| json!(m.gear.sign())),
    })
}

/// A manoeuvre that was tried, and the curve to it where there is one.
fn attempt(problem: &Problem, tried: &Tried) -> Value {
    let frame = &problem.frame;
    let step = COARSE * problem.vehicle.scale();
    let manoeuvre = sampled(frame, tried.preparatory, &tried.motions, step);
    let (fate, curve, cost) = match &tried.fate {
        Fate::Touches => ("touches", Value::Null, None),
        Fate::NotJoined => ("not joined", Value::Null, None),
        Fate::Joined { curve, cost } => {
            ("joined", sampled(frame, problem.start, curve, step), Some(rounded(*cost, 1e2)))
        }
    };
    let preparatory = pose(frame.world_from_local(tried.preparatory).into());
    json!({ "fate": fate, "preparatory": preparatory, "manoeuvre": manoeuvre, "curve": curve, "cost": cost })
}

fn sampled(frame: &Frame, start: Pose, segments: &[Segment], step: f64) -> Value {
    let path = Path::new(start, segments.iter().copied()).to_world(frame);
    path.sample(step).iter().map(|s| pose(s.pose.into())).collect()
}

/// A pose to the tenth of a millimetre.
fn pose(pose: [f64; 3]) -> Value {
    pose.iter().map(|&v| rounded(v, 1e4)).collect()
}

/// A number to one part of `parts`.
fn rounded(value: f64, parts: f64) -> Value {
    json!((value * parts).round() / parts)
}
