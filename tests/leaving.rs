//! Leaving spots: out of a confined place the way is planned as the way in.

#![cfg(feature = "lab")]

#[path = "fixtures/narrow.rs"]
mod narrow;

use n3p::episode::{self, Case, Episode, EpisodeConfig};
use n3p::lab::evaluation::oracle;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::planners::goals::Terms;
use n3p::planners::{Budget, Planner};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::lots::lot;
use n3p::world::{Level, ParkingType, Scene};

const BUDGET: Budget = Budget::new(200_000);

fn planner(method: Method) -> Box<dyn Planner> {
    let models = Models::usual(&[method], Some(&Vehicle::default())).unwrap();
    method.build(&models, &MethodSettings::default()).unwrap()
}

/// Plans a scene; the oracle has looked at the path.
fn run(planner: &mut dyn Planner, scene: Scene, terms: Terms) -> Episode {
    let config = EpisodeConfig { terms, repeats: 0, ..EpisodeConfig::new(BUDGET) };
    let case = Case { kind: scene.parking_type, level: None, set: String::new(), scene };
    episode::run(&case, planner, &config, &oracle::JUDGE).unwrap()
}

fn scenes() -> Vec<Scene> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let settings = ParkingType::ALL.into_iter().flat_map(|k| Level::ALL.map(|l| (k, l)));
    let home = settings.flat_map(|(k, l)| {
        let config = &config;
        (0..2).map(move |i| generate(config, &vehicle, k, l, 62, i))
    });
    let lots =
        ParkingType::ALL.into_iter().flat_map(|k| (0..3).map(move |i| lot(&vehicle, k, 62, i)));
    home.chain(lots).collect()
}

/// Out of where the scene parks, to where it starts.
fn left(scene: &Scene) -> Scene {
    Scene { start: scene.goal, goal: scene.start, parking_type: None, ..scene.clone() }
}

/// Length and changes of gear as one number, metres.
fn cost(episode: &Episode) -> f64 {
    let path = episode.result.outcome.as_ref().unwrap();
    path.length() + 3.0 * path.direction_changes() as f64
}

#[test]
fn what_can_be_parked_can_be_left() {
    let mut n3p = planner(Method::N3P);
    let (mut searched, mut all) = (0, 0);
    for scene in scenes() {
        let parked = run(n3p.as_mut(), scene.clone(), Terms::default());
        let out = run(n3p.as_mut(), left(&scene), Terms::default());
        let name = &scene.name;
        let path = out.result.outcome.as_ref().unwrap_or_else(|reason| panic!("{name}: {reason}"));
        assert!(path.start.distance(out.problem.start) < 1e-6, "{name}");
        assert!(path.end().distance(out.problem.goal) < 1e-6, "{name}");
        let (cost, known) = (cost(&out), cost(&parked));
        assert!(cost <= 1.5 * known, "{name}: {cost} against {known}");
        searched += usize::from(out.result.expansions > 0);
        all += 1;
        let again = run(n3p.as_mut(), left(&scene), Terms::default());
        assert_eq!(Ok(path), again.result.outcome.as_ref(), "{name}");
    }
    assert!(searched * 3 < all, "{searched} of {all}");
}

/// A search that comes from outside has to find its way into the spot: 200,000 expansions were not enough.
#[test]
fn every_search_leaves_a_narrow_spot() {
    let scene = narrow::narrow_spot(narrow::parked(), narrow::in_the_lane(6.0));
    for method in [Method::N3P, Method::HA_RS, Method::MHHA] {
        let out = run(planner(method).as_mut(), scene.clone(), Terms::default());
        let expansions = out.result.expansions;
        assert!(out.result.outcome.is_ok() && expansions < 100_000, "{method} {expansions}");
    }
}
