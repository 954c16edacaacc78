//! Occupancy grids: a `.yaml` beside an image, as the map servers of robots read and write them.
//!
//! What a pixel means is theirs (nav2_map_server): in the mode `trinary` a cell is occupied above `occupied_thresh`, free
//! below `free_thresh`, else unknown; in `scale` what lies between is a probability; in `raw` the value itself is one.
//! As navigation takes such a map by default, a cell is in the way where it is certain to be occupied (100 %).
//! What lies beyond the image is not to be driven on: the image is the drivable area.

use std::cell::Cell;
use std::collections::HashMap;
use std::path::Path;

use saphyr_parser::{Event, Parser};

use super::cells::{Block, blocks};
use super::image::{Cells, Pixel};
use super::{Map, MapFile, MapOptions};
use crate::files::reason;
use crate::geometry::{Pose, Vec2};
use crate::world::DrivableArea;
use crate::world::scene::SceneError;

/// A map's description: the values of its keys, single or in a list.
type Keys = HashMap<String, Vec<String>>;

pub(super) fn read(text: &str, options: &MapOptions, file: MapFile) -> Result<Map, SceneError> {
    let keys = keys(text).map_err(|e| file.format(e))?;
    let value = |key: &str| match keys.get(key).map(Vec::as_slice) {
        Some([value]) => Ok(value.as_str()),
        Some(_) => Err(file.invalid(key, "is a list; expected one value")),
        None => {
            let all = "image, resolution, origin, negate, occupied_thresh and free_thresh";
            Err(file.invalid(key, format!("is missing; a map has {all}")))
        }
    };
    let number = |key: &str| {
        let text = value(key)?;
        let number = text.parse().ok().filter(|v: &f64| v.is_finite());
        number.ok_or_else(|| file.invalid(key, format!("is {text:?}; expected a finite number")))
    };
    let share = |key: &str| {
        let v = number(key)?;
        let wrong = || file.invalid(key, format!("is {v:?}; expected a number from 0 to 1"));
        if (0.0..=1.0).contains(&v) { Ok(v) } else { Err(wrong()) }
    };
    let resolution = number("resolution")?;
    if !(1e-4..=100.0).contains(&resolution) {
        let text = format!("is {resolution:?}; expected metres per pixel, 0.0001 to 100");
        return Err(file.invalid("resolution", text));
    }
    let origin = origin(&keys, file)?;
    let (occupied, free) = (share("occupied_thresh")?, share("free_thresh")?);
    if free > occupied {
        let text = format!("is {free}; expected at most occupied_thresh, {occupied}");
        return Err(file.invalid("free_thresh", text));
    }
    let negate = match &value("negate")?.to_ascii_lowercase()[..] {
        "0" | "false" | "no" | "off" => false,
        "1" | "true" | "yes" | "on" => true,
        other => return Err(file.invalid("negate", format!("is {other:?}; expected 0 or 1"))),
    };
    let mode = match keys.get("mode") {
        None => Mode::Trinary,
        Some(_) => match value("mode")? {
            "trinary" => Mode::Trinary,
            "scale" => Mode::Scale,
            "raw" => Mode::Raw,
            other => {
                let text = format!("is {other:?}; expected trinary, scale or raw");
                return Err(file.invalid("mode", text));
            }
        },
    };
    let rule = Rule { mode, negate, occupied, free, unknown: options.unknown_is_occupied };

    let image = value("image")?;
    let at = file.path.parent().unwrap_or(Path::new("")).join(image);
    let unusable = |message: String| file.invalid("image", format!("{image} {message}"));
    let bytes = (file.bytes)(&at).map_err(|e| {
        unusable(format!("cannot be read: {}; expected a PGM or PNG file", reason(&e)))
    })?;
    let is_seen_through = Cell::new(false);
    let is_blocked = |pixel: Pixel| {
        let is_blocked = rule.is_blocked(pixel);
        is_seen_through.set(is_seen_through.get() || (is_blocked && pixel.opacity == 0.0));
        is_blocked
    };
    let cells = Cells::read(bytes, is_blocked).map_err(unusable)?;
    if is_seen_through.get() {
        log::warn!(
            "{}: transparent pixels of {image} count as occupied, as map servers take them; with mode: scale they are unknown",
            file.path.display()
        );
    }
    Ok(map(&cells, origin, resolution, image))
}

