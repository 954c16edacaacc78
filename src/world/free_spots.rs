//! Free spots where nothing marks them: gaps between obstacles, beside a lane.
//!
//! Whoever parks stands along what stands there already. So places are tried along the sides of obstacles (`sides`): beside a
//! side as long as a car for bays, behind one as wide as a car for parallel spots. A place counts where the gap has an end on
//! both sides, the parked car keeps [`MARGIN`] from everything, and [`spot`](super::spot) finds a lane beside it, by the same
//! rules as for a goal that is given, and it is closed on the other side. Of places that overlap the one with the largest lane is kept.
//!
//! The work is bounded: [`MOST_SIDES`] sides, a few places at each, [`MOST_LANES`] of them held against their lanes. Points are
//! thinned for all but the last check of the car's own place.

mod sides;

use std::collections::HashSet;
use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use self::sides::{Side, sides, thinned};
use super::abstraction::clip;
use super::collision::CollisionWorld;
use super::maps::Spot;
use super::spot::{LaneBeside, lane_beside};
use super::{LowObstacles, ObstacleError, ParkingType, Scene};
use crate::geometry::{Aabb, Pose, Vec2};
use crate::vehicle::Vehicle;

/// A place to park in that is free.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeSpot {
    /// How it lies beside its lane.
    pub kind: SpotKind,
    /// Its middle, which of bays heads for the lane, and how long and wide the gap is.
    pub spot: Spot,
}

/// How a spot lies beside its lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SpotKind {
    /// Square to the lane: nose in or tail in.
    Bay,
    /// Aslant to the lane.
    Angled,
    /// Along the lane.
    Parallel,
}

impl SpotKind {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bay => "bay",
            Self::Angled => "angled",
            Self::Parallel => "parallel",
        }
    }
}

/// Sides of obstacles looked at.
pub const MOST_SIDES: usize = 20_000;
/// Places whose lane is looked for.
pub const MOST_LANES: usize = 4_000;
/// What a parked car keeps from everything, metres for the default vehicle.
pub const MARGIN: f64 = 0.08;

/// Room along a lane that one bay takes where several are free side by side, of the car's width; and the same of parallel
/// spots, of its length.
const PITCH: f64 = 1.3;
const PARALLEL_PITCH: f64 = 1.3;
/// The widest gap in which bays are looked for, of the car's width, and the longest for parallel spots, of its length. What is
/// wider is no gap in a row.
const WIDEST: f64 = 6.5;
const LONGEST: f64 = 2.7;
/// How long a side is that a car stands beside, of its length.
const BESIDE: [f64; 2] = [0.42, 2.2];
/// How long a side is that a car stands behind, of its width.
const BEHIND: [f64; 2] = [0.35, 1.6];
/// How far a place moves along itself to be free, metres for the default vehicle.
const SLIDE: f64 = 1.2;
/// How far it lies from where its neighbour does, metres for the default vehicle.
const SLIDES: [f64; 8] = [0.6, -0.6, 1.2, -1.2, 1.8, -1.8, 2.4, -2.4];
/// A side may be a little off the direction of its row, degrees.
const TURNS: [f64; 5] = [0.0, 2.0, -2.0, 4.0, -4.0];
/// How far away what ends a bay is from the car at most, of its length; across so much of its width.
const BEYOND: f64 = 1.0;
const INNER: f64 = 0.8;
/// How far away what runs along a parallel spot is from the car, of its width; and along how many of so many parts of it.
const ASIDE: f64 = 1.0;
const PARTS: u32 = 10;
const MOST_PARTS: u32 = 9;
/// Cars that cover this share of each other stand in one place.
const SAME: f64 = 0.05;
/// Obstacles within this of a place can matter to its lane, metres for the default vehicle.
const REACH: f64 = 28.0;

