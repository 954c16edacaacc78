//! Scenes that are no parking lots: vehicles from a toy car to a bus among needles, poles, blocks,
//! walls and points.
//!
//! For tests: nothing here looks like a spot beside a lane, sizes differ by a factor of thirty, and
//! obstacles are as thin as they come. Many scenes have a solution, not all.
//!
//! A scene depends on its arguments alone. Whether something is free is asked here with arithmetic
//! of its own, not with [`super::collision`], so that scenes can show what is wrong there.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Scene;
use crate::geometry::{Aabb, Polygon, Pose, Vec2, segment_in_box};
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;

/// The vehicles, smallest first, with their names. Scenes take turns.
pub const VEHICLES: [(&str, Vehicle); 7] = [
    ("robot", vehicle([0.40, 0.30, 0.26, 0.07], 0.60, [0.5, 0.3])),
    ("model-car", vehicle([0.50, 0.24, 0.32, 0.08], 0.42, [1.0, 0.5])),
    // Turns about a point within its own footprint.
    ("forklift", vehicle([2.60, 1.20, 1.50, 0.40], 1.30, [2.0, 1.5])),
    ("small-car", vehicle([3.60, 1.65, 2.42, 0.48], 0.62, [2.0, 1.0])),
    ("sedan", vehicle([4.97, 1.86, 2.83, 1.10], 0.609, [2.0, 1.0])),
    ("van", vehicle([5.93, 2.02, 3.67, 1.25], 0.63, [2.0, 1.0])),
    ("bus", vehicle([12.0, 2.55, 5.90, 3.40], 0.80, [2.0, 1.0])),
];

/// Length, width, wheelbase and rear overhang, steering limit, both speeds.
const fn vehicle(
    [length, width, wheelbase, rear_overhang]: [f64; 4],
    max_steer: f64,
    [forward_speed, backward_speed]: [f64; 2],
) -> Vehicle {
    Vehicle {
        length,
        width,
        wheelbase,
        rear_overhang,
        max_steer,
        forward_speed,
        backward_speed,
        steer_rate: Vehicle::STEER_RATE,
    }
}

/// What stands around.
#[derive(Clone, Copy)]
enum Kind {
    /// A polygon as thin as a sheet, up to three vehicles long.
    Needle,
    /// A small regular polygon.
    Pole,
    /// A rectangle or another convex polygon, at any angle.
    Block,
    /// Two vertices.
    Wall,
    /// A point.
    Point,
}

const KINDS: [Kind; 5] = [Kind::Needle, Kind::Pole, Kind::Block, Kind::Wall, Kind::Point];

/// Start and goal are this far from obstacles and bounds, in vehicle lengths.
const CLEARANCE: f64 = 0.01;

/// The scene number `index` of a seed, named `clutter-SEED-INDEX`.
pub fn clutter(seed: u64, index: u64) -> Scene {
    let (name, vehicle) = VEHICLES[(index % VEHICLES.len() as u64) as usize];
    let mut draw = Draw { rng: rng(seed, Stream::Clutter, index), unit: vehicle.length };
    let half = draw.lengths(3.0, 6.0);
    let start = draw.pose(half);
    let goal = if draw.rng.random_bool(0.3) {
        let direction = Pose { heading: draw.rng.random_range(-PI..PI), ..start };
        let near = direction.shifted(draw.lengths(0.0, 2.0));
        let (x, y) = (near.x.clamp(-half, half), near.y.clamp(-half, half));
        Pose::new(x, y, draw.rng.random_range(-PI..PI))
    } else {
        draw.pose(half)
    };
    let border = half + CLEARANCE * vehicle.length;
    let mut scene = Scene {
        name: format!("clutter-{seed}-{index:04}"),
        source: format!("clutter, {name}, seed {seed}, number {index}"),
        vehicle,
        start,
        goal,
        bounds: draw.rng.random_bool(0.25).then_some([-border, -border, border, border]),
        ..Scene::default()
    };
    // Obstacles for each square of one vehicle length, and the kinds that this scene has.
    let density = 0.6 * 10.0_f64.powf(-draw.rng.random_range(0.0..1.2));
    let chosen = draw.rng.random_range(1..1_u32 << KINDS.len());
    let kinds: Vec<Kind> =
        (0..KINDS.len()).filter(|k| (chosen >> k) & 1 == 1).map(|k| KINDS[k]).collect();
    let count = (density * (2.0 * half / vehicle.length).powi(2)).ceil() as usize;
    for _ in 0..count {
        let kind = kinds[draw.rng.random_range(0..kinds.len())];
        let outline = draw.obstacle(kind, half);
        // What stands in the way of start or goal is left out, so that these are free.
        if [start, goal].iter().all(|&pose| is_clear(&vehicle, pose, &outline)) {
            match kind {
                Kind::Point => scene.points.push(outline[0].into()),
                _ => scene.obstacles.push(outline.into_iter().map(<[f64; 2]>::from).collect()),
            }
        }
    }
    scene
}

/// Whether the vehicle at `pose` is [`CLEARANCE`] away from an obstacle with these vertices.
fn is_clear(vehicle: &Vehicle, pose: Pose, outline: &[Vec2]) -> bool {
    let body = vehicle.footprint(CLEARANCE * vehicle.length);
    let seen: Vec<Vec2> = outline.iter().map(|&p| pose.point_to_local(p)).collect();
    let next = seen.iter().cycle().skip(1);
    let touches = seen.iter().zip(next).any(|(&a, &b)| segment_in_box(a, b, &body));
    let centre = Vec2::new(vehicle.center_offset(), 0.0);
    let around = Polygon::new(seen).is_ok_and(|polygon| polygon.contains(centre));
    !touches && !around
}