/// The blocked cells as rectangles in the frame in which the corner of the grid is `origin`.
fn map(cells: &Cells, origin: Pose, resolution: f64, image: &str) -> Map {
    // Without a turn every corner is one rounding from where it should be.
    let corner = |x: usize, y: usize| {
        let (x, y) = (x as f64 * resolution, y as f64 * resolution);
        match origin.heading == 0.0 {
            true => [origin.x + x, origin.y + y],
            false => origin.point_to_parent(Vec2::new(x, y)).into(),
        }
    };
    let rectangle = |Block { x0, x1, y0, y1 }| {
        vec![corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)]
    };
    let blocks = blocks(cells.rows_upward(), &cells.is_blocked);
    let whole = Block { x0: 0, x1: cells.columns, y0: 0, y1: cells.rows };
    Map {
        source: format!("occupancy grid {image}, {} × {} cells", cells.columns, cells.rows),
        obstacles: blocks.into_iter().map(rectangle).collect(),
        drivable_area: Some(DrivableArea { outer: rectangle(whole), holes: Vec::new() }),
        ..Map::default()
    }
}

fn origin(keys: &Keys, file: MapFile) -> Result<Pose, SceneError> {
    let given = keys.get("origin").map(Vec::as_slice).unwrap_or_default();
    let numbers: Option<Vec<f64>> = given.iter().map(|text| text.parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, yaw]) if [x, y, yaw].iter().all(|v| v.is_finite() && v.abs() < 1e9) => {
            Ok(Pose::new(x, y, yaw))
        }
        _ => {
            let given = given.join(", ");
            let expected = "expected the pose of the lower left corner, [x, y, yaw]";
            Err(file.invalid("origin", format!("is [{given}]; {expected}")))
        }
    }
}

#[derive(Clone, Copy)]
enum Mode {
    Trinary,
    Scale,
    Raw,
}

/// Which pixels are in the way.
struct Rule {
    mode: Mode,
    negate: bool,
    occupied: f64,
    free: f64,
    unknown: bool,
}

impl Rule {
    fn is_blocked(&self, pixel: Pixel) -> bool {
        let Pixel { shade, opacity, has_opacity } = pixel;
        match self.mode {
            Mode::Trinary => {
                // Map servers take transparency for a fourth colour here.
                let shade = if has_opacity { (3.0 * shade + opacity) / 4.0 } else { shade };
                let occupied = if self.negate { shade } else { 1.0 - shade };
                occupied > self.occupied || (self.unknown && occupied >= self.free)
            }
            Mode::Scale if opacity < 1.0 => self.unknown,
            Mode::Scale => {
                let occupied = if self.negate { shade } else { 1.0 - shade };
                let percent = (occupied - self.free) / (self.occupied - self.free) * 100.0;
                occupied > self.occupied || percent.round_ties_even() >= 100.0
            }
            Mode::Raw => match (shade * 255.0).round() {
                100.0 => true,
                value => self.unknown && value > 100.0,
            },
        }
    }
}

