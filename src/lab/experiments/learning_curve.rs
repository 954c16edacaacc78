//! The learning curve: N3P with models from parts of the data set.

use std::path::Path;

use super::config::{ExperimentConfig, LearningCurveConfig};
use super::runner::ExperimentError;
use crate::episode::Row;
use crate::lab::dataset::{Dataset, Subset};
use crate::lab::evaluation::CurvePoint;
use crate::lab::evaluation::learning_curve::Part;
use crate::lab::evaluation::suite::{self, Drawn, World};
use crate::lab::progress;
use crate::lab::training;
use crate::lab::training::worlds::WorldsConfig;
use crate::n3p::Models;

/// Trains on `subset` of `data`, keeping the models in `folder`, and plans with them.
pub(super) fn points(
    config: &ExperimentConfig,
    curve: &LearningCurveConfig,
    data: &Dataset,
    subset: &Subset,
    folder: &Path,
) -> Result<Vec<CurvePoint>, ExperimentError> {
    let part = subset.of(data);
    let kinds = &config.evaluate.types;
    let knn = folder.join("knn.bin");
    // What data alone is worth.
    let no_worlds = WorldsConfig { count: 0, ..config.train.knn };
    training::knn::train(&part.metadata, &part.samples, kinds, &no_worlds.into(), &knn)?;
    let mut files = vec![knn];
    if curve.needs_mlp() {
        for &kind in kinds {
            let out = folder.join(format!("mlp-{kind}.safetensors"));
            let mlp = &config.train.mlp;
            training::mlp::train(&part.metadata, &part.samples, kind, mlp, &out)?;
            files.push(out);
        }
    }
    let models = Models::load(&files)?;
    let e = &config.evaluate;
    let suite_config = e.suite(&curve.methods);
    let drawn = Drawn { count: curve.count, seed: curve.seed, ..e.drawn(&config.vehicle) };
    let cases = drawn.cases(World::Home)?;
    let bar = progress::bar((cases.len() * curve.methods.len()) as u64, "learning curve");
    let rows = suite::run(&cases, &models, &suite_config, 0, |_, _| {
        bar.inc(1);
        Ok::<(), ExperimentError>(())
    })?;
    bar.finish_and_clear();
    let mut points = Vec::new();
    for &kind in kinds {
        let solved = part.solved().filter(|s| s.cell.kind() == kind).count();
        let from = Part {
            grid: &part.metadata.grid,
            samples_per_cell: part.metadata.samples_per_cell,
            samples: solved,
        };
        for method in &curve.methods {
            let is_mine = |r: &&Row| r.kind == Some(kind) && r.method == method.name();
            let mine: Vec<&Row> = rows.iter().filter(is_mine).collect();
            points.push(CurvePoint::new(from, kind, method.name(), &mine));
        }
    }
    Ok(points)
}
