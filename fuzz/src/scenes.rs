//! Structured random scenes: drawn by the generators, then pulled about.

use arbitrary::{Arbitrary, Result, Unstructured};
use n3p::Vehicle;
use n3p::geometry::{Frame, Pose};
use n3p::world::clutter::{VEHICLES, clutter};
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::lots::lot;
use n3p::world::{GoalTolerance, Level, ParkingType, Scene};

/// A number of hundredths within `reach` of 0.
fn about(u: &mut Unstructured, reach: f64) -> Result<f64> {
    Ok(f64::from(i16::arbitrary(u)?) / f64::from(i16::MAX) * reach)
}

fn pose_about(u: &mut Unstructured, pose: Pose, reach: f64) -> Result<Pose> {
    Ok(Pose::new(
        pose.x + about(u, reach)?,
        pose.y + about(u, reach)?,
        pose.heading + about(u, 0.6)?,
    ))
}

/// A scene; most have a free start and goal.
pub fn scene(u: &mut Unstructured) -> Result<Scene> {
    let kind = *u.choose(&ParkingType::ALL)?;
    let (seed, index) = (u64::from(u8::arbitrary(u)?), u64::from(u16::arbitrary(u)?));
    let vehicle = match u8::arbitrary(u)? % 9 {
        n @ 0..7 => VEHICLES[usize::from(n)].1,
        _ => Vehicle::default(),
    };
    let generator = GeneratorConfig::default();
    let mut scene = match u8::arbitrary(u)? % 4 {
        0 => clutter(seed, index),
        1 | 2 if generator.validate(&vehicle).is_ok() => {
            let level = *u.choose(&Level::ALL)?;
            generate(&generator, &vehicle, kind, level, seed, index)
        }
        _ => lot(&vehicle, kind, seed, index),
    };
    let size = scene.vehicle.length;
    if bool::arbitrary(u)? {
        scene.start = pose_about(u, scene.start, size / 2.0)?;
    }
    if u8::arbitrary(u)? % 4 == 0 {
        scene.goal = pose_about(u, scene.goal, size / 8.0)?;
    }
    if u8::arbitrary(u)? % 4 == 0 {
        scene.parking_type = None;
    }
    for _ in 0..u8::arbitrary(u)? % 4 {
        obstacle(u, &mut scene)?;
    }
    if u8::arbitrary(u)? % 8 == 0 {
        let one = pose_about(u, scene.goal, size)?;
        scene.goals = vec![scene.goal, one, scene.start];
    }
    if u8::arbitrary(u)? % 8 == 0 {
        let part = |u: &mut Unstructured| Ok(f64::from(u8::arbitrary(u)?) / 255.0);
        scene.goal_tolerance =
            Some(GoalTolerance { position_m: part(u)? / 2.0, heading_rad: part(u)? / 4.0 });
    }
    Ok(match u8::arbitrary(u)? % 4 {
        0 => elsewhere(&scene, u)?,
        _ => scene,
    })
}

/// Adds something that stands near the start or the goal, or between.
fn obstacle(u: &mut Unstructured, scene: &mut Scene) -> Result<()> {
    let size = scene.vehicle.length;
    let share = f64::from(u8::arbitrary(u)?) / 255.0;
    let at = [
        scene.start.x + share * (scene.goal.x - scene.start.x) + about(u, size)?,
        scene.start.y + share * (scene.goal.y - scene.start.y) + about(u, size)?,
    ];
    let mut corner = || Ok([at[0] + about(u, size / 4.0)?, at[1] + about(u, size / 4.0)?]);
    let corners = [corner()?, corner()?, corner()?];
    match u8::arbitrary(u)? % 3 {
        0 => scene.points.push(at),
        1 => scene.obstacles.push(corners[..2].to_vec()),
        _ => scene.obstacles.push(corners.to_vec()),
    }
    Ok(())
}

/// The scene turned, moved as far as maps reach, perhaps mirrored.
fn elsewhere(scene: &Scene, u: &mut Unstructured) -> Result<Scene> {
    let far = 10_f64.powi(i32::from(u8::arbitrary(u)? % 9));
    let origin_in_world = Pose::new(about(u, far)?, about(u, far)?, about(u, 3.2)?);
    let frame = Frame { origin_in_world, mirrored: bool::arbitrary(u)? };
    Ok(scene.placed(&frame))
}