/// The keys of a map's description and their values, or what is wrong with it.
fn keys(text: &str) -> Result<Keys, String> {
    let mut keys = Keys::new();
    let (mut depth, mut key, mut starts) = (0_usize, None::<String>, false);
    for event in Parser::new_from_str(text) {
        let (event, _) = event.map_err(|e| format!("is not valid YAML: {e}"))?;
        match event {
            Event::MappingStart(..) | Event::SequenceStart(..) => {
                if depth == 0 && !matches!(event, Event::MappingStart(..)) {
                    return Err("is no map's description; expected lines KEY: VALUE".to_owned());
                }
                depth += 1;
                starts = true;
            }
            Event::MappingEnd | Event::SequenceEnd => {
                depth -= 1;
                if depth == 1 {
                    key = None;
                }
            }
            Event::Scalar(value, ..) => match (depth, &key) {
                (0, _) => {
                    return Err("is no map's description; expected lines KEY: VALUE".to_owned());
                }
                (1, None) => {
                    if keys.insert(value.to_string(), Vec::new()).is_some() {
                        return Err(format!("has the key {value} twice; leave one of them out"));
                    }
                    key = Some(value.into_owned());
                }
                (1, Some(name)) => {
                    keys.entry(name.clone()).or_default().push(value.into_owned());
                    key = None;
                }
                // What lies deeper is a list's, or nobody's.
                (_, Some(name)) => keys.entry(name.clone()).or_default().push(value.into_owned()),
                (_, None) => {}
            },
            Event::Alias(_) => {
                return Err("refers to an anchor (*); expected plain values".to_owned());
            }
            _ => {}
        }
    }
    match starts {
        true => Ok(keys),
        false => Err("is no map's description; expected lines KEY: VALUE".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_mean_what_they_mean_to_map_servers() {
        let usual =
            Rule { mode: Mode::Trinary, negate: false, occupied: 0.65, free: 0.25, unknown: false };
        let pixel = |byte: f64, opacity: f64, has_opacity| Pixel {
            shade: byte / 255.0,
            opacity,
            has_opacity,
        };
        let blocked = |rule: &Rule, byte| rule.is_blocked(pixel(byte, 1.0, false));
        assert_eq!(
            [0.0, 89.0, 90.0, 205.0, 254.0].map(|b| blocked(&usual, b)),
            [true, true, false, false, false]
        );
        let careful = Rule { unknown: true, ..usual };
        assert_eq!(
            [0.0, 90.0, 191.0, 205.0].map(|b| blocked(&careful, b)),
            [true, true, true, false]
        );
        let negated = Rule { negate: true, ..usual };
        assert_eq!(
            [0.0, 165.0, 166.0, 255.0].map(|b| blocked(&negated, b)),
            [false, false, true, true]
        );
        let raw = Rule { mode: Mode::Raw, ..usual };
        assert_eq!(
            [0.0, 99.0, 100.0, 101.0, 255.0].map(|b| blocked(&raw, b)),
            [false, false, true, false, false]
        );
        let raw = Rule { unknown: true, ..raw };
        assert_eq!([99.0, 100.0, 101.0].map(|b| blocked(&raw, b)), [false, true, true]);
        let scale = Rule { mode: Mode::Scale, ..usual };
        assert_eq!([0.0, 89.0, 128.0].map(|b| blocked(&scale, b)), [true, true, false]);
        assert!(!scale.is_blocked(pixel(0.0, 0.5, true)), "unknown");
        // Transparency as a fourth colour: black and clear is as dark as can be.
        assert!(usual.is_blocked(pixel(0.0, 0.0, true)) && usual.is_blocked(pixel(0.0, 1.0, true)));
        assert!(!usual.is_blocked(pixel(100.0, 1.0, true)));
    }

    #[test]
    fn lists_may_be_written_either_way() {
        let text = "image: a.pgm\norigin:\n- -1.0\n- 2\n- 0.0\nmore: {deep: [1, 2]}\n";
        let one = keys(text).unwrap();
        assert_eq!(one["origin"], ["-1.0", "2", "0.0"]);
        assert_eq!(keys("image: a.pgm\norigin: [-1.0, 2, 0.0]").unwrap()["origin"], one["origin"]);
        for wrong in ["- a\n- b", "plain", "a: b: c: d", "a: [1, 2", "a: &x 1\nb: *x", "a: 1\na: 2"]
        {
            assert!(keys(wrong).is_err(), "{wrong}");
        }
    }
}
