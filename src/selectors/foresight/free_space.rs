//! The free space around a spot, as a network sees it, and what a manoeuvre needs of it.
//!
//! Two profiles in the spot frame, lengths in turning radii. Across the lane: in strips of equal width
//! along it, how far it is from the lane's middle to the next obstacle on either side. In the spot: in
//! rows of equal depth, how far to either side. They are read off the obstacles' edges in one pass.

use crate::curves::Segment;
use crate::geometry::{Aabb, Pose, Vec2};
use crate::planners::Problem;
use crate::vehicle::Vehicle;
use crate::world::Stance;

/// Strips across the lane.
const STRIPS: usize = 36;
/// Rows of the spot.
const ROWS: usize = 6;
/// The strips lie so far to either side of the spot's centre.
const REACH: f64 = 4.5;
/// What lies farther from the lane's middle, or from the spot's, is as good as nothing.
const FAR: f64 = 2.0;
const FAR_IN_SPOT: f64 = 1.0;
/// Poses of a manoeuvre that are looked at lie so far apart.
const STRIDE: f64 = 0.08;

/// Whether a pose lies within what is seen of the lane: of cars that start elsewhere nothing was learnt.
pub(crate) fn is_in_sight(stance: Stance, vehicle: &Vehicle, pose: Pose) -> bool {
    let seen = Layout::new(stance, vehicle).in_lane(pose.position());
    seen.x.abs() <= REACH && seen.y.abs() <= FAR
}

/// Numbers of a [`FreeSpace`].
pub(super) const FREE: usize = 2 * (STRIPS + ROWS);
/// Numbers of a [`Swept`].
pub(super) const SWEPT: usize = 2 * STRIPS;

/// Where strips and rows lie, metres in the spot frame.
#[derive(Clone, Copy, Debug)]
struct Layout {
    /// Metres in a turning radius.
    unit: f64,
    /// The lane's middle, about: a car's width above the parked car.
    middle: f64,
    /// Half the depth of the parked car.
    half: f64,
    /// How far the way out of the spot leads along the lane for every metre across it.
    slant: f64,
}

impl Layout {
    fn new(stance: Stance, vehicle: &Vehicle) -> Self {
        let parked = vehicle.rear_axle(Pose::new(0.0, 0.0, stance.heading()));
        let half = vehicle.footprint_at(parked).aabb().max.y;
        let out = stance.out();
        let unit = vehicle.turning_radius();
        Self { unit, middle: half + vehicle.width, half, slant: out.x / out.y }
    }

    /// A point seen from the lane's middle, in turning radii.
    fn in_lane(&self, p: Vec2) -> Vec2 {
        Vec2::new(p.x, p.y - self.middle) / self.unit
    }

    /// A point's place among the rows, 0 to [`ROWS`] from the back of the spot to its front, and its
    /// distance from the way out, in turning radii.
    fn in_spot(&self, p: Vec2) -> Vec2 {
        let row = (p.y + self.half) / (2.0 * self.half) * ROWS as f64;
        Vec2::new(row, (p.x - p.y * self.slant) / self.unit)
    }
}

/// Calls `visit` for every interval of `[0, count)` of length 1 that the x of the edge enters, with the
/// smallest and the largest y of the edge there.
fn in_intervals(count: usize, a: Vec2, b: Vec2, mut visit: impl FnMut(usize, f64, f64)) {
    let (a, b) = if a.x <= b.x { (a, b) } else { (b, a) };
    if b.x < 0.0 || a.x >= count as f64 {
        return;
    }
    let is_upright = b.x - a.x < 1e-9;
    let slope = (b.y - a.y) / (b.x - a.x).max(1e-9);
    let (low, high) = sorted(a.y, b.y);
    let y = |x: f64| lesser(greater(a.y + slope * (x - a.x), low), high);
    let (first, last) = (greater(a.x, 0.0) as usize, (b.x as usize).min(count - 1));
    let mut from = y(greater(a.x, first as f64));
    for i in first..=last {
        if is_upright {
            visit(i, low, high);
        } else {
            let to = y(lesser(b.x, i as f64 + 1.0));
            let (least, most) = sorted(from, to);
            visit(i, least, most);
            from = to;
        }
    }
}

