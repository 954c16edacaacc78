//! Recordings: a plan in time as an MCAP file, which the usual viewers of robotics play.
//!
//! Messages are JSON with Foxglove's schemas (docs.foxglove.dev, "Schemas"): `/scene` has what stands there, start, goal and
//! the car's body, `/plan` the poses of the path, `/tf` and `/pose` where the car is, `/drive` how fast and with which
//! steering. The file is one chunk without compression, with an index. Container: mcap.dev, "MCAP Format Specification".

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::TrajectoryFile;
use crate::curves::trajectory::Moment;
use crate::geometry::{Aabb, Pose};
use crate::world::{Scene, Shape};

/// The frame of everything that does not move, and that of the rear axle.
const MAP: &str = "map";
const CAR: &str = "base_link";

/// What obstacles, what is low, the start, the goal and the car look like: red, green, blue and opacity.
const OBSTACLE: [f64; 4] = [0.42, 0.46, 0.52, 1.0];
const LOW: [f64; 4] = [0.66, 0.54, 0.31, 1.0];
const START: [f64; 4] = [0.11, 0.31, 0.85, 0.25];
const GOAL: [f64; 4] = [0.08, 0.5, 0.24, 0.35];
const BODY: [f64; 4] = [0.18, 0.49, 0.88, 0.8];
/// Height of a car as it is drawn, metres.
const HEIGHT: f64 = 1.5;

/// The recording of a trajectory in its scene.
pub fn recording(scene: &Scene, trajectory: &TrajectoryFile) -> Vec<u8> {
    let mut file = Recording::default();
    let surroundings = file.channel("/scene", "foxglove.SceneUpdate", scene_update());
    let plan = file.channel("/plan", "foxglove.PosesInFrame", poses_in_frame());
    let transform = file.channel("/tf", "foxglove.FrameTransform", frame_transform());
    let pose = file.channel("/pose", "foxglove.PoseInFrame", pose_in_frame());
    let drive = file.channel("/drive", "n3p.Drive", drive_schema());

    file.message(surroundings, 0.0, &json!({"deletions": [], "entities": entities(scene)}));
    let poses: Vec<Value> = trajectory.moments.iter().map(|m| pose_of(m.pose)).collect();
    file.message(plan, 0.0, &json!({"timestamp": stamp(0.0), "frame_id": MAP, "poses": poses}));
    for moment in &trajectory.moments {
        let &Moment { time, pose: at, speed, acceleration, steer, curvature, distance, .. } =
            moment;
        let Value::Object(placed) = pose_of(at) else { continue };
        let (timestamp, rotation) = (stamp(time), &placed["orientation"]);
        file.message(
            transform,
            time,
            &json!({
                "timestamp": timestamp, "parent_frame_id": MAP, "child_frame_id": CAR,
                "translation": placed["position"], "rotation": rotation,
            }),
        );
        file.message(pose, time, &json!({"timestamp": timestamp, "frame_id": MAP, "pose": placed}));
        file.message(
            drive,
            time,
            &json!({
                "timestamp": timestamp, "speed_mps": speed, "acceleration_mps2": acceleration,
                "steer_rad": steer, "curvature_per_m": curvature, "distance_m": distance,
                "gear": moment.gear.sign() as i8,
            }),
        );
    }
    file.finish()
}

/// What stands in a scene, and the car, which moves with its frame.
fn entities(scene: &Scene) -> Vec<Value> {
    let edges = |is_low: bool| {
        let outlines = scene.outlines().filter(move |o| o.is_low == is_low);
        let edges = outlines.filter(|o| o.shape != Shape::Point).flat_map(|o| {
            // The last edge of a chain has no length.
            o.edges().filter(|(a, b)| a != b).collect::<Vec<_>>()
        });
        edges.flat_map(|(a, b)| [a, b]).map(|p| point(p.x, p.y, 0.0)).collect::<Vec<Value>>()
    };
    // Points as short strokes upward: viewers draw lists of lines fast.
    let points = |is_low: bool| {
        let points =
            scene.outlines().filter(move |o| o.is_low == is_low && o.shape == Shape::Point);
        points.flat_map(|o| {
            let [x, y] = o.vertices[0];
            [point(x, y, 0.0), point(x, y, 0.1)]
        })
    };
    let mut entities = Vec::new();
    for (id, is_low, colour) in [("obstacles", false, OBSTACLE), ("low", true, LOW)] {
        let mut lines = edges(is_low);
        lines.extend(points(is_low));
        if !lines.is_empty() {
            entities.push(entity(id, MAP, "lines", lines_of(lines, colour)));
        }
    }
    let body = |pose: Pose, colour: [f64; 4]| {
        let Aabb { min, max } = scene.vehicle.footprint(0.0);
        let middle = pose.point_to_parent((min + max) / 2.0);
        let mut placed = pose_of(Pose::new(middle.x, middle.y, pose.heading));
        placed["position"]["z"] = json!(HEIGHT / 2.0);
        let size = point(max.x - min.x, max.y - min.y, HEIGHT);
        json!([{"pose": placed, "size": size, "color": rgba(colour)}])
    };
    entities.push(entity("start", MAP, "cubes", body(scene.start, START)));
    entities.push(entity("goal", MAP, "cubes", body(scene.goal, GOAL)));
    entities.push(entity("car", CAR, "cubes", body(Pose::default(), BODY)));
    entities
}

