//! Samples → artefacts → selectors, on synthetic samples.

#![cfg(feature = "lab")]

use std::path::{Path, PathBuf};

use n3p::curves::Segment;
use n3p::geometry::{Pose, signed_angle};
use n3p::lab::dataset::{Dataset, Metadata, Sample, Status};
use n3p::lab::training::worlds::WorldsConfig;
use n3p::lab::training::{self, Loss, MlpConfig, Targets, TrainingError, Validation};
use n3p::planners::HybridAStarConfig;
use n3p::rng::{Stream, rng};
use n3p::selectors::artefact::{Fault, find_model};
use n3p::selectors::fleet::{self, FleetHeader, FleetSelector, Scaling};
use n3p::selectors::knn::KnnSelector;
use n3p::selectors::knn_file;
use n3p::selectors::mlp::MlpSelector;
use n3p::selectors::model::Model;
use n3p::selectors::nearest;
use n3p::selectors::network::{LAYERS, LayerWeights, pose_from_outputs};
use n3p::selectors::{Features, Normaliser, PoseSelector, UNIT_COUNT, UNIT_NAMES};
use n3p::vehicle::Vehicle;
use n3p::world::cell::{Axis, Cell, Grid};
use n3p::world::{ParkingType, Stance};
use proptest::prelude::*;
use rand::RngExt;

const KIND: ParkingType = ParkingType::Parallel;

/// 2 × 3 × 2 cells: small enough to fill, large enough to fall back in.
fn metadata() -> Metadata {
    let grid = Grid {
        lane_width: Axis { min: 4.0, max: 5.0, step: 1.0 },
        parallel_spot_width: Axis { min: 6.0, max: 7.0, step: 0.5 },
        dead_end: Axis { min: 4.0, max: 12.0, step: 8.0 },
        ..Grid::default()
    };
    Metadata {
        format_version: 1,
        vehicle: Vehicle::default(),
        grid,
        planner: HybridAStarConfig::default(),
        max_expansions: 1000,
        solutions: 1,
        samples_per_cell: 50,
        manoeuvres_per_cell: 50,
        start_behind: 0.0,
        start_heading_max: 0.5,
        cells_per_shard: 4,
        seed: 7,
        crate_version: "test".to_owned(),
        git_revision: "test".to_owned(),
    }
}

/// A preparatory pose that is a smooth function of start and cell.
fn answer(start: Pose, grid: &Grid, kind: ParkingType, cell: usize) -> Pose {
    let cell = grid.cell(kind, cell);
    Pose::new(
        2.0 + 0.3 * start.x.sin() + 0.2 * cell.spot_width,
        2.5 + 0.4 * start.y - 0.1 * cell.lane_width,
        0.5 * start.heading + 0.1 * (0.3 * start.x).cos(),
    )
}

fn sample(kind: ParkingType, cell: usize, index: usize, start: Pose) -> Sample {
    let grid = metadata().grid;
    Sample {
        cell: grid.cell(kind, cell),
        cell_index: cell as u32,
        sample_index: index as u32,
        start,
        status: Status::Solved,
        rs_start: answer(start, &grid, kind, cell),
        rs_word: "L+R-".to_owned(),
        rs_lengths: [1.0, -1.0, 0.0, 0.0, 0.0],
        entry: 0.0,
        // Two of three samples end with one of four manoeuvres.
        manoeuvre: (0..index % 3)
            .map(|i| Segment { curvature: 0.25, length: 0.5 + (i + index % 4) as f64 })
            .collect(),
        path_length: 10.0,
        direction_changes: 1,
        expansions: 10,
        seed: 7,
    }
}

/// `per_cell` samples in each of `cells`, with some failed ones between.
fn samples(kind: ParkingType, cells: &[usize], per_cell: usize, seed: u64) -> Vec<Sample> {
    let mut all = Vec::new();
    for &cell in cells {
        let mut rng = rng(seed, Stream::Start, cell as u64);
        for i in 0..per_cell {
            let mut draw = |low: f64, high: f64| rng.random_range(low..high);
            let start = Pose::new(draw(-8.0, 8.0), draw(2.0, 5.0), draw(-0.5, 0.5));
            all.push(sample(kind, cell, i, start));
        }
        let nan = Pose::new(f64::NAN, f64::NAN, f64::NAN);
        let failed = sample(kind, cell, per_cell, Pose::default());
        all.push(Sample { status: Status::NoPath, rs_start: nan, ..failed });
    }
    all
}

