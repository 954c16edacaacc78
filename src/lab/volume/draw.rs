//! The scene of a number.

use rand::RngExt;
use std::f64::consts::PI;

use super::{VolumeConfig, VolumeWorld};
use crate::episode::Case;
use crate::geometry::{Frame, Pose};
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;
use crate::world::clutter::{VEHICLES, clutter};
use crate::world::generate::{GeneratorConfig, generate, wide};
use crate::world::lots::lot;
use crate::world::{Level, ParkingType, Scene};

/// The numbers of one world, vehicle, type and level: scenes of volume runs begin at indices that no
/// experiment comes to.
const FIRST_INDEX: u64 = 1 << 32;

/// Draws of sizes for the world [`VolumeWorld::Wide`] until some leave room for the vehicle.
const DRAWS: u64 = 64;

/// The scene `number`, from 0: worlds take turns, then vehicles, then types, then levels. The seven vehicles
/// are those of [`VEHICLES`]; at home, where sizes are those of the paper, the ones that fit there.
pub fn draw(config: &VolumeConfig, number: u64) -> Case {
    let mut rest = number;
    let mut turn = |of: usize| {
        let turn = rest % of as u64;
        rest /= of as u64;
        turn as usize
    };
    let world = config.worlds[turn(config.worlds.len())];
    let (mut kind, mut level) = (None, None);
    let scene = match world {
        VolumeWorld::Clutter => clutter(config.seed, FIRST_INDEX + rest),
        _ => {
            let vehicles = vehicles(world);
            let vehicle = vehicles[turn(vehicles.len())];
            let of = ParkingType::ALL[turn(ParkingType::ALL.len())];
            kind = Some(of);
            match world {
                VolumeWorld::Home => {
                    let hard = Level::ALL[turn(Level::ALL.len())];
                    level = Some(hard);
                    let generator = GeneratorConfig::default();
                    generate(&generator, &vehicle, of, hard, config.seed, FIRST_INDEX + rest)
                }
                VolumeWorld::Wide => some_wide(&vehicle, of, config.seed, FIRST_INDEX + rest),
                _ => lot(&vehicle, of, config.seed, FIRST_INDEX + rest),
            }
        }
    };
    let scene =
        Scene { name: format!("{number:07}-{}", world.name()), ..place(config, number, scene) };
    Case { scene, kind, level, set: world.name().to_owned() }
}

/// The vehicles of a world.
fn vehicles(world: VolumeWorld) -> Vec<Vehicle> {
    let generator = GeneratorConfig::default();
    let fits = |v: &Vehicle| world != VolumeWorld::Home || generator.validate(v).is_ok();
    VEHICLES.map(|(_, vehicle)| vehicle).into_iter().filter(fits).collect()
}

fn some_wide(vehicle: &Vehicle, kind: ParkingType, seed: u64, index: u64) -> Scene {
    let drawn = (0..DRAWS).find_map(|i| wide(vehicle, kind, seed, index * DRAWS + i).ok());
    // Sizes leave no room once in a while; for a vehicle that they hardly ever fit, a car park does, another than those
    // of the world of car parks.
    drawn.unwrap_or_else(|| lot(vehicle, kind, seed.wrapping_add(1), index))
}

/// Puts every other scene somewhere on a map.
fn place(config: &VolumeConfig, number: u64, scene: Scene) -> Scene {
    let far = config.map_coordinates;
    let mut rng = rng(config.seed, Stream::Place, number);
    if far == 0.0 || rng.random_bool(0.5) {
        return scene;
    }
    let origin_in_world = Pose::new(
        rng.random_range(-far..far),
        rng.random_range(-far..far),
        rng.random_range(-PI..PI),
    );
    scene.placed(&Frame { origin_in_world, mirrored: rng.random_bool(0.5) })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    #[test]
    fn every_number_is_a_scene_of_its_own_and_always_the_same() {
        let text = "version = 1\nseed = 3\ncount = 400\nmap_coordinates = 1e6";
        let config: VolumeConfig = toml::from_str(text).unwrap();
        let (mut starts, mut settings) = (BTreeSet::new(), BTreeSet::new());
        let mut far = 0;
        for number in 0..config.count {
            let case = draw(&config, number);
            assert_eq!(case.scene, draw(&config, number).scene);
            case.scene.validate(Path::new("drawn")).unwrap();
            starts.insert(format!("{:?}", (case.scene.start, case.scene.vehicle, case.kind)));
            far += usize::from(case.scene.start.x.abs() > 1000.0);
            let length = format!("{:.2}", case.scene.vehicle.length);
            settings.insert((case.set, length, case.kind.map(|k| k.name())));
        }
        assert_eq!(starts.len(), 400);
        assert!((150..250).contains(&far), "{far}");
        // Three worlds of four types (seven vehicles, at home those that fit), and clutter's seven.
        let home = vehicles(VolumeWorld::Home).len();
        assert!((2..=7).contains(&home), "{home}");
        assert_eq!(settings.len(), (7 + 7 + home) * 4 + 7);
    }
}
