//! Objects beside a road: one by one, in rows (`<repeat>`) and as long as the road.

use super::Reader;
use super::reference_line::ReferenceLine;
use crate::geometry::{Pose, Vec2};
use crate::world::maps::commonroad::circle;
use crate::world::maps::xml::{Element, child, children, field};
use crate::world::maps::{Map, Spot};
use crate::world::scene::SceneError;

/// Types of objects that a car drives over.
const FLAT: [&str; 7] =
    ["crosswalk", "patch", "roadMark", "roadSurface", "roadmark", "stopLine", "stopline"];
/// Types of objects that a car parks in. The second is none of the standard's, but in use.
const PARKING: [&str; 2] = ["parkingSpace", "parking"];
/// Objects of one row.
const MOST_REPEATED: f64 = 10_000.0;
/// What is as long as the road has a corner every so many metres: in a bend of 10 m radius it is 3 mm off.
const STEP: f64 = 0.5;

/// What an object is to a car.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Space,
    /// It stops wheels, not bumpers.
    Low,
    Solid,
}

/// Corners around an object, or along one.
struct Outline {
    corners: Vec<[f64; 2]>,
    is_closed: bool,
}

/// One of an object's instances: itself, or one of a row.
struct Instance {
    s: f64,
    t: f64,
    length: Option<f64>,
    width: Option<f64>,
    radius: Option<f64>,
}

