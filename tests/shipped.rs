//! What the repository holds fits together: settings, data sets, models, experiments.

#![cfg(feature = "lab")]

use std::path::Path;

use n3p::environment::courses::Course;
use n3p::lab::dataset::{CollectConfig, Dataset};
use n3p::lab::experiments::ExperimentConfig;
use n3p::lab::rl::policy_file;
use n3p::lab::training::MlpConfig;
use n3p::lab::training::rl::{RlConfig, RlLog};
use n3p::selectors::knn::KnnSelector;
use n3p::selectors::mlp::MlpSelector;
use n3p::world::ParkingType;

fn data(name: &str) -> Dataset {
    let data = Dataset::read(&Path::new("datasets").join(name), None).unwrap();
    assert_eq!(data.kinds(), ParkingType::SQUARE);
    let file = format!("datasets/{name}.toml");
    let settings = CollectConfig::read(Some(file.as_ref()), &[]).unwrap().metadata();
    assert_eq!(data.metadata.settings_difference(&settings), None, "{file}");
    data
}

#[test]
fn the_small_data_set_has_its_settings() {
    assert!(data("small").solved().count() > 20_000);
}

#[test]
fn the_models_come_from_the_papers_data_set_and_settings() {
    let data = data("paper");
    let experiment = ExperimentConfig::read("experiments/paper.toml".as_ref(), &[]).unwrap();
    assert_eq!(data.metadata.content_difference(&experiment.collect.metadata()), None);
    let training = MlpConfig::read(Some("models/mlp.toml".as_ref()), &[]).unwrap();
    assert_eq!(training, experiment.train.mlp);

    let knn = KnnSelector::load("models/knn.bin".as_ref()).unwrap();
    let header = knn.file().header();
    assert_eq!(header.data_sha256, data.content_sha256(&ParkingType::SQUARE));
    let samples: usize = header.kinds.iter().map(|k| k.samples).sum();
    assert_eq!(samples, data.solved().count());
    for kind in ParkingType::SQUARE {
        assert!(data.samples.iter().filter(|s| s.cell.kind() == kind).count() >= 150_000);
        let file = format!("models/mlp-{kind}.safetensors");
        let network = MlpSelector::load(file.as_ref()).unwrap();
        let header = network.headers().next().unwrap();
        assert_eq!(header.data_sha256, data.content_sha256(&[kind]), "{file}");
        assert_eq!(header.training, serde_json::to_value(&training).unwrap(), "{file}");
    }
}

#[test]
fn the_policies_come_from_the_papers_settings() {
    let experiment = ExperimentConfig::read("experiments/paper.toml".as_ref(), &[]).unwrap();
    let training = RlConfig::read(Some("models/rl.toml".as_ref()), &[]).unwrap();
    assert_eq!(training, experiment.train.rl);
    assert_ne!(training.seed, experiment.evaluate.seed);
    assert_ne!(training.validation_seed, experiment.evaluate.seed);
    for course in [Course::Simple, Course::Eval] {
        let path = Path::new("models").join(policy_file::usual_name(course));
        assert!(path.metadata().unwrap().len() < 5 << 20);
        let (header, _) = policy_file::load(&path).unwrap();
        assert_eq!((header.course, header.vehicle), (course, experiment.vehicle));
        assert_eq!(header.training, serde_json::to_value(&training).unwrap());
        let log = std::fs::read_to_string(path.with_extension("training.json")).unwrap();
        let log: RlLog = serde_json::from_str(&log).unwrap();
        assert_eq!(header.episodes, log.best().episodes);
        assert!(log.points.last().unwrap().episodes >= training.episodes);
    }
}
