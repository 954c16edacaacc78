//! Foresight: what it says is worth, and that nothing depends on its being right.

#![cfg(feature = "lab")]

use std::path::Path;
use std::sync::Arc;

use n3p::geometry::Pose;
use n3p::lab::training::foresight::{ForesightConfig, load, train};
use n3p::n3p::{GuidedPlanner, Models, ModelsError};
use n3p::planners::{Budget, HybridAStarConfig, Planner, Problem};
use n3p::rng::{Stream, rng};
use n3p::selectors::Normaliser;
use n3p::selectors::foresight::{
    self, Foresight, ForesightHeader, MANOEUVRE, MANOEUVRE_LAYERS, SCENE, SCENE_LAYERS,
    manoeuvre_values,
};
use n3p::selectors::knn::KnnSelector;
use n3p::selectors::network::LayerWeights;
use n3p::vehicle::Vehicle;
use n3p::world::generate::some_wide;
use n3p::world::{ParkingType, Scene};
use rand::RngExt;

fn plain(columns: usize) -> Normaliser {
    Normaliser { mean: vec![0.0; columns], std: vec![1.0; columns] }
}

fn header() -> ForesightHeader {
    ForesightHeader {
        format_version: foresight::VERSION,
        foresight: vec![("knn.bin".to_owned(), String::new())],
        scene: plain(SCENE),
        manoeuvre: plain(MANOEUVRE),
        training: serde_json::Value::Null,
        crate_version: String::new(),
    }
}

/// Weights of these widths, drawn at random.
fn drawn(widths: &[usize], seed: u64) -> Vec<LayerWeights> {
    let mut rng = rng(seed, Stream::Weights, 0);
    let layers = widths.windows(2).map(|size| {
        let limit = (6.0 / size[0] as f32).sqrt();
        let mut draw = |n| (0..n).map(|_| rng.random_range(-limit..limit)).collect();
        LayerWeights { weight: draw(size[0] * size[1]), bias: draw(size[1]) }
    });
    layers.collect()
}

/// A network that has learnt nothing.
fn foolish(seed: u64) -> Foresight {
    let [scene, manoeuvre] = [(&SCENE_LAYERS[..], seed), (&MANOEUVRE_LAYERS[..], seed + 1)]
        .map(|(widths, seed)| drawn(widths, seed));
    let bytes = foresight::encode(&header(), &scene, &manoeuvre);
    Foresight::from_bytes(Path::new("foolish.safetensors"), &bytes).unwrap()
}

fn problems(kind: ParkingType, count: usize) -> Vec<Problem> {
    let scenes = some_wide(&Vehicle::default(), kind, 31, count).unwrap();
    scenes.iter().filter_map(|scene| Problem::new(scene).ok()).collect()
}

/// From the next aisle, or from far down this one, it is as if there were no network.
#[test]
fn nobody_asks_a_network_about_cars_that_it_does_not_see() {
    let knn: Arc<KnnSelector> = Arc::new(KnnSelector::load(Path::new("models/knn.bin")).unwrap());
    let planner = || {
        let (config, ranked) = (HybridAStarConfig::default(), Default::default());
        GuidedPlanner::ranked("n3p", knn.clone(), config, ranked)
    };
    let mut without = planner();
    let mut with = planner().with_foresight(Some(Arc::new(foolish(1))));
    let box_of = |x0: f64, y0: f64, x1: f64, y1: f64| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let vehicle = Vehicle::default();
    let mut same = |start: Pose| {
        let scene = Scene {
            vehicle,
            start,
            goal: vehicle.rear_axle(Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2)),
            parking_type: Some(ParkingType::Reverse),
            obstacles: vec![box_of(-4.0, -2.6, -1.3, 2.4), box_of(1.3, -2.6, 4.0, 2.4)],
            ..Scene::default()
        };
        let problem = Problem::new(&scene).unwrap();
        let plan = |planner: &mut GuidedPlanner| {
            planner.plan(&problem, Budget::new(200_000)).outcome.unwrap()
        };
        plan(&mut without) == plan(&mut with)
    };
    for start in [[-25.0, 6.0, 0.0], [22.0, 6.0, 3.1], [-7.0, 16.0, -1.5], [3.0, -20.0, 1.5]] {
        assert!(same(start.into()), "{start:?}");
    }
    // In sight it has a say.
    let mut starts = (0..40).map(|i| Pose::new(-12.0 + 0.5 * f64::from(i), 6.5, 0.05));
    assert!(starts.any(|start| !same(start)));
}