impl Reader<'_> {
    /// Adds an object to the map. One that is repeated stands where its rows say, and only there.
    pub(super) fn object(
        &self,
        object: Element,
        line: &ReferenceLine,
        map: &mut Map,
    ) -> Result<(), SceneError> {
        let named = object.attribute("type").unwrap_or_default();
        let is_space = PARKING.contains(&named) || child(object, "parkingSpace").is_some();
        let kind = match named {
            _ if is_space => Kind::Space,
            _ if FLAT.contains(&named) => return Ok(()),
            // Kerbs around an island.
            "trafficIsland" => Kind::Low,
            _ => Kind::Solid,
        };
        let own = Instance {
            s: self.number(object, "s")?,
            t: self.number(object, "t")?,
            length: self.optional(object, "length")?,
            width: self.optional(object, "width")?,
            radius: self.optional(object, "radius")?,
        };
        let mut repeats = children(object, "repeat").peekable();
        if repeats.peek().is_none() {
            return self.place(object, kind, line, &own, &own, map);
        }
        for repeat in repeats {
            let (from, length) = (self.number(repeat, "s")?, self.length(repeat, "length")?);
            let distance = self.length(repeat, "distance")?;
            let t = self.range(repeat, "t", Some(own.t))?.unwrap_or([own.t; 2]);
            let lengths = self.range(repeat, "length", own.length)?;
            let widths = self.range(repeat, "width", own.width)?;
            let radii = self.range(repeat, "radius", own.radius)?;
            if distance == 0.0 && length > 0.0 {
                let outlines = self.outlines(object, line, &own, &own)?;
                let widths = widths.or(across(line, &own, &outlines)).unwrap_or([0.0; 2]);
                let outline = strip(line, [from, from + length], t, widths);
                if kind == Kind::Space && !outline.is_closed {
                    let text =
                        "is a parking space as long as the road without a width; expected one";
                    return Err(self.file.invalid(field(object), text));
                }
                add(map, kind, &name(object), outline);
                continue;
            }
            let count = if distance > 0.0 { length / distance } else { 0.0 };
            if count > MOST_REPEATED {
                let text = format!("has {count:.0} objects; expected at most {MOST_REPEATED}");
                return Err(self.file.invalid(field(repeat), text));
            }
            // The last may stand at the end of the row, whatever is lost in decimals.
            for i in 0..=(count + 1e-6) as u32 {
                let along = f64::from(i) * distance;
                let share = if length > 0.0 { along / length } else { 0.0 };
                let at = |[a, b]: [f64; 2]| a + (b - a) * share;
                let one = Instance {
                    s: from + along,
                    t: at(t),
                    length: lengths.map(at),
                    width: widths.map(at),
                    radius: radii.map(at),
                };
                self.place(object, kind, line, &own, &one, map)?;
            }
        }
        Ok(())
    }

    /// What a row says of a size at its start and at its end, else what the object itself does.
    fn range(
        &self,
        repeat: Element,
        what: &str,
        own: Option<f64>,
    ) -> Result<Option<[f64; 2]>, SceneError> {
        let [start, end] = [format!("{what}Start"), format!("{what}End")];
        let [start, end] = [self.optional(repeat, &start)?, self.optional(repeat, &end)?];
        let start = start.or(own).or(end);
        Ok(start.map(|start| [start, end.unwrap_or(start)]))
    }

    /// Adds an object as it stands at `one`.
    fn place(
        &self,
        object: Element,
        kind: Kind,
        line: &ReferenceLine,
        own: &Instance,
        one: &Instance,
        map: &mut Map,
    ) -> Result<(), SceneError> {
        let mut outlines = self.outlines(object, line, own, one)?;
        let pose = self.pose(object, line, one)?;
        if outlines.is_empty() {
            match (one.length, one.width, one.radius) {
                (Some(length), Some(width), _) if length > 0.0 && width > 0.0 => {
                    let rectangle = Spot { name: String::new(), middle: pose, length, width };
                    outlines.push(Outline { corners: rectangle.corners(), is_closed: true });
                }
                (_, _, Some(radius)) if radius > 0.0 => {
                    let corners = circle([pose.x, pose.y], radius);
                    outlines.push(Outline { corners, is_closed: true });
                }
                // A thing without a size is where it stands.
                _ if kind != Kind::Space => {
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
        let name = name(object);
        outlines.into_iter().for_each(|outline| add(map, kind, &name, outline));
        Ok(())
    }

    fn pose(
        &self,
        object: Element,
        line: &ReferenceLine,
        one: &Instance,
    ) -> Result<Pose, SceneError> {
        let turn = self.optional(object, "hdg")?.unwrap_or(0.0);
        Ok(line.at(one.s, one.t).compose(Pose::new(0.0, 0.0, turn)))
    }

    /// The outlines of an object moved from its own place to `one`.
    fn outlines(
        &self,
        object: Element,
        line: &ReferenceLine,
        own: &Instance,
        one: &Instance,
    ) -> Result<Vec<Outline>, SceneError> {
        let pose = self.pose(object, line, one)?;
        let mut outlines = Vec::new();
        let nested = child(object, "outlines").into_iter().flat_map(|o| children(o, "outline"));
        // What is left out inside of an outline is inside.
        let is_outer = |outline: &Element| outline.attribute("outer") != Some("false");
        for outline in children(object, "outline").chain(nested).filter(is_outer) {
            let mut corners: Vec<[f64; 2]> = Vec::new();
            for corner in outline.children().filter(Element::is_element) {
                let number = |name| self.number(corner, name);
                corners.push(match corner.tag_name().name() {
                    "cornerRoad" => {
                        let (s, t) = (number("s")? - own.s, number("t")? - own.t);
                        line.at(one.s + s, one.t + t).position().into()
                    }
                    "cornerLocal" => {
                        pose.point_to_parent(Vec2::new(number("u")?, number("v")?)).into()
                    }
                    _ => continue,
                });
            }
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            if corners.len() >= 2 {
                let is_closed = outline.attribute("closed") != Some("false");
                outlines.push(Outline { corners, is_closed });
            }
        }
        Ok(outlines)
    }
}

/// What an object is called, else its id.
fn name(object: Element) -> String {
    let name = object.attribute("name").filter(|name| !name.is_empty());
    name.or(object.attribute("id")).unwrap_or_default().to_owned()
}

/// Parking spaces are as wide and long as their outlines, closed or not.
fn add(map: &mut Map, kind: Kind, name: &str, Outline { corners, is_closed }: Outline) {
    match (kind, is_closed) {
        (Kind::Space, _) => map.spots.push(Spot::around(name, &corners)),
        (Kind::Low, true) => map.low.obstacles.push(corners),
        (Kind::Low, false) => map.low.polylines.push(corners),
        (Kind::Solid, true) => map.obstacles.push(corners),
        (Kind::Solid, false) => map.polylines.push(corners),
    }
}

/// How wide `outlines` of an object are across the road where it stands.
fn across(line: &ReferenceLine, own: &Instance, outlines: &[Outline]) -> Option<[f64; 2]> {
    let road = line.at(own.s, own.t);
    let corners = outlines.iter().flat_map(|outline| &outline.corners);
    let sides = corners.map(|&[x, y]| road.point_to_local(Vec2::new(x, y)).y);
    let [low, high] =
        sides.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)]);
    (low < high).then_some([high - low; 2])
}

/// What lies along the road from one s to another, its middle and its width at both ends as given; a line where it is not wide
/// at all.
fn strip(line: &ReferenceLine, [from, to]: [f64; 2], t: [f64; 2], widths: [f64; 2]) -> Outline {
    let count = ((to - from) / STEP).ceil().clamp(1.0, MOST_REPEATED) as u32;
    let side = |side: f64| {
        (0..=count).map(move |i| {
            let share = f64::from(i) / f64::from(count);
            let at = |[a, b]: [f64; 2]| a + (b - a) * share;
            line.at(at([from, to]), at(t) + side * at(widths) / 2.0).position().into()
        })
    };
    let right = side(-1.0);
    match widths {
        [0.0, 0.0] => Outline { corners: right.collect(), is_closed: false },
        _ => Outline { corners: right.chain(side(1.0).rev()).collect(), is_closed: true },
    }
}
