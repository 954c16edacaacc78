//! GeoJSON as it is written: maps, and what else has a place in them.

use serde_json::{Value, json};

use super::{Geographic, Map, Place};
use crate::world::LowObstacles;

/// A point of the local frame as it is written: in degrees where that lies somewhere on Earth.
fn position(point: [f64; 2], on_earth: Option<Geographic>) -> Value {
    json!(on_earth.map_or(point, |origin| origin.to_wgs84(point)))
}

/// A point.
pub(crate) fn point(at: [f64; 2], on_earth: Option<Geographic>) -> Value {
    json!({"type": "Point", "coordinates": position(at, on_earth)})
}

/// A line through points.
pub(crate) fn line_string(points: &[[f64; 2]], on_earth: Option<Geographic>) -> Value {
    let coordinates: Vec<Value> = points.iter().map(|&p| position(p, on_earth)).collect();
    json!({"type": "LineString", "coordinates": coordinates})
}

/// A polygon, of an outer ring and holes.
fn polygon(rings: &[&[[f64; 2]]], on_earth: Option<Geographic>) -> Value {
    let ring = |ring: &&[[f64; 2]]| {
        let closed = ring.iter().chain(ring.first());
        closed.map(|&p| position(p, on_earth)).collect::<Vec<Value>>()
    };
    json!({"type": "Polygon", "coordinates": rings.iter().map(ring).collect::<Vec<_>>()})
}

/// A geometry with what it is.
pub(crate) fn feature(geometry: Value, properties: Value) -> Value {
    json!({"type": "Feature", "properties": properties, "geometry": geometry})
}

/// All features of a file, with its unit.
pub(crate) fn collection(features: Vec<Value>, on_earth: Option<Geographic>) -> Value {
    match on_earth {
        Some(origin) => {
            json!({"type": "FeatureCollection", "origin": origin, "features": features})
        }
        None => json!({"type": "FeatureCollection", "units": "metres", "features": features}),
    }
}

impl Map {
    /// The map as GeoJSON: in WGS-84 where its place on Earth is known, else in metres.
    pub fn to_geojson(&self) -> String {
        let earth = self.geographic;
        let mut features = Vec::new();
        let mut add = |role: &str, geometry: Value| {
            features.push(feature(geometry, json!({"role": role})));
        };
        if let Some(area) = &self.drivable_area {
            let holes = area.holes.iter().map(Vec::as_slice);
            let rings: Vec<_> = std::iter::once(&area.outer[..]).chain(holes).collect();
            add("drivable_area", polygon(&rings, earth));
        }
        if let Some([x0, y0, x1, y1]) = self.bounds {
            let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
            add("bounds", polygon(&[&corners], earth));
        }
        let LowObstacles { obstacles, polylines, points } = &self.low;
        let lists = [
            ("obstacle", &self.obstacles, &self.polylines, &self.points),
            ("low", obstacles, polylines, points),
        ];
        for (role, obstacles, polylines, points) in lists {
            for vertices in obstacles {
                features.push(match vertices.len() {
                    // Two vertices are a wall.
                    2 => feature(line_string(vertices, earth), json!({"role": role, "wall": true})),
                    _ => feature(polygon(&[vertices], earth), json!({"role": role})),
                });
            }
            for line in polylines {
                features.push(feature(line_string(line, earth), json!({"role": role})));
            }
            for &at in points {
                features.push(feature(point(at, earth), json!({"role": role})));
            }
        }
        for spot in &self.spots {
            let properties = json!({"role": "spot", "name": spot.name});
            features.push(feature(polygon(&[&spot.corners()], earth), properties));
        }
        let goals = self.goals.iter().map(|goal| ("goal", goal));
        for (role, place) in self.start.iter().map(|start| ("start", start)).chain(goals) {
            let (pose, of) = match place {
                Place::RearAxle(pose) => (pose, "rear_axle"),
                Place::Middle(pose) => (pose, "middle"),
            };
            let properties = json!({"role": role, "heading": pose.heading, "pose_of": of});
            features.push(feature(point([pose.x, pose.y], earth), properties));
        }
        let mut file = collection(features, earth);
        let mut member = |name: &str, value: Value| {
            let is_empty = value.is_null() || value == json!("") || value == json!([]);
            if !is_empty {
                file[name] = value;
            }
        };
        member("name", json!(self.name));
        member("source", json!(self.source));
        member("vehicle", json!(self.vehicle));
        member("contour", json!(self.contour));
        member("margins", json!(self.margins));
        member("goal_tolerance", json!(self.goal_tolerance));
        member("parking_type", json!(self.parking_type));
        file.to_string()
    }
}
