//! What a corpus begins with.

use std::path::Path;
use std::{fs, io};

/// Writes `OUT/TARGET/seed-N`.
pub fn write_seeds(out: &Path) -> io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut seeds = crate::models::seeds();
    for (target, folder, ending) in [
        ("scene_json", "examples/scenes", "json"),
        ("vehicle_toml", "experiments/vehicles", "toml"),
        ("lab_files", "experiments", "toml"),
        ("lab_files", "models", "toml"),
    ] {
        for entry in fs::read_dir(root.join(folder))? {
            let path = entry?.path();
            if path.extension().is_some_and(|e| e == ending) {
                seeds.push((target, fs::read(path)?));
            }
        }
    }
    let tpcap = "-6,4.5,0,0,-1.1,1.57,2,4,3,-4,-2,-1.6,-2,-1.6,2,-4,2,1.6,-2,4,-2,4,2\n";
    seeds.push(("tpcap", tpcap.into()));
    let settings = "grid.back=7.5\nstart_reach = [-3.0, 3.0]\nlane_width = 6.0\n";
    seeds.push(("settings", settings.into()));
    let path = r#"{"poses":[[0,0,0],[0.05,0,0]],"gears":[1,1],"steer":[0,0],"method":"n3p"}"#;
    seeds.push(("path_file", path.into()));
    // For targets that read structure from any bytes: several lengths of a simple sequence.
    for target in ["planner", "door", "c_door", "oracle"] {
        for length in [64, 256, 1024] {
            for step in [7_u32, 31, 101] {
                seeds.push((target, (0..length).map(|i| (i * i * step % 251) as u8).collect()));
            }
        }
    }
    for (number, (target, bytes)) in seeds.iter().enumerate() {
        let folder = out.join(target);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(format!("seed-{number:03}")), bytes)?;
    }
    Ok(())
}