#[test]
fn a_foolish_network_costs_time_but_no_path() {
    let knn: Arc<KnnSelector> = Arc::new(KnnSelector::load(Path::new("models/knn.bin")).unwrap());
    let mut found = 0;
    for seed in 0..3 {
        let planner = || {
            GuidedPlanner::ranked(
                "n3p",
                knn.clone(),
                HybridAStarConfig::default(),
                Default::default(),
            )
        };
        let mut without = planner();
        let mut with = planner().with_foresight(Some(Arc::new(foolish(seed))));
        for kind in ParkingType::SQUARE {
            for problem in problems(kind, 12) {
                let [a, b] = [&mut without, &mut with]
                    .map(|planner| planner.plan(&problem, Budget::default()).outcome);
                assert_eq!(a.is_ok(), b.is_ok(), "{kind}: {a:?}, {b:?}");
                if let Ok(path) = b {
                    assert!(problem.collision.path_is_free(&path));
                    found += 1;
                }
            }
        }
    }
    assert!(found > 90, "{found}");
}

#[test]
fn scores_are_products_of_codes_less_estimates() {
    let foolish = foolish(5);
    let problem = &problems(ParkingType::Reverse, 1)[0];
    let stance = problem.stance().unwrap();
    let motions = |length| [n3p::curves::Segment::straight(length)];
    let manoeuvres: Vec<_> = (0..70)
        .map(|i| manoeuvre_values(stance, &problem.vehicle, &motions(-0.1 * f64::from(i)), 1.0))
        .collect();
    let all = foolish.codes(&manoeuvres);
    let outlook = foolish.look(problem, stance, [9.0, 12.0]);
    let estimates: Vec<f32> = (0..70).map(|i| i as f32).collect();
    let mut scores = Vec::new();
    all.scores(&outlook, &estimates, &mut scores);
    assert_eq!(scores.len(), 70);
    // One by one they are the same, and an estimate counts in proportion.
    for (i, &manoeuvre) in manoeuvres.iter().enumerate() {
        let (mut alone, mut dearer) = (Vec::new(), Vec::new());
        let one = foolish.codes(&[manoeuvre]);
        one.scores(&outlook, &estimates[i..=i], &mut alone);
        one.scores(&outlook, &[2.0 * estimates[i]], &mut dearer);
        assert_eq!(alone, [scores[i]]);
        let mut free = Vec::new();
        one.scores(&outlook, &[0.0], &mut free);
        assert!((dearer[0] - 2.0 * alone[0] + free[0]).abs() < 1e-3);
    }
    assert!(outlook.cost.is_finite() && outlook.cost > 0.0);
}

/// An estimate that sees no obstacles finds the best manoeuvre among its first few far more
/// rarely (the model's card has both).
#[test]
fn the_shipped_log_says_that_it_foresees_better_than_estimates() {
    let text = std::fs::read_to_string("models/foresight.training.json").unwrap();
    let log: n3p::lab::training::foresight::ForesightLog = serde_json::from_str(&text).unwrap();
    for library in &log.libraries {
        let v = library.validation;
        assert!(v.in_first > 1.5 * v.in_first_by_estimate, "{library:?}");
        assert!(v.in_order > 0.6 && v.cost_median < 0.1, "{library:?}");
    }
}

