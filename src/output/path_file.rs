//! Path files: a plan as plain numbers in the scene's own frame.
//!
//! `SCENE.METHOD.json` holds `{"poses": [[x, y, θ], …], "gears": [1 | -1, …],
//! "steer": [rad, …], "method": …}`: three arrays of one length. Gear and steering
//! angle belong to the motion that *follows* a pose; the last pose repeats those of the
//! motion that led there.

use std::path::{Path as FilePath, PathBuf};

use serde::{Deserialize, Serialize};

use crate::curves::{Clothoid, Path, SmoothPath};
use crate::files::{reason, write_whole};
use crate::geometry::{Frame, Pose, Vec2, signed_angle};
use crate::vehicle::Vehicle;
use crate::world::Scene;
use crate::world::maps::Geographic;

/// A planned path, as exported.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathFile {
    /// Rear-axle poses `[x, y, θ]` in the scene's frame, metres and radians.
    pub poses: Vec<[f64; 3]>,
    /// +1 forward, −1 backward.
    pub gears: Vec<i8>,
    /// Angle of the front wheels, radians, positive to the left: where it changes on the way to the next
    /// pose, that of the mean curvature.
    pub steer: Vec<f64>,
    /// Where the steering is continuous: the angle at each pose, of the motion that follows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steer_from: Option<Vec<f64>>,
    /// And the angle with which that motion ends; in between the curvature changes steadily.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steer_to: Option<Vec<f64>>,
    /// The method that planned it.
    pub method: String,
}

/// A path file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PathFileError {
    /// Reading or writing failed.
    #[error("{path}: {}", reason(error))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: std::io::Error,
    },
    /// The contents are not a path.
    #[error("{path}: {message}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong and what would be right.
        message: String,
    },
}

impl PathFile {
    /// Distance between exported poses, metres; at most.
    pub const STEP: f64 = 0.05;
    /// Ends this near to the scene's own (metres and radians) are written as those.
    const SNAP: f64 = 1e-6;

    /// The export of `path`, planned in `frame` for `scene`.
    pub fn new(scene: &Scene, frame: &Frame, path: &Path, method: &str) -> Self {
        Self::of_smooth(scene, frame, &SmoothPath::of(path), method)
    }

    /// The same of a path on which the curvature may change steadily.
    pub fn of_smooth(scene: &Scene, frame: &Frame, path: &SmoothPath, method: &str) -> Self {
        Self::between([scene.start, scene.goal], &scene.vehicle, frame, path, method)
    }

    /// The export of `path`, planned in `frame`, from a start to a goal in the world.
    pub fn between(
        [start, goal]: [Pose; 2],
        vehicle: &Vehicle,
        frame: &Frame,
        path: &SmoothPath,
        method: &str,
    ) -> Self {
        let near = Near::new(start, frame);
        let mut samples = path.to_world(&near.frame).sample(Self::STEP);
        samples.iter_mut().for_each(|s| s.pose = near.to_world(s.pose));
        if let Some(first) = samples.first_mut() {
            first.pose = snap(first.pose, start);
        }
        if let Some(last) = samples.last_mut() {
            last.pose = snap(last.pose, goal);
        }
        let steer = |curvature: fn(&Clothoid) -> f64| {
            samples.iter().map(|s| vehicle.steer(curvature(&s.motion))).collect::<Vec<f64>>()
        };
        let changes = !path.is_arcs();
        Self {
            poses: samples.iter().map(|s| s.pose.into()).collect(),
            gears: samples.iter().map(|s| s.gear.sign() as i8).collect(),
            steer: steer(|m| f64::midpoint(m.from, m.to)),
            steer_from: changes.then(|| steer(|m| m.from)),
            steer_to: changes.then(|| steer(|m| m.to)),
            method: method.to_owned(),
        }
    }

    /// `SCENE.METHOD.json`.
    pub fn file_name(scene: &Scene, method: &str) -> String {
        format!("{}.{method}.json", scene.file_stem())
    }

    /// Reads a path file and checks that its arrays fit together.
    pub fn read(file: &FilePath) -> Result<Self, PathFileError> {
        let text = std::fs::read_to_string(file)
            .map_err(|error| PathFileError::Io { path: file.to_owned(), error })?;
        Self::from_json(&text, file)
    }

    /// The path of such a text, its arrays checked. `origin` is where the text comes from, for messages.
    pub fn from_json(text: &str, origin: &FilePath) -> Result<Self, PathFileError> {
        let format = |message| PathFileError::Format { path: origin.to_owned(), message };
        let path: Self = serde_json::from_str(text).map_err(|e| {
            format(format!("not a path file: {e}; expected poses, gears, steer and method"))
        })?;
        let (poses, gears, steer) = (path.poses.len(), path.gears.len(), path.steer.len());
        if poses == 0 || poses != gears || poses != steer {
            return Err(format(format!(
                "{poses} poses, {gears} gears, {steer} steer; expected equal numbers, at least 1"
            )));
        }
        let counts = [&path.steer_from, &path.steer_to].map(|a| a.as_ref().map(Vec::len));
        if counts != [None; 2] && counts != [Some(poses); 2] {
            let text = "steer_from and steer_to: expected both or none, as many numbers as poses";
            return Err(format(text.to_owned()));
        }
        Ok(path)
    }

