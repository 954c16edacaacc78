//! A scene: what a user gives a planner. Read from JSON or TPCAP CSV, or generated.
//!
//! A scene keeps its own (world) frame and the exact numbers of its file. What
//! [`Scene::read`] returns has passed [`Scene::validate`]; whether start and goal are
//! free of obstacles is asked later, by [`Problem`](crate::planners::Problem).
//! The raw benchmark format is in [`tpcap`], the generator in `generate`.

use std::collections::HashSet;
use std::f64::consts::TAU;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::goals::GoalTolerance;
use super::scene_file::{SceneFile, parse_json};
use super::{DrivableArea, LowObstacles, ParkingType, PreviousPath, tpcap};
use crate::files::{reason, write_whole};
use crate::geometry::Pose;
use crate::vehicle::{Margins, Vehicle};

/// A parking scene in its own (world) frame; metres and radians.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SceneFile", into = "SceneFile")]
pub struct Scene {
    /// Name, used in rows and file names.
    pub name: String,
    /// Where it comes from, for people.
    pub source: String,
    /// The car.
    pub vehicle: Vehicle,
    /// The car's outline from above, a simple polygon in its own frame within the rectangle of its sizes, where it
    /// does not take up all of that: chamfered corners, mirrors. None: empty.
    pub contour: Vec<[f64; 2]>,
    /// Clearance to keep on each side of the car, metres, beyond what planning keeps anyway.
    pub margins: Option<Margins>,
    /// Rear-axle pose to start from.
    pub start: Pose,
    /// Angle of the front wheels at the start, radians.
    pub start_steer: f64,
    /// The path that the car follows already, if there is one.
    pub previous: Option<PreviousPath>,
    /// Rear-axle pose to park at; of several [`Scene::goals`] the first.
    pub goal: Pose,
    /// Where there is a choice: the poses to park at, of which any will do. Empty where `goal` is
    /// the only one; see [`Scene::all_goals`].
    pub goals: Vec<Pose>,
    /// How far from its goal a path may end; exactly there where it is `None`.
    pub goal_tolerance: Option<GoalTolerance>,
    /// A hint of how the goal lies in its spot.
    pub parking_type: Option<ParkingType>,
    /// Simple polygons, closed implicitly; two vertices are a wall without thickness.
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// Walls without thickness, one after the other: chains of two or more vertices, not closed.
    pub polylines: Vec<Vec<[f64; 2]>>,
    /// Obstacle points, as a range sensor sees them (an extension of the format).
    pub points: Vec<[f64; 2]>,
    /// What only wheels must keep off.
    pub low: LowObstacles,
    /// Where the car's body must stay, if that is limited.
    pub drivable_area: Option<DrivableArea>,
    /// The rear axle stays in `[xmin, ymin, xmax, ymax]`.
    pub bounds: Option<[f64; 4]>,
}

/// A scene that cannot be used, and why.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file or folder cannot be read.
    #[error("{path}: cannot read it: {}", reason(error))]
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

    /// The most [`Scene::goals`]: each may take a search of its own.
    pub const MAX_GOALS: usize = 256;

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
            log::warn!("{}: {warning}", path.display());
        }
        Ok(scene)
    }

    /// The scene of a text in the scene format, validated. `origin` is where the text comes from,
    /// for messages.
    pub fn from_json(text: &str, origin: &Path) -> Result<Scene, SceneError> {
        let scene = parse_json(text, origin)?;
        scene.validate(origin)?;
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
        paths.sort_unstable();
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
        self.check_contour()?;
        let most = self.vehicle.max_steer;
        if self.start_steer.is_nan() || self.start_steer.abs() > most + 1e-9 {
            let message =
                format!("is {}; expected an angle within ±max_steer, {most} rad", self.start_steer);
            return invalid("start_steer".to_owned(), message);
        }
        self.previous.as_ref().map_or(Ok(()), PreviousPath::check)?;
        if self.goals.len() > Self::MAX_GOALS {
            let (given, most) = (self.goals.len(), Self::MAX_GOALS);
            let message = format!("has {given} poses; expected at most {most}");
            return invalid("goals".to_owned(), message);
        }
        for (which, pose) in self.poses() {
            let heading = match pose.heading.abs() {
                h if h <= Self::MAX_HEADING => None,
                h if h.is_finite() => Some("has too large a heading; expected at most 1e7 rad"),
                _ => Some("is not finite; every value must be a finite number"),
            };
            // Their distance has a limit of its own, below.
            if let Some(message) = fault(&[pose.x, pose.y], f64::INFINITY).or(heading) {
                let values = <[f64; 3]>::from(pose);
                return invalid(self.pose_field(which), format!("= {values:?} {message}"));
            }
        }
        for (which, goal) in self.poses().skip(1) {
            let distance = self.start.distance(goal);
            if distance > Self::MAX_DISTANCE {
                let field = self.pose_field(which);
                let what = if field == "goal" { "the goal" } else { &field };
                let most = Self::MAX_DISTANCE;
                let message =
                    format!("lies {distance:.0} m from {what}; expected at most {most} m");
                return invalid("start".to_owned(), message);
            }
        }
        if self.goals.first().is_some_and(|&first| first != self.goal) {
            let message = "does not begin with the scene's goal; expected that first".to_owned();
            return invalid("goals".to_owned(), message);
        }
        if let Some(tolerance) = self.goal_tolerance {
            tolerance.validate()?;
        }
        self.check_outlines(numbers)?;
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

    /// Start and goals; the start is `None`, a goal its index.
    fn poses(&self) -> impl Iterator<Item = (Option<usize>, Pose)> + '_ {
        let goals = self.all_goals().iter().enumerate().map(|(i, &goal)| (Some(i), goal));
        std::iter::once((None, self.start)).chain(goals)
    }

    /// The field of one of these poses.
    fn pose_field(&self, which: Option<usize>) -> String {
        which.map_or_else(|| "start".to_owned(), |goal| self.goal_field(goal))
    }

    /// A warning where headings look like degrees: no scene needs whole turns, and no heading in
    /// radians is a whole or half number by chance.
    pub(super) fn degrees(&self) -> Option<String> {
        let is_suspect = |h: f64| {
            let halves = 2.0 * h;
            h.abs() > TAU * 1.0001 && (halves - halves.round()).abs() < 1e-6
        };
        let suspects = self.poses().filter(|(_, pose)| is_suspect(pose.heading));
        let told: Vec<String> = suspects
            .map(|(which, pose)| format!("{} is {}", self.pose_field(which), pose.heading))
            .collect();
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
