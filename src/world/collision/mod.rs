//! Exact collision of driven motions.
//!
//! A motion is checked whole, not sampled: nothing tunnels through, and one check per
//! segment replaces hundreds of footprints. [`Sweep`] has the geometry, `index` finds
//! the obstacles near a motion; [`CollisionWorld`] puts both together for one vehicle.
//! Touching counts as collision.

mod bounds;
mod contour;
mod index;
mod sweep;

use crate::curves::{Path, Segment, SmoothPath};
use crate::geometry::{Aabb, Pose, Vec2, segment_in_box};
use crate::vehicle::{Margins, Vehicle};

use super::Obstacles;
use bounds::ConvexBounds;
pub use contour::Contour;
use index::EdgeIndex;
pub use sweep::Sweep;

/// An obstacle edge of one world that a motion touches, by its number.
#[derive(Clone, Copy, Debug)]
pub struct Contact(usize);

/// Obstacles indexed for swept checks of one footprint.
#[derive(Clone, Debug)]
pub struct CollisionWorld {
    /// What the whole car keeps off.
    body: Kept,
    bounds: Option<ConvexBounds>,
    /// What a smaller car keeps off: what is next to a start or a goal, or touched there.
    tolerated: Vec<Kept>,
    /// What wheels keep off.
    low: Option<Kept>,
}

/// Obstacles, and the part of the car that keeps off them.
#[derive(Clone, Debug)]
struct Kept {
    index: EdgeIndex,
    footprint: Aabb,
    /// What of the footprint is taken up, where that is not all of it.
    contour: Option<Contour>,
}

impl Kept {
    /// Some contact of the motion of `sweep`, that of this footprint.
    #[inline]
    fn contact(&self, start: &BodyFrame, sweep: &Sweep) -> Option<Contact> {
        let near = start.aabb_of(sweep.aabb());
        self.index.first_near(&near, |a, b| self.is_hit(start, sweep, a, b)).map(Contact)
    }

    /// Whether the motion meets the edge `a`–`b` of the planning frame.
    #[inline]
    fn is_hit(&self, start: &BodyFrame, sweep: &Sweep, a: Vec2, b: Vec2) -> bool {
        let (a, b) = (start.local(a), start.local(b));
        match &self.contour {
            None => sweep.hits(a, b),
            // What lies in the rectangle all along is met by none of its sides.
            Some(contour) => sweep.is_near(a, b) && contour.sweeps(sweep.segment(), a, b),
        }
    }

    /// Whether the motion along `segment` touches nothing.
    fn is_swept_free(&self, start: &BodyFrame, segment: Segment) -> bool {
        self.contact(start, &Sweep::new(&self.footprint, segment)).is_none()
    }

