//! Files of the laboratory, each tried by every reader, and the planner before the laboratory's own check.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::{env, fs, process};

use arbitrary::{Arbitrary, Unstructured};
use n3p::lab::dataset::CollectConfig;
use n3p::lab::evaluation::{oracle as checker, rows, trace};
use n3p::lab::experiments::ExperimentConfig;
use n3p::lab::rl::policy_file;
use n3p::lab::training::MlpConfig;
use n3p::output::PathFile;
use n3p::planners::goals;

use crate::plans::{Asked, with_planner};

/// A file that every reader sees in turn.
fn file() -> &'static Path {
    static FILE: OnceLock<PathBuf> = OnceLock::new();
    FILE.get_or_init(|| {
        // In memory, where there is such a place.
        let shared = Path::new("/dev/shm");
        let folder = if shared.is_dir() { shared.to_owned() } else { env::temp_dir() };
        folder.join(format!("n3p-fuzz-{}", process::id()))
    })
}

/// Configurations, rows, traces and policies.
pub fn lab_files(data: &[u8]) {
    fs::write(file(), data).expect("a place to write to");
    if let Ok(config) = ExperimentConfig::read(file(), &[]) {
        fs::write(file(), config.to_toml()).unwrap();
        assert_eq!(ExperimentConfig::read(file(), &[]).unwrap(), config);
        fs::write(file(), data).unwrap();
    }
    let _ = CollectConfig::read(Some(file()), &[]);
    let _ = MlpConfig::read(Some(file()), &[]);
    if let Ok(read) = rows::read_csv(file()) {
        rows::write_csv(file(), &read).unwrap();
        let again = rows::read_csv(file()).unwrap();
        assert_eq!(format!("{again:?}"), format!("{read:?}"));
        fs::write(file(), data).unwrap();
    }
    let _ = trace::read(file(), &HashSet::from(["a"]));
    let _ = policy_file::load(file());
    if let Some(mended) = crate::models::mended(data) {
        fs::write(file(), mended).unwrap();
        let _ = policy_file::load(file());
    }
    let _ = fs::remove_file(file());
}

/// As the target `planner`, checked by the laboratory.
pub fn oracle(data: &[u8]) {
    let Ok(asked) = Asked::arbitrary(&mut Unstructured::new(data)) else { return };
    with_planner(&asked, |planner| {
        let Asked { scene, terms, budget, .. } = &asked;
        let Ok(planned) = goals::plan(planner, scene, *terms, *budget) else { return };
        let Some(driven) = planned.result.driven() else { return };
        let goal = scene.all_goals()[planned.goal_index];
        let end = planned.problem.frame.world_from_local(driven.end());
        // Where it may end elsewhere, there it ends.
        let scene = scene.with_goal(if scene.goal_tolerance.is_some() { end } else { goal });
        let file = PathFile::of_smooth(&scene, &planned.problem.frame, &driven, planner.name());
        if let Err(violation) = checker::measure(&scene, &file, None, terms.contact) {
            panic!("{violation}");
        }
    });
}
