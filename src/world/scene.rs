//! A scene: what a user gives a planner. Read from JSON or TPCAP CSV, or generated.
//!
//! A scene keeps its own (world) frame and the exact numbers of its file. What
//! [`Scene::read`] returns has passed [`Scene::validate`]; whether start and goal are
//! free of obstacles is asked later, by [`Problem`](crate::planners::Problem).
//! The raw benchmark format is in [`tpcap`], the generator in [`generate`](super::generate).

use std::collections::HashSet;
use std::f64::consts::TAU;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, error::Category};

use super::{ObstacleError, Obstacles, ParkingType, tpcap};
use crate::files::{reason, write_whole};
use crate::geometry::{Polygon, Polyline, Pose, Vec2};
use crate::vehicle::Vehicle;

/// A parking scene in its own (world) frame; metres and radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name, used in rows and file names.
    #[serde(default)]
    pub name: String,
    /// Where it comes from, for people.
    #[serde(default)]
    pub source: String,
    /// The car.
    pub vehicle: Vehicle,
    /// Rear-axle pose to start from.
    pub start: Pose,
    /// Rear-axle pose to park at.
    pub goal: Pose,
    /// A hint of how the goal lies in its spot.
    #[serde(default)]
    pub parking_type: Option<ParkingType>,
    /// Simple polygons, closed implicitly; two vertices are a wall without thickness.
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// Obstacle points, as a range sensor sees them (an extension of the format).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// The rear axle stays in `[xmin, ymin, xmax, ymax]`.
    #[serde(default)]
    pub bounds: Option<[f64; 4]>,
}

/// A scene that cannot be used, and why.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file or folder cannot be read.
    #[error("{path}: cannot read scene: {}", reason(error))]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
    /// The file cannot be written.
    #[error("{path}: cannot write scene: {}", reason(error))]
    Write {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
    /// The file is not the format it should be.
    #[error("{path}: {message}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong and what would be right.
        message: String,
    },
    /// A field has a value that no scene can have.
    #[error("{path}: {field} {message}")]
    Invalid {
        /// The file (or the scene's name).
        path: PathBuf,
        /// The field.
        field: String,
        /// What is wrong and what would be right; continues a sentence that begins
        /// with the field.
        message: String,
    },
}

/// A scene file, with its scene or why it holds none.
pub type FileScene = (PathBuf, Result<Scene, SceneError>);

/// A field with a value that no scene can have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} {message}")]
pub struct InvalidField {
    /// The field.
    pub field: String,
    /// What is wrong and what would be right; continues a sentence that begins with the field.
    pub message: String,
}

impl Scene {
    /// Largest |coordinate| of a scene, metres: 2³⁹, up to which `f64` resolves a tenth of a
    /// millimetre.
    pub const MAX_COORDINATE: f64 = (1_u64 << 39) as f64;

    /// How far obstacles and bounds may lie from the start along each axis, metres: beyond it
    /// `f64` no longer resolves what the collision check relies on.
    pub const MAX_REACH: f64 = 1e7;

    /// Largest |heading|, radians: beyond it `f64` no longer resolves angles to a few nanoradians.
    const MAX_HEADING: f64 = 1e7;

    /// Largest straight distance between start and goal, metres: paths are sampled and
    /// checked every few centimetres.
    pub const MAX_DISTANCE: f64 = 1e4;

    /// Longest name as part of a file name, bytes: leaves room for `.METHOD.json`.
    pub const MAX_NAME: usize = 200;