fn knn_of(samples: &[Sample], kinds: &[ParkingType], dir: &Path) -> KnnSelector {
    let path = dir.join("knn.bin");
    training::knn::train(&metadata(), samples, kinds, &NO_WORLDS.into(), &path).unwrap();
    KnnSelector::load(&path).unwrap()
}

/// Of the samples alone.
const NO_WORLDS: WorldsConfig = WorldsConfig { count: 0, seed: 1 };

fn features(start: Pose, cell: usize) -> Features {
    Features::new(start, metadata().grid.cell(KIND, cell))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Starts on a coarse lattice make ties common, doubled samples certain.
    #[test]
    fn knn_equals_a_linear_scan(
        starts in prop::collection::vec((-8i32..8, 2i32..6, -1i32..2), 1..400),
        queries in prop::collection::vec((-9.0f64..9.0, 1.0f64..6.0, -3.2f64..3.2), 8),
        on_lattice in (-8i32..8, 2i32..6, -1i32..2),
        n in 1usize..12,
    ) {
        let lattice = |(x, y, h): (i32, i32, i32)| {
            Pose::new(f64::from(x), f64::from(y), f64::from(h) * 0.25)
        };
        let stored: Vec<_> =
            starts.iter().enumerate().map(|(i, s)| sample(KIND, 0, i, lattice(*s))).collect();
        let dir = tempfile::tempdir().unwrap();
        let knn = knn_of(&stored, &[KIND], dir.path());
        let radius = knn.file().header().heading_radius;
        let mut queries: Vec<_> = queries.iter().map(|&(x, y, h)| Pose::new(x, y, h)).collect();
        queries.push(lattice(on_lattice));
        for query in queries {
            let point = KnnSelector::point(query, radius);
            let mut scan: Vec<_> = (0..stored.len())
                .map(|i| (KnnSelector::point(knn.file().start(0, i), radius), i))
                .map(|(p, i)| (nearest::distance_sq(&p, &point), i))
                .collect();
            scan.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            scan.truncate(n);
            let got: Vec<_> = knn.nearest(&features(query, 0), n)
                .iter().map(|h| (h.distance_sq, h.sample)).collect();
            prop_assert_eq!(got, scan, "query {:?}", query);
        }
    }
}

#[test]
fn a_stored_start_returns_its_own_pose() {
    let dir = tempfile::tempdir().unwrap();
    let all = samples(KIND, &[0, 5, 11], 40, 3);
    let knn = knn_of(&all, &[KIND], dir.path());
    for s in all.iter().filter(|s| s.status == Status::Solved) {
        let mut out = Vec::new();
        knn.select(&Features::new(s.start, s.cell), &Vehicle::default(), 1, &mut out);
        assert_eq!(out.len(), 1);
        let pose = out[0];
        assert!(pose.distance(s.rs_start) < 2e-6, "{pose:?} {:?}", s.rs_start);
        assert!(signed_angle(pose.heading, s.rs_start.heading).abs() < 1e-6);
    }
}

#[test]
fn an_empty_cell_falls_back_to_the_nearest_smaller_one() {
    // Index = (lane * 3 + spot) * 2 + dead end.
    let index = |lane: usize, spot: usize, dead: usize| (lane * 3 + spot) * 2 + dead;
    let dir = tempfile::tempdir().unwrap();
    let stored = [index(0, 0, 0), index(0, 1, 1), index(1, 0, 1)];
    let knn = knn_of(&samples(KIND, &stored, 3, 1), &[KIND], dir.path());
    for (cell, expected) in [
        (index(0, 0, 0), Some(index(0, 0, 0))),
        (index(0, 0, 1), Some(index(0, 0, 0))),
        // Both neighbours are one step away: the wider lane wins.
        (index(1, 1, 1), Some(index(1, 0, 1))),
        (index(0, 2, 1), Some(index(0, 1, 1))),
        (index(0, 2, 0), Some(index(0, 0, 0))),
        (index(1, 2, 0), Some(index(0, 0, 0))),
    ] {
        assert_eq!(knn.source_cell(0, cell), expected, "cell {cell}");
        let near = knn.nearest(&features(Pose::new(0.0, 3.0, 0.0), cell), 1);
        assert_eq!(near.first().map(|n| n.cell), expected);
    }
    let knn = knn_of(&samples(KIND, &[index(1, 1, 1)], 3, 1), &[KIND], dir.path());
    let mut out = Vec::new();
    knn.select(
        &features(Pose::new(0.0, 3.0, 0.0), index(1, 1, 0)),
        &Vehicle::default(),
        3,
        &mut out,
    );
    assert!(out.is_empty(), "a larger cell must not answer");
}

