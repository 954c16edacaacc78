//! What the repository holds fits together: settings, data sets, models, experiments.

use std::path::Path;

use n3p::dataset::{CollectConfig, Dataset};
use n3p::experiments::ExperimentConfig;
use n3p::selectors::knn::KnnSelector;
use n3p::selectors::mlp::MlpSelector;
use n3p::training::MlpConfig;
use n3p::world::ParkingType;

fn data(name: &str) -> Dataset {
    let data = Dataset::read(&Path::new("datasets").join(name), None).unwrap();
    assert_eq!(data.kinds(), ParkingType::ALL);
    let file = format!("datasets/{name}.toml");
    let settings = CollectConfig::read(file.as_ref()).unwrap().metadata();
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
    let experiment = ExperimentConfig::read("experiments/paper.toml".as_ref()).unwrap();
    assert_eq!(data.metadata.content_difference(&experiment.collect.metadata()), None);
    let training = MlpConfig::read("models/mlp.toml".as_ref()).unwrap();
    assert_eq!(training, experiment.train.mlp);

    let knn = KnnSelector::load("models/knn.bin".as_ref()).unwrap();
    let header = knn.file().header();
    assert_eq!(header.data_sha256, data.content_sha256(&ParkingType::ALL));
    let samples: usize = header.kinds.iter().map(|k| k.samples).sum();
    assert_eq!(samples, data.solved().count());
    for kind in ParkingType::ALL {
        assert!(data.samples.iter().filter(|s| s.cell.kind == kind).count() >= 150_000);
        let file = format!("models/mlp-{kind}.safetensors");
        let network = MlpSelector::load(file.as_ref()).unwrap();
        let header = network.headers().next().unwrap();
        assert_eq!(header.data_sha256, data.content_sha256(&[kind]), "{file}");
        assert_eq!(header.training, serde_json::to_value(&training).unwrap(), "{file}");
    }
}
