//! Why a car cannot stand somewhere.

use super::contact::{depth_by, depth_into};
use crate::geometry::{Aabb, Pose};
use crate::world::collision::CollisionWorld;
use crate::world::{Outline, Scene};

/// What keeps a car from standing where it is to start or to park.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Conflict {
    /// It reaches into an obstacle.
    #[error("touches an obstacle: it reaches {depth:.3} m into {obstacle}")]
    Obstacle {
        /// The scene's field, such as `obstacles[3]`.
        obstacle: String,
        /// The least margin by which a smaller car would clear it, metres.
        depth: f64,
    },
    /// A wheel of it reaches onto something low.
    #[error("has a wheel on something low: it reaches {depth:.3} m into {obstacle}")]
    Low {
        /// The scene's field, such as `low.polylines[3]`.
        obstacle: String,
        /// How deep the rectangle around the wheels reaches in, metres.
        depth: f64,
    },
    /// Its middle is out of the drivable area.
    #[error("lies outside of the drivable_area")]
    Area,
    /// Its rear axle is out of the bounds.
    #[error("has its axle outside the bounds")]
    Bounds,
    /// One of both.
    #[error("touches an obstacle or leaves the bounds")]
    Unknown,
}

impl Conflict {
    /// What the car meets at `pose` of the scene, in its own frame.
    pub(super) fn of(scene: &Scene, pose: Pose) -> Conflict {
        if !scene.is_in_area(pose) {
            return Conflict::Area;
        }
        let vehicle = &scene.vehicle;
        let body = vehicle.footprint_at(pose).aabb().inflated(1e-3);
        let is_near = |o: &Outline| Aabb::around(o.points()).intersects(&body);
        let mut deepest: Option<(Outline, f64)> = None;
        for outline in scene.outlines().filter(is_near) {
            let Ok(one) = outline.geometry() else { continue };
            let depth = if outline.is_low {
                let wheels = |depth: f64| vehicle.wheel_box(-depth);
                depth_by(&CollisionWorld::new(&one, None, vehicle, 0.0), wheels, pose)
            } else {
                depth_into(&CollisionWorld::new(&one, None, vehicle, 0.0), vehicle, pose)
            };
            if depth > 0.0 && deepest.as_ref().is_none_or(|(_, deepest)| depth > *deepest) {
                deepest = Some((outline, depth));
            }
        }
        let out = |b: [f64; 4]| pose.x < b[0] || pose.y < b[1] || pose.x > b[2] || pose.y > b[3];
        match deepest {
            Some((outline, depth)) if outline.is_low => {
                Conflict::Low { obstacle: outline.to_string(), depth }
            }
            Some((outline, depth)) => Conflict::Obstacle { obstacle: outline.to_string(), depth },
            None if scene.bounds.is_some_and(out) => Conflict::Bounds,
            None => Conflict::Unknown,
        }
    }
}
