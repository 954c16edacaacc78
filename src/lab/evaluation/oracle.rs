//! The independent check of exported paths.
//!
//! Written apart from the planner: it reads the scene and the path file alone, drives
//! the path with its own arithmetic, and asks parry2d about footprints every centimetre.
//! It shares no code with [`crate::curves`] or [`crate::world::collision`], so that one
//! mistake cannot hide in both.
//!
//! A solid polygon touches the (convex) footprint if and only if one of its edges does or
//! it contains the footprint's centre; this needs no decomposition and holds for any
//! simple polygon. Footprints are tested shrunk by [`PENETRATION_TOL`].

mod body;
mod contact;

use std::f64::consts::TAU;

use parry2d_f64::math::Vector2;
use parry2d_f64::utils::point_in_poly2d;

use self::body::{Body, Extent, Motion, Solid, State};
use self::contact::Contacts;
use crate::episode::{Clearance, Judge, WAY_ENDS, measured};
use crate::geometry::Pose;
use crate::output::PathFile;
use crate::vehicle::Vehicle;
use crate::world::{GoalTolerance, Outline, Scene, Shape};

/// The independent check of every row.
pub const JUDGE: Judge = Judge { verdict: "ok", check: judge };

fn judge(
    scene: &Scene,
    path: &PathFile,
    share: Option<f64>,
    contact: f64,
) -> Result<Clearance, String> {
    measure(scene, path, share, contact).map_err(|violation| violation.to_string())
}

/// Footprints are tested at most this far apart along the path, metres; no corner moves more
/// than twice this between them. For vehicles shorter than [`CHECK_LENGTH`] in proportion.
pub const CHECK_STEP: f64 = 0.01;
/// Vehicles from this length on are tested every [`CHECK_STEP`], metres.
pub const CHECK_LENGTH: f64 = 4.0;
/// Poses may be this far apart, metres.
pub const MAX_SPACING: f64 = 0.1;
/// How deep a footprint may reach into an obstacle, metres.
pub const PENETRATION_TOL: f64 = 1e-4;
/// How near the ends must be to start and goal, metres and radians.
pub const END_TOL: f64 = 1e-6;
/// How near each pose must be to where gear and steering lead from the one before,
/// metres and radians: wide enough for an end that was snapped by [`END_TOL`].
pub const MOTION_TOL: f64 = 1e-5;
/// How far the steering angle may jump where it is continuous, radians.
pub const STEER_TOL: f64 = 1e-6;
/// To these, and to bounds, comes what coordinates do not resolve where the scene lies: so many times
/// the distance between neighbouring numbers. Below a nanometre on a city's map, half a micrometre
/// 10⁶ km away.
pub const ROUNDING_STEPS: f64 = 4.0;
/// Relative excess of the curvature limit that passes.
pub const CURVATURE_TOL: f64 = 1e-6;