    /// Reads one scene from `.json` (the scene format) or `.csv` (TPCAP) and validates it.
    /// A scene without a name gets its file's.
    pub fn read(path: &Path) -> Result<Scene, SceneError> {
        let format = |message: String| SceneError::Format { path: path.to_owned(), message };
        let Some(kind) = FileKind::of(path) else {
            return Err(format("not a scene file; expected .json or a TPCAP .csv".to_owned()));
        };
        let bytes =
            fs::read(path).map_err(|error| SceneError::Read { path: path.to_owned(), error })?;
        let text = String::from_utf8(bytes)
            .map_err(|_| format("is not text (UTF-8); expected a scene file".to_owned()))?;
        let text = text.trim_start_matches('\u{feff}');
        if text.trim().is_empty() {
            return Err(format("is empty; expected one scene".to_owned()));
        }
        let mut scene = match kind {
            FileKind::Json => parse_json(text, path)?,
            FileKind::Tpcap => tpcap::parse(text, path)?,
        };
        if scene.name.is_empty() {
            scene.name = stem(path);
        }
        scene.validate(path)?;
        if let Some(warning) = scene.degrees() {
            tracing::warn!("{}: {warning}", path.display());
        }
        Ok(scene)
    }

    /// Reads every `.json` and `.csv` file of a folder, in the order of their names.
    /// A scene whose name another one has already is called after its file instead, so
    /// that names are unique. Fails with the first file that is no scene.
    pub fn read_dir(dir: &Path) -> Result<Vec<Scene>, SceneError> {
        Self::read_each(dir)?.into_iter().map(|(_, scene)| scene).collect()
    }

    /// As [`Scene::read_dir`], but every file is read: each with its scene, or why it holds none.
    pub fn read_each(dir: &Path) -> Result<Vec<FileScene>, SceneError> {
        let read = |error| SceneError::Read { path: dir.to_owned(), error };
        let mut paths = Vec::new();
        for entry in fs::read_dir(dir).map_err(read)? {
            let path = entry.map_err(read)?.path();
            if FileKind::of(&path).is_some() && path.is_file() {
                paths.push(path);
            }
        }
        if paths.is_empty() {
            return Err(SceneError::Format {
                path: dir.to_owned(),
                message: "holds no scene; expected .json or TPCAP .csv files".to_owned(),
            });
        }
        paths.sort();
        let mut taken = HashSet::new();
        let mut scenes = Vec::with_capacity(paths.len());
        for path in paths {
            let mut scene = Scene::read(&path);
            if let Ok(scene) = &mut scene {
                if taken.contains(&scene.name) {
                    scene.name = stem(&path);
                }
                if taken.contains(&scene.name) {
                    scene.name =
                        path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                }
                taken.insert(scene.name.clone());
            }
            scenes.push((path, scene));
        }
        Ok(scenes)
    }

    /// Writes the scene as JSON, every number exactly as it is. The file appears whole
    /// or not at all.
    pub fn write(&self, path: &Path) -> Result<(), SceneError> {
        self.validate(path)?;
        let error = |error| SceneError::Write { path: path.to_owned(), error };
        let json = serde_json::to_string(self).map_err(|e| error(e.into()))?;
        write_whole(path, (json + "\n").as_bytes()).map_err(error)
    }

    /// Checks the name and every number. `path` is where the scene comes from, for the message.
    pub fn validate(&self, path: &Path) -> Result<(), SceneError> {
        self.check_name().and_then(|()| self.check_numbers()).map_err(|e| SceneError::Invalid {
            path: path.to_owned(),
            field: e.field,
            message: e.message,
        })
    }

    /// Checks that the name can be part of a file's name.
    fn check_name(&self) -> Result<(), InvalidField> {
        let invalid = |message| Err(InvalidField { field: "name".to_owned(), message });
        if let Some(c) = self.name.chars().find(|c| c.is_control()) {
            return invalid(format!("holds the control character {c:?}; expected plain text"));
        }
        let length = self.file_stem().len();
        if length > Self::MAX_NAME {
            let most = Self::MAX_NAME;
            return invalid(format!(
                "needs {length} bytes in a file name; expected at most {most}"
            ));
        }
        Ok(())
    }

