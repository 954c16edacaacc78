//! What readers of XML share: elements by name, and numbers in them.

use roxmltree::{Document, Node};

use super::MapFile;
use crate::world::scene::SceneError;

/// An element of a document.
pub(super) type Element<'a> = Node<'a, 'a>;

/// The document of a text; one that defines entities is refused.
pub(super) fn parse<'a>(text: &'a str, file: MapFile) -> Result<Document<'a>, SceneError> {
    Document::parse(text).map_err(|e| file.format(format!("is not valid XML: {e}")))
}

/// The children with this name.
pub(super) fn children<'a>(of: Element<'a>, name: &'a str) -> impl Iterator<Item = Element<'a>> {
    of.children().filter(move |child| child.is_element() && child.tag_name().name() == name)
}

/// The first child with this name.
pub(super) fn child<'a>(of: Element<'a>, name: &'a str) -> Option<Element<'a>> {
    children(of, name).next()
}

/// An element for messages: its name, its id and the line it begins in.
pub(super) fn field(element: Element) -> String {
    let line = element.document().text_pos_at(element.range().start).row;
    let id = element.attribute("id").map(|id| format!(" {id}")).unwrap_or_default();
    format!("<{}>{id} in line {line}", element.tag_name().name())
}

/// `text` as a finite number.
pub(super) fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|v: &f64| v.is_finite())
}
