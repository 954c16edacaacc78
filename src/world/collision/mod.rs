//! Exact collision of driven motions.
//!
//! A motion is checked whole, not sampled: nothing tunnels through, and one check per
//! segment replaces hundreds of footprints. [`Sweep`] has the geometry, `index` finds
//! the obstacles near a motion; [`CollisionWorld`] puts both together for one vehicle.
//! Touching counts as collision.

mod bounds;
mod index;
mod sweep;

use crate::curves::{Path, Segment, SmoothPath};
use crate::geometry::{Aabb, Pose, Vec2, segment_in_box};
use crate::vehicle::Vehicle;

use super::Obstacles;
use bounds::ConvexBounds;
use index::EdgeIndex;
pub use sweep::Sweep;

/// An obstacle edge of one world that a motion touches, by its number.
#[derive(Clone, Copy, Debug)]
pub struct Contact(usize);

/// Obstacles indexed for swept checks of one footprint.
#[derive(Clone, Debug)]
pub struct CollisionWorld {
    index: EdgeIndex,
    bounds: Option<ConvexBounds>,
    footprint: Aabb,
    tolerated: Vec<Tolerated>,
}

/// Obstacles that a smaller footprint must keep clear of: those next to a start or a goal, or
/// touched there.
#[derive(Clone, Debug)]
struct Tolerated {
    index: EdgeIndex,
    footprint: Aabb,
}

impl CollisionWorld {
    /// Indexes `obstacles` for `vehicle` grown by `margin` metres.
    ///
    /// `bounds`: corners of the convex region that the rear axle stays in,
    /// counter-clockwise.
    pub fn new(
        obstacles: &Obstacles,
        bounds: Option<[Vec2; 4]>,
        vehicle: &Vehicle,
        margin: f64,
    ) -> Self {
        Self {
            index: EdgeIndex::new(obstacles),
            bounds: bounds.map(ConvexBounds::new),
            footprint: vehicle.footprint(margin),
            tolerated: Vec::new(),
        }
    }

    /// The same world with more obstacles, from which only `margin` metres are kept, no more than
    /// from the others; of a negative margin the car may reach so deep into them.
    pub fn tolerating(mut self, obstacles: &Obstacles, vehicle: &Vehicle, margin: f64) -> Self {
        let (index, footprint) = (EdgeIndex::new(obstacles), vehicle.footprint(margin));
        self.tolerated.push(Tolerated { index, footprint });
        self
    }

    /// The footprint (margin included) in the vehicle's frame.
    pub fn footprint(&self) -> &Aabb {
        &self.footprint
    }

    /// The box around the region the rear axle stays in; `None` without bounds.
    pub fn bounds_aabb(&self) -> Option<Aabb> {
        self.bounds.as_ref().map(ConvexBounds::aabb)
    }

    /// Calls `visit` with every edge that may come near `area`; points are edges of length zero.
    pub fn edges_near(&self, area: &Aabb, mut visit: impl FnMut(Vec2, Vec2)) {
        for index in std::iter::once(&self.index).chain(self.tolerated.iter().map(|t| &t.index)) {
            index.first_near(area, |a, b| {
                visit(a, b);
                false
            });
        }
    }

    /// Whether the footprint at `pose` touches nothing and its axle is in bounds. A pose that is
    /// not finite is nowhere, and not free.
    pub fn pose_is_free(&self, pose: Pose) -> bool {
        if !pose.is_finite() || self.bounds.as_ref().is_some_and(|b| !b.contains(pose.position())) {
            return false;
        }
        is_clear(&self.index, &self.footprint, pose)
            && self.tolerated.iter().all(|t| is_clear(&t.index, &t.footprint, pose))
    }

    /// Whether another footprint than this world's touches nothing at `pose`; neither the bounds
    /// nor what is tolerated are looked at.
    pub fn is_free_of(&self, footprint: &Aabb, pose: Pose) -> bool {
        is_clear(&self.index, footprint, pose)
    }