/// Draws shapes in lengths of the vehicle.
struct Draw {
    rng: ChaCha8Rng,
    /// Length of the vehicle, metres.
    unit: f64,
}

impl Draw {
    /// Between `min` and `max` vehicle lengths, in metres.
    fn lengths(&mut self, min: f64, max: f64) -> f64 {
        self.unit * self.rng.random_range(min..max)
    }

    /// From `min` to `max` vehicle lengths, in metres, every order of magnitude as likely.
    fn magnitudes(&mut self, min: f64, max: f64) -> f64 {
        self.unit * min * (max / min).powf(self.rng.random_range(0.0..1.0))
    }

    /// Anywhere in the square of `half` metres around the origin.
    fn pose(&mut self, half: f64) -> Pose {
        let mut coordinate = || self.rng.random_range(-half..half);
        let (x, y) = (coordinate(), coordinate());
        Pose::new(x, y, self.rng.random_range(-PI..PI))
    }

    /// The vertices of an obstacle, in either orientation.
    fn obstacle(&mut self, kind: Kind, half: f64) -> Vec<Vec2> {
        let at = self.pose(half);
        let mut outline = match kind {
            Kind::Needle => {
                let (long, thin) = (self.lengths(0.2, 3.0), self.magnitudes(1e-5, 1e-2));
                let mut needle = vec![(0.0, 0.0), (long, 0.0), (long, thin), (0.0, thin)];
                needle.truncate(self.rng.random_range(3..=4));
                needle.into_iter().map(|(x, y)| Vec2::new(x, y)).collect()
            }
            Kind::Pole => {
                let (n, radius) = (self.rng.random_range(3..=8), self.magnitudes(5e-3, 0.1));
                (0..n).map(|i| on_circle(radius, TAU * f64::from(i) / f64::from(n))).collect()
            }
            Kind::Block if self.rng.random_bool(0.5) => {
                let (x, y) = (self.lengths(0.1, 1.0), self.lengths(0.1, 1.0));
                Aabb::new(0.0, 0.0, x, y).corners().to_vec()
            }
            Kind::Block => {
                // On one circle, so that it is convex.
                let (n, radius) = (self.rng.random_range(3..=7), self.lengths(0.1, 0.6));
                let mut angles: Vec<f64> =
                    (0..n).map(|_| self.rng.random_range(0.0..TAU)).collect();
                angles.sort_unstable_by(f64::total_cmp);
                angles.into_iter().map(|a| on_circle(radius, a)).collect()
            }
            Kind::Wall => vec![Vec2::zeros(), Vec2::new(self.lengths(0.2, 3.0), 0.0)],
            Kind::Point => vec![Vec2::zeros()],
        };
        if self.rng.random_bool(0.5) {
            outline.reverse();
        }
        outline.into_iter().map(|p| at.point_to_parent(p)).collect()
    }
}

fn on_circle(radius: f64, angle: f64) -> Vec2 {
    let (sin, cos) = angle.sin_cos();
    Vec2::new(radius * cos, radius * sin)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::world::collision::CollisionWorld;

    #[test]
    fn the_same_numbers_give_the_same_scene() {
        for index in 0..20 {
            assert_eq!(clutter(5, index), clutter(5, index), "{index}");
            assert_ne!(clutter(5, index).start, clutter(6, index).start, "{index}");
            assert_ne!(clutter(5, index).start, clutter(5, index + 7).start, "{index}");
        }
    }

    #[test]
    fn scenes_are_valid_and_have_everything() {
        let mut found = [0; 7];
        for index in 0..700 {
            let scene = clutter(1, index);
            scene.validate(Path::new("clutter")).unwrap();
            let [.., walls, polygons] = &mut found;
            for obstacle in &scene.obstacles {
                *(if obstacle.len() == 2 { &mut *walls } else { &mut *polygons }) += 1;
            }
            found[0] += scene.points.len();
            found[1] += usize::from(scene.bounds.is_some());
            let apart = scene.start.distance(scene.goal) / scene.vehicle.length;
            found[2] += usize::from(apart < 2.0);
            found[3] += usize::from(apart > 6.0);
            found[4] += usize::from(scene.obstacles.len() + scene.points.len() > 40);
        }
        assert!(found.iter().all(|&n| n > 50), "{found:?}");
        assert!(found[1] < 350 && found[2] < 350, "{found:?}");
        for (name, vehicle) in VEHICLES {
            assert!(vehicle.validate().is_ok(), "{name}");
        }
    }

    /// By the planner's own check, which the generator does not use.
    #[test]
    fn starts_and_goals_are_free() {
        for (seed, index) in [2, 3].into_iter().flat_map(|s| (0..350).map(move |i| (s, i))) {
            let scene = clutter(seed, index);
            let (obstacles, vehicle) = (scene.geometry().unwrap(), &scene.vehicle);
            // Rounding in turned frames aside.
            let margin = CLEARANCE * vehicle.length * 0.999;
            // Goals beside the start end at the border, which is not to be touched.
            let inset = |[x0, y0, x1, y1]: [f64; 4]| {
                Aabb::new(x0 + margin, y0 + margin, x1 - margin, y1 - margin).corners()
            };
            let world = CollisionWorld::new(&obstacles, scene.bounds.map(inset), vehicle, margin);
            for pose in [scene.start, scene.goal] {
                assert!(world.pose_is_free(pose), "{}: {pose:?}", scene.name);
            }
        }
    }
}