/// The free spots of a scene for its vehicle, from left to right; start and goals are not looked at.
pub fn free_spots(scene: &Scene) -> Result<Vec<FreeSpot>, ObstacleError> {
    let search = Search::new(scene)?;
    let mut places = Vec::new();
    for side in sides(&search.scene, search.scale).iter().take(MOST_SIDES) {
        for out in [Vec2::new(-side.along.y, side.along.x), Vec2::new(side.along.y, -side.along.x)]
        {
            search.beside(side, out, &mut places);
            search.behind(side, out, &mut places);
        }
    }
    // The same place is found from both of its neighbours.
    let mut seen = HashSet::new();
    places.retain(|place| seen.insert(place.key(search.scale)) && search.is_free(place.body));
    if places.len() > MOST_LANES {
        let left_out = places.len() - MOST_LANES;
        log::warn!("{}: {left_out} places beside obstacles are not looked at", scene.name);
    }
    let with_lane = places.into_iter().take(MOST_LANES);
    let mut found: Vec<(f64, Place, SpotKind)> =
        with_lane.filter_map(|place| search.with_lane(place)).collect();
    let by_lane = |(a, p, _): &(f64, Place, SpotKind), (b, q, _): &(f64, Place, SpotKind)| {
        let (p, q) = (p.slide.abs(), q.slide.abs());
        b.total_cmp(a).then(p.total_cmp(&q))
    };
    found.sort_by(by_lane);
    let mut kept: Vec<(Place, SpotKind)> = Vec::new();
    let vehicle = &scene.vehicle;
    for (_, place, kind) in found {
        let goal = vehicle.rear_axle(place.body);
        let overlaps = |(other, _): &(Place, SpotKind)| {
            vehicle.overlap(vehicle.rear_axle(other.body), goal) > SAME
        };
        if !kept.iter().any(overlaps) {
            kept.push((place, kind));
        }
    }
    kept.sort_by(|(p, _), (q, _)| {
        p.body.x.total_cmp(&q.body.x).then(p.body.y.total_cmp(&q.body.y))
    });
    Ok(kept.into_iter().enumerate().map(|(i, (place, kind))| place.spot(kind, i + 1)).collect())
}

/// A place where a car may stand.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The middle of the car's body, heading along it.
    body: Pose,
    is_parallel: bool,
    /// Of its spot, along the car and across it, metres.
    length: f64,
    width: f64,
    /// How far it lies from where its neighbour does, along it.
    slide: f64,
}

impl Place {
    /// The same for places that are the same but for a few centimetres and a degree, whichever way they head.
    fn key(&self, scale: f64) -> [i64; 4] {
        let at = |v: f64, step: f64| (v / step).round() as i64;
        let turn = self.body.heading.rem_euclid(PI).to_degrees();
        let (x, y) = (at(self.body.x, 0.1 * scale), at(self.body.y, 0.1 * scale));
        [x, y, at(turn, 2.0) % 90, i64::from(self.is_parallel)]
    }

    fn spot(self, kind: SpotKind, number: usize) -> FreeSpot {
        let name = format!("{} {number}", kind.name());
        let (length, width) = (self.length, self.width);
        FreeSpot { kind, spot: Spot { name, middle: self.body, length, width } }
    }
}

struct Search<'a> {
    vehicle: Vehicle,
    scale: f64,
    /// With thinned points and nothing low.
    scene: Scene,
    /// Boxes around its outlines.
    boxes: Vec<Aabb>,
    /// The thinned scene, and the given one with the margin to keep.
    near: CollisionWorld,
    exact: CollisionWorld,
    given: &'a Scene,
}

impl<'a> Search<'a> {
    fn new(given: &'a Scene) -> Result<Self, ObstacleError> {
        let vehicle = given.vehicle;
        let scale = vehicle.scale();
        let scene = Scene {
            points: thinned(&given.points, scale),
            low: LowObstacles::default(),
            previous: None,
            ..given.clone()
        };
        let bounds = given.bounds.map(|[x0, y0, x1, y1]| Aabb::new(x0, y0, x1, y1).corners());
        let margin = MARGIN * scale;
        let low = given.low_geometry_by(|p| p)?;
        let exact = CollisionWorld::new(&given.geometry()?, bounds, &vehicle, margin)
            .keeping_wheels_off(&low, &vehicle, margin);
        let near = CollisionWorld::new(&scene.geometry()?, None, &vehicle, 0.0);
        let vec = |&[x, y]: &[f64; 2]| Vec2::new(x, y);
        let outlines = scene.obstacles.iter().chain(&scene.polylines);
        let boxes = outlines.map(|outline| Aabb::around(outline.iter().map(vec))).collect();
        Ok(Self { vehicle, scale, scene, boxes, near, exact, given })
    }

    /// What stands within `reach` of `at`.
    fn edges(&self, at: Vec2, reach: f64) -> Vec<(Vec2, Vec2)> {
        let area = Aabb { min: at, max: at }.inflated(reach);
        let mut edges = Vec::new();
        self.near.edges_near(&area, |a, b| edges.push((a, b)));
        edges
    }

    /// Whether a car parked there keeps the margin, one way or the other.
    fn is_free(&self, body: Pose) -> bool {
        let area = self.given.drivable_area.as_ref();
        let ways = [body, Pose { heading: body.heading + PI, ..body }];
        area.is_none_or(|area| area.contains(body.position()))
            && ways.iter().any(|&way| self.exact.pose_is_free(self.vehicle.rear_axle(way)))
    }

