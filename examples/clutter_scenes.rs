//! Writes scenes of clutter as files: vehicles of seven sizes among needles, poles, blocks, walls
//! and points.
//!
//! `cargo run --release --example clutter_scenes -- DIR COUNT SEED` writes COUNT scenes, each named
//! `clutter-SEED-INDEX.json`; `n3p-eval --scenes DIR --methods ha,ha-rs` plans them.

use std::path::PathBuf;

use anyhow::{Context, Result};
use n3p::world::clutter::clutter;

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [dir, count, seed] = &args[..] else {
        anyhow::bail!("usage: clutter_scenes DIR COUNT SEED");
    };
    let dir = PathBuf::from(dir);
    let (count, seed) = (count.parse().context("COUNT")?, seed.parse().context("SEED")?);
    std::fs::create_dir_all(&dir).with_context(|| dir.display().to_string())?;
    for index in 0..count {
        let scene = clutter(seed, index);
        scene.write(&dir.join(format!("{}.json", scene.file_stem())))?;
    }
    Ok(())
}
