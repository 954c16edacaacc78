//! Model files. Each input is tried as it is, and once more with length and checksum mended, so that the
//! fuzzer gets behind them; a model that is accepted then has to answer and to plan.

use std::borrow::Cow;
use std::path::Path;
use std::sync::OnceLock;

use n3p::curves::Segment;
use n3p::geometry::Pose;
use n3p::planners::goals::{self, Terms};
use n3p::planners::{Budget, Planner};
use n3p::selectors::foresight::Foresight;
use n3p::selectors::knn_file::{self, KindHeader, KnnEntries, KnnEntry, KnnHeader};
use n3p::selectors::model::Model;
use n3p::selectors::{Features, PoseSelector, shipped, tensor_file};
use n3p::world::cell::{Axis, Grid};
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use n3p::{Method, Models, Vehicle};
use sha2::{Digest, Sha256};

use crate::check;

/// A `knn.bin`: whole, or its header and payload behind the length of the former.
pub fn knn(data: &[u8]) {
    try_model(data.to_vec());
    if let Some((length, rest)) = data.split_first_chunk::<2>() {
        let header = usize::from(u16::from_le_bytes(*length)).min(rest.len());
        try_model(knn_of(&rest[..header], &rest[header..]));
    }
}

fn knn_of(header: &[u8], payload: &[u8]) -> Vec<u8> {
    let mut bytes = knn_file::MAGIC.to_vec();
    bytes.extend(knn_file::VERSION.to_le_bytes());
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    let sum =
        Sha256::new().chain_update(&bytes).chain_update(header).chain_update(payload).finalize();
    bytes.extend(sum);
    bytes.extend(header);
    bytes.extend(payload);
    bytes
}

/// A safetensors file: an MLP, a model for any vehicle, or foresight.
pub fn tensors(data: &[u8]) {
    try_model(data.to_vec());
    if let Some(mended) = mended(data) {
        try_model(mended);
    }
}

/// The file with the checksum that its header and tensors have.
pub(crate) fn mended(data: &[u8]) -> Option<Vec<u8>> {
    let (length, rest) = data.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok().filter(|l| *l <= rest.len())?;
    let (header, tensors) = rest.split_at(length);
    let mut header: serde_json::Value = serde_json::from_slice(header).ok()?;
    let entry = header.get_mut("__metadata__")?.get_mut("n3p")?;
    let json = entry.as_str()?.split_once("\"header\":")?.1.strip_suffix('}')?.to_owned();
    let sum = Sha256::new().chain_update(&json).chain_update(tensors).finalize();
    let sum: String = sum.iter().map(|b| format!("{b:02x}")).collect();
    *entry = format!("{{\"sha256\":\"{sum}\",\"header\":{json}}}").into();
    let header = serde_json::to_vec(&header).ok()?;
    Some([&(header.len() as u64).to_le_bytes(), &header[..], tensors].concat())
}

/// One of the models compiled in, with bytes of it changed: which one, then for each change where (three
/// bytes), in which of its parts, and to what.
pub fn patched_model(data: &[u8]) {
    let Some((&which, patches)) = data.split_first() else { return };
    // The largest takes too long for each of many tries.
    let files: Vec<_> =
        shipped::FILES.iter().filter(|(_, bytes)| bytes.len() < 5_000_000).collect();
    let (name, bytes) = files[usize::from(which) % files.len()];
    let is_knn = bytes.starts_with(&knn_file::MAGIC);
    let (begin, length) = if is_knn {
        (56, u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize)
    } else {
        (8, u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize)
    };
    let mut header = bytes[begin..begin + length].to_vec();
    let mut payload = bytes[begin + length..].to_vec();
    for patch in patches.chunks_exact(8).take(64) {
        let at = usize::from(patch[0]) << 16 | usize::from(patch[1]) << 8 | usize::from(patch[2]);
        let part = if patch[3] % 2 == 0 { &mut header } else { &mut payload };
        let at = at % part.len();
        let end = (at + 4).min(part.len());
        part[at..end].copy_from_slice(&patch[4..4 + end - at]);
    }
    let whole = if is_knn {
        Some(knn_of(&header, &payload))
    } else {
        mended(&[&(header.len() as u64).to_le_bytes(), &header[..], &payload].concat())
    };
    let Some(whole) = whole else { return };
    if name.starts_with("foresight") {
        if let Ok(foresight) = Foresight::from_bytes(Path::new(name), &whole) {
            let _ = foresight.header();
        }
    }
    if let Some(selector) = try_model(whole) {
        plan_by(selector, patches.len());
    }
}

