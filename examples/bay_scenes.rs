//! Writes scenes of unusual bays as files: deep ones, with pillars or kerbs at the mouth, the last
//! of a row beside a wall, oblique ones.
//!
//! `cargo run --release --example bay_scenes -- DIR COUNT SEED [--hint]` writes COUNT scenes of
//! every sort and type, each named `SORT-TYPE-INDEX.json`; without `--hint` none says its parking
//! type. `n3p-eval --scenes DIR --methods n3p,ha-rs` plans them.

use std::path::PathBuf;

use anyhow::{Context, Result};
use n3p::world::bays::{Unusual, bay};

fn main() -> Result<()> {
    let mut args: Vec<String> = std::env::args().skip(1).collect();
    let hint = args.last().is_some_and(|a| a == "--hint");
    args.truncate(args.len() - usize::from(hint));
    let [dir, count, seed] = &args[..] else {
        anyhow::bail!("usage: bay_scenes DIR COUNT SEED [--hint]");
    };
    let dir = PathBuf::from(dir);
    let (count, seed) = (count.parse().context("COUNT")?, seed.parse().context("SEED")?);
    std::fs::create_dir_all(&dir).with_context(|| dir.display().to_string())?;
    for unusual in Unusual::ALL {
        for &kind in unusual.kinds() {
            for index in 0..count {
                let mut scene = bay(unusual, kind, seed, index);
                if !hint {
                    scene.parking_type = None;
                }
                scene.write(&dir.join(format!("{}.json", scene.file_stem())))?;
            }
        }
    }
    Ok(())
}
