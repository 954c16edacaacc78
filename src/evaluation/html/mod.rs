//! `report.html`: one page that needs nothing but itself.
//!
//! The page's parts lie beside this file: `page.html` (a template), `style.css`, `theme.js`
//! and `gallery.js`. This module fills in what the template names: [`tables`], [`plots`]
//! (SVG, so that both can be read without scripts) and the data of the [`gallery`].

pub mod gallery;
mod plots;
mod tables;

use std::collections::{HashMap, HashSet};

use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

use super::episode::Case;
use super::method::Method;
use super::metrics;
use super::report::{NOTES, Provenance};
use super::rows::Row;
use super::trace::Trace;
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
    speed_plot: Vec<plots::PanelView>,
    time_plot: Vec<plots::PanelView>,
    node_plot: Vec<plots::PanelView>,
    dots: usize,
    failures: Vec<tables::Failure>,
    notes: Vec<&'static str>,
    first: usize,
    more: usize,
    shown: usize,
    data: String,
    style: &'static str,
    scripts: Vec<&'static str>,
}

/// The page of a run. `shown` are the [`gallery::chosen`] cases, `traces` theirs.
pub fn page(
    title: &str,
    rows: &[Row],
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
        speed_plot: plots::speed_ups(&groups, &methods).panels(),
        time_plot: plots::times(&groups, &methods, rows).panels(),
        node_plot: plots::nodes(&groups, &methods, rows).panels(),
        dots: plots::DOTS,
        failures,
        notes: NOTES.trim().split("\n\n").collect(),
        first: gallery::FIRST,
        more: gallery::FAILED,
        shown: gallery.scenes.len(),
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
        Ok(Method::N3p) => "ours",
        Ok(Method::MlpN3p | Method::KnnN3p) => "n3p",
        Ok(Method::RlSimple | Method::RlEval) => "rl",
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
