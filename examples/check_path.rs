//! Checks path files with the independent oracle, whoever planned them.
//!
//! `cargo run --release --example check_path -- [--footprints] SCENE PATH [SCENE PATH …]`
//! prints one line of JSON per pair. `clearance_m` is the smallest distance from the
//! obstacles, `violation` says what is wrong (one of both is null).
//!
//! With `--footprints` only what stands in the way is asked: each pose of the path, on its
//! own, must be free and in bounds. Gears, steering and the ends are not looked at. It
//! serves planners that return poses alone, or stop at some distance from the goal.

use std::path::Path;

use anyhow::Result;
use n3p::geometry::Pose;
use n3p::lab::evaluation::oracle::{self, Violation};
use n3p::output::PathFile;
use n3p::world::Scene;

fn main() -> Result<()> {
    let mut args: Vec<String> = std::env::args().skip(1).collect();
    let footprints = args.first().is_some_and(|a| a == "--footprints");
    if footprints {
        args.remove(0);
    }
    anyhow::ensure!(
        !args.is_empty() && args.len().is_multiple_of(2),
        "usage: check_path [--footprints] SCENE PATH [SCENE PATH ...]"
    );
    for pair in args.chunks(2) {
        let (scene, path) =
            (Scene::read(Path::new(&pair[0]))?, PathFile::read(Path::new(&pair[1]))?);
        let verdict =
            if footprints { check_footprints(&scene, &path) } else { oracle::check(&scene, &path) };
        let line = serde_json::json!({
            "scene": pair[0],
            "path": pair[1],
            "clearance_m": verdict.as_ref().ok().filter(|c| c.is_finite()),
            "violation": verdict.as_ref().err().map(Violation::to_string),
        });
        println!("{line}");
    }
    Ok(())
}

/// The oracle's verdict on each pose as a path of its own, which begins and ends there.
fn check_footprints(scene: &Scene, path: &PathFile) -> Result<f64, Violation> {
    let mut scene = scene.clone();
    let mut clearance = f64::INFINITY;
    for (i, &pose) in path.poses.iter().enumerate() {
        scene.start = Pose::from(pose);
        scene.goal = scene.start;
        let standing = PathFile {
            poses: vec![pose],
            gears: vec![1],
            steer: vec![0.0],
            method: path.method.clone(),
            ..PathFile::default()
        };
        let here = oracle::check(&scene, &standing).map_err(|violation| match violation {
            Violation::Collision { mm, obstacle, .. } => {
                Violation::Collision { pose: i, mm, obstacle }
            }
            Violation::OutOfBounds { mm, .. } => Violation::OutOfBounds { pose: i, mm },
            other => other,
        })?;
        clearance = clearance.min(here);
    }
    Ok(clearance)
}
