//! From a scene to its planning frame: where the spot is, what it is, and where the lane lies.
//!
//! The frame is the spot frame: origin at the parked body's centre, +x along the lane in the
//! direction of travel, +y out of the spot toward the lane. A spot on the driver's left gives a
//! left-handed, mirrored frame. Where nothing around the goal looks like a spot beside a lane, the
//! goal's own frame serves, mirrored where the start lies to its right: results then still do
//! not depend on where in the world the scene lies.
//!
//! A goal alone does not say which way its lane lies: ahead of the nose (parked in reverse),
//! behind the tail (forward) or beside the car (parallel, on either side), each travelled in one of two
//! directions. Each of these is held against the obstacles by [`super::abstraction`]: it is possible
//! where the smallest cell is free. Where none is, less will do: a lane that the car just passes
//! through and that may end beside the spot, and a spot in which it just stands. A parking type given
//! with the scene leaves only its two directions to choose from.
//!
//! What looks like a lane may be no more than the room before slanted bays. It is one where no oblique
//! direction leads farther than along it. Where so no usual spot fits, an angled bay is looked for
//! (`angled`).

use super::abstraction::{Abstraction, Surroundings, abstractions};
use super::cell::Grid;
use super::{ObstacleError, Obstacles, ParkingType, Scene, Stance};
use crate::geometry::{Aabb, Frame, Pose, Vec2, segment_in_box};

mod angled;
mod beside_lane;

use beside_lane::{Found, found};
pub(super) use beside_lane::{LaneBeside, lane_beside};

/// How coordinates are taken into the planning frame.
///
/// Far from the origin of their map, coordinates lose digits: 500 km away a tenth of a nanometre.
/// That is nothing to a car, but enough to decide between equals in a search. Rounding what is seen
/// from the planning frame makes such scenes the same again, nearly always.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// As given.
    Given,
    /// Obstacles to a micrometre, the start to 60 nm and as many nanoradians.
    Rounded,
}

impl Precision {
    /// An obstacle's or border's point.
    fn point(self, p: Vec2) -> Vec2 {
        const STEP: f64 = 1.0 / (1 << 20) as f64;
        match self {
            Self::Given => p,
            Self::Rounded => p.map(|v| round_to(v, STEP)),
        }
    }

    /// The start.
    pub fn pose(self, p: Pose) -> Pose {
        const STEP: f64 = 1.0 / (1 << 24) as f64;
        let round = |v| round_to(v, STEP);
        match self {
            Self::Given => p,
            Self::Rounded => Pose::new(round(p.x), round(p.y), round(p.heading)),
        }
    }
}

/// The nearest multiple of `step`, a power of two, for `v` of up to 2⁵¹ steps.
fn round_to(v: f64, step: f64) -> f64 {
    // From here to twice this there are multiples of the step and nothing between. Two sums, where
    // rounding would be a call.
    let multiples = step * 1.5 * (1_u64 << 52) as f64;
    (v + multiples) - multiples
}

/// A scene seen from its planning frame.
#[derive(Clone, Debug, PartialEq)]
pub struct SpotGuess {
    /// The spot frame in the world (the goal's own frame where no spot was found).
    pub frame: Frame,
    /// The parking type, given or found, and how the parked car stands.
    pub stance: Option<Stance>,
    /// The obstacles, seen from the frame.
    pub obstacles: Obstacles,
    /// Those that the spot and its lane can be made of, where there are many more.
    pub around: Option<Obstacles>,
    /// How much farther from the parked centre the lane begins than beside a usual spot, metres;
    /// 0 where none was found.
    pub mouth: f64,
}

impl SpotGuess {
    /// The obstacles that the spot and its lane can be made of, and perhaps others.
    pub fn around(&self) -> &Obstacles {
        self.around.as_ref().unwrap_or(&self.obstacles)
    }

    /// The parking type, given or found.
    pub fn kind(&self) -> Option<ParkingType> {
        self.stance.map(Stance::kind)
    }
}