/// Why a path is not what it claims to be. Indices count exported poses from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Violation {
    /// The arrays have different lengths, or none at all.
    #[error("{poses} poses, {gears} gears, {steer} steering angles: not a path")]
    Shape {
        /// Number of poses.
        poses: usize,
        /// Number of gears.
        gears: usize,
        /// Number of steering angles.
        steer: usize,
    },
    /// A number is NaN or infinite, or a gear neither 1 nor −1.
    #[error("pose {pose}: not a finite pose with gear 1 or -1")]
    NotANumber {
        /// Index of the pose.
        pose: usize,
    },
    /// The path does not begin at the scene's start.
    #[error("begins {mm:.3} mm and {rad:.2e} rad from the start")]
    Start {
        /// Distance, millimetres.
        mm: f64,
        /// Difference of heading, radians.
        rad: f64,
    },
    /// The path does not end at the scene's goal.
    #[error("ends {mm:.3} mm and {rad:.2e} rad from the goal")]
    Goal {
        /// Distance, millimetres.
        mm: f64,
        /// Difference of heading, radians.
        rad: f64,
    },
    /// The car covers less of its parked footprint at the end than it should.
    #[error("ends where {covered:.4} of the parked footprint is covered, expected {share:.4}")]
    Cover {
        /// Share covered.
        covered: f64,
        /// Share wanted.
        share: f64,
    },
    /// Two successive poses are too far apart.
    #[error("pose {pose}: the next one is {metres:.3} m away")]
    Spacing {
        /// Index of the first of the two.
        pose: usize,
        /// Their distance, metres.
        metres: f64,
    },
    /// The steering angle is beyond the vehicle's limit.
    #[error("pose {pose}: curvature {curvature:.6} beyond the limit {limit:.6} (1/m)")]
    Curvature {
        /// Index of the pose.
        pose: usize,
        /// |curvature| there, 1/m.
        curvature: f64,
        /// The vehicle's limit, 1/m.
        limit: f64,
    },
    /// The steering angle jumps where it is said to be continuous.
    #[error("pose {pose}: the steering angle jumps by {rad:.2e} rad")]
    SteerJump {
        /// Index of the pose.
        pose: usize,
        /// How far, radians.
        rad: f64,
    },
    /// The motion goes against its gear.
    #[error("pose {pose}: moves against gear {gear}")]
    Gear {
        /// Index of the pose.
        pose: usize,
        /// The gear it claims.
        gear: i8,
    },
    /// Gear and steering do not lead to the next pose.
    #[error("pose {pose}: gear and steering end {mm:.3} mm and {rad:.2e} rad from the next pose")]
    Motion {
        /// Index of the pose.
        pose: usize,
        /// Distance, millimetres.
        mm: f64,
        /// Difference of heading, radians.
        rad: f64,
    },
    /// The rear axle leaves the bounds.
    #[error("pose {pose}: the rear axle is {mm:.3} mm out of bounds")]
    OutOfBounds {
        /// Index of the pose at or before it.
        pose: usize,
        /// How far, millimetres.
        mm: f64,
    },
    /// The car leaves the drivable area.
    #[error("pose {pose}: the car is out of the drivable area")]
    OutOfArea {
        /// Index of the pose at or before it.
        pose: usize,
    },
    /// The footprint reaches into an obstacle.
    #[error("pose {pose}: the footprint reaches {mm:.1} mm into {obstacle}")]
    Collision {
        /// Index of the pose at or before it.
        pose: usize,
        /// How deep, millimetres: the footprint shrunk by this is free.
        mm: f64,
        /// Which obstacle, such as `obstacles[3]`.
        obstacle: String,
    },
}

/// Checks a path file against its scene. Returns the smallest distance between footprint
/// and obstacles, metres (infinite without obstacles, 0 on contact).
pub fn check(scene: &Scene, path: &PathFile) -> Result<f64, Violation> {
    measure(scene, path, None, 0.0).map(|c| c.least)
}

/// [`check`] of a path that need not end at the goal where a `share` of the parked footprint is given,
/// which it covers at least, and that may begin and end up to
/// `contact_m` metres deep in obstacles, with all that it measures: each is only left from the start
/// on, and only entered towards the end.
pub fn measure(
    scene: &Scene,
    path: &PathFile,
    share: Option<f64>,
    contact_m: f64,
) -> Result<Clearance, Violation> {
    measured(scene, path, |scene| Oracle::new(scene).check(path, share, contact_m))
}

/// The arc over a chord: c = 2/κ · sin(κ s / 2).
fn arc(curvature: f64, chord: f64) -> f64 {
    let half = curvature.abs() * chord / 2.0;
    if half < 1e-8 { chord } else { 2.0 / curvature.abs() * half.min(1.0).asin() }
}

