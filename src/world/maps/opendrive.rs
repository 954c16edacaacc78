//! OpenDRIVE roads: parking spaces to park in, and other objects to keep off.
//!
//! Of a road only its reference line is used (`reference_line`), to place objects (`objects`) by their road coordinates s, t.
//! Heights are ignored, and so is what is painted or flat. Format: ASAM OpenDRIVE 1.4 to 1.8.

mod objects;
mod reference_line;

use roxmltree::Document;

use super::xml::{Element, child, children, field, finite};
use super::{Map, MapFile};
use crate::world::scene::SceneError;

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

    /// A length that is at least 0.
    fn length(&self, of: Element, name: &str) -> Result<f64, SceneError> {
        match self.number(of, name)? {
            v if v >= 0.0 => Ok(v),
            v => {
                Err(self.file.invalid(field(of), format!("has {name} {v:?}; expected at least 0")))
            }
        }
    }
}