/// An entity with one kind of primitives, which stays and moves with its frame.
fn entity(id: &str, frame: &str, kind: &str, primitives: Value) -> Value {
    let mut entity = json!({
        "timestamp": stamp(0.0), "frame_id": frame, "id": id, "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": true, "metadata": [],
    });
    for name in PRIMITIVES {
        entity[name] = json!([]);
    }
    entity[kind] = primitives;
    entity
}

/// Pairs of points as a list of lines (type 2).
fn lines_of(points: Vec<Value>, colour: [f64; 4]) -> Value {
    json!([{
        "type": 2, "pose": pose_of(Pose::default()), "thickness": 2.0, "scale_invariant": true,
        "points": points, "color": rgba(colour), "colors": [], "indices": [],
    }])
}

fn rgba([r, g, b, a]: [f64; 4]) -> Value {
    json!({"r": r, "g": g, "b": b, "a": a})
}

fn point(x: f64, y: f64, z: f64) -> Value {
    json!({"x": x, "y": y, "z": z})
}

fn pose_of(pose: Pose) -> Value {
    let (sin, cos) = (pose.heading / 2.0).sin_cos();
    let orientation = json!({"x": 0.0, "y": 0.0, "z": sin, "w": cos});
    json!({"position": point(pose.x, pose.y, 0.0), "orientation": orientation})
}

/// Seconds as nanoseconds.
fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

fn stamp(seconds: f64) -> Value {
    let time = nanoseconds(seconds);
    json!({"sec": time / 1_000_000_000, "nsec": time % 1_000_000_000})
}

/// Lists that an entity has.
const PRIMITIVES: [&str; 8] =
    ["arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"];

// The schemas, as far as messages here fill them.

fn object(properties: Value) -> Value {
    json!({"type": "object", "properties": properties})
}

fn numbers(names: &[&str]) -> Value {
    let number = json!({"type": "number"});
    object(names.iter().map(|&name| (name.to_owned(), number.clone())).collect())
}

fn list(items: Value) -> Value {
    json!({"type": "array", "items": items})
}

fn time_schema() -> Value {
    let integer = json!({"type": "integer"});
    object(json!({"sec": integer, "nsec": integer}))
}

fn text() -> Value {
    json!({"type": "string"})
}

fn pose_schema() -> Value {
    let (vector, quaternion) = (numbers(&["x", "y", "z"]), numbers(&["x", "y", "z", "w"]));
    object(json!({"position": vector, "orientation": quaternion}))
}

fn frame_transform() -> Value {
    object(json!({
        "timestamp": time_schema(), "parent_frame_id": text(), "child_frame_id": text(),
        "translation": numbers(&["x", "y", "z"]), "rotation": numbers(&["x", "y", "z", "w"]),
    }))
}

fn pose_in_frame() -> Value {
    object(json!({"timestamp": time_schema(), "frame_id": text(), "pose": pose_schema()}))
}

fn poses_in_frame() -> Value {
    object(json!({"timestamp": time_schema(), "frame_id": text(), "poses": list(pose_schema())}))
}

fn drive_schema() -> Value {
    let mut schema = numbers(&[
        "speed_mps",
        "acceleration_mps2",
        "steer_rad",
        "curvature_per_m",
        "distance_m",
        "gear",
    ]);
    schema["properties"]["timestamp"] = time_schema();
    schema
}

fn scene_update() -> Value {
    let (vector, colour) = (numbers(&["x", "y", "z"]), numbers(&["r", "g", "b", "a"]));
    let mut properties = json!({
        "timestamp": time_schema(), "frame_id": text(), "id": text(), "lifetime": time_schema(),
        "frame_locked": {"type": "boolean"}, "metadata": list(object(json!({"key": text(), "value": text()}))),
    });
    for name in PRIMITIVES {
        properties[name] = list(object(json!({"pose": pose_schema(), "color": colour})));
    }
    properties["cubes"]["items"]["properties"]["size"] = vector.clone();
    let line = &mut properties["lines"]["items"]["properties"];
    line["type"] = json!({"type": "integer"});
    line["thickness"] = json!({"type": "number"});
    line["scale_invariant"] = json!({"type": "boolean"});
    line["points"] = list(vector);
    line["colors"] = list(colour);
    line["indices"] = list(json!({"type": "integer"}));
    let deletion = json!({"timestamp": time_schema(), "type": {"type": "integer"}, "id": text()});
    object(json!({"deletions": list(object(deletion)), "entities": list(object(properties))}))
}

