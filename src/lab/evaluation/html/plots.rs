//! Plots as SVG, drawn here so that they need no script: one panel for each type and level,
//! one line in it for each method. Colours come from the page's style sheet.

use std::collections::HashMap;
use std::fmt::Write;

use serde::Serialize;

use super::super::away::{self, HomeAndAway, Side};
use super::super::metrics::Group;
use super::super::table::{self, figures, kind_name, part_name};
use super::axis::{Axis, count, factor, seconds};
use super::filter::Setting;
use super::marks::{Dot, Mark};
use super::tables::paper_ratio;
use super::{escape, family};
use crate::episode::Row;
use crate::world::ParkingType;

/// Sizes, in the panel's own units (about a pixel).
pub(super) const WIDTH: f64 = 400.0;
pub(super) const LEFT: f64 = 66.0;
pub(super) const RIGHT: f64 = 20.0;
const TOP: f64 = 8.0;
const LINE: f64 = 27.0;
const BOTTOM: f64 = 34.0;

/// One plot: panels that share their axis.
pub struct Plot {
    /// What is drawn, for people who cannot see it.
    what: &'static str,
    axis: Axis,
    /// Whether the value 1 is marked: equal to the reference.
    unity: bool,
    panels: Vec<Panel>,
}

/// One type and level.
struct Panel {
    heading: String,
    setting: Setting,
    lines: Vec<(String, Mark)>,
}

/// A drawn panel.
#[derive(Serialize)]
pub struct PanelView {
    pub heading: String,
    /// Of its element: which scenes it shows.
    pub attributes: String,
    pub svg: String,
}

/// Planning times of every scene; `shown` are the gallery's scenes by name.
pub fn times(
    groups: &[Group],
    methods: &[&str],
    rows: &[Row],
    shown: &HashMap<&str, usize>,
) -> Plot {
    let panels = values(groups, methods, rows, shown, |r| r.plan_time_s);
    let value = |v: f64| format!("{} ms", figures(v * 1e3));
    let axis = Axis::decades("planning time", false, seconds, value, all_values(&panels));
    Plot { what: "Planning times", axis, unity: false, panels }
}

/// Node expansions in every scene; `shown` are the gallery's scenes by name.
pub fn nodes(
    groups: &[Group],
    methods: &[&str],
    rows: &[Row],
    shown: &HashMap<&str, usize>,
) -> Plot {
    let panels = values(groups, methods, rows, shown, |r| f64::from(r.nodes));
    let value = |v: f64| format!("{v:.0}");
    let axis = Axis::decades("node expansions", true, count, value, all_values(&panels));
    Plot { what: "Node expansions", axis, unity: false, panels }
}

/// Paired speed-ups with their intervals.
pub fn speed_ups(groups: &[Group], methods: &[&str]) -> Plot {
    let printed = table::paper_rows();
    let mark = |g: &Group, method: &str| {
        let Some(s) = g.summaries.iter().find(|s| s.method == method) else {
            return Mark::Nothing;
        };
        s.speed_up.as_ref().map_or(Mark::Reference, |u| Mark::Ratio {
            ratio: u.ratio,
            low: u.interval.low,
            high: u.interval.high,
            paper: paper_ratio(&printed, g, s),
        })
    };
    let panels = panels_of(groups, methods, mark);
    let title = "times as fast as the fastest graph search";
    let axis = Axis::decades(title, false, factor, times_as_fast, all_values(&panels));
    Plot { what: "Speed-ups", axis, unity: true, panels }
}

/// Home against away: speed, quality and failures of every method, over all types and then for each of them.
/// Empty unless the run has both.
pub fn home_and_away(rows: &[Row]) -> Vec<PanelView> {
    let kinds = rows.iter().fold(Vec::new(), |mut kinds: Vec<Option<ParkingType>>, row| {
        if !kinds.contains(&row.kind) {
            kinds.push(row.kind);
        }
        kinds
    });
    let all = [("all types".to_owned(), Setting::default(), away::compare(rows, None))];
    let of_kind = |kind: Option<ParkingType>| {
        let name = kind_name(kind);
        (name.clone(), Setting::of_kind(name), away::compare(rows, Some(kind)))
    };
    // Of one type alone the first row says it all.
    let each = kinds.iter().filter(|_| kinds.len() > 1).map(|&kind| of_kind(kind));
    let parts: Vec<_> =
        all.into_iter().chain(each).filter(|(_, _, lines)| !lines.is_empty()).collect();
    type Value = fn(Side) -> Option<f64>;
    let plot = |what: &'static str, value: Value, unity: bool, axis: fn(Vec<f64>) -> Axis| {
        let mark =
            |line: &HomeAndAway| match [line.home, line.away].map(|side| side.and_then(value)) {
                [None, None] => Mark::Nothing,
                [home, away] => Mark::HomeAndAway { home, away },
            };
        let panel = |(name, setting, lines): &(String, Setting, Vec<HomeAndAway>)| Panel {
            heading: format!("{what}, {name}"),
            setting: setting.clone(),
            lines: lines.iter().map(|l| (l.method.clone(), mark(l))).collect(),
        };
        let panels: Vec<Panel> = parts.iter().map(panel).collect();
        let axis = axis(all_values(&panels).collect());
        Plot { what: "Home against away", axis, unity, panels }.panels()
    };
    let speed = |values: Vec<f64>| {
        let title = "times as fast as ha-rs, by mean";
        Axis::decades(title, false, factor, times_as_fast, values.into_iter())
    };
    let cost = |values: Vec<f64>| {
        Axis::over_one("cost over the cheapest, 95th percentile", values.into_iter())
    };
    let failed = |values: Vec<f64>| Axis::percent("scenes without a path", values.into_iter());
    let share = |side: Side| Some(100.0 * side.failed as f64 / side.scenes as f64);
    let columns = [
        plot("Speed", |side| side.faster, true, speed),
        plot("Quality", |side| side.p95_cost, false, cost),
        plot("Failures", share, false, failed),
    ];
    // Row by row: the three of all types are the first picture.
    let mut columns = columns.map(Vec::into_iter);
    let mut views = Vec::new();
    for _ in 0..parts.len() {
        views.extend(columns.iter_mut().filter_map(Iterator::next));
    }
    views
}