/// An outline as vectors, counter-clockwise.
fn counter_clockwise(outline: &[[f64; 2]]) -> Vec<Vector2> {
    let mut vertices: Vec<Vector2> = outline.iter().map(|&[x, y]| Vector2::new(x, y)).collect();
    let next = vertices.iter().cycle().skip(1);
    let twice: f64 = vertices.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
    if twice < 0.0 {
        vertices.reverse();
    }
    vertices
}

/// A scene made ready, in coordinates relative to its start: scenes may lie anywhere.
struct Oracle {
    origin: Vector2,
    /// How far rounding may put a pose aside, metres.
    rounding: f64,
    vehicle: Vehicle,
    start: State,
    goals: Vec<State>,
    tolerance: GoalTolerance,
    bounds: Option<Extent>,
    solids: Vec<Solid>,
    /// Single points: what they are called, where they lie, and whether they are low.
    points: Vec<(String, Vector2, bool)>,
    /// The border of the drivable area.
    area: Option<Vec<Vector2>>,
    /// The car's outline in its own frame, counter-clockwise; empty where it is its rectangle.
    outline: Vec<Vector2>,
}

impl Oracle {
    fn new(scene: &Scene) -> Self {
        let origin = Vector2::new(scene.start.x, scene.start.y);
        let local = |x: f64, y: f64| Vector2::new(x, y) - origin;
        let locals = |v: &[[f64; 2]]| v.iter().map(|&[x, y]| local(x, y)).collect::<Vec<_>>();
        let outlines: Vec<Outline> = scene.outlines().collect();
        let state = |p: Pose| State { position: local(p.x, p.y), heading: p.heading };
        let goals = scene.all_goals();
        let resolutions = goals.iter().map(|goal| goal.resolution());
        let resolution = resolutions.fold(scene.start.resolution(), f64::max);
        Self {
            origin,
            rounding: ROUNDING_STEPS * resolution,
            vehicle: scene.vehicle,
            start: state(scene.start),
            goals: goals.iter().map(|&goal| state(goal)).collect(),
            tolerance: scene.goal_tolerance.unwrap_or_default(),
            bounds: scene
                .bounds
                .map(|[x0, y0, x1, y1]| Extent { min: local(x0, y0), max: local(x1, y1) }),
            solids: outlines
                .iter()
                .filter(|o| o.shape != Shape::Point)
                .map(|o| Solid::new(o.to_string(), o.is_low, o.shape, locals(o.vertices)))
                .collect(),
            points: outlines
                .iter()
                .filter(|o| o.shape == Shape::Point)
                .map(|o| (o.to_string(), locals(o.vertices)[0], o.is_low))
                .collect(),
            area: scene.drivable_area.as_ref().map(|area| locals(&area.outer)),
            outline: counter_clockwise(&scene.contour),
        }
    }

