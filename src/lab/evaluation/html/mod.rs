//! `report.html`: one page that needs nothing but itself.
//!
//! The page's parts lie beside this file: `page.html` (a template), `style.css`, `theme.js`
//! and `gallery.js`. This module fills in what the template names: `tables`, `plots`
//! (SVG, so that both can be read without scripts) and the data of the [`gallery`].

mod curve;
pub mod gallery;
mod plots;
mod tables;

use std::collections::{HashMap, HashSet};

use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

use super::learning_curve::{self, CurvePoint};
use super::metrics;
use super::quality;
use super::report::{CURVE_NOTE, NOTES, Provenance};
use super::table::Table;
use super::trace::Trace;
use crate::episode::Case;
use crate::episode::Row;
use crate::n3p::Method;
use gallery::Gallery;

/// What the template names.
#[derive(Serialize)]
struct Page<'a> {
    title: &'a str,
    command: &'a str,
    facts: Vec<(&'static str, String)>,
    methods: Vec<tables::MethodLine>,
    scenes: usize,
    settings: usize,
    episodes: usize,
    rejected: usize,
    columns: Vec<tables::Column>,
    levels: Vec<tables::LevelTable>,
    speed_ups: Vec<tables::SpeedLine>,
    quality: Vec<tables::QualityLine>,
    quality_note: &'static str,
    home_and_away: Vec<plots::PanelView>,
    speed_plot: Vec<plots::PanelView>,
    time_plot: Vec<plots::PanelView>,
    node_plot: Vec<plots::PanelView>,
    dots: usize,
    curve: Vec<curve::CurveView>,
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

/// The page of a run. `curve` may be empty; `shown` are the [`gallery::chosen`] cases, `traces` theirs.
pub fn page(
    title: &str,
    rows: &[Row],
    curve: &[CurvePoint],
    provenance: &Provenance,
    shown: &[&Case],
    traces: &[Trace],
) -> String {
    let groups = metrics::summarise(rows, provenance.seed);
    let totals = metrics::totals(rows);
    // Methods that apply nowhere have no place in tables and plots.
    let used = totals.iter().filter(|t| t.scenes > 0);
    let methods: Vec<&str> = used.map(|t| t.method.as_str()).collect();
    let gallery = Gallery::new(shown, rows, traces);
    let scene_index: HashMap<&str, usize> =
        gallery.scenes.iter().enumerate().map(|(i, s)| (s.name.as_str(), i)).collect();
    let failures = tables::failures(rows, &scene_index, &gallery.methods);
    let view = Page {
        title,
        command: &provenance.command,
        facts: provenance.facts().to_vec(),
        methods: tables::methods(&totals),
        scenes: rows.iter().map(|r| &r.scene).collect::<HashSet<_>>().len(),
        settings: groups.len(),
        episodes: rows.iter().filter(|r| r.applies()).count(),
        rejected: rows.iter().filter(|r| r.is_rejected()).count(),
        columns: tables::COLUMNS.to_vec(),
        levels: tables::levels(&groups, &methods),
        speed_ups: tables::speed_ups(&groups),
        quality: tables::quality(&quality::summarise(rows)),
        quality_note: quality::NOTE,
        home_and_away: plots::home_and_away(&methods, rows),
        speed_plot: plots::speed_ups(&groups, &methods).panels(),
        time_plot: plots::times(&groups, &methods, rows).panels(),
        node_plot: plots::nodes(&groups, &methods, rows).panels(),
        dots: plots::DOTS,
        curve: curve::panels(curve),
        curve_table: (!curve.is_empty()).then(|| learning_curve::table(curve)),
        curve_note: CURVE_NOTE,
        failures,
        notes: NOTES.trim().split("\n\n").collect(),
        first: gallery::FIRST,
        more: gallery::FAILED,
        shown: gallery.scenes.len(),
        driven: traces.iter().any(|trace| !trace.driven.is_empty()),
        data: embedded(&gallery),
        style: include_str!("style.css"),
        scripts: vec![include_str!("theme.js"), include_str!("gallery.js")],
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
    use super::*;
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
        let provenance = Provenance::here("by hand".into(), 7, Budget::new(100), 1);
        page("A & B", rows, &[], &provenance, &gallery::chosen(cases, rows), traces)
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
        assert_eq!((run.start, &run.segments), (traces[0].start, &traces[0].segments));
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
    fn the_gallery_takes_the_first_scenes_and_some_failures() {
        let cases = cases(60);
        let name = |i: usize| cases[i].scene.name.clone();
        let rows: Vec<Row> =
            (0..60).map(|i| row(&name(i), "ha-rs", 0.1, i < 15 || i % 2 == 1)).collect();
        let chosen = gallery::chosen(&cases, &rows);
        assert_eq!(chosen.len(), gallery::FIRST + gallery::FAILED);
        assert_eq!(chosen[gallery::FIRST].scene.name, name(16));
    }
}