#[test]
fn several_poses_differ_and_keep_their_order() {
    let dir = tempfile::tempdir().unwrap();
    let knn = knn_of(&samples(KIND, &[4], 200, 3), &[KIND], dir.path());
    let query = features(Pose::new(1.0, 3.0, 0.1), 4);
    let before = Pose::default();
    let (mut one, mut many) = (Vec::new(), vec![before]);
    knn.select(&query, &Vehicle::default(), 1, &mut one);
    knn.select(&query, &Vehicle::default(), 5, &mut many);
    assert_eq!(many[0], before, "poses are appended");
    assert_eq!(one[0], many[1]);
    assert!(many.len() > 2 && many.len() <= 6, "{many:?}");
    for (i, a) in many[1..].iter().enumerate() {
        for b in &many[i + 2..] {
            let same = a.distance(*b) <= KnnSelector::SAME_POSITION
                && signed_angle(a.heading, b.heading).abs() <= KnnSelector::SAME_HEADING;
            assert!(!same, "{a:?} {b:?}");
        }
    }
}

#[test]
fn one_file_holds_all_types_and_the_same_input_gives_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let mut all: Vec<_> =
        ParkingType::ALL.iter().flat_map(|k| samples(*k, &[0, 1], 20, 5)).collect();
    let knn = knn_of(&all, &ParkingType::ALL, dir.path());
    assert_eq!(knn.kinds(), ParkingType::ALL);
    let files = || {
        let paths = [knn.path().to_owned(), training::log_path(knn.path())];
        (paths.map(|path| std::fs::read(path).unwrap()), card(knn.path()))
    };
    let before = files();
    all.reverse();
    knn_of(&all, &ParkingType::ALL, dir.path());
    assert!(before == files(), "the order of rows must not matter");
    let error = training::knn::train(
        &metadata(),
        &samples(KIND, &[0], 5, 1),
        &ParkingType::SQUARE,
        &NO_WORLDS.into(),
        &dir.path().join("other.bin"),
    );
    assert!(matches!(error, Err(TrainingError::NoSamples(ParkingType::Forward))));
}

/// Networks for angled bays see how the bay slants, and stand beside those of other grids.
#[test]
fn networks_for_angled_bays_see_the_slant() {
    let dir = tempfile::tempdir().unwrap();
    let path = |kind: ParkingType| dir.path().join(format!("mlp-{kind}.safetensors"));
    for kind in [ParkingType::Angled, KIND] {
        let all = samples(kind, &[0, 1], 20, 5);
        training::mlp::train(&metadata(), &all, kind, &quick(2), &path(kind)).unwrap();
    }
    let both = MlpSelector::load_all(path(KIND), &[path(ParkingType::Angled)]).unwrap();
    let [first, second] = [0, 1].map(|i| both.headers().nth(i).unwrap().layers[0]);
    assert_eq!([first, second], [6, 8]);
    let grid = metadata().grid;
    let stances = grid.stances(ParkingType::Angled);
    let cell = grid.cell(ParkingType::Angled, 0);
    let answers: Vec<Pose> = [stances[0], stances[stances.len() - 1]]
        .map(|stance| Features::new(Pose::new(-5.0, 5.0, 0.1), Cell { stance, ..cell }))
        .iter()
        .map(|features| both.predict(features).unwrap())
        .collect();
    assert!(answers[0].distance(answers[1]) > 1e-6, "{answers:?}");
}

