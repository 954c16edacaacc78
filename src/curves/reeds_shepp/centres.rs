//! What the words share: how the turning circles of start and goal lie to each other.
//!
//! Every formula of the paper begins with the vector from a turning-circle centre of the
//! start to one of the goal, and adds angles that depend on the distance alone. Four vectors
//! serve all words: time flip mirrors a vector, reflection swaps left and right circles, and
//! seen from the other end it is turned and mirrored.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::geometry::{Pose, wrap_angle};

/// Centres closer than this are the same: the vector between them is rounding.
const SAME: f64 = 1e-12;

/// The goal seen from the start, in turning radii, with its sine and cosine.
#[derive(Clone, Copy)]
pub(super) struct UnitGoal {
    x: f64,
    y: f64,
    pub phi: f64,
    sin: f64,
    cos: f64,
}

impl UnitGoal {
    pub fn new(from: Pose, to: Pose, radius: f64) -> Self {
        let (s, c) = from.sin_cos();
        let (dx, dy) = ((to.x - from.x) / radius, (to.y - from.y) / radius);
        let phi = wrap_angle(to.heading - from.heading);
        let (sin, cos) = phi.sin_cos();
        Self { x: c * dx + s * dy, y: c * dy - s * dx, phi, sin, cos }
    }

    /// The goal that has the same words but for swapped gears or sides, with x, y ≥ 0.
    pub fn in_first_quadrant(self) -> Self {
        let sign = if (self.x < 0.0) == (self.y < 0.0) { 1.0 } else { -1.0 };
        let (phi, sin) = (sign * self.phi, sign * self.sin);
        Self { x: self.x.abs(), y: self.y.abs(), phi, sin, ..self }
    }

    /// From the start's left centre to the goal's left centre.
    pub fn left_left(self) -> Link {
        Link::new(self.x - self.sin, self.y - 1.0 + self.cos)
    }

    /// From the start's left centre to the goal's right centre.
    pub fn left_right(self) -> Link {
        Link::new(self.x + self.sin, self.y - 1.0 - self.cos)
    }

    /// As `left_left` for the right centres, left and right swapped.
    pub fn right_right(self) -> Link {
        Link::new(self.x + self.sin, -self.y - 1.0 + self.cos)
    }

    /// As `left_right` from right to left, left and right swapped.
    pub fn right_left(self) -> Link {
        Link::new(self.x - self.sin, -self.y - 1.0 - self.cos)
    }
}

/// The vector between two centres.
#[derive(Clone, Copy)]
pub(super) struct Link {
    x: f64,
    y: f64,
    /// Its squared length.
    pub sq: f64,
}

impl Link {
    fn new(x: f64, y: f64) -> Self {
        Self { x, y, sq: x * x + y * y }
    }

    /// Its length ρ: neither huge nor tiny, no need for hypot's scaling.
    pub fn length(self) -> f64 {
        self.sq.sqrt()
    }

    /// Its direction θ; zero when the circles are the same and every direction serves.
    pub fn angle(self) -> f64 {
        if self.sq > SAME * SAME { self.y.atan2(self.x) } else { 0.0 }
    }

    /// The inner tangent of the circles: its length √(ρ² − 4), and its angle to the link.
    pub fn crossing(self) -> Option<(f64, f64)> {
        (self.sq >= 4.0).then(|| {
            let r = (self.sq - 4.0).sqrt();
            (r, (2.0 / r).atan())
        })
    }
}

/// Circles turned in the same sense, left to left.
#[derive(Clone, Copy)]
pub(super) struct Same {
    pub rho: f64,
    pub theta: f64,
    pub crossing: Option<(f64, f64)>,
    /// The middle arc of L⁺R⁻L^±, half: asin(ρ/4).
    pub half_middle: Option<f64>,
}

impl Same {
    pub fn new(link: Link) -> Self {
        let rho = link.length();
        let half_middle = (rho <= 4.0).then(|| (0.25 * rho).asin());
        Self { rho, theta: link.angle(), crossing: link.crossing(), half_middle }
    }

    /// Every gear swapped.
    pub fn time_flipped(self) -> Self {
        let theta = if self.rho > SAME { flip(self.theta) } else { 0.0 };
        Self { theta, ..self }
    }

    /// Seen from the other end, which has heading `phi`.
    pub fn reversed(self, phi: f64) -> Self {
        Self { theta: wrap(phi - self.theta), ..self }
    }
}

/// Circles turned in opposite senses, left to right.
#[derive(Clone, Copy)]
pub(super) struct Opposite {
    pub rho: f64,
    pub theta: f64,
    pub crossing: Option<(f64, f64)>,
    /// The inner arcs of L⁺R⁺ᵤL⁻ᵤR⁻.
    pub outward: Option<f64>,
    /// The inner arcs of L⁺R⁻ᵤL⁻ᵤR⁺, and how far its first arc turns beyond θ.
    pub inward: Option<(f64, f64)>,
}

impl Opposite {
    pub fn new(link: Link) -> Self {
        let rho = link.length();
        let outward = (rho <= 2.0).then(|| (0.25 * (2.0 + rho)).acos());
        let cos = (20.0 - link.sq) / 16.0;
        let inward = (0.0..=1.0).contains(&cos).then(|| {
            // Eq. 8.8 with δ = 0: the vector (sin u, cos u − 2) has length ρ/2.
            let sin = -(1.0 - cos * cos).sqrt();
            (-cos.acos(), FRAC_PI_2 + (sin / (cos - 2.0)).atan())
        });
        Self { rho, theta: link.angle(), crossing: link.crossing(), outward, inward }
    }

    /// Every gear swapped.
    pub fn time_flipped(self) -> Self {
        Self { theta: flip(self.theta), ..self }
    }

    /// Seen from the other end, which has heading `phi`: from right to left, so that it takes
    /// the place of `left_right` where this is `right_left`.
    pub fn reversed(self, phi: f64) -> Self {
        Self { theta: wrap(phi + self.theta), ..self }
    }
}

/// The direction of a vector whose x changes sign.
fn flip(theta: f64) -> f64 {
    wrap(PI - theta)
}

/// `wrap_angle` of a sum of at most three turns' halves: one turn to add or take.
pub(super) fn wrap(a: f64) -> f64 {
    if a > PI {
        a - TAU
    } else if a <= -PI {
        a + TAU
    } else {
        a
    }
}