fn try_model(bytes: Vec<u8>) -> Option<Model> {
    let path = Path::new("fuzz");
    let _ = Foresight::from_bytes(path, &bytes);
    let model = Model::from_bytes(path, Cow::Owned(bytes)).ok()?;
    let vehicle = model.vehicle().copied().unwrap_or_default();
    let kinds = model.kinds();
    match &model {
        Model::Knn(m) => ask(m, &kinds, &vehicle),
        Model::Mlp(m) => ask(m, &kinds, &vehicle),
        Model::Fleet(m) => ask(&**m, &kinds, &vehicle),
    }
    Some(model)
}

fn ask(selector: &dyn PoseSelector, kinds: &[ParkingType], vehicle: &Vehicle) {
    for &kind in kinds {
        let grid = selector.grid(kind);
        for stance in grid.stances(kind).into_iter().take(3) {
            let _ = selector.manoeuvres(stance, vehicle);
        }
        let last = grid.cell_count(kind) - 1;
        for cell in [0, last / 2, last] {
            let features = Features::new(Pose::new(-6.0, 4.5, 0.1), grid.cell(kind, cell));
            let mut poses = Vec::new();
            selector.select(&features, vehicle, 3, &mut poses);
            assert!(poses.len() <= 3, "asked for 3, got {}", poses.len());
        }
    }
}

/// A plan by a wrong model may be a bad one, and is checked all the same.
fn plan_by(model: Model, which: usize) {
    static SCENES: OnceLock<Vec<Scene>> = OnceLock::new();
    let vehicle = model.vehicle().copied().unwrap_or_default();
    let scenes = SCENES.get_or_init(|| {
        let config = GeneratorConfig::default();
        let of = |kind| generate(&config, &Vehicle::default(), kind, Level::Complex, 3, 1);
        ParkingType::ALL.map(of).to_vec()
    });
    let Ok(models) = Models::default().with_selector(model) else { return };
    let Ok(mut planner) = Method::N3P.build(&models, &Default::default()) else { return };
    if models.check_vehicle(Method::N3P, "fuzz", &vehicle).is_ok() {
        let scene = Scene { vehicle, ..scenes[which % scenes.len()].clone() };
        checked(planner.as_mut(), &scene);
    }
}

fn checked(planner: &mut dyn Planner, scene: &Scene) {
    let budget = Budget::new(100);
    let Ok(planned) = goals::plan(planner, scene, Terms::default(), budget) else { return };
    if let Some(driven) = planned.result.driven() {
        check::path(scene, &planned.problem.frame, &driven, 0.0);
    }
}

/// Small models that are right, to begin from: target and bytes.
pub fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let one = |value| Axis { min: value, max: value, step: 1.0 };
    let grid = Grid {
        lane_width: one(5.0),
        bay_spot_width: one(3.0),
        parallel_spot_width: one(7.0),
        dead_end: one(12.0),
        ..Grid::default()
    };
    let kind = ParkingType::Parallel;
    let pose = Pose::new(2.0, 2.5, 0.3);
    let entries = KnnEntries {
        samples: vec![KnnEntry { cell: 0, start: Pose::new(-5.0, 3.0, 0.0), preparatory: pose }; 2],
        manoeuvres: vec![vec![Segment { curvature: 0.2, length: -3.0 }; 2]; 2],
    };
    let header = KnnHeader {
        vehicle: Vehicle::default(),
        grid,
        heading_radius: 4.0,
        extent: 16.0,
        kinds: vec![KindHeader {
            kind,
            cells: grid.cell_count(kind),
            samples: 2,
            poses: 0,
            manoeuvres: 2,
            segments: 4,
            manoeuvres_by_stance: Vec::new(),
        }],
        data_sha256: String::new(),
        seed: 1,
        crate_version: "0.1.0".to_owned(),
    };
    let whole = knn_file::encode(header, &[entries]);
    let length = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as u16;
    let parts = [&length.to_le_bytes(), &whole[56..]].concat();
    let mut seeds = vec![("knn", whole), ("knn", parts)];
    for (_, bytes) in shipped::FILES.iter().filter(|(name, _)| name.ends_with(".safetensors")) {
        // The header as it is, over tensors of no size: as far as the shapes.
        let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        let json: serde_json::Value = serde_json::from_slice(&bytes[8..8 + length]).unwrap();
        let entry = json["__metadata__"]["n3p"].as_str().unwrap();
        let header = entry.split_once("\"header\":").unwrap().1.strip_suffix('}').unwrap();
        if header.len() < 20_000 {
            let tensor =
                tensor_file::NamedTensor::f32("layers.0.bias".to_owned(), vec![2], &[0.5, 1.0]);
            seeds.push(("tensors", tensor_file::encode(header, vec![tensor])));
        }
    }
    for which in 0..7 {
        for part in 0..2 {
            seeds.push(("patched_model", vec![which, 0, 9, 40, part, 0x39, 0x2e, 0x35, 0x30]));
        }
    }
    seeds
}