    /// Whether driving `segment` from the free pose `start` touches nothing.
    ///
    /// `start` must be free already (see [`CollisionWorld::pose_is_free`]): only contacts
    /// made by moving are looked for.
    pub fn segment_is_free(&self, start: Pose, segment: Segment) -> bool {
        self.sweep_is_free(&BodyFrame::new(start), &Sweep::new(&self.footprint, segment))
    }

    /// [`CollisionWorld::segment_is_free`] with the sweep of this world's footprint
    /// prepared beforehand, as the search does for its motion primitives.
    pub fn sweep_is_free(&self, start: &BodyFrame, sweep: &Sweep) -> bool {
        self.stays_in_bounds(start, sweep)
            && self.contact(start, sweep).is_none()
            && self.tolerates(start, sweep)
    }

    /// Whether the motion of `sweep` touches nothing of what is tolerated.
    fn tolerates(&self, start: &BodyFrame, sweep: &Sweep) -> bool {
        self.tolerated.iter().all(|t| {
            let sweep = Sweep::new(&t.footprint, sweep.segment());
            let near = start.aabb_of(sweep.aabb());
            let hit = |a, b| sweep.hits(start.local(a), start.local(b));
            t.index.first_near(&near, hit).is_none()
        })
    }

    fn stays_in_bounds(&self, start: &BodyFrame, sweep: &Sweep) -> bool {
        self.bounds.as_ref().is_none_or(|b| b.contains_motion(start.pose, sweep.segment()))
    }

    /// Whether the rear axle stays within the bounds all along `path`.
    pub fn stays_within_bounds(&self, path: &SmoothPath) -> bool {
        let Some(bounds) = &self.bounds else { return true };
        path.legs().all(|(start, motion)| bounds.contains_clothoid(start, motion))
    }

    /// Whether a sweep of any footprint, free at its start, touches nothing; neither the bounds nor
    /// what is tolerated are looked at.
    pub fn is_swept_free(&self, start: &BodyFrame, sweep: &Sweep) -> bool {
        self.contact(start, sweep).is_none()
    }

    /// Some contact of the motion with an obstacle; the bounds are not looked at.
    fn contact(&self, start: &BodyFrame, sweep: &Sweep) -> Option<Contact> {
        let near = start.aabb_of(sweep.aabb());
        let hit = |a, b| sweep.hits(start.local(a), start.local(b));
        self.index.first_near(&near, hit).map(Contact)
    }

    /// [`CollisionWorld::sweep_is_free`] for many motions in turn, most of them not free: what the
    /// last of them touched is looked at first, and is kept in `suspect`. It decides only what is
    /// looked at first: one of another world does no harm.
    pub fn sweep_is_free_of(
        &self,
        suspect: &mut Option<Contact>,
        start: &BodyFrame,
        sweep: &Sweep,
    ) -> bool {
        let again = |&Contact(edge): &Contact| {
            let touches = |(a, b)| sweep.hits(start.local(a), start.local(b));
            self.index.edge(edge).is_some_and(touches)
        };
        if suspect.as_ref().is_some_and(again) {
            return false;
        }
        let contact = self.contact(start, sweep);
        *suspect = contact.or(*suspect);
        contact.is_none() && self.stays_in_bounds(start, sweep) && self.tolerates(start, sweep)
    }

    /// Whether driving all `segments` from the free pose `start` touches nothing.
    ///
    /// The last segments are checked first: near the goal space is tightest.
    pub fn segments_are_free(&self, start: Pose, segments: &[Segment]) -> bool {
        self.segments_are_free_of(&mut None, start, segments)
    }

