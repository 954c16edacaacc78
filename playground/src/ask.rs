//! Requests of the page, and their answers. Both are JSON; lengths in metres, angles in radians, poses
//! `[x, y, θ]` of the rear axle.
//!
//! | request | answer |
//! |---|---|
//! | `{"catalogue": {}}` | `{"methods": […], "vehicles": […], "examples": […], "version": …}` |
//! | `{"load": {"name": "lot.yaml", "bytes": BASE64, "others": [{"name": "lot.pgm", "bytes": BASE64}]}}` | `{"scene": …}` |
//! | `{"plan": {"scene": …, "methods": ["n3p"], "wish": {…}}}` | `{"plans": [one for each method]}` |
//!
//! What cannot be answered is `{"error": {"field": …, "message": …, "touches": …}}`: the field of the scene or of
//! the request that is wrong, if it is one, in plain words what is, and the obstacle that start or goal touch.

use std::cell::RefCell;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use n3p::Vehicle;
use n3p::geometry::Pose;
use n3p::planners::{Conflict, ProblemError};
use n3p::world::Scene;
use n3p::world::maps::{Map, MapOptions, MapRequest};
use n3p::world::scene::SceneError;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use serde_json::{Value, json};

use crate::catalogue::catalogue;
use crate::desk::Desk;
use crate::planning::{Wish, plan};

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Request {
    Catalogue {},
    Load(Load),
    Plan(Box<Planning>),
}

/// A file to make a scene of.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Load {
    /// Its name, whose ending says what it is.
    name: String,
    /// What it holds, in base64.
    bytes: String,
    /// Files that it may name, such as the image of an occupancy grid.
    #[serde(default)]
    others: Vec<Other>,
    /// Who parks where the file does not say it.
    #[serde(default)]
    vehicle: Option<Vehicle>,
}

/// One more file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Other {
    name: String,
    bytes: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Planning {
    /// In the scene format.
    scene: Box<RawValue>,
    /// By which methods; at most [`METHODS`].
    methods: Vec<String>,
    /// How, and what is to be told.
    #[serde(default)]
    wish: Wish,
}

/// A request may name so many methods.
const METHODS: usize = 4;

/// What could not be done, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// The field that is wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
    /// What is wrong and what would be right.
    pub message: String,
    /// The obstacle that start or goal touch, as `obstacles[3]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touches: Option<String>,
}

impl Failure {
    /// A failure with what `error` says.
    pub fn of(field: Option<&str>, error: impl ToString) -> Self {
        Self { field: field.map(str::to_owned), message: error.to_string(), touches: None }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        match error {
            SceneError::Invalid { field, message, .. } => {
                Self::of(Some(&field), format!("{field} {message}"))
            }
            SceneError::Format { message, .. } => Self::of(Some("scene"), message),
            other => Self::of(Some("scene"), other),
        }
    }
}

impl From<ProblemError> for Failure {
    fn from(error: ProblemError) -> Self {
        let in_collision = |which: &str, conflict: &Conflict| {
            let touches = match conflict {
                Conflict::Obstacle { obstacle, .. } | Conflict::Low { obstacle, .. } => {
                    Some(obstacle.clone())
                }
                _ => None,
            };
            let what = match conflict {
                Conflict::Obstacle { depth, .. } => {
                    format!("stands {} cm deep in an obstacle", (depth * 100.0).ceil().max(1.0))
                }
                Conflict::Low { .. } => "has a wheel on something low, such as a kerb".to_owned(),
                Conflict::Area => "stands outside the drivable area".to_owned(),
                Conflict::Bounds => "stands outside the bounds of the scene".to_owned(),
                Conflict::Unknown => "touches an obstacle or the bounds of the scene".to_owned(),
            };
            let message = format!("at its {which} the car {what}; move one of them");
            Self { touches, ..Self::of(Some(which), message) }
        };
        match &error {
            ProblemError::StartInCollision(_, conflict) => in_collision("start", conflict),
            ProblemError::GoalInCollision(_, conflict) => in_collision("goal", conflict),
            ProblemError::NoGoalFree(_) => Self::of(Some("goal"), error),
            ProblemError::Margin(_) => Self::of(Some("margin"), error),
            ProblemError::Invalid(invalid) => Self::of(Some(&invalid.field), &error),
            _ => Self::of(Some("scene"), error),
        }
    }
}

