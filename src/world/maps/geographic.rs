//! From WGS-84 to metres about a point, and back.
//!
//! A transverse Mercator projection whose middle meridian goes through that point, at scale 1: angles are true everywhere, and
//! x km east or west of it lengths are too long by x² / 8.1e7, 1.2 millionths at 10 km. +x points east, +y north; off the
//! middle meridian north turns away from +y by the difference of longitudes times sin(latitude).
//!
//! Source: Karney, "Transverse Mercator with an accuracy of a few nanometers", 2011, eqs. 7 to 36 (Krüger's series to the
//! sixth order).

use serde::{Deserialize, Serialize};

/// A point on Earth that is the origin of a local frame, degrees. Written as `[longitude, latitude]`, as GeoJSON has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Geographic {
    /// East is positive.
    pub longitude: f64,
    /// North is positive.
    pub latitude: f64,
}

impl From<[f64; 2]> for Geographic {
    fn from([longitude, latitude]: [f64; 2]) -> Self {
        Self { longitude, latitude }
    }
}

impl From<Geographic> for [f64; 2] {
    fn from(origin: Geographic) -> Self {
        [origin.longitude, origin.latitude]
    }
}

/// Half the length of the Earth's axis across the poles, metres, and the flattening.
const EQUATORIAL: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Third flattening.
const N: f64 = FLATTENING / (2.0 - FLATTENING);
/// Square of the eccentricity.
const E2: f64 = FLATTENING * (2.0 - FLATTENING);
/// Radius of the circle as long as a meridian, metres.
const RECTIFYING: f64 =
    EQUATORIAL / (1.0 + N) * (1.0 + N * N * (1.0 / 4.0 + N * N * (1.0 / 64.0 + N * N / 256.0)));

/// The polynomial in [`N`] with these coefficients, from the one of N⁶ down to that of N.
const fn polynomial<const K: usize>(coefficients: [f64; K]) -> f64 {
    let (mut sum, mut i) = (0.0, 0);
    while i < K {
        sum = (sum + coefficients[i]) * N;
        i += 1;
    }
    sum
}