    /// Whether the car at `pose` touches nothing.
    fn is_clear(&self, pose: Pose) -> bool {
        let body = BodyFrame::new(pose);
        let touches = |a, b| {
            let (a, b) = (body.local(a), body.local(b));
            segment_in_box(a, b, &self.footprint)
                && self.contour.as_ref().is_none_or(|contour| contour.touches(a, b))
        };
        let touched = self.index.first_near(&body.aabb_of(&self.footprint), touches);
        // No edge touches the car, so it lies wholly inside or outside each polygon.
        touched.is_none() && !self.index.is_in_polygon(pose.position())
    }
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
        margin: impl Into<Margins>,
    ) -> Self {
        Self::of(obstacles, bounds, vehicle, None, margin)
    }

    /// [`CollisionWorld::new`] for a vehicle of this contour, which lies within its footprint.
    pub fn of(
        obstacles: &Obstacles,
        bounds: Option<[Vec2; 4]>,
        vehicle: &Vehicle,
        contour: Option<&Contour>,
        margin: impl Into<Margins>,
    ) -> Self {
        let margins = margin.into();
        let (index, footprint) = (EdgeIndex::new(obstacles), vehicle.footprint(margins));
        let contour = contour.map(|contour| contour.grown(margins));
        Self {
            body: Kept { index, footprint, contour },
            bounds: bounds.map(ConvexBounds::new),
            tolerated: Vec::new(),
            low: None,
        }
    }

    /// The same world with the obstacles of another, from which only that one's margin is kept, no more
    /// than from this one's; of a negative margin the car may reach so deep into them.
    pub fn tolerating(mut self, obstacles: CollisionWorld) -> Self {
        self.tolerated.push(obstacles.body);
        self
    }

    /// The same world with low obstacles, from which wheels keep `margin` metres.
    pub fn keeping_wheels_off(
        mut self,
        low: &Obstacles,
        vehicle: &Vehicle,
        margin: impl Into<Margins>,
    ) -> Self {
        let (index, footprint) = (EdgeIndex::new(low), vehicle.wheel_box(margin));
        self.low = (!low.is_empty()).then_some(Kept { index, footprint, contour: None });
        self
    }

    /// The same world, in which checks within `area` are as fast as if there were nothing else.
    pub fn focused_on(mut self, area: Aabb) -> Self {
        let kept = std::iter::once(&mut self.body).chain(&mut self.tolerated).chain(&mut self.low);
        kept.for_each(|kept| kept.index.focus(area));
        self
    }

    /// The footprint (margin included) in the vehicle's frame.
    pub fn footprint(&self) -> &Aabb {
        &self.body.footprint
    }

    /// The box around the region the rear axle stays in; `None` without bounds.
    pub fn bounds_aabb(&self) -> Option<Aabb> {
        self.bounds.as_ref().map(ConvexBounds::aabb)
    }

    /// The smallest box around all that the body keeps off.
    pub fn obstacles_aabb(&self) -> Aabb {
        let others = self.tolerated.iter().map(|kept| kept.index.aabb());
        others.fold(self.body.index.aabb(), |a, b| Aabb {
            min: a.min.inf(&b.min),
            max: a.max.sup(&b.max),
        })
    }

    /// Calls `visit` with every edge that may come near `area`; points are edges of length zero. What is low is left
    /// out.
    pub fn edges_near(&self, area: &Aabb, mut visit: impl FnMut(Vec2, Vec2)) {
        for kept in std::iter::once(&self.body).chain(&self.tolerated) {
            kept.index.first_near(area, |a, b| {
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
        self.body.is_clear(pose) && self.others().all(|kept| kept.is_clear(pose))
    }

    /// Whether another footprint than this world's touches nothing at `pose`; neither the bounds
    /// nor what is tolerated are looked at.
    pub fn is_free_of(&self, footprint: &Aabb, pose: Pose) -> bool {
        let body = BodyFrame::new(pose);
        let touches = |a, b| segment_in_box(body.local(a), body.local(b), footprint);
        let index = &self.body.index;
        index.first_near(&body.aabb_of(footprint), touches).is_none()
            && !index.is_in_polygon(pose.position())
    }

    /// What a part of the car keeps off, or a smaller car.
    fn others(&self) -> impl Iterator<Item = &Kept> {
        self.tolerated.iter().chain(&self.low)
    }

    /// Whether driving `segment` from the free pose `start` touches nothing.
    ///
    /// `start` must be free already (see [`CollisionWorld::pose_is_free`]): only contacts
    /// made by moving are looked for.
    pub fn segment_is_free(&self, start: Pose, segment: Segment) -> bool {
        self.sweep_is_free(&BodyFrame::new(start), &Sweep::new(&self.body.footprint, segment))
    }

    /// [`CollisionWorld::segment_is_free`] with the sweep of this world's footprint
    /// prepared beforehand, as the search does for its motion primitives.
    pub fn sweep_is_free(&self, start: &BodyFrame, sweep: &Sweep) -> bool {
        self.stays_in_bounds(start, sweep)
            && self.body.contact(start, sweep).is_none()
            && self.others_allow(start, sweep)
    }

    /// Whether the motion of `sweep` is free for all parts of the car and smaller cars.
    fn others_allow(&self, start: &BodyFrame, sweep: &Sweep) -> bool {
        self.others().all(|kept| kept.is_swept_free(start, sweep.segment()))
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
        let near = start.aabb_of(sweep.aabb());
        let hit = |a, b| sweep.hits(start.local(a), start.local(b));
        self.body.index.first_near(&near, hit).is_none()
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
            let touches = |(a, b)| self.body.is_hit(start, sweep, a, b);
            self.body.index.edge(edge).is_some_and(touches)
        };
        if suspect.as_ref().is_some_and(again) {
            return false;
        }
        let contact = self.body.contact(start, sweep);
        *suspect = contact.or(*suspect);
        contact.is_none() && self.stays_in_bounds(start, sweep) && self.others_allow(start, sweep)
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
            self.sweep_is_free_of(suspect, from, &Sweep::new(&self.body.footprint, s))
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
