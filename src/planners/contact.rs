//! Planning out of a contact, and into one.
//!
//! Who measures where a car stands errs by centimetres, so that a start beside a neighbour may reach
//! a little into it. Such a start is planned out of, if its user allows that, by one law: the
//! contact is only ever left. [`Contact::is_only_left`] is the law, and part of the certificate of
//! every path. [`plan`] finds paths that keep it with any planner: one arc out of the contact, and
//! an ordinary problem from where it ends.

use super::problem::{Place, Terms};
use super::{Budget, PlanResult, Planner, Problem};
use crate::curves::{Path, Segment, reeds_shepp};
use crate::geometry::{Aabb, Pose, Vec2};
use crate::vehicle::{Gear, Vehicle};
use crate::world::Obstacles;
use crate::world::collision::{BodyFrame, CollisionWorld, Sweep};

/// What start and goal of a problem reach into.
///
/// A path keeps the usual clearance from everything else. Into what the start reaches into it reaches
/// ever less: no deeper than a centimetre of way before, give or take 0.1 mm, until it is free of
/// it within the first vehicle length; from there on it does not touch it again. The same holds
/// backward from the goal.
#[derive(Clone, Debug)]
pub struct Contact {
    /// How deep the start reaches in, metres: the least margin by which a smaller car would be free.
    pub start_depth: f64,
    /// How deep the goal reaches in, metres.
    pub goal_depth: f64,
    /// Each obstacle that one of them touches, alone.
    touched: Vec<CollisionWorld>,
    /// What the ordinary problems between start and goal are made of.
    bounds: Option<[Vec2; 4]>,
    margin: f64,
}

/// How a path that begins in contact with an obstacle leaves it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Leave {
    /// It is free after so many metres, and reached in ever less before.
    After(f64),
    /// It ends within a vehicle length, still in contact, and reached in ever less.
    Never,
    /// It reaches deeper, or takes too long.
    Wrongly,
}

/// How deep the vehicle at `pose` reaches into what `world` holds, metres: 0 where it is free, and
/// half of its width at most.
pub(super) fn depth_into(world: &CollisionWorld, vehicle: &Vehicle, pose: Pose) -> f64 {
    depth_by(world, |depth| vehicle.footprint(-depth), pose)
}

/// The same of the part of a car that is `part` of 0, and smaller by a depth with more.
pub(super) fn depth_by(world: &CollisionWorld, part: impl Fn(f64) -> Aabb, pose: Pose) -> f64 {
    let is_free = |depth: f64| world.is_free_of(&part(depth), pose);
    if is_free(0.0) {
        return 0.0;
    }
    let size = part(0.0).max - part(0.0).min;
    let (mut touching, mut free) = (0.0, size.x.min(size.y) / 2.0);
    while free - touching > 1e-5 {
        let middle = f64::midpoint(touching, free);
        *(if is_free(middle) { &mut free } else { &mut touching }) = middle;
    }
    free
}

impl Contact {
    /// Between two depths that are compared the car drives at most so far, metres.
    const STEP: f64 = 0.01;
    /// How much deeper than before is no deeper, metres.
    const DEEPER: f64 = 1e-4;
    /// Ways out are tried every so far, metres.
    const WAY_OUT: f64 = 0.05;
    /// Steering of the ways out, of the largest curvature.
    const CURVATURES: [f64; 7] = [0.0, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0];

    /// What `ends`, start and goal, touch is `touched`, and nothing else.
    pub(super) fn new(
        touched: &Obstacles,
        vehicle: &Vehicle,
        ends: [Pose; 2],
        bounds: Option<[Vec2; 4]>,
        margin: f64,
    ) -> Self {
        let touched: Vec<CollisionWorld> =
            touched.each().map(|one| CollisionWorld::new(&one, None, vehicle, 0.0)).collect();
        let [start_depth, goal_depth] = ends.map(|pose| {
            let depths = touched.iter().map(|one| depth_into(one, vehicle, pose));
            depths.fold(0.0, f64::max)
        });
        Self { start_depth, goal_depth, touched, bounds, margin }
    }

    /// Whether `path`, from the start to the goal, keeps the law of [`Contact`].
    pub fn is_only_left(&self, vehicle: &Vehicle, path: &Path) -> bool {
        let back = backward(path);
        self.touched.iter().all(|one| match leave(one, vehicle, path) {
            Leave::Wrongly => false,
            Leave::Never => true,
            Leave::After(out) => match leave(one, vehicle, &back) {
                Leave::After(into) => is_clear_between(one, path, out, path.length() - into),
                Leave::Never | Leave::Wrongly => false,
            },
        })
    }