// One instruction each, where `f64::min` and `f64::max` have to look for what is not a number.

fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

fn sorted(a: f64, b: f64) -> (f64, f64) {
    (lesser(a, b), greater(a, b))
}

/// The edge `a`–`b` strip by strip: its smallest and largest distance above the lane's middle.
fn in_strips(a: Vec2, b: Vec2, visit: impl FnMut(usize, f64, f64)) {
    let strip = |p: Vec2| Vec2::new((p.x + REACH) * STRIPS as f64 / (2.0 * REACH), p.y);
    in_intervals(STRIPS, strip(a), strip(b), visit);
}

/// The free space around the spot of a problem.
pub(super) fn free_space(problem: &Problem, stance: Stance) -> [f32; FREE] {
    let layout = Layout::new(stance, &problem.vehicle);
    let (mut above, mut below) = ([FAR; STRIPS], [-FAR; STRIPS]);
    let (mut right, mut left) = ([FAR_IN_SPOT; ROWS], [-FAR_IN_SPOT; ROWS]);
    let reach = Vec2::new(REACH * layout.unit, FAR * layout.unit);
    let middle = Vec2::new(0.0, layout.middle);
    let near = Aabb { min: middle - reach, max: middle + reach };
    problem.collision.edges_near(&near, |a, b| {
        in_strips(layout.in_lane(a), layout.in_lane(b), |i, low, high| {
            if low >= 0.0 {
                above[i] = lesser(above[i], low);
            } else if high <= 0.0 {
                below[i] = greater(below[i], high);
            } else {
                (above[i], below[i]) = (0.0, 0.0);
            }
        });
        in_intervals(ROWS, layout.in_spot(a), layout.in_spot(b), |i, low, high| {
            if low >= 0.0 {
                right[i] = lesser(right[i], low);
            } else if high <= 0.0 {
                left[i] = greater(left[i], high);
            }
        });
    });
    collected(above.into_iter().chain(below).chain(right).chain(left))
}

/// Whether nothing stands in what is seen of the spot, given a [`free_space`].
pub(super) fn has_nothing_beside_the_spot(free: &[f32]) -> bool {
    free[FREE - 2 * ROWS..].iter().all(|to_the_side| f64::from(to_the_side.abs()) >= FAR_IN_SPOT)
}

/// What the vehicle sweeps in the lane while it drives `motions` to its goal.
pub(super) fn swept(stance: Stance, vehicle: &Vehicle, motions: &[Segment]) -> [f32; SWEPT] {
    let layout = Layout::new(stance, vehicle);
    let (mut above, mut below) = ([-FAR; STRIPS], [FAR; STRIPS]);
    let body = vehicle.footprint(0.0).corners();
    let mut see = |pose: Pose| {
        let corners = body.map(|c| layout.in_lane(pose.point_to_parent(c)));
        for i in 0..4 {
            in_strips(corners[i], corners[(i + 1) % 4], |i, low, high| {
                above[i] = greater(above[i], lesser(high, FAR));
                below[i] = lesser(below[i], greater(low, -FAR));
            });
        }
    };
    let mut pose = vehicle.rear_axle(Pose::new(0.0, 0.0, stance.heading()));
    see(pose);
    for back in motions.iter().rev().map(|s| s.reversed()) {
        let steps = (back.length.abs() / (STRIDE * layout.unit)).ceil().clamp(1.0, 1e3);
        for i in 1..=steps as usize {
            see(back.at(pose, back.length * i as f64 / steps));
        }
        pose = back.end(pose);
    }
    collected(above.into_iter().chain(below))
}