/// Whoever learns in worlds knows more, whatever the order of rows, and what is used most comes first.
#[test]
fn manoeuvres_are_learnt_in_worlds() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("knn.bin");
    let few = samples(KIND, &[0], 5, 1);
    let stance = Stance::new(KIND, 0.0);
    let learnt = |count| {
        let config = WorldsConfig { count, seed: 3 };
        training::knn::train(&metadata(), &few, &[KIND], &config.into(), &path).unwrap();
        (KnnSelector::load(&path).unwrap().manoeuvres(stance, &metadata().vehicle), config)
    };
    let (none, _) = learnt(0);
    let (some, config) = learnt(60);
    assert!(some.len() > none.len() + 5, "{} and {}", some.len(), none.len());
    assert_eq!(learnt(60).0, some, "the same worlds teach the same");
    let text = card(&path);
    assert!(text.contains("60 generated worlds of each type (seed 3)"), "{text}");
    let log: training::knn::KnnLog =
        serde_json::from_slice(&std::fs::read(training::log_path(&path)).unwrap()).unwrap();
    assert_eq!(log.worlds, config);
    // So do those that drive smaller cars.
    let small = Metadata {
        vehicle: Vehicle {
            length: 4.0,
            width: 1.66,
            wheelbase: 2.4,
            rear_overhang: 0.7,
            ..metadata().vehicle
        },
        ..metadata()
    };
    training::knn::train(&small, &few, &[KIND], &config.into(), &path).unwrap();
    let of_small = KnnSelector::load(&path).unwrap().manoeuvres(stance, &small.vehicle);
    assert!(of_small.len() > 5, "{}", of_small.len());
    let error = training::knn::train(
        &metadata(),
        &few,
        &[KIND],
        &WorldsConfig { count: 2_000_000, seed: 3 }.into(),
        &path,
    );
    assert!(error.unwrap_err().to_string().contains("worlds is 2000000; expected 0 to 1000000"));
}

fn quick(epochs: usize) -> MlpConfig {
    // The samples are made up: their poses are to be learnt as they are.
    let (targets, validation) = (Targets::Stored, Validation::Cells);
    let patience = epochs;
    MlpConfig { epochs, patience, batch: 64, seed: 11, targets, validation, ..MlpConfig::default() }
}

fn train_mlp(samples: &[Sample], config: &MlpConfig, path: &Path) -> training::mlp::TrainingLog {
    training::mlp::train(&metadata(), samples, KIND, config, path).unwrap()
}

#[test]
fn mlp_learns_a_smooth_mapping_reproducibly() {
    let dir = tempfile::tempdir().unwrap();
    let cells: Vec<usize> = (0..12).collect();
    let all = samples(KIND, &cells, 60, 9);
    // The Huber loss is linear far out, so that it falls slower than the squared error.
    for (loss, fall) in [(Loss::Mse, 10.0), (Loss::Huber, 5.0)] {
        let config = MlpConfig { loss, ..quick(25) };
        let path = dir.path().join("mlp-parallel.safetensors");
        let log = train_mlp(&all, &config, &path);
        let (first, last) = (log.losses[0].train, log.losses[log.losses.len() - 1].train);
        assert!(last < first / fall, "{loss:?}: {first} → {last}");
        assert!(log.validation.position_median_m < 0.3, "{:?}", log.validation);
        assert!(log.validation_rows > 0 && log.best_epoch > 0);
        let again = dir.path().join("again.safetensors");
        train_mlp(&all, &config, &again);
        assert!(std::fs::read(&path).unwrap() == std::fs::read(&again).unwrap(), "same bytes");
        let reach = log.reach;
        assert!(reach.rows > 0 && reach.direct <= reach.to_goal && reach.to_goal <= 1.0);
        assert!(path.with_extension("training.svg").exists());
    }
    let log = std::fs::read(training::log_path(&dir.path().join("again.safetensors")));
    let log: training::mlp::TrainingLog = serde_json::from_slice(&log.unwrap()).unwrap();
    assert_eq!(log.config.loss, Loss::Huber);
}

fn card(model: &Path) -> String {
    std::fs::read_to_string(training::card_path(model)).unwrap()
}

