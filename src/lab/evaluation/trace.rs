//! Traces: what a method did in a scene, short enough to keep for every row.
//!
//! `traces.jsonl` grows beside `rows.csv`, one line per row, written before it. So the
//! report draws the very paths that were timed and checked, also after an interruption,
//! and whoever planned them; planning again could give neither.

use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::episode::{Episode, regions};
use crate::geometry::Pose;
use crate::n3p::Models;

/// A path as its motions, and what N3P made of the spot; all in the scene's own frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trace {
    /// Name of the scene.
    pub scene: String,
    /// Name of the method.
    pub method: String,
    /// Where the path begins; `None` without a path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Pose>,
    /// Its motions in driving order: curvature (1/m) and signed length (m).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<[f64; 2]>,
    /// The corners of the abstraction's two rectangles, lane and spot, to the millimetre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub regions: Option<[Vec<[f64; 2]>; 2]>,
    /// The preparatory pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preparatory: Option<Pose>,
    /// Where the car was when the path was driven, to the millimetre.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub driven: Vec<[f64; 3]>,
}

impl Trace {
    /// The trace of `episode`, whose method was built from `models`, and whose path was `driven` so.
    pub fn new(episode: &Episode, models: &Models, driven: &[Pose]) -> Self {
        let frame = &episode.problem.frame;
        let path = episode.result.outcome.as_ref().ok().map(|p| p.to_world(frame));
        let guidance = episode.result.guidance.as_ref();
        Self {
            scene: episode.row.scene.clone(),
            method: episode.row.method.clone(),
            start: path.as_ref().map(|p| p.start),
            segments: path
                .map(|p| p.segments.iter().map(|s| [s.curvature, s.length]).collect())
                .unwrap_or_default(),
            regions: regions(episode, models).map(|both| {
                both.map(|r| r.vertices().iter().map(|v| [v.x, v.y].map(mm)).collect())
            }),
            preparatory: guidance.and_then(|g| g.preparatory).map(|p| frame.world_from_local(p)),
            driven: driven.iter().map(|&p| <[f64; 3]>::from(p).map(mm)).collect(),
        }
    }

    /// Scene and method, as of the row.
    pub fn key(&self) -> (&str, &str) {
        (&self.scene, &self.method)
    }
}

/// Rounded to thousandths.
pub(super) fn mm(v: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (v * 1e3).round() / 1e3 + 0.0
}

/// The traces of the scenes in `wanted`. Only those are held; of two for one row the later
/// counts. What is no whole line of a trace (an interrupted run) is left out, and so is
/// everything where there is no file.
pub fn read(path: &Path, wanted: &HashSet<&str>) -> io::Result<Vec<Trace>> {
    let file = match File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        file => BufReader::new(file?),
    };
    let mut traces: Vec<Trace> = Vec::new();
    let mut places: HashMap<(String, String), usize> = HashMap::new();
    for line in file.split(b'\n') {
        let Ok(trace) = serde_json::from_slice::<Trace>(&line?) else { continue };
        if !wanted.contains(trace.scene.as_str()) {
            continue;
        }
        match places.get(&(trace.scene.clone(), trace.method.clone())) {
            Some(&i) => traces[i] = trace,
            None => {
                places.insert((trace.scene.clone(), trace.method.clone()), traces.len());
                traces.push(trace);
            }
        }
    }
    Ok(traces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_round_exactly_and_half_ones_are_left_out() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("traces.jsonl");
        let trace = Trace {
            scene: "a \"b\"\n".into(),
            method: "n3p".into(),
            start: Some(Pose::new(1.0 / 3.0, -2e-17, 0.1 + 0.2)),
            segments: vec![[0.246_5, 1.0 / 7.0], [0.0, -3.0]],
            regions: Some([vec![[0.0, 1.0]], vec![]]),
            preparatory: None,
            driven: vec![[1.5, -2.25, 0.125]],
        };
        let blocked = Trace { scene: "c".into(), method: "n3p".into(), ..Trace::default() };
        let lines = [&blocked, &trace, &blocked].map(|t| serde_json::to_string(t).unwrap() + "\n");
        std::fs::write(&path, lines.concat()).unwrap();
        let all = HashSet::from([&trace.scene[..], "c"]);
        assert_eq!(read(&path, &all).unwrap(), [blocked.clone(), trace.clone()]);
        assert_eq!(read(&path, &HashSet::from(["c"])).unwrap(), std::slice::from_ref(&blocked));
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        assert_eq!(read(&path, &all).unwrap(), [blocked, trace.clone()]);
        assert!(read(&dir.path().join("none"), &all).unwrap().is_empty());
    }
}