    /// The text of the file, every number exactly as it is.
    #[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("plain numbers and strings")
    }

    /// The path as a table: a line of names with units, and one for each pose.
    pub fn to_csv(&self) -> String {
        let changes = self.steer_from.as_ref().zip(self.steer_to.as_ref());
        let more = if changes.is_some() { ",steer_from_rad,steer_to_rad" } else { "" };
        let mut text = format!("x_m,y_m,heading_rad,gear,steer_rad{more}\n");
        for (i, [x, y, heading]) in self.poses.iter().enumerate() {
            let more = changes.map(|(from, to)| format!(",{},{}", from[i], to[i]));
            let (gear, steer, more) = (self.gears[i], self.steer[i], more.unwrap_or_default());
            text += &format!("{x},{y},{heading},{gear},{steer}{more}\n");
        }
        text
    }

    /// Writes a table where the name ends in `.csv`, lines on a map where it ends in `.geojson` (`on_earth` is
    /// where the scene's frame lies), else JSON.
    pub fn write_as(
        &self,
        file: &FilePath,
        on_earth: Option<Geographic>,
    ) -> Result<(), PathFileError> {
        let text = match (has_ending(file, "csv"), has_ending(file, "geojson")) {
            (true, _) => self.to_csv(),
            (_, true) => self.to_geojson(on_earth),
            _ => self.to_json(),
        };
        let error = |error| PathFileError::Io { path: file.to_owned(), error };
        write_whole(file, text.as_bytes()).map_err(error)
    }

    /// Writes the file (to a temporary name, then renamed).
    pub fn write(&self, file: &FilePath) -> Result<(), PathFileError> {
        let json = self.to_json();
        write_whole(file, json.as_bytes())
            .map_err(|error| PathFileError::Io { path: file.to_owned(), error })
    }
}

/// Whether a file's name ends so.
pub(super) fn has_ending(file: &FilePath, ending: &str) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// `exact`, where `pose` is as near as rounding leaves it; else `pose`.
pub(super) fn snap(pose: Pose, exact: Pose) -> Pose {
    let turn = signed_angle(pose.heading, exact.heading).abs();
    // Far from the origin frame and pose are both rounded to what coordinates resolve there.
    let near = PathFile::SNAP + 4.0 * exact.resolution();
    if pose.distance(exact) <= near && turn <= PathFile::SNAP { exact } else { pose }
}

/// Where paths are driven before they are put into the world: the world itself, and around the
/// start of scenes so far away that rounding, pose after pose, would add up to what can be seen.
pub(super) struct Near {
    origin: Vec2,
    /// The planning frame, seen from here.
    pub frame: Frame,
}

impl Near {
    /// Farther than this from the origin is far, metres: up to here coordinates resolve 2 nm.
    const FAR: f64 = 1e7;

    pub fn new(start: Pose, frame: &Frame) -> Self {
        let start = start.position();
        let origin = if start.amax() > Self::FAR { start } else { Vec2::zeros() };
        let Frame { origin_in_world: o, mirrored } = *frame;
        let origin_in_world = Pose::new(o.x - origin.x, o.y - origin.y, o.heading);
        Self { origin, frame: Frame { origin_in_world, mirrored } }
    }

    pub fn to_world(&self, pose: Pose) -> Pose {
        Pose::new(pose.x + self.origin.x, pose.y + self.origin.y, pose.heading)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::curves::Segment;

    /// A plan forward to the left and back, in a mirrored frame far from the origin, and its scene.
    pub fn far_and_mirrored() -> (Scene, Frame, Path) {
        let frame = Frame { origin_in_world: Pose::new(5e5, -3e5, 2.0), mirrored: true };
        let path = Path::new(
            Pose::new(3.0, 4.0, 0.2),
            [(0.2, 3.0), (0.0, -2.0)].map(|(curvature, length)| Segment { curvature, length }),
        );
        let mut start = frame.world_from_local(path.start);
        start.heading += std::f64::consts::TAU;
        let scene = Scene {
            name: "s".into(),
            vehicle: Vehicle::default(),
            start,
            goal: frame.world_from_local(path.end()),
            ..Scene::default()
        };
        (scene, frame, path)
    }

    #[test]
    fn ends_are_the_scenes_own_numbers() {
        let (scene, frame, path) = far_and_mirrored();
        let file = PathFile::new(&scene, &frame, &path, "ha-rs");
        assert_eq!(file.poses[0], <[f64; 3]>::from(scene.start));
        assert_eq!(*file.poses.last().unwrap(), <[f64; 3]>::from(scene.goal));
        assert_eq!(file.poses.len(), 60 + 40 + 1);
        assert!(file.steer[0] < 0.0, "a mirrored left turn is a right turn");
        assert_eq!((file.gears[0], file.gears[100]), (1, -1));
        let dir = tempfile::tempdir().unwrap();
        let name = dir.path().join(PathFile::file_name(&scene, "ha-rs"));
        file.write(&name).unwrap();
        assert_eq!(PathFile::read(&name).unwrap(), file);
    }
}