/// Eq. 35.
const ALPHA: [f64; 6] = [
    polynomial([7891.0 / 37_800.0, -127.0 / 288.0, 41.0 / 180.0, 5.0 / 16.0, -2.0 / 3.0, 0.5]),
    polynomial([-1_983_433.0 / 1_935_360.0, 281.0 / 630.0, 557.0 / 1440.0, -0.6, 13.0 / 48.0, 0.0]),
    polynomial([
        167_603.0 / 181_440.0,
        15_061.0 / 26_880.0,
        -103.0 / 140.0,
        61.0 / 240.0,
        0.0,
        0.0,
    ]),
    polynomial([6_601_661.0 / 7_257_600.0, -179.0 / 168.0, 49_561.0 / 161_280.0, 0.0, 0.0, 0.0]),
    polynomial([-3_418_889.0 / 1_995_840.0, 34_729.0 / 80_640.0, 0.0, 0.0, 0.0, 0.0]),
    polynomial([212_378_941.0 / 319_334_400.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
];
/// Eq. 36.
const BETA: [f64; 6] = [
    polynomial([96_199.0 / 604_800.0, -81.0 / 512.0, -1.0 / 360.0, 37.0 / 96.0, -2.0 / 3.0, 0.5]),
    polynomial([
        -1_118_711.0 / 3_870_720.0,
        46.0 / 105.0,
        -437.0 / 1440.0,
        1.0 / 15.0,
        1.0 / 48.0,
        0.0,
    ]),
    polynomial([5569.0 / 90_720.0, -209.0 / 4480.0, -37.0 / 840.0, 17.0 / 480.0, 0.0, 0.0]),
    polynomial([-830_251.0 / 7_257_600.0, -11.0 / 504.0, 4397.0 / 161_280.0, 0.0, 0.0, 0.0]),
    polynomial([-108_847.0 / 3_991_680.0, 4583.0 / 161_280.0, 0.0, 0.0, 0.0, 0.0]),
    polynomial([20_648_693.0 / 638_668_800.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
];

impl Geographic {
    /// `[longitude, latitude]`, degrees, in the local frame: metres east and north.
    pub fn to_local(self, [longitude, latitude]: [f64; 2]) -> [f64; 2] {
        let [xi, eta] = mercator(turn(longitude - self.longitude).to_radians(), latitude);
        let [origin, _] = mercator(0.0, self.latitude);
        [RECTIFYING * eta, RECTIFYING * (xi - origin)]
    }

    /// How far `[longitude, latitude]` is from here, degrees of the one or of the other.
    pub(super) fn degrees_from(self, [longitude, latitude]: [f64; 2]) -> f64 {
        turn(longitude - self.longitude).abs().max((latitude - self.latitude).abs())
    }

    /// Metres east and north, as `[longitude, latitude]` in degrees.
    pub fn to_wgs84(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [origin, _] = mercator(0.0, self.latitude);
        let (xi, eta) = (origin + y / RECTIFYING, x / RECTIFYING);
        let [dx, de] = series(&BETA, xi, eta);
        let (xi, eta) = (xi - dx, eta - de);
        let (sin, cos) = xi.sin_cos();
        let sinh = eta.sinh();
        let goal = sin / sinh.hypot(cos);
        // Newton's method for the tangent of the latitude: twice is enough for all digits.
        let mut tau = goal / (1.0 - E2);
        for _ in 0..4 {
            let here = conformal(tau);
            let slope =
                (1.0 - E2) * here.hypot(1.0) * tau.hypot(1.0) / (1.0 + (1.0 - E2) * tau * tau);
            tau += (goal - here) / slope;
        }
        let longitude = self.longitude + sinh.atan2(cos).to_degrees();
        [turn(longitude), tau.atan().to_degrees()]
    }
}

/// An angle in degrees between −180 and 180.
fn turn(degrees: f64) -> f64 {
    if degrees.abs() <= 180.0 { degrees } else { degrees - 360.0 * (degrees / 360.0).round() }
}

/// Tangent of the conformal latitude, from that of the latitude (eqs. 7 to 9).
fn conformal(tau: f64) -> f64 {
    let e = E2.sqrt();
    let sigma = (e * (e * tau / tau.hypot(1.0)).atanh()).sinh();
    tau * sigma.hypot(1.0) - sigma * tau.hypot(1.0)
}

/// Along the middle meridian and across it, in [`RECTIFYING`] radii (eqs. 10, 11).
fn mercator(from_meridian: f64, latitude: f64) -> [f64; 2] {
    let tau = conformal(latitude.clamp(-90.0, 90.0).to_radians().tan());
    let (sin, cos) = from_meridian.sin_cos();
    let xi = tau.atan2(cos);
    let eta = (sin / tau.hypot(cos)).asinh();
    let [dx, de] = series(&ALPHA, xi, eta);
    [xi + dx, eta + de]
}

/// The sums of sines and hyperbolic sines of eqs. 11 and 15.
fn series(coefficients: &[f64; 6], xi: f64, eta: f64) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (j, c) in (1..).zip(coefficients) {
        let (angle, growth) = (2.0 * f64::from(j) * xi, 2.0 * f64::from(j) * eta);
        sum[0] += c * angle.sin() * growth.cosh();
        sum[1] += c * angle.cos() * growth.sinh();
    }
    sum
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn there_and_back_is_where_one_was(
            longitude in -180.0..180.0_f64, latitude in -85.0..85.0_f64, x in -2e4..2e4_f64, y in -2e4..2e4_f64,
        ) {
            let origin = Geographic { longitude, latitude };
            let [bx, by] = origin.to_local(origin.to_wgs84([x, y]));
            // Degrees resolve 3 nm at best.
            prop_assert!((bx - x).abs() < 1e-8 && (by - y).abs() < 1e-8, "{} {}", bx - x, by - y);
        }
    }
}
