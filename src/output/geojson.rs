//! Plans as GeoJSON: a line for each move between changes of gear, with what belongs to each of its points.

use serde_json::{Value, json};

use super::{PathFile, TrajectoryFile};
use crate::geometry::Pose;
use crate::world::maps::{Geographic, collection, feature, line_string, point};

impl PathFile {
    /// The path as GeoJSON: in WGS-84 where the scene's place on Earth is known, else in metres.
    pub fn to_geojson(&self, on_earth: Option<Geographic>) -> String {
        let poses: Vec<Pose> = self.poses.iter().map(|&pose| pose.into()).collect();
        let features = moves(
            &poses,
            &self.gears,
            on_earth,
            |from, to| json!({"method": self.method, "steer_rad": self.steer[from..to]}),
        );
        collection(features, on_earth).to_string() + "\n"
    }
}

impl TrajectoryFile {
    /// The trajectory as GeoJSON: in WGS-84 where the scene's place on Earth is known, else in metres.
    pub fn to_geojson(&self, on_earth: Option<Geographic>) -> String {
        let poses: Vec<Pose> = self.moments.iter().map(|m| m.pose).collect();
        let gears: Vec<i8> = self.moments.iter().map(|m| m.gear.sign() as i8).collect();
        let features = moves(&poses, &gears, on_earth, |from, to| {
            let moments = &self.moments[from..to];
            let each = |value: fn(&_) -> f64| moments.iter().map(value).collect::<Vec<f64>>();
            json!({
                "method": self.method,
                "time_s": each(|m| m.time),
                "speed_mps": each(|m| m.speed),
                "steer_rad": each(|m| m.steer),
            })
        });
        collection(features, on_earth).to_string() + "\n"
    }
}

/// Features of both ends and of each move; `properties` are those of the points from one index to before another.
fn moves(
    poses: &[Pose],
    gears: &[i8],
    on_earth: Option<Geographic>,
    properties: impl Fn(usize, usize) -> Value,
) -> Vec<Value> {
    let end = |role: &str, pose: &Pose| {
        let properties = json!({"role": role, "heading": pose.heading, "pose_of": "rear_axle"});
        feature(point([pose.x, pose.y], on_earth), properties)
    };
    let mut features: Vec<Value> = poses.first().iter().map(|pose| end("start", pose)).collect();
    let mut from = 0;
    for i in 1..poses.len() {
        // A gear belongs to the motion that follows; the last repeats the one before.
        if gears[i] == gears[from] && i + 1 < poses.len() {
            continue;
        }
        let line: Vec<[f64; 2]> = poses[from..=i].iter().map(|pose| [pose.x, pose.y]).collect();
        let headings: Vec<f64> = poses[from..=i].iter().map(|pose| pose.heading).collect();
        let mut properties = properties(from, i + 1);
        properties["role"] = json!("path");
        properties["gear"] = json!(gears[from]);
        properties["heading_rad"] = json!(headings);
        features.push(feature(line_string(&line, on_earth), properties));
        from = i;
    }
    features.extend(poses.last().iter().map(|pose| end("goal", pose)));
    features
}