    fn check(
        &self,
        path: &PathFile,
        share: Option<f64>,
        contact_m: f64,
    ) -> Result<Clearance, Violation> {
        let n = path.poses.len();
        if n == 0 || path.gears.len() != n || path.steer.len() != n {
            return Err(Violation::Shape {
                poses: n,
                gears: path.gears.len(),
                steer: path.steer.len(),
            });
        }
        for i in 0..n {
            let finite = path.poses[i].iter().all(|v| v.is_finite()) && path.steer[i].is_finite();
            if !finite || !matches!(path.gears[i], 1 | -1) {
                return Err(Violation::NotANumber { pose: i });
            }
        }
        let state = |i: usize| {
            let [x, y, heading] = path.poses[i];
            State { position: Vector2::new(x, y) - self.origin, heading }
        };
        let (metres, rad) = state(0).apart(self.start);
        if metres > END_TOL + self.rounding || rad > END_TOL {
            return Err(Violation::Start { mm: metres * 1e3, rad });
        }
        self.end(state(n - 1), share)?;
        let step = CHECK_STEP * (self.vehicle.length / CHECK_LENGTH).min(1.0);
        let mut contacts = Contacts::new(contact_m);
        let curvature = |i: usize| {
            let angle = |steer: &Option<Vec<f64>>| steer.as_ref().map_or(path.steer[i], |s| s[i]);
            let curvature = |angle: f64| match angle.abs() < TAU / 4.0 {
                true => angle.tan() / self.vehicle.wheelbase,
                false => f64::INFINITY,
            };
            [&path.steer_from, &path.steer_to].map(|s| curvature(angle(s)))
        };
        let mean = |i: usize| {
            let [from, to] = curvature(i);
            (from + to) / 2.0
        };
        let chord = |i: usize| (state(i + 1).position - state(i).position).length();
        let length: f64 = (0..n - 1).map(|i| arc(mean(i), chord(i))).sum();
        let ends = WAY_ENDS * self.vehicle.scale();
        let way = ends..=length - ends;
        let (mut driven, mut at_ends, mut on_the_way) = (0.0, f64::INFINITY, f64::INFINITY);
        for i in 0..n - 1 {
            let ends = curvature(i);
            if i > 0 && path.gears[i] == path.gears[i - 1] {
                self.steers_on(i, curvature(i - 1)[1], ends[0], path.steer_from.is_some())?;
            }
            let motion = self.motion(i, state(i), state(i + 1), path.gears[i], ends)?;
            let s = motion.length;
            let steps = (self.corner_motion(ends[0].abs().max(ends[1].abs()), s) / step)
                .ceil()
                .max(1.0) as usize;
            for k in 0..steps {
                let part = s * k as f64 / steps as f64;
                let is_way = way.contains(&(driven + part.abs()));
                let clearance = if is_way { &mut on_the_way } else { &mut at_ends };
                self.footprint(i, state(i).driven(motion, part), clearance, &mut contacts)?;
            }
            driven += s.abs();
        }
        self.footprint(n - 1, state(n - 1), &mut at_ends, &mut contacts)?;
        contacts.check()?;
        let least = at_ends.min(on_the_way);
        Ok(Clearance { least, on_the_way: (!way.is_empty()).then_some(on_the_way) })
    }

    /// How far the rear axle drives, or half of how far any corner may move, whichever is more.
    fn corner_motion(&self, curvature: f64, s: f64) -> f64 {
        let v = &self.vehicle;
        let reach = v.rear_overhang.max(v.length - v.rear_overhang).hypot(v.width / 2.0);
        s.abs() * 0.5_f64.mul_add(curvature.abs() * reach, 0.5).max(1.0)
    }

    /// Whether `end` is a goal, give or take the tolerance, or covers a `share` of its footprint.
    fn end(&self, end: State, share: Option<f64>) -> Result<(), Violation> {
        let Some(share) = share else {
            let GoalTolerance { position_m, heading_rad } = self.tolerance;
            let mut nearest = (f64::INFINITY, 0.0);
            for goal in &self.goals {
                let (metres, rad) = end.apart(*goal);
                if metres <= position_m + END_TOL + self.rounding && rad <= heading_rad + END_TOL {
                    return Ok(());
                }
                if metres < nearest.0 {
                    nearest = (metres, rad);
                }
            }
            let (metres, rad) = nearest;
            return Err(Violation::Goal { mm: metres * 1e3, rad });
        };
        let body = |state| Body::new(&self.vehicle, state);
        let covered = self.goals.iter().map(|&goal| body(goal).covered_by(&body(end)));
        let covered = covered.fold(0.0, f64::max);
        if covered >= share - 1e-9 { Ok(()) } else { Err(Violation::Cover { covered, share }) }
    }

    /// Whether the curvature goes on as it was, where the steering is said to be continuous.
    fn steers_on(
        &self,
        pose: usize,
        before: f64,
        after: f64,
        is_continuous: bool,
    ) -> Result<(), Violation> {
        let steer = |curvature: f64| (curvature * self.vehicle.wheelbase).atan();
        let rad = (steer(after) - steer(before)).abs();
        if is_continuous && rad > STEER_TOL {
            Err(Violation::SteerJump { pose, rad })
        } else {
            Ok(())
        }
    }