fn values(
    groups: &[Group],
    methods: &[&str],
    rows: &[Row],
    shown: &HashMap<&str, usize>,
    value: fn(&Row) -> f64,
) -> Vec<Panel> {
    let mark = |g: &Group, method: &str| {
        let mine = rows.iter().filter(|r| {
            (&r.set, r.level, r.kind) == (&g.set, g.level, g.kind)
                && r.method == method
                && r.applies()
        });
        let (solved, failed): (Vec<&Row>, Vec<&Row>) = mine.partition(|r| r.ok);
        let sorted = |rows: Vec<&Row>| {
            let dot =
                |row: &Row| Dot { value: value(row), scene: shown.get(&row.scene[..]).copied() };
            let mut dots: Vec<Dot> = rows.into_iter().map(dot).collect();
            dots.sort_by(|a, b| a.value.total_cmp(&b.value));
            dots
        };
        if solved.is_empty() && failed.is_empty() {
            return Mark::Nothing;
        }
        Mark::Values { solved: sorted(solved), failed: sorted(failed) }
    };
    panels_of(groups, methods, mark)
}

fn panels_of(
    groups: &[Group],
    methods: &[&str],
    mark: impl Fn(&Group, &str) -> Mark,
) -> Vec<Panel> {
    let panel = |g: &Group| Panel {
        heading: format!("{}, {}", part_name(&g.set, g.level), kind_name(g.kind)),
        setting: Setting::new(&g.set, g.kind, g.level),
        lines: methods.iter().map(|m| ((*m).to_owned(), mark(g, m))).collect(),
    };
    groups.iter().map(panel).collect()
}

fn all_values(panels: &[Panel]) -> impl Iterator<Item = f64> + '_ {
    panels.iter().flat_map(|p| &p.lines).flat_map(|(_, mark)| mark.values())
}

fn times_as_fast(v: f64) -> String {
    format!("{} ×", figures(v))
}

impl Plot {
    /// The panels, drawn.
    pub fn panels(&self) -> Vec<PanelView> {
        let view = |p: &Panel| PanelView {
            heading: p.heading.clone(),
            attributes: p.setting.attributes(),
            svg: self.panel(p),
        };
        self.panels.iter().map(view).collect()
    }

    fn panel(&self, panel: &Panel) -> String {
        let bottom = TOP + LINE * panel.lines.len() as f64;
        let height = bottom + BOTTOM;
        let describe = |mark: &Mark| mark.describe(self.axis.value);
        let described: Vec<String> =
            panel.lines.iter().map(|(m, mark)| format!("{m}: {}", describe(mark))).collect();
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\"><title>{}, {}</title><desc>{}</desc>\n",
            self.what,
            escape(&panel.heading),
            escape(&described.join("; "))
        );
        self.draw_axis(&mut svg, bottom);
        let x = |v: f64| LEFT + self.axis.share(v) * (WIDTH - LEFT - RIGHT);
        for (i, (method, mark)) in panel.lines.iter().enumerate() {
            let y = TOP + LINE * (i as f64 + 0.5);
            let _ = write!(
                svg,
                "<g class=\"f-{}\" data-name=\"{m}\"><title>{m}: {}</title><rect class=\"hit\" y=\"{}\" \
                 width=\"{WIDTH}\" height=\"{LINE}\"/><text class=\"m\" x=\"{}\" y=\"{}\">{m}\
                 </text>",
                family(method),
                escape(&describe(mark)),
                y - LINE / 2.0,
                LEFT - 8.0,
                y + 4.0,
                m = escape(method),
            );
            mark.draw(&mut svg, x, y);
            svg += "</g>\n";
        }
        svg + "</svg>"
    }

    fn draw_axis(&self, svg: &mut String, bottom: f64) {
        let room = WIDTH - LEFT - RIGHT;
        // Labels get 40 units each at least.
        for (value, label) in self.axis.ticks(40.0 / room) {
            let x = num(LEFT + self.axis.share(value) * room);
            let class = if self.unity && value == 1.0 { "grid one" } else { "grid" };
            let _ = write!(svg, "<path class=\"{class}\" d=\"M{x} {TOP}V{bottom}\"/>");
            if !label.is_empty() {
                let y = bottom + 13.0;
                let _ = write!(svg, "<text class=\"t\" x=\"{x}\" y=\"{y}\">{label}</text>");
            }
        }
        let (x, y) = (LEFT + room / 2.0, bottom + 28.0);
        let _ = writeln!(svg, "<text class=\"t\" x=\"{x}\" y=\"{y}\">{}</text>", self.axis.title);
    }
}

