//! What the page can be narrowed to: scenes of one world, type and level, or of all.
//!
//! Whatever belongs to some scenes carries [`Setting::attributes`]; `filter.js` hides what is of others.
//! Numbers over all scenes are there once for each [`Slice`], so that the page computes none itself.

use serde::Serialize;

use super::super::table::kind_name;
use super::escape;
use crate::episode::Row;
use crate::world::{Level, ParkingType};

/// The world of scenes from no named set.
const FILES: &str = "files";
/// The level of scenes that have none.
const NONE: &str = "–";

/// The world of a set of scenes.
pub fn world(set: &str) -> &str {
    if set.is_empty() { FILES } else { set }
}

/// A level by name.
pub fn level_name(level: Option<Level>) -> String {
    level.map_or(NONE.to_owned(), |level| level.to_string())
}

/// Which scenes something is about; `None` for all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setting {
    pub world: Option<String>,
    pub kind: Option<String>,
    pub level: Option<String>,
}

impl Setting {
    /// The scenes of one group.
    pub fn new(set: &str, kind: Option<ParkingType>, level: Option<Level>) -> Self {
        let (world, level) = (world(set).to_owned(), level_name(level));
        Self { world: Some(world), kind: Some(kind_name(kind)), level: Some(level) }
    }

    /// Those of one type in any world.
    pub fn of_kind(kind: String) -> Self {
        Self { kind: Some(kind), ..Self::default() }
    }

    /// As attributes of an element, each after a blank.
    pub fn attributes(&self) -> String {
        let parts = [("world", &self.world), ("type", &self.kind), ("level", &self.level)];
        let attribute = |(name, value): (&str, &Option<String>)| {
            value.as_ref().map(|value| format!(" data-{name}=\"{}\"", escape(value)))
        };
        parts.into_iter().filter_map(attribute).collect()
    }

    /// World, type and level as a list in JSON, each empty for all.
    pub fn key(&self) -> String {
        let parts = [&self.world, &self.kind, &self.level];
        serde_json::to_string(&parts.map(|part| part.as_deref().unwrap_or(""))).expect("strings")
    }

    /// Whether a row is of such a scene.
    fn holds(&self, row: &Row) -> bool {
        let is = |wanted: &Option<String>, value: &str| wanted.as_ref().is_none_or(|w| w == value);
        is(&self.world, world(&row.set))
            && is(&self.kind, &kind_name(row.kind))
            && is(&self.level, &level_name(row.level))
    }
}

/// What there is to choose from; a list of one choice is empty.
#[derive(Debug, PartialEq, Serialize)]
pub struct Choices {
    pub worlds: Vec<String>,
    pub types: Vec<String>,
    pub levels: Vec<String>,
}

impl Choices {
    /// All that occur in `rows`, in the order of tables.
    pub fn new(rows: &[Row]) -> Self {
        let mut worlds: Vec<String> = Vec::new();
        let mut kinds: Vec<Option<ParkingType>> = Vec::new();
        let mut levels: Vec<Option<Level>> = Vec::new();
        for row in rows {
            if !worlds.iter().any(|w| w == world(&row.set)) {
                worlds.push(world(&row.set).to_owned());
            }
            if !kinds.contains(&row.kind) {
                kinds.push(row.kind);
            }
            if !levels.contains(&row.level) {
                levels.push(row.level);
            }
        }
        let place =
            |kind: &Option<ParkingType>| ParkingType::ALL.iter().position(|k| Some(*k) == *kind);
        kinds.sort_by_key(|kind| place(kind).unwrap_or(usize::MAX));
        levels.sort();
        let several = |list: Vec<String>| if list.len() > 1 { list } else { Vec::new() };
        Self {
            worlds: several(worlds),
            types: several(kinds.into_iter().map(kind_name).collect()),
            levels: several(levels.into_iter().map(level_name).collect()),
        }
    }

    /// The rows of every choice that holds any, all of them first.
    pub fn slices(&self, rows: &[Row]) -> Vec<(Setting, Vec<Row>)> {
        let or_all = |list: &[String]| -> Vec<Option<String>> {
            [None].into_iter().chain(list.iter().cloned().map(Some)).collect()
        };
        let (kinds, levels) = (or_all(&self.types), or_all(&self.levels));
        let mut slices = Vec::new();
        for world in or_all(&self.worlds) {
            for kind in &kinds {
                for level in &levels {
                    let setting =
                        Setting { world: world.clone(), kind: kind.clone(), level: level.clone() };
                    let held: Vec<Row> =
                        rows.iter().filter(|row| setting.holds(row)).cloned().collect();
                    let is_all = setting == Setting::default();
                    if is_all || !held.is_empty() {
                        slices.push((setting, held));
                    }
                }
            }
        }
        slices
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::metrics::tests::row;
    use super::*;

    #[test]
    fn every_choice_that_holds_scenes_is_there_once() {
        let (forward, easy) = (Some(ParkingType::Forward), Some(Level::Easy));
        let rows = [
            row("a", "n3p", 1.0, true),
            Row { kind: forward, level: easy, ..row("b", "n3p", 1.0, true) },
            Row { set: "x\"y".into(), level: None, kind: None, ..row("c", "n3p", 1.0, true) },
        ];
        let choices = Choices::new(&rows);
        assert_eq!(choices.worlds, ["home", "x\"y"]);
        assert_eq!(choices.types, ["forward", "parallel", "–"]);
        assert_eq!(choices.levels, ["–", "easy", "extreme"]);
        let slices = choices.slices(&rows);
        assert_eq!((slices[0].0.attributes(), slices[0].1.len()), (String::new(), 3));
        let of = |world: Option<&str>, kind: Option<&str>, level: Option<&str>| {
            let [world, kind, level] = [world, kind, level].map(|v| v.map(str::to_owned));
            let wanted = Setting { world, kind, level };
            let found: Vec<_> = slices.iter().filter(|(s, _)| *s == wanted).collect();
            assert!(found.len() <= 1, "{wanted:?} twice");
            found.first().map(|(_, rows)| rows.len())
        };
        assert_eq!(of(Some("home"), None, None), Some(2));
        assert_eq!(of(Some("home"), Some("forward"), Some("easy")), Some(1));
        assert_eq!(of(Some("home"), Some("forward"), Some("extreme")), None);
        assert_eq!(of(None, Some("–"), None), Some(1));
        assert_eq!(slices[1].0.key(), r#"["","","–"]"#);
        let last = Setting::new("x\"y", None, None).attributes();
        assert_eq!(last, " data-world=\"x&quot;y\" data-type=\"–\" data-level=\"–\"");
        // One of each: nothing to choose.
        let choices = Choices::new(&rows[..1]);
        assert!(choices.worlds.is_empty() && choices.types.is_empty() && choices.levels.is_empty());
        assert_eq!(choices.slices(&rows[..1]).len(), 1);
        assert_eq!(Choices::new(&[]).slices(&[]).len(), 1);
    }
}
