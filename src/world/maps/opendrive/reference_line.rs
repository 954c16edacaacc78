//! The reference line of a road, along which its objects are placed.

use super::Reader;
use crate::curves::Clothoid;
use crate::geometry::Pose;
use crate::world::maps::xml::{Element, child, children, field};
use crate::world::scene::SceneError;

/// A road's reference line.
pub(super) struct ReferenceLine(Vec<Piece>);

/// A piece of a road's reference line, from `s` on.
struct Piece {
    s: f64,
    length: f64,
    from: Pose,
    shape: Shape,
}

enum Shape {
    /// Curvature at both ends.
    Clothoid(f64, f64),
    /// Coefficients of u and v, and the length of the parameter.
    Cubic([f64; 4], [f64; 4], f64),
}

impl ReferenceLine {
    /// The pose at `s` along the line and `t` to its left, heading along it.
    pub(super) fn at(&self, s: f64, t: f64) -> Pose {
        let later = self.0.partition_point(|piece| piece.s <= s);
        let piece = &self.0[later.saturating_sub(1)];
        piece.at(s - piece.s).compose(Pose::new(0.0, t, 0.0))
    }
}

impl Piece {
    /// The pose `along` metres from its start.
    fn at(&self, along: f64) -> Pose {
        let local = match self.shape {
            Shape::Clothoid(from, to) => {
                return Clothoid { from, to, length: self.length }.at(self.from, along);
            }
            Shape::Cubic(u, v, range) => {
                let p = along / self.length * range;
                let value = |c: [f64; 4]| c[0] + p * (c[1] + p * (c[2] + p * c[3]));
                let slope = |c: [f64; 4]| c[1] + p * (2.0 * c[2] + p * 3.0 * c[3]);
                Pose::new(value(u), value(v), slope(v).atan2(slope(u)))
            }
        };
        self.from.compose(local)
    }
}

impl Reader<'_> {
    pub(super) fn reference_line(&self, road: Element) -> Result<ReferenceLine, SceneError> {
        let view = child(road, "planView");
        let mut line = Vec::new();
        for geometry in view.into_iter().flat_map(|view| children(view, "geometry")) {
            let number = |name| self.number(geometry, name);
            let length = number("length")?;
            let from = Pose::new(number("x")?, number("y")?, number("hdg")?);
            if !(0.0..1e6).contains(&length) {
                let text = format!("has length {length:?}; expected metres from 0");
                return Err(self.file.invalid(field(geometry), text));
            }
            let Some(shape) = geometry.children().find(Element::is_element) else {
                return Err(self
                    .file
                    .invalid(field(geometry), "has no shape; expected line, arc or another"));
            };
            let cubic = |names: [&str; 4]| -> Result<[f64; 4], SceneError> {
                let mut values = [0.0; 4];
                for (value, name) in values.iter_mut().zip(names) {
                    *value = self.number(shape, name)?;
                }
                Ok(values)
            };
            let form = match shape.tag_name().name() {
                "line" => Shape::Clothoid(0.0, 0.0),
                "arc" => {
                    let curvature = self.number(shape, "curvature")?;
                    Shape::Clothoid(curvature, curvature)
                }
                "spiral" => {
                    let ends = [self.number(shape, "curvStart")?, self.number(shape, "curvEnd")?];
                    if ends.iter().any(|curvature| curvature.abs() * length > 1e3) {
                        let text = "turns more than 1000 rad; expected curvatures in 1/m";
                        return Err(self.file.invalid(field(shape), text));
                    }
                    Shape::Clothoid(ends[0], ends[1])
                }
                // The parameter of poly3 is u, which is the length where the road bends little.
                "poly3" => Shape::Cubic([0.0, 1.0, 0.0, 0.0], cubic(["a", "b", "c", "d"])?, length),
                "paramPoly3" => {
                    // Files that do not say so, of old versions and of some programs, mean it normalized.
                    let is_length = shape.attribute("pRange") == Some("arcLength");
                    let range = if is_length { length } else { 1.0 };
                    Shape::Cubic(
                        cubic(["aU", "bU", "cU", "dU"])?,
                        cubic(["aV", "bV", "cV", "dV"])?,
                        range,
                    )
                }
                other => {
                    let text = format!(
                        "has the shape {other}; expected line, arc, spiral, poly3 or paramPoly3"
                    );
                    return Err(self.file.invalid(field(geometry), text));
                }
            };
            line.push(Piece { s: number("s")?, length: length.max(1e-9), from, shape: form });
        }
        match line.is_empty() {
            true => Err(self
                .file
                .invalid(field(road), "has objects and no planView; expected a reference line")),
            false => Ok(ReferenceLine(line)),
        }
    }
}