/// An MCAP file under construction.
#[derive(Default)]
struct Recording {
    /// Schemas and channels, which are both in the chunk and in the summary.
    declared: Vec<u8>,
    channels: u16,
    chunk: Vec<u8>,
    /// For each channel the time of each message and where it lies in the chunk.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

impl Recording {
    /// Declares a channel and its schema.
    fn channel(&mut self, topic: &str, schema: &str, description: Value) -> u16 {
        self.channels += 1;
        let id = self.channels;
        let mut content = Content::default();
        content.u16(id).text(schema).text("jsonschema").bytes(description.to_string().as_bytes());
        content.record(0x03, &mut self.declared);
        let mut content = Content::default();
        content.u16(id).u16(id).text(topic).text("json").bytes(&[]);
        content.record(0x04, &mut self.declared);
        id
    }

    /// Adds a message, after all channels are declared.
    fn message(&mut self, channel: u16, seconds: f64, message: &Value) {
        if self.chunk.is_empty() {
            self.chunk.extend_from_slice(&self.declared);
        }
        let time = nanoseconds(seconds);
        let index = self.index.entry(channel).or_default();
        let mut content = Content::default();
        content.u16(channel).u32(index.len() as u32).u64(time).u64(time);
        content.0.extend_from_slice(message.to_string().as_bytes());
        index.push((time, self.chunk.len() as u64));
        content.record(0x05, &mut self.chunk);
    }

    fn finish(self) -> Vec<u8> {
        let mut file = MAGIC.to_vec();
        let mut content = Content::default();
        content.text("").text(concat!("n3p ", env!("CARGO_PKG_VERSION")));
        content.record(0x01, &mut file);

        let times = || self.index.values().flatten().map(|(time, _)| *time);
        let (first, last) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
        let (chunk_at, chunk_size) = (file.len() as u64, self.chunk.len() as u64);
        let mut content = Content::default();
        content.u64(first).u64(last).u64(chunk_size).u32(0).text("").u64(chunk_size);
        content.0.extend_from_slice(&self.chunk);
        content.record(0x06, &mut file);
        let chunk_length = file.len() as u64 - chunk_at;
        let (mut offsets, mut counts) = (Content::default(), Content::default());
        let index_at = file.len() as u64;
        for (&channel, messages) in &self.index {
            offsets.u16(channel).u64(file.len() as u64);
            counts.u16(channel).u64(messages.len() as u64);
            let mut entries = Content::default();
            for &(time, offset) in messages {
                entries.u64(time).u64(offset);
            }
            let mut content = Content::default();
            content.u16(channel).bytes(&entries.0);
            content.record(0x07, &mut file);
        }
        let index_length = file.len() as u64 - index_at;
        let mut content = Content::default();
        content.u32(0);
        content.record(0x0F, &mut file);

        let summary_at = file.len() as u64;
        file.extend_from_slice(&self.declared);
        let mut content = Content::default();
        let channels = u32::from(self.channels);
        let messages = times().count() as u64;
        content.u64(messages).u16(self.channels).u32(channels).u32(0).u32(0).u32(1);
        content.u64(first).u64(last).bytes(&counts.0);
        content.record(0x0B, &mut file);
        let mut content = Content::default();
        content.u64(first).u64(last).u64(chunk_at).u64(chunk_length).bytes(&offsets.0);
        content.u64(index_length).text("").u64(chunk_size).u64(chunk_size);
        content.record(0x08, &mut file);

        let mut content = Content::default();
        content.u64(summary_at).u64(0).u32(0);
        content.record(0x02, &mut file);
        file.extend_from_slice(MAGIC);
        file
    }
}

/// The content of a record: little-endian numbers, and texts with their length before them.
#[derive(Default)]
struct Content(Vec<u8>);

impl Content {
    fn u16(&mut self, value: u16) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn u64(&mut self, value: u64) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(bytes.len() as u32).0.extend_from_slice(bytes);
        self
    }

    fn text(&mut self, text: &str) -> &mut Self {
        self.bytes(text.as_bytes())
    }

    /// Appends the record of this content and of a kind.
    fn record(&self, kind: u8, out: &mut Vec<u8>) {
        out.push(kind);
        out.extend_from_slice(&(self.0.len() as u64).to_le_bytes());
        out.extend_from_slice(&self.0);
    }
}
