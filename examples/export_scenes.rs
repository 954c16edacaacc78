//! Writes generated scenes as files, for planners that are not ours.
//!
//! `cargo run --release --example export_scenes -- DIR COUNT SEED` writes COUNT scenes of
//! every type and level, each named `LEVEL-TYPE-INDEX.json`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType};

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [dir, count, seed] = &args[..] else {
        anyhow::bail!("usage: export_scenes DIR COUNT SEED");
    };
    let (dir, vehicle) = (PathBuf::from(dir), Vehicle::default());
    let (count, seed) = (count.parse().context("COUNT")?, seed.parse().context("SEED")?);
    std::fs::create_dir_all(&dir).with_context(|| dir.display().to_string())?;
    for kind in ParkingType::SQUARE {
        for level in Level::ALL {
            for i in 0..count {
                let scene = generate(&GeneratorConfig::default(), &vehicle, kind, level, seed, i);
                scene.write(&dir.join(format!("{}.json", scene.file_stem())))?;
            }
        }
    }
    Ok(())
}
