//! Trajectory files: a plan in time, as numbers for a controller.
//!
//! `.csv` holds the columns alone; `.json` holds them as arrays, and beside them the vehicle, the
//! limits and what the trajectory asks of the car. Poses are in the scene's own frame. The format
//! is described in `docs/formats.md`.

use std::io;
use std::path::{Path as FilePath, PathBuf};

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::path_file::{Near, has_ending, snap};
use super::recording;
use crate::curves::trajectory::{LimitError, Moment, TrajectoryReport};
use crate::curves::{SmoothPath, Trajectory, TrajectoryLimits};
use crate::files::write_whole;
use crate::geometry::{Frame, Pose};
use crate::vehicle::Vehicle;
use crate::world::Scene;
use crate::world::maps::Geographic;

/// A planned trajectory, as exported.
#[derive(Clone, Debug, Serialize)]
pub struct TrajectoryFile {
    /// Name of the scene.
    pub scene: String,
    /// The method that planned the path.
    pub method: String,
    /// The car, with its speeds.
    pub vehicle: Vehicle,
    /// The limits kept.
    pub limits: TrajectoryLimits,
    /// Extremes and steering jumps.
    pub report: TrajectoryReport,
    /// The samples, in the scene's frame.
    #[serde(rename = "columns", serialize_with = "columns")]
    pub moments: Vec<Moment>,
}

/// A path in time, in the world's frame.
#[derive(Clone, Debug)]
pub struct Driven {
    /// Extremes and steering jumps.
    pub report: TrajectoryReport,
    /// Samples [`Driven::STEP`] apart, and the end.
    pub moments: Vec<Moment>,
}

impl Driven {
    /// Time between samples, seconds.
    pub const STEP: f64 = 0.05;

    /// `path`, planned in `frame` from a start to a goal in the world, driven within `limits`.
    pub fn new(
        [start, goal]: [Pose; 2],
        vehicle: &Vehicle,
        frame: &Frame,
        path: &SmoothPath,
        limits: &TrajectoryLimits,
    ) -> Result<Self, LimitError> {
        let near = Near::new(start, frame);
        let trajectory = Trajectory::new(&path.to_world(&near.frame), vehicle, limits)?;
        let mut moments = trajectory.sample(Self::STEP);
        moments.iter_mut().for_each(|m| m.pose = near.to_world(m.pose));
        // The wheels turn at the start before the car moves: several samples are there.
        for moment in moments.iter_mut().take_while(|m| m.distance == 0.0) {
            moment.pose = snap(moment.pose, start);
        }
        if let Some(last) = moments.last_mut() {
            last.pose = snap(last.pose, goal);
        }
        Ok(Self { report: trajectory.report(), moments })
    }
}

