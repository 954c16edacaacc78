//! The library in one page: a scene file → a path → poses to drive.
//!
//! `cargo run --release --example plan_scene -- examples/scenes/reverse.json`

use std::path::Path;

use n3p::n3p::guided::{GuidedPlanner, RankedConfig};
use n3p::planners::{Budget, HybridAStarConfig, Planner, Problem};
use n3p::selectors::model::Model;
use n3p::world::Scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).unwrap_or("examples/scenes/reverse.json".to_owned());
    let scene = Scene::read(Path::new(&file))?;

    // The scene in planning coordinates, its obstacles indexed; refuses a start or goal in
    // collision. `problem.frame` leads back to the scene's own coordinates.
    let problem = Problem::new(&scene)?;

    // A model is trained for one vehicle and says so. A planner keeps its buffers: make it
    // once and use it for many scenes.
    let model = Model::load(Path::new("models/knn.bin"))?;
    model.check_vehicle(&scene.vehicle)?;
    let config = HybridAStarConfig::default();
    let mut planner =
        GuidedPlanner::ranked("n3p", model.into_selector(), config, RankedConfig::default());

    let result = planner.plan(&problem, Budget::new(200_000));
    let path = result.outcome?.to_world(&problem.frame);
    println!(
        "{}: {:.2} m, {} direction changes, {} expansions",
        scene.name,
        path.length(),
        path.direction_changes(),
        result.expansions
    );

    // Poses at most 0.1 m apart; gear and curvature belong to the motion that follows.
    for s in path.sample(0.1) {
        let steer = scene.vehicle.steer(s.curvature);
        println!(
            "{:8.3} {:8.3} {:7.4}  {:?} {steer:7.4}",
            s.pose.x, s.pose.y, s.pose.heading, s.gear
        );
    }
    Ok(())
}