#[test]
fn every_model_gets_a_card_of_the_same_bytes() {
    let all = samples(KIND, &[0, 3, 7, 11], 30, 2);
    let trained = || {
        let dir = tempfile::tempdir().unwrap();
        let knn = knn_of(&all, &[KIND], dir.path());
        let mlp = dir.path().join("mlp-parallel.safetensors");
        train_mlp(&all, &quick(3), &mlp);
        (dir, knn, mlp)
    };
    let [(dir, knn, mlp), (_other, knn_again, mlp_again)] = [trained(), trained()];
    for (path, again) in [(knn.path(), knn_again.path()), (&mlp, &mlp_again)] {
        let card = card(path);
        assert_eq!(card, self::card(again), "same samples, settings and seed");
        let folder = dir.path().to_str().unwrap();
        assert!(!card.contains(folder), "no path of this machine: {card}");
    }
    let hash = &knn.file().header().data_sha256;
    let mlp_hash = &MlpSelector::load(&mlp).unwrap().headers().next().unwrap().data_sha256.clone();
    assert!(card(knn.path()).contains(hash) && card(&mlp).contains(mlp_hash));
    for text in [card(knn.path()), card(&mlp)] {
        assert!(text.contains("| parallel | 12 | 124 | 120 (96.8 %) |"), "{text}");
        assert!(text.contains("| Seed | 7 |"), "{text}");
    }
    assert!(card(&mlp).contains("| Seed | 11 ("), "of the training");
    let (_, link) =
        card(&mlp).split_once("](<").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    assert!(dir.path().join(link.split_once(">)").unwrap().0).exists(), "the curve is there");
    let reseeded = MlpConfig { seed: 12, ..quick(3) };
    train_mlp(&all, &reseeded, &mlp);
    assert_ne!(card(&mlp), card(&mlp_again));
}

#[test]
fn knn_leaves_a_log_with_what_neighbours_answer() {
    let dir = tempfile::tempdir().unwrap();
    let all = samples(KIND, &[0, 5, 11], 40, 3);
    let knn = knn_of(&all, &[KIND], dir.path());
    let log = std::fs::read(training::log_path(knn.path())).unwrap();
    let log: training::knn::KnnLog = serde_json::from_slice(&log).unwrap();
    let header = knn.file().header();
    assert_eq!((&log.data_sha256, log.seed), (&header.data_sha256, header.seed));
    assert_eq!(log.heading_radius, header.heading_radius);
    assert_eq!(log.bytes as u64, std::fs::metadata(knn.path()).unwrap().len());
    let kind = &log.kinds[0];
    assert_eq!((kind.rows, kind.samples, kind.occupied_cells), (123, 120, 3));

    // The model itself answers a stored start with the sample, then with its neighbours.
    let solved: Vec<_> = all.iter().filter(|s| s.status == Status::Solved).collect();
    let mut distances: Vec<f64> = (0..solved.len())
        .map(|i| {
            let near = knn.nearest(&Features::new(solved[i].start, solved[i].cell), 2);
            let other = near.iter().find(|n| n.sample != i).unwrap();
            knn.file().preparatory(0, other.sample).distance(solved[i].rs_start)
        })
        .collect();
    distances.sort_by(f64::total_cmp);
    let errors = kind.leave_one_out.unwrap().errors;
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    assert!(mean > 0.01 && (errors.position_mean_m - mean).abs() < 1e-5, "{errors:?} {mean}");
    assert!((errors.position_p95_m - distances[113]).abs() < 1e-5, "{errors:?}");
}

/// The network as candle computes it from the same file.
fn candle_prediction(path: &Path, mlp: &MlpSelector, features: &Features) -> Pose {
    use candle_core::{Device, Tensor};
    use candle_nn::{Linear, Module};
    let header = mlp.headers().next().unwrap();
    let tensors = candle_core::safetensors::load(path, &Device::Cpu).unwrap();
    let input = header.input.normalise(features.values());
    let mut x = Tensor::from_slice(&input, (1, 6), &Device::Cpu).unwrap();
    for n in 0..LAYERS.len() - 1 {
        let get = |part: &str| tensors[&format!("layers.{n}.{part}")].clone();
        x = Linear::new(get("weight"), Some(get("bias"))).forward(&x).unwrap();
        if n + 2 < LAYERS.len() {
            x = x.relu().unwrap();
        }
    }
    let row = x.to_vec2::<f32>().unwrap();
    pose_from_outputs(header.output.restore([row[0][0], row[0][1], row[0][2], row[0][3]]))
}

#[test]
fn mlp_inference_equals_candle() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mlp-parallel.safetensors");
    let all = samples(KIND, &[0, 3, 7, 11], 60, 2);
    train_mlp(&all, &quick(3), &path);
    let mlp = MlpSelector::load(&path).unwrap();
    for s in &all {
        let features = Features::new(s.start, s.cell);
        let (ours, candle) =
            (mlp.predict(&features).unwrap(), candle_prediction(&path, &mlp, &features));
        assert!(ours.distance(candle) < 1e-4, "{ours:?} {candle:?}");
        assert!(signed_angle(ours.heading, candle.heading).abs() < 1e-4);
    }
    let elsewhere = metadata().grid.cell(ParkingType::Reverse, 0);
    let mut out = Vec::new();
    mlp.select(&Features::new(Pose::default(), elsewhere), &Vehicle::default(), 3, &mut out);
    assert!(out.is_empty(), "a type without a network has no answer");
}