    /// Whether the car at `pose` is `margin` metres from all that is touched.
    fn is_left_at(&self, vehicle: &Vehicle, pose: Pose, margin: f64) -> bool {
        self.touched.iter().all(|one| one.is_free_of(&vehicle.footprint(margin), pose))
    }

    /// Arcs out of the contact at `from`, each to where the usual margin is kept again, or where
    /// there is no contact any more if that is nowhere. Where there is none, nothing is driven.
    fn ways_out(&self, problem: &Problem, from: Pose) -> Vec<Path> {
        let vehicle = &problem.vehicle;
        if self.is_left_at(vehicle, from, 0.0) {
            return vec![Path::new(from, [])];
        }
        let step = Self::WAY_OUT * vehicle.scale();
        let steps = (vehicle.length / step) as u32;
        let usual = Problem::usual_margin(vehicle);
        let mut ways = Vec::new();
        for gear in [Gear::Forward, Gear::Backward] {
            for share in Self::CURVATURES {
                let arc = |i: u32| Segment {
                    curvature: share * vehicle.max_curvature(),
                    length: gear.sign() * f64::from(i) * step,
                };
                let leaves = |margin: f64| {
                    let i = (1..=steps)
                        .find(|&i| self.is_left_at(vehicle, arc(i).end(from), margin))?;
                    let way = Path::new(from, [arc(i)]);
                    let left = |one| matches!(leave(one, vehicle, &way), Leave::After(_));
                    let free =
                        problem.collision.path_is_free(&way) && self.touched.iter().all(left);
                    free.then_some(way)
                };
                ways.extend(leaves(usual).or_else(|| leaves(0.0)));
            }
        }
        ways
    }

    /// The ordinary problem from `start` to `goal`, which touch nothing.
    fn between(&self, problem: &Problem, start: Pose, goal: Pose) -> Option<Problem> {
        let Problem { vehicle, frame, kind, ref obstacles, .. } = *problem;
        let terms = Terms { margin: self.margin, ..Terms::default() };
        let place = Place {
            obstacles: obstacles.clone(),
            low: problem.low.clone(),
            bounds: self.bounds,
            contour: problem.contour.clone(),
            margins: problem.margins,
        };
        let part = Problem::checked(vehicle, frame, kind, [start, goal], place, terms);
        // The lane begins where it did; the goal may lie farther out.
        let mouth = (problem.mouth - (goal.y - problem.goal.y)).max(0.0);
        part.ok().map(|part| Problem { mouth, ..part })
    }
}

/// The same way, driven from its end to its start.
fn backward(path: &Path) -> Path {
    Path::new(path.end(), path.segments.iter().rev().map(|s| s.reversed()))
}

/// How `path` leaves what `one` holds.
fn leave(one: &CollisionWorld, vehicle: &Vehicle, path: &Path) -> Leave {
    let mut depth = depth_into(one, vehicle, path.start);
    if depth == 0.0 {
        return Leave::After(0.0);
    }
    let mut driven = 0.0;
    let longest = Contact::STEP * vehicle.scale().min(1.0);
    for (from, segment) in path.legs() {
        let pieces = (segment.length.abs() / longest).ceil().max(1.0);
        let piece = Segment { length: segment.length / pieces, ..segment };
        for i in 0..pieces as u32 {
            let at = segment.at(from, piece.length * f64::from(i));
            // The whole piece is looked at, not its ends: a car as much smaller as it reached in
            // before touches nothing.
            let smaller = vehicle.footprint(-(depth + Contact::DEEPER));
            let sweep = Sweep::new(&smaller, piece);
            let stays =
                one.is_free_of(&smaller, at) && one.is_swept_free(&BodyFrame::new(at), &sweep);
            driven += piece.length.abs();
            if !stays || driven > vehicle.length {
                return Leave::Wrongly;
            }
            depth = depth.min(depth_into(one, vehicle, piece.end(at)));
            if depth == 0.0 {
                return Leave::After(driven);
            }
        }
    }
    Leave::Never
}

