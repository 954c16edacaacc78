//! From a scene to its planning frame.
//!
//! Where the parking type is known the frame is the spot frame: origin at the parked
//! body's centre, +x along the lane in the direction of travel, +y out of the spot toward
//! the lane. A spot on the driver's left gives a left-handed, mirrored frame. Where it is
//! unknown the goal's own frame serves: results then still do not depend on where in the
//! world the scene lies.

use super::{ParkingType, Scene};
use crate::geometry::{Frame, Pose, Vec2};

/// Where a scene's spot lies and what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotGuess {
    /// The spot frame in the world (the goal's own frame where no spot is known).
    pub frame: Frame,
    /// The parking type, where known.
    pub kind: Option<ParkingType>,
}

/// The planning frame of a scene.
pub fn guess(scene: &Scene) -> SpotGuess {
    let Some(kind) = scene.parking_type else {
        return SpotGuess {
            frame: Frame { origin_in_world: scene.goal, mirrored: false },
            kind: None,
        };
    };
    let center = scene.vehicle.body_center(scene.goal);
    // Right-handed first: the goal heading is `goal_heading` of the kind.
    let x_heading = scene.goal.heading - kind.goal_heading();
    let plain = Frame { origin_in_world: Pose { heading: x_heading, ..center }, mirrored: false };
    let start = plain.local_from_world(scene.start);
    let mirrored = match kind {
        // +x is the goal heading; the lane is on the side the car comes from.
        ParkingType::Parallel => start.y < 0.0,
        // +y leads out of the bay; +x is the direction of travel.
        ParkingType::Forward | ParkingType::Reverse => travels_backward_along_x(start),
    };
    let frame = match (mirrored, kind.is_bay()) {
        (false, _) => plain,
        (true, false) => Frame { mirrored, ..plain },
        (true, true) => Frame {
            origin_in_world: Pose { heading: x_heading + std::f64::consts::PI, ..center },
            mirrored,
        },
    };
    SpotGuess { frame, kind: Some(kind) }
}

/// Whether a car at `start` drives along the lane toward −x: by its heading, or, when it
/// stands across the lane, because the spot lies on that side of it.
fn travels_backward_along_x(start: Pose) -> bool {
    let along = start.heading.cos();
    if along.abs() > 0.2 { along < 0.0 } else { start.x > 0.0 }
}

/// Corners of a world-aligned box `[xmin, ymin, xmax, ymax]` seen from `frame`,
/// counter-clockwise there.
pub fn bounds_in_frame([x0, y0, x1, y1]: [f64; 4], frame: &Frame) -> [Vec2; 4] {
    let mut corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        .map(|(x, y)| frame.local_from_world_point(Vec2::new(x, y)));
    if frame.mirrored {
        corners.reverse();
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::signed_angle;
    use crate::vehicle::Vehicle;

    fn scene(kind: ParkingType, start: Pose, goal: Pose) -> Scene {
        Scene {
            name: String::new(),
            source: String::new(),
            vehicle: Vehicle::default(),
            start,
            goal,
            parking_type: Some(kind),
            obstacles: vec![],
            points: vec![],
            bounds: None,
        }
    }

    #[test]
    fn the_goal_is_parked_whatever_the_side() {
        let v = Vehicle::default();
        for kind in ParkingType::ALL {
            for turn in [0.0, 1.0, -2.5] {
                for side in [1.0, -1.0] {
                    // A spot at the origin of a turned world, the lane on either side.
                    let world = Pose::new(3.0, -7.0, turn);
                    let goal = v.rear_axle(Pose::new(0.0, 0.0, kind.goal_heading() * side));
                    let start = Pose::new(-9.0, 5.0 * side, 0.2 * side);
                    let g = guess(&scene(kind, world.compose(start), world.compose(goal)));
                    assert_eq!(g.frame.mirrored, side < 0.0, "{kind} {turn} {side}");
                    let seen = g.frame.local_from_world(world.compose(goal));
                    let expected = v.rear_axle(Pose::new(0.0, 0.0, kind.goal_heading()));
                    assert!(seen.distance(expected) < 1e-9, "{kind} {seen:?}");
                    assert!(signed_angle(seen.heading, expected.heading).abs() < 1e-9);
                    let from = g.frame.local_from_world(world.compose(start));
                    assert!(from.distance(Pose::new(-9.0, 5.0, 0.0)) < 1e-9, "{kind} {from:?}");
                }
            }
        }
    }
}
