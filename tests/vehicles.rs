//! Other vehicles: what a model serves, what it refuses, and one model for all.

#![cfg(feature = "lab")]

use std::path::Path;
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use n3p::lab::evaluation::oracle;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::output::PathFile;
use n3p::planners::{Budget, Problem};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType};
use proptest::prelude::*;

const BUDGET: Budget = Budget::new(200_000);

/// Plans generated scenes for `vehicle` with `method`; every path must pass the independent check.
/// Returns how many plans needed a search, and how many a full one.
fn plan_all(models: &Models, method: Method, vehicle: &Vehicle, count: u64) -> [usize; 2] {
    let mut planner = method.build(models, &MethodSettings::default()).unwrap();
    let (mut searched, mut full) = (0, 0);
    for kind in ParkingType::SQUARE {
        for level in Level::ALL {
            for i in 0..count {
                let scene = generate(&GeneratorConfig::default(), vehicle, kind, level, 909, i);
                let problem = Problem::new(&scene).unwrap();
                let result = planner.plan(&problem, BUDGET);
                let path = result.outcome.unwrap_or_else(|e| panic!("{}: {e}", scene.name));
                searched += usize::from(result.expansions > 0);
                full += usize::from(result.guidance.unwrap().route.is_fallback());
                let file = PathFile::new(&scene, &problem.frame, &path, method.name());
                oracle::check(&scene, &file).unwrap_or_else(|e| panic!("{}: {e}", scene.name));
            }
        }
    }
    [searched, full]
}

/// A vehicle within the Accord's footprint that turns at least as tightly.
fn covered() -> impl Strategy<Value = Vehicle> {
    let accord = Vehicle::default();
    (0.0..0.5f64, 0.0..0.3f64, 0.0..0.15f64, 0.0..0.1f64).prop_map(
        move |(front, rear, width, steer)| {
            let max_steer = accord.max_steer + steer;
            // The axle stays where it is; the wheelbase that keeps the radius.
            let wheelbase =
                (accord.turning_radius() * max_steer.tan()).min(accord.wheelbase - front);
            Vehicle {
                length: accord.length - front - rear,
                width: accord.width - width,
                wheelbase,
                rear_overhang: accord.rear_overhang - rear,
                max_steer,
                ..accord
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn a_model_serves_vehicles_that_its_own_covers(vehicle in covered()) {
        prop_assert!(vehicle.validate().is_ok() && Vehicle::default().covers(&vehicle));
        let models = Models::load(&["models/knn.bin"]).unwrap();
        prop_assert!(models.check_vehicle(Method::N3P, "a", &vehicle).is_ok());
        plan_all(&models, Method::N3P, &vehicle, 2);
    }

    #[test]
    fn whatever_it_covers_fits_where_it_fits(vehicle in covered(), x in -3.0..3.0f64, y in -3.0..3.0f64) {
        // The footprint of the smaller one, axle upon axle, lies within the larger one's.
        let (large, small) = (Vehicle::default().footprint(0.0), vehicle.footprint(0.0));
        let p = n3p::geometry::Vec2::new(x, y);
        prop_assert!(!small.contains(p) || large.contains(p));
        prop_assert!(vehicle.max_curvature() >= Vehicle::default().max_curvature() - 1e-4);
    }
}

#[test]
fn larger_wider_or_clumsier_vehicles_are_refused_with_the_way_to_train() {
    let accord = Vehicle::default();
    let models = Models::load(&["models/knn.bin"]).unwrap();
    for other in [
        Vehicle { length: accord.length + 0.1, ..accord },
        Vehicle { width: accord.width + 0.02, ..accord },
        Vehicle { rear_overhang: accord.rear_overhang + 0.05, ..accord },
        Vehicle { max_steer: accord.max_steer - 0.02, ..accord },
        Vehicle { wheelbase: accord.wheelbase + 0.1, ..accord },
    ] {
        assert!(!accord.covers(&other) && !accord.is_like(&other));
        let error = models.check_vehicle(Method::N3P, "lot", &other).unwrap_err().to_string();
        for part in
            ["scene lot", "knn.bin", "trained for another vehicle", "n3p-collect", "n3p-train knn"]
        {
            assert!(error.contains(part), "{error}");
        }
    }
}

#[test]
fn one_model_plans_for_vehicles_it_never_saw() {
    let models = Models::load(&["models/fleet.safetensors"]).unwrap();
    for name in ["held-out-hatch", "held-out-estate", "held-out-suv"] {
        let file = format!("experiments/vehicles/{name}.toml");
        let vehicle = Vehicle::read(Path::new(&file)).unwrap();
        // Known manoeuvres serve, but for those that are looked at once more.
        let [searched, full] = plan_all(&models, Method::N3P, &vehicle, 4);
        assert!(searched <= 24 && full <= 4, "{name}: {searched} of 36 searched, {full} in full");
        // Without the network every plan would be a full one.
        let [searched, full] = plan_all(&models, Method::MLP_N3P, &vehicle, 4);
        assert!(searched <= 22 && full <= 3, "{name}: {searched} of 36 searched, {full} in full");
    }
}

#[test]
fn models_of_several_vehicles_go_together() {
    let models = Models::load(&["models/knn.bin", "models/knn-tpcap.bin"]).unwrap();
    let tpcap = Vehicle::read("experiments/vehicles/tpcap.toml".as_ref()).unwrap();
    let of = |vehicle: &Vehicle| *models.serving(Method::KNN_N3P, vehicle).unwrap().vehicle();
    assert!(of(&Vehicle::default()).is_like(&Vehicle::default()));
    assert!(of(&tpcap).is_like(&tpcap));
    // The cases of Dragon Lake are 2 mm narrower.
    assert!(of(&Vehicle { width: 1.94, ..tpcap }).is_like(&tpcap));
    plan_all(&models, Method::N3P, &tpcap, 2);
    plan_all(&models, Method::N3P, &Vehicle::default(), 2);
}

fn run(program: &str, folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let path = match program {
        "n3p-collect" => cargo_bin!("n3p-collect"),
        _ => cargo_bin!("n3p-eval"),
    };
    let output = Command::new(path).current_dir(folder).args(arguments).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn vehicle_files_are_checked() {
    let dir = tempfile::tempdir().unwrap();
    let good = std::fs::read_to_string("experiments/vehicles/tpcap.toml").unwrap();
    for (text, told) in [
        (good.replace("1.942", "nan"), "car.toml: vehicle.width is NaN"),
        (good.replace("width", "widht"), "unknown field `widht`"),
        (good.replace("wheelbase = 2.8", ""), "missing field `wheelbase`"),
        (String::new(), "missing field"),
        (good.replace("4.69", "-4.69"), "vehicle.length is -4.69"),
    ] {
        std::fs::write(dir.path().join("car.toml"), &text).unwrap();
        for program in ["n3p-collect", "n3p-eval"] {
            let (code, stderr) = run(program, dir.path(), &["--vehicle", "car.toml"]);
            assert!(code == Some(2) && stderr.contains(told), "{program}: {stderr}");
        }
        assert!(!dir.path().join("datasets").exists());
    }
    let (code, stderr) = run("n3p-eval", dir.path(), &["--vehicle", "none.toml"]);
    assert!(code == Some(2) && stderr.contains("none.toml: cannot be read"), "{stderr}");
}