#[test]
fn training_refuses_bad_rows_and_settings() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("m.safetensors");
    let mut all = samples(KIND, &[0, 1], 20, 2);
    let train = |samples: &[Sample], config: &MlpConfig| {
        training::mlp::train(&metadata(), samples, KIND, config, &out).unwrap_err()
    };
    let config = MlpConfig { batch: 0, ..MlpConfig::default() };
    assert!(train(&all, &config).to_string().starts_with("batch is 0"));
    assert!(matches!(train(&all[..5], &quick(1)), TrainingError::TooFew { samples: 5, .. }));
    assert!(matches!(train(&[], &quick(1)), TrainingError::NoSamples(KIND)));
    all[3].rs_start.x = f64::NAN;
    let error = train(&all, &quick(1)).to_string();
    assert!(error.contains("sample 3 of parallel cell 0"), "{error}");
    assert!(toml::from_str::<MlpConfig>("epoch = 3").unwrap_err().to_string().contains("epoch"));
}

/// A model of each kind, and the folder that holds them.
fn both_models() -> (tempfile::TempDir, [PathBuf; 2]) {
    let dir = tempfile::tempdir().unwrap();
    let all = samples(KIND, &[0, 3], 30, 2);
    let knn = knn_of(&all, &[KIND], dir.path()).path().to_owned();
    let mlp = dir.path().join("mlp-parallel.safetensors");
    train_mlp(&all, &quick(1), &mlp);
    (dir, [knn, mlp])
}

fn fault(path: &Path, bytes: &[u8]) -> Fault {
    std::fs::write(path, bytes).unwrap();
    let error = Model::load(path).expect_err("a damaged model must be refused");
    assert_eq!(error.path, path);
    assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    error.fault
}

#[test]
fn damaged_models_are_refused() {
    let (dir, models) = both_models();
    let bad = dir.path().join("bad");
    for path in &models {
        let good = std::fs::read(path).unwrap();
        assert_eq!(Model::load(path).unwrap().kinds(), [KIND]);
        assert!(matches!(fault(&bad, &[]), Fault::Empty));
        assert!(matches!(fault(&bad, b"PK"), Fault::NotAModel));
        assert!(matches!(
            fault(&bad, &[b"hello world, ".as_slice(), &good].concat()),
            Fault::NotAModel
        ));
        for length in [9, 40, 100, good.len() / 2, good.len() - 1] {
            let fault = fault(&bad, &good[..length]);
            let told = matches!(fault, Fault::Length { got, .. } if got == length as u64);
            assert!(told, "{} cut to {length}: {fault}", path.display());
        }
        let longer = [good.as_slice(), &[0]].concat();
        assert!(matches!(fault(&bad, &longer), Fault::Length { .. }));
        // Any flipped bit is noticed; in the second half, which is data, as a checksum.
        for i in 0..200 {
            let at = i * (good.len() - 1) / 199;
            let mut flipped = good.clone();
            flipped[at] ^= 1 << (i % 8);
            let fault = fault(&bad, &flipped);
            assert!(at < good.len() / 2 || matches!(fault, Fault::Checksum), "byte {at}: {fault}");
        }
    }
    let missing = Model::load(&dir.path().join("none.bin")).unwrap_err();
    assert!(matches!(missing.fault, Fault::Missing));
    assert!(matches!(Model::load(dir.path()).unwrap_err().fault, Fault::Unreadable(_)));
}