/// A coordinate to a tenth.
pub(super) fn num(v: f64) -> String {
    ((v * 10.0).round() / 10.0 + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::super::metrics::{summarise, tests::row};
    use super::super::marks::DOTS;
    use super::*;

    #[test]
    fn every_method_has_its_line_and_failures_their_crosses() {
        let rows: Vec<Row> = (0..400)
            .map(|i| row(&format!("s{i}"), "ha-rs", 1e-4 * f64::from(i + 1), i % 40 != 0))
            .collect();
        let groups = summarise(&rows, 1);
        let shown = HashMap::from([("s1", 7), ("s399", 9), ("s0", 3)]);
        let panels = times(&groups, &["ha-rs", "sha"], &rows, &shown).panels();
        assert_eq!((panels.len(), &panels[0].heading[..]), (1, "extreme, parallel"));
        let svg = &panels[0].svg;
        assert!(svg.contains("sha: not applicable") && svg.contains("10 failed"), "{svg}");
        assert!(svg.contains("100 µs") && svg.contains("10 ms") && !svg.contains("NaN"));
        let dots = svg.split("class=\"dots\"").nth(1).unwrap().split('>').next().unwrap();
        assert_eq!(dots.matches("h0").count(), DOTS);
        // Each dot says which scene of the gallery it is, if it is there.
        let scenes = |path: &str| -> Vec<String> {
            let list = path.split("data-scenes=\"").nth(1).unwrap().split('"').next().unwrap();
            list.split(',').map(str::to_owned).collect()
        };
        let of_dots = scenes(dots);
        assert_eq!((of_dots.len(), &of_dots[0][..], &of_dots[149][..]), (DOTS, "7", "9"));
        let crosses = svg.split("class=\"failed\"").nth(1).unwrap().split('>').next().unwrap();
        assert_eq!((scenes(crosses).len(), &scenes(crosses)[0][..]), (10, "3"));
        let speed = speed_ups(&groups, &["ha-rs"]).panels();
        assert!(speed[0].svg.contains("the reference"));
        assert!(nodes(&groups, &["ha-rs"], &rows, &shown).panels()[0].svg.contains("median 10,"));
    }

    #[test]
    fn home_stands_against_away_where_a_run_has_both() {
        let in_set = |set: &str, method: &str, time| Row {
            set: set.to_owned(),
            ..row(&format!("{set}-scene"), method, time, true)
        };
        let rows = [
            in_set("home", "ha-rs", 0.02),
            in_set("home", "n3p", 0.001),
            in_set("lots", "ha-rs", 0.02),
            in_set("lots", "n3p", 0.01),
        ];
        assert_eq!(home_and_away(&rows[..2]).len(), 0, "only home");
        let panels = home_and_away(&rows);
        let headings: Vec<&str> = panels.iter().map(|p| &p.heading[..]).collect();
        assert_eq!(headings, ["Speed, all types", "Quality, all types", "Failures, all types"]);
        assert!(panels[0].svg.contains("n3p: at home 20.00 ×, away 2.000 ×"), "{}", panels[0].svg);
        assert!(panels[1].svg.contains("n3p: at home 1.000, away 1.000"), "{}", panels[1].svg);
        assert!(panels[2].svg.contains("n3p: at home 0.0 %, away 0.0 %"), "{}", panels[2].svg);
        assert!(panels.iter().all(|p| !p.svg.contains("NaN") && p.attributes.is_empty()));
        let other = Row { kind: Some(ParkingType::Forward), ..in_set("home", "n3p", 0.1) };
        let rows: Vec<Row> = rows.into_iter().chain([other]).collect();
        let panels = home_and_away(&rows);
        // Of forward there is nothing away.
        assert_eq!(panels.len(), 6);
        assert_eq!(panels[3].attributes, " data-type=\"parallel\"");
    }
}