    /// Checks every number: what planners need to be true.
    pub(crate) fn check_numbers(&self) -> Result<(), InvalidField> {
        let invalid = |field: String, message: String| Err(InvalidField { field, message });
        let Pose { x, y, .. } = self.start;
        // What is wrong with coordinates, in turn x and y, that may lie `reach` from the start.
        let fault = |values: &[f64], reach: f64| {
            let is_far = |(i, v): (usize, &f64)| (v - [x, y][i % 2]).abs() > reach;
            if !values.iter().all(|v| v.is_finite()) {
                Some("is not finite; every value must be a finite number")
            } else if values.iter().any(|v| v.abs() > Self::MAX_COORDINATE) {
                Some(
                    "is too large: a number no longer tells tenths of a millimetre there; \
                     coordinates must lie within ±5.4e11 (subtract the map's offset)",
                )
            } else if values.iter().enumerate().any(is_far) {
                Some("is too far from the start; expected at most 1e7 m along each axis")
            } else {
                None
            }
        };
        let numbers =
            |field: &dyn Fn() -> String, values: &[f64]| match fault(values, Self::MAX_REACH) {
                Some(message) => invalid(field(), format!("= {values:?} {message}")),
                None => Ok(()),
            };
        if let Err(e) = self.vehicle.validate() {
            let message = format!("is {}; it must be {}", e.value, e.expected);
            return invalid(format!("vehicle.{}", e.field), message);
        }
        let poses = [("start", self.start), ("goal", self.goal)];
        for (field, pose) in poses {
            let heading = match pose.heading.abs() {
                h if h <= Self::MAX_HEADING => None,
                h if h.is_finite() => Some("has too large a heading; expected at most 1e7 rad"),
                _ => Some("is not finite; every value must be a finite number"),
            };
            // Their distance has a limit of its own, below.
            if let Some(message) = fault(&[pose.x, pose.y], f64::INFINITY).or(heading) {
                let values = <[f64; 3]>::from(pose);
                return invalid(field.to_owned(), format!("= {values:?} {message}"));
            }
        }
        let distance = self.start.distance(self.goal);
        if distance > Self::MAX_DISTANCE {
            let message = format!(
                "lies {distance:.0} m from the goal; expected at most {} m",
                Self::MAX_DISTANCE
            );
            return invalid("start".to_owned(), message);
        }
        for (i, polygon) in self.obstacles.iter().enumerate() {
            for (j, vertex) in polygon.iter().enumerate() {
                numbers(&|| format!("obstacles[{i}][{j}]"), vertex)?;
            }
            if polygon.len() < 2 {
                let vertices = if polygon.is_empty() { "no vertices" } else { "1 vertex" };
                return invalid(
                    format!("obstacles[{i}]"),
                    format!(
                        "has {vertices}; a polygon needs at least 3, a wall 2 (or use \"points\")"
                    ),
                );
            }
        }
        for (i, point) in self.points.iter().enumerate() {
            numbers(&|| format!("points[{i}]"), point)?;
        }
        if let Some(b) = self.bounds {
            numbers(&|| "bounds".to_owned(), &b)?;
            if b[0] >= b[2] || b[1] >= b[3] {
                return invalid(
                    "bounds".to_owned(),
                    format!(
                        "= {b:?}; expected [xmin, ymin, xmax, ymax] with each min below its max"
                    ),
                );
            }
        }
        Ok(())
    }

    /// A warning where headings look like degrees: no scene needs whole turns, and no heading in
    /// radians is a whole or half number by chance.
    fn degrees(&self) -> Option<String> {
        let poses = [("start", self.start.heading), ("goal", self.goal.heading)];
        let is_suspect = |h: f64| {
            let halves = 2.0 * h;
            h.abs() > TAU * 1.0001 && (halves - halves.round()).abs() < 1e-6
        };
        let suspects = poses.iter().filter(|(_, h)| is_suspect(*h));
        let told: Vec<String> = suspects.map(|(field, h)| format!("{field} is {h}")).collect();
        let what = told.join(", that of ");
        (!told.is_empty()).then(|| {
            format!("the heading of {what}; headings are taken as radians (90° is 1.5708)")
        })
    }