#[test]
fn other_versions_and_shapes_are_named() {
    let (dir, [knn, mlp]) = both_models();
    let bad = dir.path().join("bad");
    let mut bytes = std::fs::read(&knn).unwrap();
    bytes[8] = 9;
    let text = fault(&bad, &bytes).to_string();
    let ours = format!("version {}", knn_file::VERSION);
    assert!(text.contains("version 9") && text.contains(&ours), "{text}");

    let replace = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let mut bytes = std::fs::read(&mlp).unwrap();
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).expect(from);
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        fault(&bad, &bytes)
    };
    let text = replace(r#"\"format_version\":1"#, r#"\"format_version\":7"#).to_string();
    assert!(text.contains("version 7") && text.contains("version 1"), "{text}");
    let text = replace(r#""shape":[256,6]"#, r#""shape":[6,256]"#).to_string();
    assert!(text.contains("expected F32 [256, 6], got F32 [6, 256]"), "{text}");
    let text = replace("layers.2.bias", "layers.2.bios").to_string();
    assert!(text.contains("layers.2.bias") && text.contains("got nothing"), "{text}");
}

#[test]
fn models_of_another_vehicle_or_twice_the_same_are_refused() {
    let (_dir, [knn, mlp]) = both_models();
    let van = Vehicle { length: 5.5, ..Vehicle::default() };
    for path in [&knn, &mlp] {
        let model = Model::load(path).unwrap();
        model.check_vehicle(&Vehicle::default()).unwrap();
        let text = model.check_vehicle(&van).unwrap_err().to_string();
        assert!(
            text.contains("length is 4.97, wanted 5.5") && text.contains("n3p-train"),
            "{text}"
        );
    }
    let error = MlpSelector::load_all(&mlp, &[&mlp]).unwrap_err();
    assert!(matches!(error.fault, Fault::Mismatch(_)), "{error}");
}

#[test]
fn names_with_folders_are_taken_as_they_are() {
    assert_eq!(find_model("some/knn.bin"), Path::new("some/knn.bin"));
    assert_eq!(find_model("no-such-model.bin"), Path::new("no-such-model.bin"));
}

fn n3p_train(dir: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    assert_cmd::Command::cargo_bin("n3p-train").unwrap().current_dir(dir).args(args).assert()
}

#[test]
fn the_command_refuses_bad_input_before_training() {
    use predicates::str::contains;
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("bad.toml"), "epoch = 3").unwrap();
    std::fs::write(dir.path().join("file"), "no folder").unwrap();
    let refused = |args: &[&str], told: &str| {
        let result = n3p_train(dir.path(), args).code(2).stderr(contains(told));
        let lines = String::from_utf8_lossy(&result.get_output().stderr).lines().count();
        assert!(lines <= 2, "{args:?}: {lines} lines");
    };
    let parallel = ["mlp", "--type", "parallel"];
    refused(&[&parallel[..], &["--config", "bad.toml"]].concat(), "bad.toml: line 1");
    refused(&[&parallel[..], &["--config", "bad.toml"]].concat(), "`epoch`");
    refused(
        &[&parallel[..], &["--out", "file/m.safetensors"]].concat(),
        "m.safetensors: cannot be written",
    );
    refused(&["knn", "--out", "file/knn.bin"], "file/knn.bin: cannot be written");
    refused(&["knn", "--data", "nowhere"], "nowhere");
    refused(&["mlp", "--out", "m.safetensors"], "--type");
}