/// The answer to a request. It never panics and never fails: what goes wrong is an answer, too.
///
/// Planners are kept from call to call, for each thread its own; no answer depends on what was asked
/// before, but for the time a plan takes.
pub fn answer(request: &str) -> String {
    thread_local! {
        static DESK: RefCell<Desk> = RefCell::default();
    }
    let answered = DESK.with(|desk| {
        // What a panic leaves behind is thrown away.
        let mut own = desk.take();
        let answered = catch_unwind(AssertUnwindSafe(|| {
            let answered = respond(request, &mut own);
            desk.replace(own);
            answered
        }));
        answered.unwrap_or_else(|_| {
            Err(Failure::of(None, "the planner failed on this scene; that is a bug of ours"))
        })
    });
    answered.unwrap_or_else(|failure| json!({ "error": failure })).to_string()
}

fn respond(request: &str, desk: &mut Desk) -> Result<Value, Failure> {
    let wrong =
        |e: serde_json::Error| Failure::of(Some("request"), format!("the request is none: {e}"));
    match serde_json::from_str(request).map_err(wrong)? {
        Request::Catalogue {} => Ok(catalogue()),
        Request::Load(file) => Ok(json!({ "scene": load(&file)? })),
        Request::Plan(planning) => {
            let Planning { scene, methods, wish } = *planning;
            if !(1..=METHODS).contains(&methods.len()) {
                let message = format!("{} methods; expected 1 to {METHODS}", methods.len());
                return Err(Failure::of(Some("methods"), message));
            }
            let scene = Scene::from_json(scene.get(), Path::new("scene"))?;
            let plans = methods.iter().map(|method| plan(&scene, method, &wish, desk));
            Ok(json!({ "plans": plans.collect::<Result<Vec<_>, _>>()? }))
        }
    }
}

/// The scene that a file holds, any map that [`Map`] reads. A map that does not say where the car stands gets a start and a
/// goal about its middle, to be moved.
fn load(file: &Load) -> Result<Scene, Failure> {
    let of = |name: &str, message: &str| Failure::of(Some(name), format!("{name}: {message}"));
    let decoded = |name: &str, bytes: &str| {
        BASE64_STANDARD.decode(bytes).map_err(|_| of(name, "is not whole base64"))
    };
    let mut files = vec![(PathBuf::from(&file.name), decoded(&file.name, &file.bytes)?)];
    for Other { name, bytes } in &file.others {
        files.push((PathBuf::from(name), decoded(name, bytes)?));
    }
    let held = |path: &Path| {
        let found = files.iter().find(|(name, _)| name.file_name() == path.file_name());
        found.map(|(_, bytes)| bytes.clone()).ok_or_else(|| io::ErrorKind::NotFound.into())
    };
    let map = Map::of_files(Path::new(&file.name), &MapOptions::default(), &held)?;
    let vehicle = map.vehicle.or(file.vehicle).unwrap_or_default();
    let [x0, y0, x1, y1] = map.extent().unwrap_or([-10.0, -5.0, 10.0, 5.0]);
    let middle = Pose::new(f64::midpoint(x0, x1), f64::midpoint(y0, y1), 0.0);
    let beside = |lengths: f64| Some(middle.shifted(lengths * vehicle.length));
    let has_goal = !(map.goals.is_empty() && map.spots.is_empty());
    let request = MapRequest {
        start: beside(-1.0).filter(|_| map.start.is_none()),
        goals: beside(1.0).filter(|_| !has_goal).into_iter().collect(),
        vehicle: Some(vehicle),
    };
    Ok(map.scene(&request)?)
}
