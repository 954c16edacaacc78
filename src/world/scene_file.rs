//! The scene format: JSON in, a scene or a message that names the field out.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, error::Category};

use super::goals::GoalTolerance;
use super::scene::{Scene, SceneError};
use super::{DrivableArea, LowObstacles, ParkingType, PreviousPath};
use crate::geometry::Pose;
use crate::vehicle::{Margins, Vehicle};

/// A scene as it is written: with one `goal`, or with `goals`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    #[serde(default)]
    name: String,
    #[serde(default)]
    source: String,
    vehicle: Vehicle,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    contour: Vec<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    margins: Option<Margins>,
    start: Pose,
    #[serde(default, skip_serializing_if = "is_straight")]
    start_steer: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    previous: Option<PreviousPath>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    goal: Option<Pose>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    goals: Option<Vec<Pose>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    goal_tolerance: Option<GoalTolerance>,
    #[serde(default)]
    parking_type: Option<ParkingType>,
    obstacles: Vec<Vec<[f64; 2]>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    points: Vec<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    polylines: Vec<Vec<[f64; 2]>>,
    #[serde(default, skip_serializing_if = "LowObstacles::is_empty")]
    low: LowObstacles,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drivable_area: Option<DrivableArea>,
    #[serde(default)]
    bounds: Option<[f64; 4]>,
}

fn is_straight(steer: &f64) -> bool {
    *steer == 0.0
}

impl TryFrom<SceneFile> for Scene {
    type Error = String;

    fn try_from(file: SceneFile) -> Result<Scene, String> {
        let (goal, goals) = match (file.goal, file.goals) {
            (Some(goal), None) => (goal, Vec::new()),
            (None, Some(goals)) => match goals.first() {
                Some(&first) => (first, goals),
                None => return Err("goals is []; expected at least one pose [x, y, θ]".to_owned()),
            },
            (Some(_), Some(_)) => {
                return Err("has both goal and goals; leave one of them out".to_owned());
            }
            (None, None) => {
                let text = "missing field `goal`; give one pose, or several as goals";
                return Err(text.to_owned());
            }
        };
        let SceneFile { name, source, vehicle, contour, margins, start, goal_tolerance, .. } = file;
        let SceneFile { parking_type, obstacles, polylines, points, .. } = file;
        let SceneFile { start_steer, previous, .. } = file;
        let SceneFile { low, drivable_area, bounds, .. } = file;
        Ok(Scene {
            name,
            source,
            vehicle,
            contour,
            margins,
            start,
            start_steer,
            previous,
            goal,
            goals,
            goal_tolerance,
            parking_type,
            obstacles,
            polylines,
            points,
            low,
            drivable_area,
            bounds,
        })
    }
}

impl From<Scene> for SceneFile {
    fn from(scene: Scene) -> Self {
        let one = scene.goals.is_empty();
        Self {
            name: scene.name,
            source: scene.source,
            vehicle: scene.vehicle,
            contour: scene.contour,
            margins: scene.margins,
            start: scene.start,
            start_steer: scene.start_steer,
            previous: scene.previous,
            goal: one.then_some(scene.goal),
            goals: (!one).then_some(scene.goals),
            goal_tolerance: scene.goal_tolerance,
            parking_type: scene.parking_type,
            obstacles: scene.obstacles,
            points: scene.points,
            polylines: scene.polylines,
            low: scene.low,
            drivable_area: scene.drivable_area,
            bounds: scene.bounds,
        }
    }
}

/// The key whose value a syntax error lies in, as far as the text tells.
fn key_before<'a>(text: &'a str, error: &serde_json::Error) -> Option<&'a str> {
    let before: usize =
        text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
    let head = text.get(..before + error.column().saturating_sub(1))?;
    let head = &head[..head.rfind("\":")?];
    Some(&head[head.rfind('"')? + 1..])
}

pub(super) fn parse_json(text: &str, path: &Path) -> Result<Scene, SceneError> {
    let error = match serde_json::from_str(text) {
        Ok(scene) => return Ok(scene),
        Err(error) => error,
    };
    // The slow way, only for a message that names the field: first the syntax alone,
    // then the shapes, then what serde says.
    let message = match serde_json::from_str::<Value>(text) {
        Err(syntax) => match (word_at(text, &syntax), syntax.classify()) {
            (Some(word), _) => format!(
                "{}{word} at line {} column {} is not a number; every value must be finite",
                key_before(text, &syntax).map_or(String::new(), |key| format!("{key}: ")),
                syntax.line(),
                syntax.column()
            ),
            (None, Category::Eof) => format!("is cut short: {syntax}"),
            (None, _) => format!("is not valid JSON: {syntax}"),
        },
        Ok(value) => match misshapen(&value) {
            Some((field, message)) => {
                return Err(SceneError::Invalid { path: path.to_owned(), field, message });
            }
            None => format!("is not a scene: {error}"),
        },
    };
    Err(SceneError::Format { path: path.to_owned(), message })
}

