//! `report.html`: one page that needs nothing but itself.
//!
//! The page's parts lie beside this file: `page.html` (a template), `style.css` and the scripts: `theme.js`,
//! `filter.js` (one world, type or level alone), `gallery.js` (scenes and paths), `points.js` (from a point of a
//! plot to its scene). This module fills in what the template names: `tables`, `plots` and `points` (SVG, so that
//! all can be read without scripts) and the data of the [`gallery`].

mod axis;
mod curve;
mod filter;
pub mod gallery;
mod marks;
mod plots;
mod points;
mod tables;

use std::collections::HashMap;

use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

use super::away;
use super::drives;
use super::learning_curve;
use super::metrics;
use super::quality;
use super::report::{CURVE_NOTE, NOTES, Results};
use super::table::Table;
use super::trace::Trace;
use crate::episode::Case;
use crate::n3p::Method;
use filter::Choices;
use gallery::Gallery;

/// What the template names.
#[derive(Serialize)]
struct Page<'a> {
    title: &'a str,
    command: &'a str,
    facts: Vec<(&'static str, String)>,
    choices: Choices,
    slices: Vec<tables::Slice>,
    scenes: usize,
    columns: Vec<tables::Column>,
    levels: Vec<tables::LevelTable>,
    speed_ups: Vec<tables::SpeedLine>,
    quality: Vec<tables::QualityGroup>,
    quality_note: &'static str,
    home_and_away: Vec<plots::PanelView>,
    away_sentence: Option<String>,
    away_table: Table,
    away_note: &'static str,
    speed_plot: Vec<plots::PanelView>,
    point_plot: Vec<plots::PanelView>,
    point_keys: Vec<points::Key>,
    time_plot: Vec<plots::PanelView>,
    node_plot: Vec<plots::PanelView>,
    dots: usize,
    drives: Vec<tables::DriveLine>,
    drive_headers: [&'static str; drives::HEADERS.len()],
    drive_note: &'static str,
    curve: Vec<plots::PanelView>,
    curve_table: Option<Table>,
    curve_note: &'static str,
    failures: Vec<tables::Failure>,
    notes: Vec<&'static str>,
    first: usize,
    more: usize,
    shown: usize,
    driven: bool,
    data: String,
    style: &'static str,
    scripts: Vec<&'static str>,
}

/// The page of a run. `shown` are the [`gallery::chosen`] cases, `traces` theirs.
#[allow(clippy::missing_panics_doc, reason = "the template is part of this crate")]
pub fn page(results: &Results, shown: &[&Case], traces: &[Trace]) -> String {
    let &Results { title, rows, drives, curve, provenance } = results;
    let groups = metrics::summarise(rows, provenance.seed);
    let totals = metrics::totals(rows);
    // Methods that apply nowhere have no place in tables and plots.
    let used = totals.iter().filter(|t| t.scenes > 0);
    let methods: Vec<&str> = used.map(|t| t.method.as_str()).collect();
    let gallery = Gallery::new(shown, rows, traces);
    let scene_index: HashMap<&str, usize> =
        gallery.scenes.iter().enumerate().map(|(i, s)| (s.name.as_str(), i)).collect();
    let choices = Choices::new(rows);
    let slices = tables::slices(&choices, rows);
    let compared = away::compare(rows, None);
    let view = Page {
        title,
        command: &provenance.command,
        facts: provenance.facts().to_vec(),
        scenes: slices[0].scenes,
        choices,
        columns: tables::COLUMNS.to_vec(),
        levels: tables::levels(&groups, &methods),
        speed_ups: tables::speed_ups(&groups),
        quality: tables::quality(&quality::summarise(rows), &slices),
        slices,
        quality_note: quality::NOTE,
        home_and_away: plots::home_and_away(rows),
        away_sentence: away::sentence(&compared),
        away_table: away::table(&compared),
        away_note: away::NOTE,
        speed_plot: plots::speed_ups(&groups, &methods).panels(),
        point_plot: points::panels(&groups, &gallery),
        point_keys: points::keys(&gallery),
        time_plot: plots::times(&groups, &methods, rows, &scene_index).panels(),
        node_plot: plots::nodes(&groups, &methods, rows, &scene_index).panels(),
        dots: marks::DOTS,
        drives: tables::drives(drives),
        drive_headers: drives::HEADERS,
        drive_note: drives::NOTE,
        curve: curve::panels(curve),
        curve_table: (!curve.is_empty()).then(|| learning_curve::table(curve)),
        curve_note: CURVE_NOTE,
        failures: tables::failures(rows, &scene_index, &gallery.methods),
        notes: NOTES.trim().split("\n\n").collect(),
        first: gallery::FIRST,
        more: gallery::FAILED,
        shown: gallery.scenes.len(),
        driven: traces.iter().any(|trace| !trace.driven.is_empty()),
        data: embedded(&gallery),
        style: include_str!("style.css"),
        scripts: vec![
            include_str!("theme.js"),
            include_str!("../../../output/page/geometry.js"),
            include_str!("../../../output/page/drawing.js"),
            include_str!("filter.js"),
            include_str!("gallery.js"),
            include_str!("points.js"),
        ],
    };
    let mut engine = Environment::new();
    engine.set_undefined_behavior(UndefinedBehavior::Strict);
    // The name's ending turns escaping on.
    let page = engine.render_named_str("page.html", include_str!("page.html"), Serde(&view));
    page.expect("the template is part of this crate")
}

/// What kind of method it is, as a class of the style sheet.
fn family(method: &str) -> &'static str {
    match method.parse::<Method>() {
        Ok(m) if m == Method::N3P => "ours",
        Ok(m) if m.needs_selector() => "n3p",
        Ok(m) if m.is_policy() => "rl",
        Ok(method) if method.is_graph_search() => "search",
        _ => "other",
    }
}