/// Whether the car touches nothing of `one` from the arc length `from` of `path` to `to`, metres.
fn is_clear_between(one: &CollisionWorld, path: &Path, from: f64, to: f64) -> bool {
    /// How far apart two ways to sum up the same lengths may come out, metres.
    const ROUNDING: f64 = 1e-9;
    let mut before = 0.0;
    from <= to + ROUNDING
        && path.legs().all(|(start, segment)| {
            let length = segment.length.abs();
            let (begin, end) = ((from - before).max(0.0), (to - before).min(length));
            before += length;
            if begin >= end {
                return true;
            }
            let sign = segment.gear().sign();
            let at = segment.at(start, sign * begin);
            let part = Segment { length: sign * (end - begin), ..segment };
            let sweep = Sweep::new(one.footprint(), part);
            // Where the contact was left, what is free may begin a rounding later.
            one.is_swept_free(&BodyFrame::new(at), &sweep)
        })
}

/// Plans `problem`, which may begin or end in contact, by `planner`.
///
/// The planner's own path is one candidate: it plans with a car that is smaller towards what it
/// touches, and may well keep the law. The others go out of the contact by one arc each; the
/// cheapest is taken. The first has half of the budget, all others together what it leaves.
pub(super) fn plan(planner: &mut dyn Planner, problem: &Problem, budget: Budget) -> PlanResult {
    let Some(contact) = &problem.contact else { return planner.plan(problem, budget) };
    let vehicle = &problem.vehicle;
    let model = planner.config().cost.scaled(vehicle.scale());
    let cost = |segments: &[Segment]| model.path(vehicle, segments);
    let half = Budget { max_expansions: budget.max_expansions / 2, ..budget };
    let mut best = planner.plan(problem, half);
    let mut expansions = best.expansions;
    let mut left = budget.max_expansions.saturating_sub(expansions);
    // The shortest ways first: those that cannot become the cheapest are not planned.
    let radius = 1.0 / vehicle.max_curvature();
    let per_metre = model.forward.min(model.backward);
    let mut ways = Vec::new();
    let ways_in: Vec<Path> = contact.ways_out(problem, problem.goal).iter().map(backward).collect();
    for out in contact.ways_out(problem, problem.start) {
        for into in &ways_in {
            let rest = reeds_shepp::shortest_length(out.end(), into.start, radius);
            let bound = cost(&out.segments) + per_metre * (rest + into.length());
            ways.push((bound, out.clone(), into.clone()));
        }
    }
    ways.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (bound, out, into) in ways {
        let known = best.outcome.as_ref().map_or(f64::INFINITY, |path| cost(&path.segments));
        if bound >= known || left == 0 {
            break;
        }
        let Some(part) = contact.between(problem, out.end(), into.start) else { continue };
        let found = planner.plan(&part, Budget { max_expansions: left, ..budget });
        expansions += found.expansions;
        left = left.saturating_sub(found.expansions);
        let (Ok(middle), None) = (&found.outcome, found.covered) else { continue };
        let driven = [&out.segments, &middle.segments, &into.segments];
        let path = Path::new(problem.start, driven.into_iter().flatten().copied());
        if cost(&path.segments) < known {
            let whole = PlanResult::certified(problem, path, 0);
            if whole.outcome.is_ok() {
                best = PlanResult { guidance: found.guidance, ..whole };
            }
        }
    }
    PlanResult { expansions, ..best }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Polygon;

    /// A block ahead of a car of the default size at the origin, into which it reaches `depth`.
    fn ahead(depth: f64) -> (CollisionWorld, Vehicle) {
        let vehicle = Vehicle::default();
        let x = vehicle.front_extent() - depth;
        let block = [[x, -3.0], [x + 1.0, -3.0], [x + 1.0, 3.0], [x, 3.0]];
        let block = block.map(|[x, y]| Vec2::new(x, y)).to_vec();
        let block = Obstacles::new(vec![Polygon::new(block).unwrap()], vec![], vec![]).unwrap();
        (CollisionWorld::new(&block, None, &vehicle, 0.0), vehicle)
    }

    #[test]
    fn a_contact_is_left_backward_and_never_forward() {
        let (block, vehicle) = ahead(0.03);
        assert!((depth_into(&block, &vehicle, Pose::default()) - 0.03).abs() < 2e-5);
        let drive = |lengths: &[f64]| {
            let segments = lengths.iter().map(|&l| Segment::straight(l)).collect();
            leave(&block, &vehicle, &Path { start: Pose::default(), segments })
        };
        assert!(matches!(drive(&[-1.0]), Leave::After(a) if (a - 0.03).abs() <= 0.011));
        assert_eq!(drive(&[-0.02]), Leave::Never);
        assert_eq!(drive(&[0.001, -1.0]), Leave::Wrongly);
        // Out by one centimetre and in again by half of one is deeper than before.
        assert_eq!(drive(&[-0.01, 0.005, -1.0]), Leave::Wrongly);
    }
}