    /// The name as part of a file name, where no two names meet: what does not belong there
    /// is written as `%` and the hexadecimal digits of its bytes.
    pub fn file_stem(&self) -> String {
        let mut stem = String::new();
        for c in self.name.chars() {
            let hidden = c == '.' && stem.is_empty();
            if (c.is_alphanumeric() || "-_.@+ ".contains(c)) && !hidden {
                stem.push(c);
            } else {
                let mut buffer = [0; 4];
                stem.extend(c.encode_utf8(&mut buffer).bytes().map(|b| format!("%{b:02X}")));
            }
        }
        stem
    }

    /// What each obstacle looks like, for drawing: its corners, or the single point.
    pub fn outlines(&self) -> impl Iterator<Item = Vec<Vec2>> + '_ {
        let points = self.points.iter().map(std::slice::from_ref);
        let outlines = self.obstacles.iter().map(Vec::as_slice).chain(points);
        outlines.map(|o| o.iter().map(|&[x, y]| Vec2::new(x, y)).collect())
    }

    /// The obstacles as geometry, in the scene's frame.
    pub fn geometry(&self) -> Result<Obstacles, ObstacleError> {
        self.geometry_by(|v| v)
    }

    /// [`Scene::geometry`] with every point mapped by `map`.
    pub fn geometry_by(&self, map: impl Fn(Vec2) -> Vec2) -> Result<Obstacles, ObstacleError> {
        let vec = |&[x, y]: &[f64; 2]| map(Vec2::new(x, y));
        let mut polygons = Vec::with_capacity(self.obstacles.len());
        let mut walls = Vec::new();
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let vertices: Vec<Vec2> = obstacle.iter().map(&vec).collect();
            let added = match vertices.len() {
                2 => Polyline::new(vertices).map(|wall| walls.push(wall)),
                _ => Polygon::new(vertices).map(|polygon| polygons.push(polygon)),
            };
            added.map_err(|fault| ObstacleError::Shape { kind: "polygon", index, fault })?;
        }
        Obstacles::new(polygons, walls, self.points.iter().map(vec).collect())
    }
}

/// What a scene file holds, by its extension.
#[derive(Clone, Copy)]
enum FileKind {
    Json,
    Tpcap,
}

impl FileKind {
    fn of(path: &Path) -> Option<FileKind> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "json" => Some(FileKind::Json),
            "csv" => Some(FileKind::Tpcap),
            _ => None,
        }
    }
}

/// The file's name without folder and extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The key whose value a syntax error lies in, as far as the text tells.
fn key_before<'a>(text: &'a str, error: &serde_json::Error) -> Option<&'a str> {
    let before: usize =
        text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
    let head = text.get(..before + error.column().saturating_sub(1))?;
    let head = &head[..head.rfind("\":")?];
    Some(&head[head.rfind('"')? + 1..])
}

fn parse_json(text: &str, path: &Path) -> Result<Scene, SceneError> {
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
    let list = |field: &str| {
        let items = scene.get(field).and_then(Value::as_array);
        items.into_iter().flatten().enumerate()
    };
    let pose = |field: &str| not_numbers(scene.get(field)?, 3, field.to_owned());
    let bounds = scene.get("bounds").filter(|b| !b.is_null());
    pose("start")
        .or_else(|| pose("goal"))
        .or_else(|| not_numbers(bounds?, 4, "bounds".to_owned()))
        .or_else(|| {
            list("points").find_map(|(i, point)| not_numbers(point, 2, format!("points[{i}]")))
        })
        .or_else(|| {
            list("obstacles").find_map(|(i, polygon)| {
                let Some(vertices) = polygon.as_array() else {
                    let message = format!("is {}; expected a list of [x, y]", brief(polygon));
                    return Some((format!("obstacles[{i}]"), message));
                };
                let field = |j| format!("obstacles[{i}][{j}]");
                vertices.iter().enumerate().find_map(|(j, v)| not_numbers(v, 2, field(j)))
            })
        })
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