    /// Bays beside `side`, which look `out` from it.
    fn beside(&self, side: &Side, out: Vec2, places: &mut Vec<Place>) {
        let Vehicle { length, width, .. } = self.vehicle;
        let margin = MARGIN * self.scale;
        if !(BESIDE[0] * length..=BESIDE[1] * length).contains(&side.length) {
            return;
        }
        let middle = side.middle + out * (width / 2.0 + margin);
        let first = Pose::new(middle.x, middle.y, side.along.y.atan2(side.along.x));
        let edges = self.edges(middle, WIDEST * width + length);
        // As deep as the neighbour, level with one of its ends, or as cars beside each other stand in a row that is aslant.
        let level = (side.length - length) / 2.0;
        let aslant = SLIDES.iter().map(|slide| slide * self.scale);
        for slide in [0.0, level, -level].into_iter().chain(aslant) {
            let at = first.shifted(slide);
            let Some([right, left]) = room(&edges, at, length / 2.0) else { continue };
            let gap = right + left;
            if !(width + 2.0 * margin..=WIDEST * width).contains(&gap) {
                continue;
            }
            let count = (gap / (PITCH * width)).floor().max(1.0);
            for k in 0..count as u32 {
                let across = -right + gap * (f64::from(k) + 0.5) / count;
                let body = at.compose(Pose::new(0.0, across, 0.0));
                let straight = if count > 1.0 { Some(body) } else { self.straight(&edges, body) };
                let Some(body) = straight.and_then(|body| self.clear_of_ends(&edges, body)) else {
                    continue;
                };
                let length = length.max(side.length);
                let width = gap / count;
                places.push(Place { body, is_parallel: false, length, width, slide });
            }
        }
    }

    /// In the middle of its gap, along the direction in which that is widest.
    fn straight(&self, edges: &[(Vec2, Vec2)], body: Pose) -> Option<Pose> {
        let turned = TURNS.iter().filter_map(|turn| {
            let body = Pose { heading: body.heading + turn.to_radians(), ..body };
            let [right, left] = room(edges, body, self.vehicle.length / 2.0)?;
            Some((right + left, body.compose(Pose::new(0.0, (left - right) / 2.0, 0.0))))
        });
        // The first of several.
        turned.reduce(|best, other| if other.0 > best.0 { other } else { best }).map(|(_, b)| b)
    }

    /// Moved along itself until it keeps the margin ahead and behind.
    fn clear_of_ends(&self, edges: &[(Vec2, Vec2)], body: Pose) -> Option<Pose> {
        let [back, front] = ends(edges, body, self.vehicle.width / 2.0)?;
        let needed = self.vehicle.length / 2.0 + MARGIN * self.scale;
        let slide = (needed - back).max(0.0) - (needed - front).max(0.0);
        let is_enough = back + front >= 2.0 * needed && slide.abs() <= SLIDE * self.scale;
        is_enough.then(|| body.shifted(slide))
    }

    /// Parallel spots behind `side`, which look `out` from it.
    fn behind(&self, side: &Side, out: Vec2, places: &mut Vec<Place>) {
        let Vehicle { length, width, .. } = self.vehicle;
        let margin = MARGIN * self.scale;
        if !(BEHIND[0] * width..=BEHIND[1] * width).contains(&side.length) {
            return;
        }
        let middle = side.middle + out * (length / 2.0 + margin);
        let at = Pose::new(middle.x, middle.y, out.y.atan2(out.x));
        let edges = self.edges(middle, LONGEST * length);
        let Some([back, front]) = ends(&edges, at, width / 2.0) else { return };
        let gap = back + front;
        if !(length + 2.0 * margin..=LONGEST * length).contains(&gap) {
            return;
        }
        let count = (gap / (PARALLEL_PITCH * length)).floor().max(1.0);
        for k in 0..count as u32 {
            let body = at.shifted(-back + gap * (f64::from(k) + 0.5) / count);
            let body = if count > 1.0 { body } else { self.between(&edges, body).unwrap_or(body) };
            let Some([right, left]) = room(&edges, body, length / 2.0) else { continue };
            let needed = width / 2.0 + margin;
            let slide = (needed - right).max(0.0) - (needed - left).max(0.0);
            if right + left >= 2.0 * needed && slide.abs() <= SLIDE * self.scale {
                let body = body.compose(Pose::new(0.0, slide, 0.0));
                let (length, width) = (gap / count, width.max(side.length));
                places.push(Place { body, is_parallel: true, length, width, slide });
            }
        }
    }

    /// In the middle of its gap, along the direction in which that is longest.
    fn between(&self, edges: &[(Vec2, Vec2)], body: Pose) -> Option<Pose> {
        let turned = TURNS.iter().filter_map(|turn| {
            let body = Pose { heading: body.heading + turn.to_radians(), ..body };
            let [back, front] = ends(edges, body, self.vehicle.width / 2.0)?;
            Some((back + front, body.shifted((front - back) / 2.0)))
        });
        turned.reduce(|best, other| if other.0 > best.0 { other } else { best }).map(|(_, b)| b)
    }