#[test]
fn one_network_learns_from_several_vehicles_reproducibly() {
    let dir = tempfile::tempdir().unwrap();
    let small = Dataset::read("datasets/small".as_ref(), None).unwrap();
    let part = |width: f64| {
        let mut set = Dataset { metadata: small.metadata.clone(), samples: vec![] };
        set.metadata.vehicle.width = width;
        // What the wider car drove, the narrower one can drive as well.
        set.samples.extend(small.samples.iter().filter(|s| s.cell_index % 40 == 7).cloned());
        set
    };
    let sets = [part(1.86), part(1.70)];
    let train = |name: &str| {
        let path = dir.path().join(name);
        let log = training::fleet::train(&sets, &quick(3), &NO_WORLDS, &path).unwrap();
        (log, std::fs::read(&path).unwrap())
    };
    let (log, bytes) = train("a.safetensors");
    assert!(train("b.safetensors").1 == bytes, "not the same bytes again");
    assert!(dir.path().join("a.card.md").exists() && dir.path().join("a.training.json").exists());
    let path = dir.path().join("a.safetensors");
    let fleet = FleetSelector::from_bytes(&path, &bytes).unwrap();
    for of_kind in &log.kinds {
        let kind = of_kind.kind;
        assert!(dir.path().join(format!("a.{kind}.training.svg")).exists());
        let solved = || sets.iter().flat_map(|s| s.solved()).filter(|s| s.cell.kind() == kind);
        assert_eq!(of_kind.samples, solved().count());
        assert_eq!(of_kind.train_rows + of_kind.validation_rows, of_kind.samples);
        assert!(of_kind.losses[of_kind.best_epoch - 1].train < of_kind.losses[0].train);
        // What the log says of errors is what the file answers.
        let mut errors = Vec::new();
        for set in &sets {
            let vehicle = &set.metadata.vehicle;
            assert!(!fleet.manoeuvres(Stance::new(kind, 0.0), vehicle).is_empty());
            for s in set.solved().filter(|s| s.cell.kind() == kind) {
                let mut poses = Vec::new();
                fleet.select(&Features::new(s.start, s.cell), vehicle, 2, &mut poses);
                assert_eq!(poses.len(), 1);
                errors.push(poses[0].distance(s.rs_start));
            }
        }
        errors.sort_by(f64::total_cmp);
        let (median, told) = (errors[errors.len() / 2], of_kind.validation.position_median_m);
        assert!((0.4..2.5).contains(&(median / told)), "{kind}: {median} m, told {told} m");
    }
    for cut in [9, 500, bytes.len() / 2, bytes.len() - 1] {
        assert!(FleetSelector::from_bytes(&path, &bytes[..cut]).is_err());
    }
    let mut flipped = bytes.clone();
    flipped[bytes.len() - 100] ^= 1;
    let error = FleetSelector::from_bytes(&path, &flipped).unwrap_err().to_string();
    assert!(error.contains("checksum"), "{error}");
}

#[test]
fn files_for_any_vehicle_say_what_is_wrong_with_them() {
    let scaling = Scaling {
        input: Normaliser { mean: vec![0.0; UNIT_COUNT], std: vec![1.0; UNIT_COUNT] },
        output: Normaliser { mean: vec![0.0; 4], std: vec![1.0; 4] },
    };
    let good = FleetHeader {
        format_version: fleet::VERSION,
        fleet: vec![Vehicle::default()],
        data_sha256: vec![],
        kinds: vec![(KIND, 1, 1)],
        grid: Grid::default(),
        features: UNIT_NAMES.map(str::to_owned).to_vec(),
        scaling: vec![scaling],
        training: serde_json::Value::Null,
        crate_version: String::new(),
    };
    let weights: Vec<LayerWeights> = fleet::UNIT_LAYERS
        .windows(2)
        .map(|size| LayerWeights { weight: vec![0.0; size[0] * size[1]], bias: vec![0.5; size[1]] })
        .collect();
    let path = Path::new("fleet.safetensors");
    let read = |change: fn(&mut FleetHeader)| {
        let mut header = good.clone();
        change(&mut header);
        let manoeuvre = vec![vec![Segment { curvature: 0.5, length: -1.0 }]];
        FleetSelector::from_bytes(
            path,
            &fleet::encode(&header, &[manoeuvre], std::slice::from_ref(&weights)),
        )
    };
    let fleet = read(|_| ()).unwrap();
    let (start, vehicle) = (Pose::default(), Vehicle::default());
    let features = Features::new(start, Grid::default().cell(KIND, 0));
    let pose = fleet.predict(&features, &vehicle).unwrap();
    assert!((pose.x - 0.5 * vehicle.turning_radius()).abs() < 1e-6, "{pose:?}");
    let other = Features::new(start, Grid::default().cell(ParkingType::Reverse, 0));
    assert!(fleet.predict(&other, &vehicle).is_none());
    for (change, told) in [
        ((|h| h.format_version = 1) as fn(&mut FleetHeader), "format version 1"),
        (|h| h.features[2] = "colour".into(), "features: expected"),
        (|h| h.scaling.clear(), "scaling: expected one for each type"),
        (|h| h.scaling[0].input.std[3] = 0.0, "input normaliser: a std is 0"),
        (|h| h.scaling[0].output.mean.truncate(2), "output normaliser: expected 4 columns"),
        (|h| h.kinds[0].2 = 2, "tensor parallel.segments: expected F32 [2, 2]"),
        (|h| h.grid.lane_width.step = 0.0, "grid.lane_width"),
    ] {
        let error = read(change).unwrap_err().to_string();
        assert!(error.starts_with("model fleet.safetensors: "), "{error}");
        assert!(error.contains(told), "{told}: {error}");
    }
}
