//! The body of a scene's car, where it is more than a rectangle with one margin.

use super::Scene;
use super::collision::Contour;
use super::scene::InvalidField;
use crate::geometry::{Frame, Vec2};
use crate::vehicle::Margins;

impl Scene {
    /// The largest margin on a side, metres.
    pub const MAX_MARGIN: f64 = 1.0;

    /// Half a millimetre: contours given with few decimals stay usable.
    const CONTOUR_SLACK: f64 = 5e-4;

    /// Checks contour and margins.
    pub(super) fn check_contour(&self) -> Result<(), InvalidField> {
        let invalid = |field: String, message: String| Err(InvalidField { field, message });
        let margins = self.margins.unwrap_or_default();
        let all = margins.sides().into_iter().chain(margins.mirrors);
        for (name, side) in Margins::NAMES.iter().zip(all) {
            let most = Self::MAX_MARGIN;
            if !(0.0..=most).contains(&side) {
                let message = format!("is {side}; expected a number from 0 to {most} m");
                return invalid(format!("margins.{name}"), message);
            }
        }
        if margins.mirrors.is_some() && self.contour.is_empty() {
            let message = "is given without a contour; expected one that has mirrors".to_owned();
            return invalid("margins.mirrors".to_owned(), message);
        }
        let body = self.vehicle.footprint(Self::CONTOUR_SLACK);
        for (i, &[x, y]) in self.contour.iter().enumerate() {
            if !body.contains(Vec2::new(x, y)) {
                let message = format!(
                    "= [{x}, {y}] lies outside of the rectangle that length, width and rear_overhang give; \
                     make that enclose the whole car"
                );
                return invalid(format!("contour[{i}]"), message);
            }
        }
        self.contour_as_given().map(|_| ())
    }

    fn contour_as_given(&self) -> Result<Option<Contour>, InvalidField> {
        if self.contour.is_empty() {
            return Ok(None);
        }
        let invalid = |message| InvalidField { field: "contour".to_owned(), message };
        Contour::new(&self.contour).map(Some).map_err(invalid)
    }

    /// The car's contour as it looks in `frame`, which may be a mirrored one; `None` where it is its rectangle.
    pub fn contour_in(&self, frame: &Frame) -> Result<Option<Contour>, InvalidField> {
        let given = self.contour_as_given()?;
        Ok(given.map(|contour| if frame.mirrored { contour.mirrored() } else { contour }))
    }

    /// The margins asked for as they look in `frame`.
    pub fn margins_in(&self, frame: &Frame) -> Margins {
        let given = self.margins.unwrap_or_default();
        if frame.mirrored { given.mirrored() } else { given }
    }
}