/// The planning frame of a scene.
pub fn guess(scene: &Scene, precision: Precision) -> Result<SpotGuess, ObstacleError> {
    let seen = |frame, stance, mouth| seen(scene, frame, stance, mouth, precision);
    let as_found = |Found { frame, stance, mouth, .. }| seen(frame, Some(stance), mouth);
    let kind = match scene.parking_type {
        None => {
            return found(scene, &ParkingType::ALL, precision)
                .map_or_else(|| seen(goal_frame(scene), None, 0.0), as_found);
        }
        Some(ParkingType::Angled) => {
            return found(scene, &[ParkingType::Angled], precision)
                .map_or_else(|| as_found(angled::told(scene)), as_found);
        }
        Some(kind) => kind,
    };
    let stance = Stance::new(kind, 0.0);
    let usual = spot_frame(scene, stance);
    let guess = seen(usual, Some(stance), 0.0)?;
    let grid = grid(scene);
    if lane_is_open(guess.around(), stance, &grid) {
        return Ok(guess);
    }
    if let Some(lane) = lane(&guess, &grid) {
        return Ok(SpotGuess { mouth: lane.shift, ..guess });
    }
    // The car may come from the other side, or stand across the lane.
    let other = seen(other_way(&usual, kind), Some(stance), 0.0)?;
    if let Some(lane) = lane(&other, &grid) {
        return Ok(SpotGuess { mouth: lane.shift, ..other });
    }
    found(scene, &[kind], precision).map_or(Ok(guess), as_found)
}

/// The usual spots and lanes, for the size of the vehicle.
fn grid(scene: &Scene) -> Grid {
    Grid::default().scaled(scene.vehicle.scale())
}

/// The goal's own frame, mirrored where the car would start to its right.
fn goal_frame(scene: &Scene) -> Frame {
    let plain = Frame { origin_in_world: scene.goal, mirrored: false };
    Frame { mirrored: plain.local_from_world(scene.start).y < 0.0, ..plain }
}

/// Obstacles within this of the parked centre are looked at, metres for the default vehicle: more
/// than to the farthest corner of the largest cell.
const REACH: f64 = 20.0;

/// What is near enough to enter any cell of the grid, whichever way it lies, seen from the centre
/// of the parked body, +x along its heading.
fn around_goal(scene: &Scene, precision: Precision) -> Surroundings {
    let far = REACH * scene.vehicle.scale();
    let center = scene.vehicle.body_center(scene.goal);
    let view = Frame { origin_in_world: center, mirrored: false }.view();
    let reach = Aabb { min: center.position(), max: center.position() }.inflated(far);
    let point = |&[x, y]: &[f64; 2]| Vec2::new(x, y);
    let is_near = |points: &[[f64; 2]]| Aabb::around(points.iter().map(point)).intersects(&reach);
    let seen = |p: Vec2| precision.point(view(p));
    let mut near = Surroundings::default();
    for outline in scene.solid_outlines().filter(|o| is_near(o.vertices)) {
        near.add_polygon(outline.edges().map(|(a, b)| (seen(a), seen(b))));
    }
    for p in scene.points.iter().map(point).filter(|&p| reach.contains(p)) {
        near.add_point(seen(p));
    }
    near
}

/// A point given in the frame of [`around_goal`], seen from the spot frame of `kind` that is
/// `mirrored` or not: quarter turns, which round nothing. Angled bays: [`angled::from_parked`].
fn from_parked(p: Vec2, kind: ParkingType, mirrored: bool) -> Vec2 {
    let plain = match kind {
        ParkingType::Forward => Vec2::new(p.y, -p.x),
        ParkingType::Reverse => Vec2::new(-p.y, p.x),
        ParkingType::Parallel | ParkingType::Angled => p,
    };
    match (mirrored, kind.is_bay()) {
        (false, _) => plain,
        (true, true) => Vec2::new(-plain.x, plain.y),
        (true, false) => Vec2::new(plain.x, -plain.y),
    }
}

fn seen(
    scene: &Scene,
    frame: Frame,
    stance: Option<Stance>,
    mouth: f64,
    precision: Precision,
) -> Result<SpotGuess, ObstacleError> {
    let view = frame.view();
    let obstacles = scene.geometry_by(|p| precision.point(view(p)))?;
    // More than this, and looking at all of them takes longer than planning.
    const MANY: usize = 5000;
    let around = (obstacles.vertices() > MANY).then(|| {
        let reach = REACH * scene.vehicle.scale();
        obstacles.within(&Aabb::new(-reach, -reach, reach, reach))
    });
    Ok(SpotGuess { frame, stance, obstacles, around, mouth })
}

/// The largest free lane beside the spot, if there is one.
fn lane(guess: &SpotGuess, grid: &Grid) -> Option<Abstraction> {
    abstractions(guess.around(), guess.stance?, grid).first().copied()
}

/// Whether nothing at all enters the smallest lane beside the spot: a quick answer for scenes
/// where the given type is right.
fn lane_is_open(obstacles: &Obstacles, stance: Stance, grid: &Grid) -> bool {
    let boundary = grid.lane_boundary(stance);
    let top = boundary + grid.lane_width.min;
    let lane = Aabb::new(-grid.back, boundary, grid.dead_end.min, top);
    !obstacles.edges().any(|(a, b)| {
        let beside = a.y.max(b.y) < boundary || a.y.min(b.y) > top;
        !beside && segment_in_box(a, b, &lane)
    })
}