    /// The motion from `from` to `to`, or what is wrong with it.
    fn motion(
        &self,
        pose: usize,
        from: State,
        to: State,
        gear: i8,
        curvatures: [f64; 2],
    ) -> Result<Motion, Violation> {
        let limit = self.vehicle.max_steer.tan() / self.vehicle.wheelbase;
        let curvature = curvatures[0].abs().max(curvatures[1].abs());
        if curvature > limit * (1.0 + CURVATURE_TOL) {
            return Err(Violation::Curvature { pose, curvature, limit });
        }
        let step = to.position - from.position;
        let chord = step.length();
        if chord > MAX_SPACING + 1e-9 {
            return Err(Violation::Spacing { pose, metres: chord });
        }
        let (sin, cos) = from.heading.sin_cos();
        let along = step.dot(Vector2::new(cos, sin));
        if along * f64::from(gear) < -(MOTION_TOL + self.rounding) {
            return Err(Violation::Gear { pose, gear });
        }
        let [begin, end] = curvatures;
        let length = arc((begin + end) / 2.0, chord) * f64::from(gear);
        let motion = Motion { from: begin, to: end, length };
        let (metres, rad) = from.driven(motion, length).apart(to);
        // A chord that is a little too long turns a little too far.
        let turn = self.rounding * curvature;
        if metres > MOTION_TOL + self.rounding || rad > MOTION_TOL + turn {
            return Err(Violation::Motion { pose, mm: metres * 1e3, rad });
        }
        Ok(motion)
    }

    /// Tests one footprint, and lowers `clearance` to its distance from the obstacles.
    fn footprint(
        &self,
        pose: usize,
        at: State,
        clearance: &mut f64,
        contacts: &mut Contacts,
    ) -> Result<(), Violation> {
        contacts.next();
        if let Some(Extent { min, max }) = self.bounds {
            let out = (min - at.position).max(at.position - max).max_element();
            if out > END_TOL + self.rounding {
                return Err(Violation::OutOfBounds { pose, mm: out * 1e3 });
            }
        }
        let body = Body::outlined(&self.vehicle, &self.outline, at);
        let wheels = Body::wheels(&self.vehicle, at);
        let part = |is_low: bool| if is_low { &wheels } else { &body };
        if self.area.as_ref().is_some_and(|area| !point_in_poly2d(body.inside(), area)) {
            return Err(Violation::OutOfArea { pose });
        }
        let mut collision = |mm, obstacle| contacts.met(pose, mm, obstacle);
        // Whatever is farther than the nearest so far can neither touch nor lower it.
        let far = |part: &Body, extent: &Extent, nearest: f64| {
            let gap = extent.gap(&part.extent);
            gap > 0.0 && gap >= nearest
        };
        for solid in &self.solids {
            let part = part(solid.is_low);
            if far(part, &solid.extent, *clearance) {
                continue;
            }
            if point_in_poly2d(part.inside(), &solid.filled) {
                collision(part.half.min_element() * 1e3, solid.name.clone())?;
            }
            for (edge, extent) in &solid.edges {
                if far(part, extent, *clearance) {
                    continue;
                }
                *clearance = clearance.min(part.distance_to_edge(edge, *clearance));
                if *clearance <= 0.0
                    && let Some(mm) = part.depth_mm(|margin| part.touches_edge(edge, margin))
                {
                    collision(mm, solid.name.clone())?;
                }
            }
        }
        for &(ref name, point, is_low) in &self.points {
            let part = part(is_low);
            if far(part, &Extent { min: point, max: point }, *clearance) {
                continue;
            }
            *clearance = clearance.min(part.distance_to_point(point, *clearance));
            if *clearance <= 0.0
                && let Some(mm) = part.depth_mm(|margin| part.touches_point(point, margin))
            {
                collision(mm, name.clone())?;
            }
        }
        Ok(())
    }
}