    /// The place with the size of its lane, and how it lies beside it.
    fn with_lane(&self, mut place: Place) -> Option<(f64, Place, SpotKind)> {
        use ParkingType::{Angled, Forward, Parallel, Reverse};
        let kinds: &[_] = if place.is_parallel { &[Parallel] } else { &[Forward, Reverse, Angled] };
        let LaneBeside { stance, size, is_usual } = lane_beside(&self.around(place.body), kinds)?;
        if !place.is_parallel && stance.heading() < 0.0 {
            // Nose in: the lane lies behind it.
            place.body.heading += PI;
        }
        let is_closed = match place.is_parallel {
            true => self.has_kerb(place.body),
            // Between cars in an aisle there seems to be a narrow lane where bays across it are free.
            false => is_usual || self.has_end(place.body),
        };
        if !is_closed {
            return None;
        }
        let kind = match stance.kind() {
            Parallel => SpotKind::Parallel,
            Angled => SpotKind::Angled,
            Forward | Reverse => SpotKind::Bay,
        };
        Some((size, place, kind))
    }

    /// Whether something stands behind a bay whose lane lies ahead.
    fn has_end(&self, body: Pose) -> bool {
        let Vehicle { length, width, .. } = self.vehicle;
        let edges = self.edges(body.position(), 2.0 * length);
        let ends = ends(&edges, body, INNER * width / 2.0);
        ends.is_some_and(|[back, _]| back <= (0.5 + BEYOND) * length)
    }

    /// Whether a kerb, a wall or the like runs along one side of a parallel spot: a row of cars that stand square to it does not.
    fn has_kerb(&self, body: Pose) -> bool {
        let Vehicle { length, width, .. } = self.vehicle;
        let (edges, reach) = (self.edges(body.position(), length), (0.5 + ASIDE) * width);
        let part = length / f64::from(PARTS);
        let mut closed = [0, 0];
        for i in 0..PARTS {
            let along = (f64::from(i) + 0.5) * part - length / 2.0;
            let Some(sides) = room(&edges, body.shifted(along), part / 2.0) else { return false };
            for (count, side) in closed.iter_mut().zip(sides) {
                *count += u32::from(side <= reach);
            }
        }
        closed.into_iter().any(|count| count >= MOST_PARTS)
    }

    /// What can matter to a lane beside `body`, as a scene whose goal it is.
    fn around(&self, body: Pose) -> Scene {
        let at = body.position();
        let area = Aabb { min: at, max: at }.inflated(REACH * self.scale);
        let Scene { obstacles, polylines, points, .. } = &self.scene;
        let (solid, walls) = self.boxes.split_at(obstacles.len());
        let near = |lists: &[Vec<[f64; 2]>], boxes: &[Aabb]| -> Vec<Vec<[f64; 2]>> {
            let near = lists.iter().zip(boxes).filter(|(_, b)| b.intersects(&area));
            near.map(|(list, _)| list.clone()).collect()
        };
        let goal = self.vehicle.rear_axle(body);
        Scene {
            vehicle: self.vehicle,
            start: goal,
            goal,
            obstacles: near(obstacles, solid),
            polylines: near(polylines, walls),
            points: points
                .iter()
                .copied()
                .filter(|&[x, y]| area.contains(Vec2::new(x, y)))
                .collect(),
            drivable_area: self.scene.drivable_area.clone(),
            ..Scene::default()
        }
    }
}

/// How much room there is to the right and to the left of the middle of a strip along `pose`, `half` of its length ahead and
/// behind, metres: endless where nothing stands. `None` where something stands on the line in its middle.
fn room(edges: &[(Vec2, Vec2)], pose: Pose, half: f64) -> Option<[f64; 2]> {
    let (mut right, mut left) = (f64::INFINITY, f64::INFINITY);
    for &(a, b) in edges {
        let (a, b) = (pose.point_to_local(a), pose.point_to_local(b));
        let Some((a, b)) = clip(a, b, 0, -half, half) else { continue };
        let (low, high) = (a.y.min(b.y), a.y.max(b.y));
        if low > 0.0 {
            left = left.min(low);
        } else if high < 0.0 {
            right = right.min(-high);
        } else {
            return None;
        }
    }
    Some([right, left])
}

/// The same behind and ahead of `pose`, in a strip as wide as twice `half`.
fn ends(edges: &[(Vec2, Vec2)], pose: Pose, half: f64) -> Option<[f64; 2]> {
    room(edges, Pose { heading: pose.heading - FRAC_PI_2, ..pose }, half)
}