/// The `NaN` or `Infinity` that a JSON syntax error stopped at.
fn word_at<'a>(text: &'a str, error: &serde_json::Error) -> Option<&'a str> {
    let line = text.lines().nth(error.line().checked_sub(1)?)?;
    let belongs = |c: char| c.is_ascii_alphabetic() || c == '-' || c == '+';
    let mut from = 0;
    line.split(|c| !belongs(c)).find(|word| {
        let range = from..=from + word.len() + 1;
        from += word.len() + 1;
        let name = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
        range.contains(&error.column()) && ["nan", "inf", "infinity"].contains(&name.as_str())
    })
}

/// The first geometric field that is not the numbers it should be.
fn misshapen(scene: &Value) -> Option<(String, String)> {
    let pose = |field: &str| not_numbers(scene.get(field)?, 3, field.to_owned());
    let bounds = scene.get("bounds").filter(|b| !b.is_null());
    pose("start")
        .or_else(|| pose("goal"))
        .or_else(|| match scene.get("goals")? {
            Value::Array(goals) => {
                let mut goals = goals.iter().enumerate();
                goals.find_map(|(i, goal)| not_numbers(goal, 3, format!("goals[{i}]")))
            }
            other => {
                let message = format!("is {}; expected a list of poses [x, y, θ]", brief(other));
                Some(("goals".to_owned(), message))
            }
        })
        .or_else(|| wrong_tolerance(scene.get("goal_tolerance")?))
        .or_else(|| wrong_margins(scene.get("margins")?))
        .or_else(|| wrong_steer(scene.get("start_steer")?))
        .or_else(|| not_numbers(bounds?, 4, "bounds".to_owned()))
        .or_else(|| wrong_lists(scene, "", &["contour", "points", "obstacles", "polylines"]))
        .or_else(|| wrong_lists(scene.get("low")?, "low.", &["points", "obstacles", "polylines"]))
        .or_else(|| wrong_lists(scene.get("drivable_area")?, "drivable_area.", &["outer", "holes"]))
}

/// The first of these lists of an object that is not points, or lists of points.
fn wrong_lists(object: &Value, prefix: &str, names: &[&str]) -> Option<(String, String)> {
    let vertices = |field: String, list: &Value| {
        let Some(vertices) = list.as_array() else {
            return Some((field, format!("is {}; expected a list of [x, y]", brief(list))));
        };
        let each = |(j, v)| not_numbers(v, 2, format!("{field}[{j}]"));
        vertices.iter().enumerate().find_map(each)
    };
    if !object.is_object() {
        let field = prefix.trim_end_matches('.').to_owned();
        let expected = names.join(", ");
        let message = format!("is {}; expected an object of {expected}", brief(object));
        let is_told = !object.is_null() && !prefix.is_empty();
        return is_told.then_some((field, message));
    }
    names.iter().find_map(|&name| {
        let (field, list) = (format!("{prefix}{name}"), object.get(name)?);
        if ["contour", "points", "outer"].contains(&name) {
            return vertices(field, list);
        }
        let Some(lists) = list.as_array() else {
            return Some((field, format!("is {}; expected a list", brief(list))));
        };
        lists.iter().enumerate().find_map(|(i, list)| vertices(format!("{field}[{i}]"), list))
    })
}

/// What is wrong with an object that is not these numbers; `shape` is what it should look like.
fn wrong_numbers(
    name: &str,
    value: &Value,
    fields: &[&str],
    shape: &str,
) -> Option<(String, String)> {
    let Some(given) = value.as_object() else {
        let wrong = format!("is {}; expected {shape}", brief(value));
        return (!value.is_null()).then_some((name.to_owned(), wrong));
    };
    given.iter().find_map(|(field, value)| {
        let message = match (fields.contains(&field.as_str()), value.is_number()) {
            (true, true) => return None,
            (true, false) => format!("is {}; expected a finite number", brief(value)),
            (false, _) => format!("is unknown; expected {}", fields.join(" and ")),
        };
        Some((format!("{name}.{field}"), message))
    })
}

/// What is wrong with a goal tolerance that is not two numbers.
fn wrong_tolerance(value: &Value) -> Option<(String, String)> {
    let shape = r#"{"position_m": metres, "heading_rad": radians}"#;
    wrong_numbers("goal_tolerance", value, &["position_m", "heading_rad"], shape)
}

/// What is wrong with margins that are not up to five numbers.
fn wrong_margins(value: &Value) -> Option<(String, String)> {
    let shape =
        r#"{"front": metres, "rear": metres, "left": metres, "right": metres, "mirrors": metres}"#;
    wrong_numbers("margins", value, &Margins::NAMES, shape)
}

/// What is wrong with an angle of the wheels that is no number.
fn wrong_steer(value: &Value) -> Option<(String, String)> {
    let wrong = || ("start_steer".to_owned(), format!("is {}; expected a number", brief(value)));
    (!value.is_number()).then(wrong)
}

/// What is wrong with `value`, where `count` numbers are expected.
fn not_numbers(value: &Value, count: usize, field: String) -> Option<(String, String)> {
    let numbers = value.as_array().is_some_and(|v| v.iter().all(Value::is_number));
    let length = value.as_array().map_or(0, Vec::len);
    if numbers && length == count {
        return None;
    }
    Some((field, format!("is {}; expected {count} finite numbers", brief(value))))
}

/// The value as JSON, cut to a readable length.
fn brief(value: &Value) -> String {
    let json = value.to_string();
    match json.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &json[..end]),
        None => json,
    }
}
