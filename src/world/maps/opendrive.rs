//! OpenDRIVE roads: parking spaces to park in, and other objects to keep off.
//!
//! Of a road only its reference line is used, to place objects by their road coordinates s, t. Heights are ignored, and so is
//! what is painted or flat. Format: ASAM OpenDRIVE 1.4 to 1.8.

use roxmltree::Document;

use super::commonroad::circle;
use super::xml::{Element, child, children, field, finite};
use super::{Map, MapFile, Spot};
use crate::curves::Clothoid;
use crate::geometry::{Pose, Vec2};
use crate::world::scene::SceneError;

/// Types of objects that a car drives over.
const FLAT: [&str; 5] = ["crosswalk", "patch", "roadMark", "roadSurface", "roadmark"];

pub(super) fn read(document: &Document, file: MapFile) -> Result<Map, SceneError> {
    let root = document.root_element();
    let header = child(root, "header").and_then(|header| header.attribute("name"));
    let name = header.unwrap_or_default().trim().to_owned();
    let mut map = Map { name, source: "OpenDRIVE".to_owned(), ..Map::default() };
    let reader = Reader { file };
    for road in children(root, "road") {
        let Some(objects) = child(road, "objects") else { continue };
        let line = reader.reference_line(road)?;
        for object in children(objects, "object") {
            reader.object(object, &line, &mut map)?;
        }
    }
    Ok(map)
}

struct Reader<'a> {
    file: MapFile<'a>,
}

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
    fn number(&self, of: Element, name: &str) -> Result<f64, SceneError> {
        let missing = || self.file.invalid(field(of), format!("has no {name}; expected a number"));
        self.optional(of, name)?.ok_or_else(missing)
    }

    fn optional(&self, of: Element, name: &str) -> Result<Option<f64>, SceneError> {
        let Some(text) = of.attribute(name) else { return Ok(None) };
        let wrong = || {
            self.file.invalid(field(of), format!("has {name} {text:?}; expected a finite number"))
        };
        finite(text).map(Some).ok_or_else(wrong)
    }

    fn reference_line(&self, road: Element) -> Result<Vec<Piece>, SceneError> {
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
                    let is_normalized = shape.attribute("pRange") == Some("normalized");
                    let range = if is_normalized { 1.0 } else { length };
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
            false => Ok(line),
        }
    }

    fn object(&self, object: Element, line: &[Piece], map: &mut Map) -> Result<(), SceneError> {
        let kind = object.attribute("type").unwrap_or_default();
        if FLAT.contains(&kind) {
            return Ok(());
        }
        let of_road = |s: f64, t: f64| {
            let later = line.partition_point(|piece| piece.s <= s);
            let piece = &line[later.saturating_sub(1)];
            piece.at(s - piece.s).compose(Pose::new(0.0, t, 0.0))
        };
        let (s, t) = (self.number(object, "s")?, self.number(object, "t")?);
        let turn = self.optional(object, "hdg")?.unwrap_or(0.0);
        let pose = of_road(s, t).compose(Pose::new(0.0, 0.0, turn));
        let mut outlines = Vec::new();
        let nested = child(object, "outlines").into_iter().flat_map(|o| children(o, "outline"));
        for outline in children(object, "outline").chain(nested) {
            let mut corners: Vec<[f64; 2]> = Vec::new();
            for corner in outline.children().filter(Element::is_element) {
                corners.push(match corner.tag_name().name() {
                    "cornerRoad" => {
                        let at = of_road(self.number(corner, "s")?, self.number(corner, "t")?);
                        [at.x, at.y]
                    }
                    "cornerLocal" => {
                        let at = Vec2::new(self.number(corner, "u")?, self.number(corner, "v")?);
                        pose.point_to_parent(at).into()
                    }
                    _ => continue,
                });
            }
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            if corners.len() >= 2 {
                outlines.push(corners);
            }
        }
        let (length, width) = (self.optional(object, "length")?, self.optional(object, "width")?);
        let name = || {
            let name = object.attribute("name").filter(|name| !name.is_empty());
            name.or(object.attribute("id")).unwrap_or_default().to_owned()
        };
        if outlines.is_empty() {
            match (length, width, self.optional(object, "radius")?) {
                (Some(length), Some(width), _) if length > 0.0 && width > 0.0 => {
                    let spot = Spot { name: name(), middle: pose, length, width };
                    outlines.push(spot.corners());
                }
                (_, _, Some(radius)) if radius > 0.0 => {
                    outlines.push(circle([pose.x, pose.y], radius))
                }
                // A thing without a size is where it stands.
                _ if kind != "parkingSpace" => {
                    map.points.push([pose.x, pose.y]);
                    return Ok(());
                }
                _ => {
                    return Err(self.file.invalid(
                        field(object),
                        "has no outline, and no length and width; expected them",
                    ));
                }
            }
        }
        match kind {
            "parkingSpace" => {
                map.spots.extend(outlines.iter().map(|corners| Spot::around(&name(), corners)))
            }
            // Kerbs around an island stop wheels, not bumpers.
            "trafficIsland" => map.low.obstacles.extend(outlines),
            _ => map.obstacles.extend(outlines),
        }
        Ok(())
    }
}