/// `value` as JSON that may stand inside a `<script>` element, whatever its texts are.
fn embedded(value: &impl Serialize) -> String {
    let json = serde_json::to_string(value).expect("plain data");
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => {
                out += &format!("\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out
}

/// `text` as text or attribute of HTML.
fn escape(text: &str) -> String {
    minijinja::HtmlEscape(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::metrics::tests::row;
    use super::super::report::Provenance;
    use super::*;
    use crate::episode::Row;
    use crate::geometry::Pose;
    use crate::planners::Budget;
    use crate::vehicle::Vehicle;
    use crate::world::generate::{GeneratorConfig, generate};
    use crate::world::{Level, ParkingType};

    fn cases(count: u64) -> Vec<Case> {
        let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
        let (kind, level) = (ParkingType::Parallel, Level::Extreme);
        let case = |i| Case {
            scene: generate(&config, &vehicle, kind, level, 77, i),
            kind: Some(kind),
            level: Some(level),
            set: "home".into(),
        };
        (0..count).map(case).collect()
    }

    fn whole_page(cases: &[Case], rows: &[Row], traces: &[Trace]) -> String {
        let provenance = &Provenance::here("by hand".into(), 7, Budget::new(100), 1);
        let results = Results { title: "A & B", rows, drives: &[], curve: &[], provenance };
        page(&results, &gallery::chosen(cases, rows), traces)
    }

    /// The text between `before` and `after`.
    fn part<'a>(page: &'a str, before: &str, after: &str) -> &'a str {
        let rest = page.split(before).nth(1).unwrap_or_else(|| panic!("no {before}"));
        rest.split(after).next().unwrap()
    }

    #[test]
    fn hostile_names_stay_text_and_the_data_goes_round() {
        const NAME: &str = "</script><img src=x onerror=alert(1)> \"'&amp;\u{2028}é {{ title }}";
        let mut cases = cases(2);
        cases[1].scene.name = NAME.into();
        let first = cases[0].scene.name.clone();
        let rows = [
            row(&first, "n3p", 1e-5, true),
            row(&first, "<b>own</b>", 0.1, true),
            row(NAME, "n3p", 1e-5, false),
            row(NAME, "<b>own</b>", 0.1, true),
        ];
        let traces = [Trace {
            scene: NAME.into(),
            method: "<b>own</b>".into(),
            start: Some(Pose::new(0.1 + 0.2, -1.0 / 3.0, 2e-17)),
            segments: vec![[1.0 / 7.0, -0.7], [0.0, 1.0 / 3.0]],
            regions: None,
            preparatory: Some(Pose::default()),
            driven: vec![[0.1, 0.2, 0.3]],
        }];
        let html = whole_page(&cases, &rows, &traces);
        for raw in ["<img", "<b>own", "</script><"] {
            assert!(!html.contains(raw), "{raw}");
        }
        assert!(html.contains("&lt;b&gt;own") && html.contains("A &amp; B"));
        assert!(html.contains("é {{ title }}"), "names are no templates");
        let data = part(&html, "id=\"data\">", "</script>");
        assert!(!data.contains(['<', '\u{2028}']));
        let gallery: Gallery = serde_json::from_str(data).unwrap();
        assert_eq!(gallery, Gallery::new(&cases.iter().collect::<Vec<_>>(), &rows, &traces));
        assert_eq!(gallery.scenes[1].name, NAME);
        let run = &gallery.scenes[1].runs[1];
        assert_eq!(run.start, Some(Pose::new(0.3, -0.333333, 0.0)), "to the micrometre");
        assert_eq!(run.segments, [[0.14285714, -0.7], [0.0, 0.333333]]);
        assert!(html.contains("href=\"#play-1-0\""), "the failure leads to its scene");
        assert_eq!(html, whole_page(&cases, &rows, &traces), "same rows, same page");
    }

    #[test]
    fn the_page_needs_nothing_else_and_knows_both_themes() {
        let cases = cases(1);
        let html = whole_page(&cases, &[row(&cases[0].scene.name, "ha-rs", 0.1, true)], &[]);
        for outside in ["://", "src=", "url(", "@import", "<link", "fetch(", "import("] {
            assert!(!html.contains(outside), "{outside}");
        }
        for theme in ["color-scheme: light dark", "color-scheme: dark", "light-dark("] {
            assert!(html.contains(theme), "{theme}");
        }
        assert!(html.contains("None in 1 episodes."));
    }

    #[test]
    fn a_run_without_scenes_or_methods_is_still_a_page() {
        assert!(whole_page(&[], &[], &[]).contains("None in 0 episodes."));
    }

    #[test]
    fn the_gallery_takes_all_scenes_and_of_very_many_the_first_and_some_failures() {
        let one = cases(1).remove(0);
        let named = |i: usize| {
            let mut case = one.clone();
            case.scene.name = i.to_string();
            case
        };
        let cases: Vec<Case> = (0..=gallery::ALL).map(named).collect();
        let name = |i: usize| cases[i].scene.name.clone();
        let rows: Vec<Row> =
            (0..cases.len()).map(|i| row(&name(i), "ha-rs", 0.1, i < 15 || i % 2 == 1)).collect();
        assert_eq!(gallery::chosen(&cases[1..], &rows).len(), gallery::ALL);
        let chosen = gallery::chosen(&cases, &rows);
        assert_eq!(chosen.len(), gallery::FIRST + gallery::FAILED);
        assert_eq!(chosen[gallery::FIRST].scene.name, name(16));
    }
}