/// The spot frame of a car that stands so, where it comes from where it starts.
fn spot_frame(scene: &Scene, stance: Stance) -> Frame {
    let kind = stance.kind();
    let plain = plain_frame(scene, stance);
    let start = plain.local_from_world(scene.start);
    let mirrored = match kind.is_bay() {
        // +x is the goal heading; the lane is on the side the car comes from.
        false => start.y < 0.0,
        // +y leads out of the bay; +x is the direction of travel.
        true => travels_backward_along_x(start),
    };
    if mirrored { other_way(&plain, kind) } else { plain }
}

/// The right-handed frame from which the parked car stands so.
fn plain_frame(scene: &Scene, stance: Stance) -> Frame {
    let center = scene.vehicle.body_center(scene.goal);
    let heading = scene.goal.heading - stance.heading();
    Frame { origin_in_world: Pose { heading, ..center }, mirrored: false }
}

/// The frame of the other direction of travel: past a bay the other way, or on the other side of
/// a parallel spot.
fn other_way(frame: &Frame, kind: ParkingType) -> Frame {
    let Frame { origin_in_world: origin, mirrored } = *frame;
    let turn = if kind.is_bay() { std::f64::consts::PI } else { 0.0 };
    let heading = origin.heading + if mirrored { -turn } else { turn };
    Frame { origin_in_world: Pose { heading, ..origin }, mirrored: !mirrored }
}

/// Whether a car at `start` drives along the lane toward −x: by its heading, or, when it
/// stands across the lane, because the spot lies on that side of it.
fn travels_backward_along_x(start: Pose) -> bool {
    let along = start.heading.cos();
    if along.abs() > 0.2 { along < 0.0 } else { start.x > 0.0 }
}

/// What only wheels keep off, seen from the planning frame.
pub fn low_in_frame(
    scene: &Scene,
    frame: &Frame,
    precision: Precision,
) -> Result<Obstacles, ObstacleError> {
    let view = frame.view();
    scene.low_geometry_by(|p| precision.point(view(p)))
}

/// Corners of a world-aligned box `[xmin, ymin, xmax, ymax]` seen from `frame`,
/// counter-clockwise there.
pub fn bounds_in_frame(
    [x0, y0, x1, y1]: [f64; 4],
    frame: &Frame,
    precision: Precision,
) -> [Vec2; 4] {
    let view = frame.view();
    let mut corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        .map(|(x, y)| precision.point(view(Vec2::new(x, y))));
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
            vehicle: Vehicle::default(),
            start,
            goal,
            parking_type: Some(kind),
            ..Scene::default()
        }
    }

    #[test]
    fn the_goal_is_parked_whatever_the_side() {
        let v = Vehicle::default();
        for kind in ParkingType::SQUARE {
            let heading = Stance::new(kind, 0.0).heading();
            for turn in [0.0, 1.0, -2.5] {
                for side in [1.0, -1.0] {
                    // A spot at the origin of a turned world, the lane on either side.
                    let world = Pose::new(3.0, -7.0, turn);
                    let goal = v.rear_axle(Pose::new(0.0, 0.0, heading * side));
                    let start = Pose::new(-9.0, 5.0 * side, 0.2 * side);
                    let scene = scene(kind, world.compose(start), world.compose(goal));
                    let g = guess(&scene, Precision::Given).unwrap();
                    assert_eq!(g.frame.mirrored, side < 0.0, "{kind} {turn} {side}");
                    let seen = g.frame.local_from_world(world.compose(goal));
                    let expected = v.rear_axle(Pose::new(0.0, 0.0, heading));
                    assert!(seen.distance(expected) < 1e-9, "{kind} {seen:?}");
                    assert!(signed_angle(seen.heading, expected.heading).abs() < 1e-9);
                    let center =
                        Frame { origin_in_world: v.body_center(scene.goal), mirrored: false };
                    let point = Vec2::new(2.0, 9.0);
                    let turned = from_parked(center.view()(point), kind, g.frame.mirrored);
                    assert!((turned - g.frame.view()(point)).norm() < 1e-9, "{kind} {turned:?}");
                    let from = g.frame.local_from_world(world.compose(start));
                    assert!(from.distance(Pose::new(-9.0, 5.0, 0.0)) < 1e-9, "{kind} {from:?}");
                }
            }
        }
    }
}