#[test]
fn the_same_settings_give_the_same_bytes_and_a_log() {
    let dir = tempfile::tempdir().unwrap();
    let config =
        ForesightConfig { worlds: 12, epochs: 2, batch: 8, seed: 9, ..ForesightConfig::default() };
    let [a, b] = ["a", "b"].map(|name| {
        let out = dir.path().join(name).join("foresight.safetensors");
        let log = train(load(&["models/knn.bin"]).unwrap(), &config, &out).unwrap();
        assert_eq!((log.libraries.len(), log.losses.len()), (3, 2));
        assert!(log.libraries.iter().all(|l| l.examples > 3), "{:?}", log.libraries);
        let lines = std::fs::read_to_string(n3p::lab::training::watch::path(&out)).unwrap();
        assert_eq!(lines.lines().count(), 2);
        let card = std::fs::read_to_string(out.with_extension("card.md")).unwrap();
        assert!(card.contains("| `knn.bin` | 4.97 | forward |"), "{card}");
        std::fs::read(&out).unwrap()
    });
    assert_eq!(a, b);
    Foresight::from_bytes(Path::new("a"), &a).unwrap();
    let none = ForesightConfig { epochs: 0, ..config };
    let out = dir.path().join("none.safetensors");
    let error = train(load(&["models/knn.bin"]).unwrap(), &none, &out).unwrap_err().to_string();
    assert!(error.starts_with("epochs is 0; expected") && !out.exists(), "{error}");
}

#[test]
fn files_say_what_is_wrong_with_them() {
    let [scene, manoeuvre] = [&SCENE_LAYERS[..], &MANOEUVRE_LAYERS[..]].map(|w| drawn(w, 1));
    let read = |change: fn(&mut ForesightHeader)| {
        let mut header = header();
        change(&mut header);
        let bytes = foresight::encode(&header, &scene, &manoeuvre);
        Foresight::from_bytes(Path::new("f.safetensors"), &bytes)
    };
    assert!(read(|_| ()).is_ok());
    for (change, told) in [
        ((|h| h.format_version = 9) as fn(&mut ForesightHeader), "format version 9"),
        (|h| h.scene.std[2] = 0.0, "scene normaliser: a std is 0"),
        (|h| h.manoeuvre.mean.truncate(3), "manoeuvre normaliser: expected 80 columns"),
    ] {
        let error = read(change).unwrap_err().to_string();
        assert!(error.starts_with("model f.safetensors: ") && error.contains(told), "{error}");
    }
    let bytes = foresight::encode(&header(), &scene, &manoeuvre);
    for length in [0, 8, 100, bytes.len() / 2, bytes.len() - 1] {
        assert!(Foresight::from_bytes(Path::new("f"), &bytes[..length]).is_err(), "{length}");
    }
    let mut flipped = bytes.clone();
    flipped[bytes.len() - 9] ^= 4;
    let error = Foresight::from_bytes(Path::new("f"), &flipped).unwrap_err().to_string();
    assert!(error.contains("checksum"), "{error}");
}

#[test]
fn one_is_enough_and_a_damaged_one_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mine.safetensors");
    let [scene, manoeuvre] = [&SCENE_LAYERS[..], &MANOEUVRE_LAYERS[..]].map(|w| drawn(w, 1));
    std::fs::write(&path, foresight::encode(&header(), &scene, &manoeuvre)).unwrap();
    let knn = Path::new("models/knn.bin");
    let models = Models::load(&[knn, &path]).unwrap();
    assert_eq!(models.foresight().unwrap().path(), path);
    let twice = Models::load(&[knn, &path, &path]).err().unwrap();
    assert!(matches!(twice, ModelsError::TwoForesights(_)), "{twice}");
    std::fs::write(&path, &std::fs::read(&path).unwrap()[..5000]).unwrap();
    let error = Models::load(&[knn, &path]).err().unwrap().to_string();
    assert!(error.contains("mine.safetensors: the file is cut off"), "{error}");
}
