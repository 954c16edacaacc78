//! Raw files of the TPCAP benchmark (Trajectory Planning Competition for Automated
//! Parking, 2022).
//!
//! One line of numbers separated by commas: start x, y, θ; goal x, y, θ; the number of
//! obstacles n; the n vertex counts; then all vertices as x, y, obstacle by obstacle. The
//! vehicle is the same in every case and not in the file.

use std::path::Path;

use super::Scene;
use super::scene::{SceneError, stem};
use crate::geometry::Pose;
use crate::vehicle::Vehicle;

/// The car of the benchmark.
pub fn vehicle() -> Vehicle {
    Vehicle {
        length: 4.689,
        width: 1.942,
        wheelbase: 2.8,
        rear_overhang: 0.929,
        max_steer: 0.75,
        ..Vehicle::default()
    }
}

/// The scene in `text`, named after the file at `path`. Vertices come out
/// counter-clockwise and without repetitions.
pub fn parse(text: &str, path: &Path) -> Result<Scene, SceneError> {
    let format = |message: String| SceneError::Format { path: path.to_owned(), message };
    let mut fields: Vec<&str> = text.trim().split([',', '\n']).map(str::trim).collect();
    if fields.last() == Some(&"") {
        fields.pop();
    }
    let values = fields
        .iter()
        .enumerate()
        .map(|(i, field)| match field.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            _ => Err(format(format!(
                "value {} is {field:?}; expected a finite number (TPCAP: numbers and commas)",
                i + 1
            ))),
        })
        .collect::<Result<Vec<f64>, SceneError>>()?;
    let ends = |needed: usize, what: &str| {
        let n = values.len();
        format(format!("ends after {n} values; expected at least {needed} ({what})"))
    };

    if values.len() < 7 {
        return Err(ends(7, "start, goal and the number of obstacles"));
    }
    let count = |i: usize, what: &str| {
        let v: f64 = values[i];
        if v.fract() == 0.0 && (0.0..1e6).contains(&v) {
            Ok(v as usize)
        } else {
            Err(format(format!("value {} is {v}; expected {what}", i + 1)))
        }
    };
    let n = count(6, "the number of obstacles")?;
    let first_vertex = 7 + n;
    if values.len() < first_vertex {
        return Err(ends(first_vertex, &format!("the vertex counts of {n} obstacles")));
    }
    let counts = (7..first_vertex)
        .map(|i| count(i, &format!("the vertex count of obstacle {} of {n}", i - 6)))
        .collect::<Result<Vec<usize>, SceneError>>()?;
    let total: usize = counts.iter().sum();
    let expected = first_vertex + 2 * total;
    if values.len() < expected {
        return Err(ends(expected, &format!("{n} obstacles with {total} vertices in all")));
    }
    if values.len() > expected {
        let extra = values.len() - expected;
        return Err(format(format!(
            "holds {} values, {extra} too many after {n} obstacles with {total} vertices; \
             check the counts in values 7 to {first_vertex}",
            values.len()
        )));
    }

    let mut at = first_vertex;
    let obstacles = counts.iter().map(|&vertices| {
        let end = at + 2 * vertices;
        let polygon = values[at..end].chunks_exact(2).map(|v| [v[0], v[1]]).collect();
        at = end;
        tidy(polygon)
    });
    Ok(Scene {
        name: stem(path),
        source: "TPCAP benchmark file".to_owned(),
        vehicle: vehicle(),
        start: Pose::new(values[0], values[1], values[2]),
        goal: Pose::new(values[3], values[4], values[5]),
        obstacles: obstacles.collect(),
        ..Scene::default()
    })
}

/// Drops repeated neighbours (the last may repeat the first) and turns the polygon
/// counter-clockwise.
fn tidy(mut polygon: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    polygon.dedup();
    while polygon.len() > 1 && polygon.first() == polygon.last() {
        polygon.pop();
    }
    let Some((&[x0, y0], rest)) = polygon.split_first() else { return polygon };
    // Relative to the first vertex, so that far from the origin no digits cancel.
    let cross =
        |[ax, ay]: [f64; 2], [bx, by]: [f64; 2]| (ax - x0) * (by - y0) - (bx - x0) * (ay - y0);
    let doubled_area: f64 = rest.windows(2).map(|w| cross(w[0], w[1])).sum();
    if doubled_area < 0.0 {
        polygon[1..].reverse();
    }
    polygon
}