/// Name and value of each column, with the unit in the name.
type Column = (&'static str, fn(&Moment) -> Value);

const COLUMNS: [Column; 10] = [
    ("time_s", |m| m.time.into()),
    ("x_m", |m| m.pose.x.into()),
    ("y_m", |m| m.pose.y.into()),
    ("heading_rad", |m| m.pose.heading.into()),
    ("speed_mps", |m| m.speed.into()),
    ("acceleration_mps2", |m| m.acceleration.into()),
    ("steer_rad", |m| m.steer.into()),
    ("curvature_per_m", |m| m.curvature.into()),
    ("distance_m", |m| m.distance.into()),
    ("gear", |m| (m.gear.sign() as i8).into()),
];

impl TrajectoryFile {
    /// The export of `path`, planned in `frame` for `scene` and driven within `limits`.
    pub fn new(
        scene: &Scene,
        frame: &Frame,
        path: &SmoothPath,
        method: &str,
        limits: TrajectoryLimits,
    ) -> Result<Self, LimitError> {
        let ends = [scene.start, scene.goal];
        let Driven { report, moments } = Driven::new(ends, &scene.vehicle, frame, path, &limits)?;
        let (scene, vehicle) = (scene.name.clone(), scene.vehicle);
        Ok(Self { scene, method: method.to_owned(), vehicle, limits, report, moments })
    }

    /// A name that [`TrajectoryFile::write`] takes, from the command line.
    pub fn file_name(text: &str) -> Result<PathBuf, String> {
        let file = PathBuf::from(text);
        let endings = ["csv", "json", "geojson", "mcap"];
        let known = endings.iter().any(|ending| has_ending(&file, ending));
        let expected = "expected a name ending in .csv, .json, .geojson or .mcap";
        known.then_some(file).ok_or_else(|| expected.to_owned())
    }

    /// Writes CSV where the name ends in `.csv`, poses and twists where it ends in `.ros.json`, else JSON (to a
    /// temporary name, then renamed).
    pub fn write(&self, file: &FilePath) -> io::Result<()> {
        let stem = file.file_stem().map(FilePath::new);
        let text = match has_ending(file, "csv") {
            true => self.to_csv(),
            false if stem.is_some_and(|stem| has_ending(stem, "ros")) => self.to_ros_json(),
            false => self.to_json(),
        };
        write_whole(file, text.as_bytes())
    }

    /// As [`TrajectoryFile::write`], and lines on a map where the name ends in `.geojson` (`on_earth` is where the
    /// scene's frame lies), a recording for viewers where it ends in `.mcap`.
    pub fn write_with(
        &self,
        file: &FilePath,
        scene: &Scene,
        on_earth: Option<Geographic>,
    ) -> io::Result<()> {
        match (has_ending(file, "mcap"), has_ending(file, "geojson")) {
            (true, _) => write_whole(file, &recording(scene, self)),
            (_, true) => write_whole(file, self.to_geojson(on_earth).as_bytes()),
            _ => self.write(file),
        }
    }

    fn to_csv(&self) -> String {
        let mut lines = vec![COLUMNS.map(|(name, _)| name).join(",")];
        let line = |m| COLUMNS.map(|(_, value)| value(m).to_string()).join(",");
        lines.extend(self.moments.iter().map(line));
        lines.join("\n") + "\n"
    }

    /// Points as robots' messages have them: time from the start, pose with a quaternion, twist in the frame of
    /// the rear axle, acceleration, and the angle of the front wheels.
    fn to_ros_json(&self) -> String {
        let vector = |x: f64, z: f64| json!({"x": x, "y": 0.0, "z": z});
        let point = |m: &Moment| {
            let (sin, cos) = (m.pose.heading / 2.0).sin_cos();
            let seconds = m.time.floor();
            json!({
                "time_from_start": {
                    "sec": seconds as i64,
                    "nanosec": (((m.time - seconds) * 1e9).round() as i64).min(999_999_999),
                },
                "pose": {
                    "position": {"x": m.pose.x, "y": m.pose.y, "z": 0.0},
                    "orientation": {"x": 0.0, "y": 0.0, "z": sin, "w": cos},
                },
                "twist": {
                    "linear": vector(m.speed, 0.0),
                    "angular": vector(0.0, m.speed * m.curvature),
                },
                "acceleration": {"linear": vector(m.acceleration, 0.0)},
                "front_wheel_angle_rad": m.steer,
            })
        };
        let points: Vec<Value> = self.moments.iter().map(point).collect();
        json!({"header": {"frame_id": "map"}, "points": points}).to_string()
    }

    fn to_json(&self) -> String {
        serde_json::to_string(self).expect("plain numbers and strings")
    }
}

/// The moments as one array per column.
fn columns<S: Serializer>(moments: &[Moment], serializer: S) -> Result<S::Ok, S::Error> {
    let arrays = COLUMNS.iter().map(|(name, value)| {
        let array: Vec<Value> = moments.iter().map(value).collect();
        (name, array)
    });
    serializer.collect_map(arrays)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::path_file::tests::far_and_mirrored;

    #[test]
    fn mirrored_plans_are_driven_in_the_scenes_frame() {
        let (scene, frame, path) = far_and_mirrored();
        let limits = TrajectoryLimits::default();
        let file =
            TrajectoryFile::new(&scene, &frame, &SmoothPath::of(&path), "ha-rs", limits).unwrap();
        let moments = &file.moments;
        let standing: Vec<_> = moments.iter().take_while(|m| m.speed == 0.0).collect();
        assert!(standing.len() > 10, "the wheels take their time");
        assert!(standing.iter().all(|m| m.pose == scene.start));
        assert_eq!(moments.last().unwrap().pose, scene.goal);
        assert!(moments.iter().all(|m| m.steer <= 0.0), "a mirrored left turn is a right turn");
    }
}