    /// [`CollisionWorld::segments_are_free`] for many ways in turn; `suspect` as in
    /// [`CollisionWorld::sweep_is_free_of`].
    pub fn segments_are_free_of(
        &self,
        suspect: &mut Option<Contact>,
        start: Pose,
        segments: &[Segment],
    ) -> bool {
        // More than a curve has: those beyond are checked in driving order.
        let mut frame = BodyFrame::new(start);
        let mut starts = [frame; 8];
        let (segments, beyond) = segments.split_at(segments.len().min(starts.len()));
        for (slot, s) in starts.iter_mut().zip(segments) {
            *slot = frame;
            frame = frame.after(*s);
        }
        let legs = starts.iter().zip(segments);
        let mut is_free = |(from, &s): (&BodyFrame, &Segment)| {
            self.sweep_is_free_of(suspect, from, &Sweep::new(&self.footprint, s))
        };
        legs.rev().all(&mut is_free)
            && (beyond.is_empty() || self.segments_are_free_of(suspect, frame.pose, beyond))
    }

    /// Whether the whole path, its start included, touches nothing.
    pub fn path_is_free(&self, path: &Path) -> bool {
        let is_finite = |s: Segment| s.length.is_finite() && s.curvature.is_finite();
        self.pose_is_free(path.start)
            && path.legs().all(|(from, s)| is_finite(s) && self.segment_is_free(from, s))
    }
}

/// Whether `footprint` at `pose` touches no edge of `index` and lies in none of its polygons.
fn is_clear(index: &EdgeIndex, footprint: &Aabb, pose: Pose) -> bool {
    let body = BodyFrame::new(pose);
    let near = body.aabb_of(footprint);
    let touches =
        index.first_near(&near, |a, b| segment_in_box(body.local(a), body.local(b), footprint));
    // No edge touches the footprint, so it lies wholly inside or outside each polygon.
    touches.is_none() && !index.is_in_polygon(pose.position())
}

/// A pose with its sine and cosine, to see obstacles from the vehicle.
#[derive(Clone, Copy, Debug)]
pub struct BodyFrame {
    pose: Pose,
    sin: f64,
    cos: f64,
}

impl BodyFrame {
    /// The vehicle's frame at a rear-axle pose.
    pub fn new(pose: Pose) -> Self {
        let (sin, cos) = pose.sin_cos();
        Self { pose, sin, cos }
    }

    /// A frame given in this frame, seen from where this one is.
    #[inline]
    pub fn compose(&self, other: &BodyFrame) -> Self {
        let p = self.parent(other.pose.position());
        Self {
            pose: Pose::new(p.x, p.y, self.pose.heading + other.pose.heading),
            sin: self.sin * other.cos + self.cos * other.sin,
            cos: self.cos * other.cos - self.sin * other.sin,
        }
    }

    /// The frame after a segment is driven from here.
    fn after(&self, segment: Segment) -> Self {
        let (sin, cos) = segment.turn().sin_cos();
        let [ahead, left] = segment.way(segment.length, (sin, cos));
        self.compose(&Self { pose: Pose::new(ahead, left, segment.turn()), sin, cos })
    }

    /// A point of the planning frame, seen from the vehicle.
    #[inline]
    pub fn local(&self, p: Vec2) -> Vec2 {
        let (dx, dy) = (p.x - self.pose.x, p.y - self.pose.y);
        Vec2::new(self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx)
    }

    /// A point of the vehicle's frame, in the planning frame.
    #[inline]
    pub fn parent(&self, p: Vec2) -> Vec2 {
        let (x, y) = (self.cos * p.x - self.sin * p.y, self.sin * p.x + self.cos * p.y);
        Vec2::new(self.pose.x + x, self.pose.y + y)
    }

    /// The smallest axis-aligned box of the parent frame around a box of the body frame.
    fn aabb_of(&self, local: &Aabb) -> Aabb {
        let center = (local.min + local.max) * 0.5;
        let half = (local.max - local.min) * 0.5;
        let (s, c) = (self.sin.abs(), self.cos.abs());
        let (hx, hy) = (c * half.x + s * half.y, s * half.x + c * half.y);
        let center = self.parent(center);
        let reach = Vec2::new(hx, hy);
        Aabb { min: center - reach, max: center + reach }
    }
}