fn collected<const N: usize>(values: impl Iterator<Item = f64>) -> [f32; N] {
    let mut all = [0.0; N];
    for (slot, value) in all.iter_mut().zip(values) {
        *slot = value as f32;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{ParkingType, Scene};

    /// A bay between two cars, a wall across the lane that comes down at the end; everything `scale` times
    /// as large.
    fn problem(scale: f64) -> Problem {
        let car = Vehicle::default();
        let vehicle = Vehicle {
            length: scale * car.length,
            width: scale * car.width,
            wheelbase: scale * car.wheelbase,
            rear_overhang: scale * car.rear_overhang,
            ..car
        };
        let block = |[x0, y0, x1, y1]: [f64; 4]| {
            [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|p| p.map(|v| scale * v)).to_vec()
        };
        let goal = vehicle.rear_axle(Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        let scene = Scene {
            vehicle,
            start: Pose::new(-8.0 * scale, 5.0 * scale, 0.0),
            goal,
            parking_type: Some(ParkingType::Reverse),
            obstacles: vec![
                block([-4.0, -2.5, -1.3, 2.4]),
                block([1.5, -2.5, 4.0, 2.6]),
                block([-30.0, 9.0, 30.0, 9.5]),
                block([9.0, 2.0, 9.2, 9.0]),
            ],
            ..Scene::default()
        };
        Problem::new(&scene).unwrap()
    }

    #[test]
    fn says_how_far_it_is_to_either_side_and_where_the_lane_ends() {
        let problem = problem(1.0);
        let radius = problem.vehicle.turning_radius();
        let middle = problem.vehicle.length / 2.0 + problem.vehicle.width;
        let free = free_space(&problem, problem.stance().unwrap());
        let strip = |x: f64| ((x / radius + REACH) * STRIPS as f64 / (2.0 * REACH)) as usize;
        let near = |got: f32, metres: f64| {
            assert!((f64::from(got) * radius - metres).abs() < 0.01, "{got}, not {metres} m");
        };
        near(free[strip(0.0)], 9.0 - middle);
        near(free[STRIPS + strip(-2.5)], 2.4 - middle);
        near(free[STRIPS + strip(2.5)], 2.6 - middle);
        // The end of the lane stands across its middle.
        near(free[strip(9.1)], 0.0);
        near(free[STRIPS + strip(9.1)], 0.0);
        for row in 0..ROWS - 1 {
            near(free[2 * STRIPS + row], 1.5);
            near(free[2 * STRIPS + ROWS + row], -1.3);
        }
    }

    #[test]
    fn is_the_same_for_everything_twice_as_large() {
        let [small, large] = [0.5, 1.0].map(problem);
        let stance = large.stance().unwrap();
        let [a, b] = [&small, &large].map(|p| free_space(p, stance));
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5), "{a:?} {b:?}");
        let motions = [[-0.2, -5.0], [0.0, -3.0]];
        let [a, b] = [&small, &large].map(|p| {
            let scale = p.vehicle.length / large.vehicle.length;
            let motion = |[curvature, length]: [f64; 2]| Segment {
                curvature: curvature / scale,
                length: length * scale,
            };
            swept(stance, &p.vehicle, &motions.map(motion))
        });
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5), "{a:?} {b:?}");
    }

    #[test]
    fn no_pose_of_a_manoeuvre_is_outside_what_it_sweeps() {
        let problem = problem(1.0);
        let (stance, vehicle) = (problem.stance().unwrap(), &problem.vehicle);
        let motions = [
            Segment { curvature: 0.1, length: 4.0 },
            Segment { curvature: -0.24, length: -6.0 },
            Segment::straight(-3.0),
        ];
        let needed = swept(stance, vehicle, &motions);
        let layout = Layout::new(stance, vehicle);
        let mut pose = problem.goal;
        for back in motions.iter().rev().map(|s| s.reversed()) {
            for i in 0..=50 {
                let at = back.at(pose, back.length * f64::from(i) / 50.0);
                for corner in vehicle.footprint_at(at).vertices() {
                    let p = layout.in_lane(*corner);
                    in_strips(p, p, |strip, y, _| {
                        // Between two of the poses looked at a corner is less than a stride away from
                        // one of them, perhaps in the next strip.
                        let beside = strip.saturating_sub(1)..=(strip + 1).min(STRIPS - 1);
                        let top = beside.clone().map(|i| needed[i]).fold(-9.0, f32::max);
                        let bottom = beside.map(|i| needed[STRIPS + i]).fold(9.0, f32::min);
                        let (top, bottom) = (f64::from(top) + STRIDE, f64::from(bottom) - STRIDE);
                        assert!(y < top && y > bottom, "{strip}: {y}, not {bottom} to {top}");
                    });
                }
            }
            pose = back.end(pose);
        }
    }
}
