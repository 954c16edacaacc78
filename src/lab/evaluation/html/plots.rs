//! Plots as SVG, drawn here so that they need no script: one panel for each type and level,
//! one line in it for each method. Colours come from the page's style sheet.

use std::collections::BTreeSet;
use std::fmt::Write;

use serde::Serialize;

use super::super::metrics::{Group, percentile};
use super::super::table::{self, figures, kind_name, part_name};
use super::tables::paper_ratio;
use super::{escape, family};
use crate::episode::Row;
use crate::world::ParkingType;

/// Dots drawn in a line; of more scenes, so many evenly spaced ranks.
pub const DOTS: usize = 150;

/// Sizes, in the panel's own units (about a pixel).
const WIDTH: f64 = 400.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 8.0;
const LINE: f64 = 27.0;
const BOTTOM: f64 = 34.0;
/// Room for the value zero at the left of a logarithmic axis.
const ZERO: f64 = 30.0;

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
    level: String,
    kind: String,
    lines: Vec<(String, Mark)>,
}

/// A drawn panel.
#[derive(Serialize)]
pub struct PanelView {
    pub heading: String,
    pub svg: String,
}

/// What a method's line shows.
enum Mark {
    /// The method does not apply here.
    Nothing,
    /// It is what the others are compared with.
    Reference,
    /// One value for each scene, sorted, solved ones and failures.
    Values { solved: Vec<f64>, failed: Vec<f64> },
    /// A number with its interval, and the paper's number.
    Ratio { ratio: f64, low: f64, high: f64, paper: Option<f64> },
    /// A number at home and one away, each where there are such scenes.
    HomeAndAway { home: Option<f64>, away: Option<f64> },
}

/// A logarithmic axis over whole decades.
struct Axis {
    title: &'static str,
    low: i32,
    high: i32,
    /// Whether zero has a place of its own.
    zero: bool,
    tick: fn(i32) -> String,
    value: fn(f64) -> String,
}

/// Planning times of every scene.
pub fn times(groups: &[Group], methods: &[&str], rows: &[Row]) -> Plot {
    let axis = Axis {
        title: "planning time",
        low: 0,
        high: 0,
        zero: false,
        tick: seconds,
        value: |v| format!("{} ms", figures(v * 1e3)),
    };
    values("Planning times", axis, groups, methods, rows, |r| r.plan_time_s)
}

/// Node expansions in every scene.
pub fn nodes(groups: &[Group], methods: &[&str], rows: &[Row]) -> Plot {
    let axis = Axis {
        title: "node expansions",
        low: 0,
        high: 0,
        zero: true,
        tick: count,
        value: |v| format!("{v:.0}"),
    };
    values("Node expansions", axis, groups, methods, rows, |r| f64::from(r.nodes))
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
    let axis = Axis {
        title: "times as fast as the fastest graph search",
        low: 0,
        high: 0,
        zero: false,
        tick: times_faster,
        value: |v| format!("{} ×", figures(v)),
    };
    Plot::new("Speed-ups", axis, true, groups, methods, mark)
}

/// How much faster than `ha-rs` methods are by mean, at home (all levels together) and away (all other
/// sets): one panel for each parking type. Empty unless the run has both and `ha-rs` among its methods.
pub fn home_and_away(methods: &[&str], rows: &[Row]) -> Vec<PanelView> {
    const HOME: &str = "home";
    const REFERENCE: &str = "ha-rs";
    let sets: BTreeSet<&str> = rows.iter().map(|r| r.set.as_str()).collect();
    if !sets.contains(HOME) || sets.len() < 2 || !methods.contains(&REFERENCE) {
        return Vec::new();
    }
    let mean = |kind: Option<ParkingType>, is_home: bool, method: &str| {
        let is_one = |r: &&Row| {
            r.kind == kind && (r.set == HOME) == is_home && r.method == method && r.applies()
        };
        let times: Vec<f64> = rows.iter().filter(is_one).map(|r| r.plan_time_s).collect();
        (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
    };
    let mark = |kind: Option<ParkingType>, method: &str| {
        if method == REFERENCE {
            return Mark::Reference;
        }
        let [home, away] = [true, false].map(|is_home| {
            Some(mean(kind, is_home, REFERENCE)? / mean(kind, is_home, method)?.max(1e-9))
        });
        match (home, away) {
            (None, None) => Mark::Nothing,
            _ => Mark::HomeAndAway { home, away },
        }
    };
    let kinds: BTreeSet<Option<ParkingType>> = rows.iter().map(|r| r.kind).collect();
    let panel = |&kind: &Option<ParkingType>| Panel {
        level: "home and away".to_owned(),
        kind: kind_name(kind),
        lines: methods.iter().map(|m| ((*m).to_owned(), mark(kind, m))).collect(),
    };
    let panels: Vec<Panel> = kinds.iter().map(panel).collect();
    let axis = Axis {
        title: "times as fast as ha-rs, by mean",
        low: 0,
        high: 0,
        zero: false,
        tick: times_faster,
        value: |v| format!("{} ×", figures(v)),
    };
    let marks = panels.iter().flat_map(|p| &p.lines).map(|(_, mark)| mark);
    let axis = axis.around(marks.flat_map(Mark::values));
    Plot { what: "Home against away", axis, unity: true, panels }.panels()
}

fn values(
    what: &'static str,
    axis: Axis,
    groups: &[Group],
    methods: &[&str],
    rows: &[Row],
    value: fn(&Row) -> f64,
) -> Plot {
    let mark = |g: &Group, method: &str| {
        let mine = rows.iter().filter(|r| {
            (&r.set, r.level, r.kind) == (&g.set, g.level, g.kind)
                && r.method == method
                && r.applies()
        });
        let (solved, failed): (Vec<&Row>, Vec<&Row>) = mine.partition(|r| r.ok);
        let sorted = |rows: Vec<&Row>| {
            let mut values: Vec<f64> = rows.into_iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        if solved.is_empty() && failed.is_empty() {
            return Mark::Nothing;
        }
        Mark::Values { solved: sorted(solved), failed: sorted(failed) }
    };
    Plot::new(what, axis, false, groups, methods, mark)
}

impl Plot {
    fn new(
        what: &'static str,
        axis: Axis,
        unity: bool,
        groups: &[Group],
        methods: &[&str],
        mark: impl Fn(&Group, &str) -> Mark,
    ) -> Self {
        let panel = |g: &Group| Panel {
            level: part_name(&g.set, g.level),
            kind: kind_name(g.kind),
            lines: methods.iter().map(|m| ((*m).to_owned(), mark(g, m))).collect(),
        };
        let panels: Vec<Panel> = groups.iter().map(panel).collect();
        let marks = panels.iter().flat_map(|p| &p.lines).map(|(_, mark)| mark);
        let axis = axis.around(marks.flat_map(Mark::values));
        Self { what, axis, unity, panels }
    }

    /// The panels, drawn.
    pub fn panels(&self) -> Vec<PanelView> {
        let view = |p: &Panel| PanelView {
            heading: format!("{}, {}", p.level, p.kind),
            svg: self.panel(p),
        };
        self.panels.iter().map(view).collect()
    }

    fn panel(&self, panel: &Panel) -> String {
        let bottom = TOP + LINE * panel.lines.len() as f64;
        let height = bottom + BOTTOM;
        let (what, level, kind) = (self.what, &panel.level, &panel.kind);
        let described: Vec<String> =
            panel.lines.iter().map(|(m, mark)| format!("{m}: {}", self.describe(mark))).collect();
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\"><title>{what}, {level}, {kind}\
             </title><desc>{}</desc>\n",
            escape(&described.join("; "))
        );
        self.draw_axis(&mut svg, bottom);
        for (i, (method, mark)) in panel.lines.iter().enumerate() {
            let y = TOP + LINE * (i as f64 + 0.5);
            let _ = write!(
                svg,
                "<g class=\"f-{}\"><title>{m}: {}</title><rect class=\"hit\" y=\"{}\" \
                 width=\"{WIDTH}\" height=\"{LINE}\"/><text class=\"m\" x=\"{}\" y=\"{}\">{m}\
                 </text>",
                family(method),
                escape(&self.describe(mark)),
                y - LINE / 2.0,
                LEFT - 8.0,
                y + 4.0,
                m = escape(method),
            );
            self.draw_mark(&mut svg, mark, y);
            svg += "</g>\n";
        }
        svg + "</svg>"
    }

    fn describe(&self, mark: &Mark) -> String {
        let text = self.axis.value;
        match mark {
            Mark::Nothing => "not applicable".to_owned(),
            Mark::Reference => "the reference, the fastest graph search".to_owned(),
            Mark::Values { solved, failed } => {
                let all = merged(solved, failed);
                let at = |q| text(percentile(&all, q));
                let fails = match failed.len() {
                    0 => String::new(),
                    n => format!(", {n} failed"),
                };
                format!(
                    "median {}, quartiles {} to {}, 5th to 95th percentile {} to {}, {} scenes\
                     {fails}",
                    at(0.5),
                    at(0.25),
                    at(0.75),
                    at(0.05),
                    at(0.95),
                    all.len()
                )
            }
            Mark::HomeAndAway { home, away } => {
                let of = |v: &Option<f64>| v.map_or("no scenes".to_owned(), text);
                format!("at home {}, away {}", of(home), of(away))
            }
            Mark::Ratio { ratio, low, high, paper } => {
                let paper = paper.map_or(String::new(), |p| format!(", in the paper {}", text(p)));
                format!("{} ({} to {}){paper}", text(*ratio), text(*low), text(*high))
            }
        }
    }

    fn draw_axis(&self, svg: &mut String, bottom: f64) {
        let axis = &self.axis;
        // Labels get 40 units each at least.
        let room = (WIDTH - LEFT - RIGHT) / f64::from(axis.high - axis.low).max(1.0);
        let every = (40.0 / room).ceil().max(1.0) as i32;
        let mut tick = |x: f64, label: String, class: &str| {
            let x = num(x);
            let _ = write!(svg, "<path class=\"{class}\" d=\"M{x} {TOP}V{bottom}\"/>");
            if !label.is_empty() {
                let y = bottom + 13.0;
                let _ = write!(svg, "<text class=\"t\" x=\"{x}\" y=\"{y}\">{label}</text>");
            }
        };
        if axis.zero {
            tick(axis.x(0.0), "0".to_owned(), "grid");
        }
        for decade in axis.low..=axis.high {
            let wanted = (decade - axis.low) % every == 0;
            let label = if wanted { (axis.tick)(decade) } else { String::new() };
            let class = if self.unity && decade == 0 { "grid one" } else { "grid" };
            tick(axis.x(10f64.powi(decade)), label, class);
        }
        let (x, y) = ((LEFT + WIDTH - RIGHT) / 2.0, bottom + 28.0);
        let _ = writeln!(svg, "<text class=\"t\" x=\"{x}\" y=\"{y}\">{}</text>", axis.title);
    }

    fn draw_mark(&self, svg: &mut String, mark: &Mark, y: f64) {
        let x = |v: f64| num(self.axis.x(v));
        match mark {
            Mark::Nothing => {
                let _ = write!(svg, "<text class=\"none\" x=\"{LEFT}\" y=\"{}\">–</text>", y + 4.0);
            }
            Mark::Reference => {
                let d = format!("M{} {}l5 5l-5 5l-5-5z", x(1.0), y - 5.0);
                let _ = write!(svg, "<path class=\"mean ref\" d=\"{d}\"/>");
            }
            Mark::HomeAndAway { home, away } => {
                if let (Some(home), Some(away)) = (home, away) {
                    let _ =
                        write!(svg, "<path class=\"ci\" d=\"M{} {y}H{}\"/>", x(*home), x(*away));
                }
                for (value, class) in [(away, "mean ref"), (home, "mean")] {
                    if let Some(value) = value {
                        let cx = x(*value);
                        let _ = write!(
                            svg,
                            "<circle class=\"{class}\" cx=\"{cx}\" cy=\"{y}\" r=\"4.5\"/>"
                        );
                    }
                }
            }
            Mark::Ratio { ratio, low, high, paper } => {
                // Ours above, the paper's below: neither hides the other.
                let (ours, theirs) = (y - 4.0, y + 5.0);
                let d = format!("M{} {ours}H{}", x(*low), x(*high));
                let caps = [low, high].map(|v| format!("M{} {}v8", x(*v), ours - 4.0)).concat();
                let _ = write!(svg, "<path class=\"ci\" d=\"{d}{caps}\"/>");
                if let Some(paper) = paper {
                    let d = format!("M{} {}l4.5 8h-9z", x(*paper), theirs - 4.0);
                    let _ = write!(svg, "<path class=\"paper-mark\" d=\"{d}\"/>");
                }
                let cx = x(*ratio);
                let _ = write!(svg, "<circle class=\"mean\" cx=\"{cx}\" cy=\"{ours}\" r=\"4\"/>");
            }
            Mark::Values { solved, failed } => {
                // Neighbours by rank are spread by the golden ratio, within ± 7.
                let spread = |i: usize| y + 14.0 * ((i as f64 * 0.618_034).fract() - 0.5);
                let dots: String =
                    some(solved).map(|(i, v)| format!("M{} {}h0", x(v), num(spread(i)))).collect();
                let _ = write!(svg, "<path class=\"dots\" d=\"{dots}\"/>");
                let all = merged(solved, failed);
                let at = |q| x(percentile(&all, q));
                let (q1, q3) = (at(0.25), at(0.75));
                let _ = write!(
                    svg,
                    "<path class=\"box\" d=\"M{} {y}H{q1}M{q3} {y}H{}M{q1} {}H{q3}v12H{q1}z\"/>\
                     <path class=\"median\" d=\"M{} {}v16\"/>",
                    at(0.05),
                    at(0.95),
                    y - 6.0,
                    at(0.5),
                    y - 8.0,
                );
                if !failed.is_empty() {
                    let crosses: String = some(failed)
                        .map(|(i, v)| (self.axis.x(v), spread(i)))
                        .map(|(x, y)| format!("M{} {}l5 5m0-5l-5 5", num(x - 2.5), num(y - 2.5)))
                        .collect();
                    let _ = write!(svg, "<path class=\"failed\" d=\"{crosses}\"/>");
                }
            }
        }
    }
}

impl Mark {
    /// The values that the axis must show.
    fn values(&self) -> Vec<f64> {
        match self {
            Mark::Nothing => Vec::new(),
            Mark::Reference => vec![1.0],
            Mark::Values { solved, failed } => merged(solved, failed),
            Mark::HomeAndAway { home, away } => home.iter().chain(away).copied().collect(),
            Mark::Ratio { low, high, paper, .. } => {
                [*low, *high].into_iter().chain(*paper).collect()
            }
        }
    }
}

impl Axis {
    /// The same over the decades of `values`; one at least.
    fn around(self, values: impl Iterator<Item = f64>) -> Self {
        let logs = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
        let range = logs.fold(None, |range: Option<(f64, f64)>, v| {
            Some(range.map_or((v, v), |(low, high)| (low.min(v), high.max(v))))
        });
        let (low, high) = range.unwrap_or((0.0, 1.0));
        let low = if self.zero { 0 } else { low.floor() as i32 };
        Self { low, high: (high.ceil() as i32).max(low + 1), ..self }
    }

    fn x(&self, v: f64) -> f64 {
        let left = if self.zero { LEFT + ZERO } else { LEFT };
        if v <= 0.0 {
            return if self.zero { LEFT + 8.0 } else { LEFT };
        }
        let share = (v.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        left + share.clamp(0.0, 1.0) * (WIDTH - RIGHT - left)
    }
}

fn merged(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut all = [a, b].concat();
    all.sort_by(f64::total_cmp);
    all
}

/// At most [`DOTS`] of the sorted values with their ranks, evenly spaced, ends included.
fn some(values: &[f64]) -> impl Iterator<Item = (usize, f64)> + '_ {
    let n = values.len().min(DOTS);
    (0..n).map(move |i| (i, values[i * (values.len() - 1) / (n - 1).max(1)]))
}

fn seconds(decade: i32) -> String {
    let (unit, base) = match decade {
        ..-6 => ("ns", -9),
        -6..-3 => ("µs", -6),
        -3..0 => ("ms", -3),
        _ => ("s", 0),
    };
    format!("{} {unit}", 10i64.pow((decade - base).clamp(0, 18) as u32))
}

fn count(decade: i32) -> String {
    match decade {
        0..4 => 10u32.pow(decade as u32).to_string(),
        4..6 => format!("{}k", 10u32.pow(decade as u32 - 3)),
        _ => format!("{}M", 10u64.pow((decade - 6).clamp(0, 18) as u32)),
    }
}

fn times_faster(decade: i32) -> String {
    10f64.powi(decade).to_string()
}

/// A coordinate to a tenth.
pub(super) fn num(v: f64) -> String {
    ((v * 10.0).round() / 10.0 + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::super::metrics::{summarise, tests::row};
    use super::*;

    #[test]
    fn every_method_has_its_line_and_failures_their_crosses() {
        let rows: Vec<Row> = (0..400)
            .map(|i| row(&format!("s{i}"), "ha-rs", 1e-4 * f64::from(i + 1), i % 40 != 0))
            .collect();
        let groups = summarise(&rows, 1);
        let plot = times(&groups, &["ha-rs", "sha"], &rows);
        assert_eq!((plot.axis.low, plot.axis.high), (-4, -1));
        let panels = plot.panels();
        assert_eq!((panels.len(), &panels[0].heading[..]), (1, "extreme, parallel"));
        let svg = &panels[0].svg;
        assert!(svg.contains("sha: not applicable") && svg.contains("10 failed"), "{svg}");
        assert!(svg.contains("100 µs") && svg.contains("10 ms") && !svg.contains("NaN"));
        let dots = svg.split("class=\"dots\"").nth(1).unwrap().split('>').next().unwrap();
        assert_eq!(dots.matches("h0").count(), DOTS);
        let speed = speed_ups(&groups, &["ha-rs"]).panels();
        assert!(speed[0].svg.contains("the reference"));
        assert!(nodes(&groups, &["ha-rs"], &rows).panels()[0].svg.contains("median 10,"));
    }

    #[test]
    fn home_stands_against_away_where_a_run_has_both() {
        let in_set = |set: &str, method: &str, time| Row {
            set: set.to_owned(),
            ..row(&format!("{set}-scene"), method, time, true)
        };
        let mut rows = vec![
            in_set("home", "ha-rs", 0.02),
            in_set("home", "n3p", 0.001),
            in_set("lots", "ha-rs", 0.02),
        ];
        let methods = ["ha-rs", "n3p", "sha"];
        assert_eq!(home_and_away(&methods, &rows[..2]).len(), 0, "only home");
        assert_eq!(home_and_away(&["n3p"], &rows).len(), 0, "nothing to compare with");
        let svg = &home_and_away(&methods, &rows)[0].svg;
        assert!(svg.contains("n3p: at home 20.00 ×, away no scenes"), "{svg}");
        rows.push(in_set("lots", "n3p", 0.01));
        let panels = home_and_away(&methods, &rows);
        assert_eq!(panels.len(), 1);
        let svg = &panels[0].svg;
        assert!(svg.contains("n3p: at home 20.00 ×, away 2.000 ×"), "{svg}");
        assert!(svg.contains("sha: not applicable") && svg.contains("the reference"), "{svg}");
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn dots_reach_from_the_least_to_the_greatest() {
        let values: Vec<f64> = (0..1000).map(f64::from).collect();
        let picks: Vec<f64> = some(&values).map(|(_, v)| v).collect();
        assert_eq!((picks.len(), picks[0], picks[DOTS - 1]), (DOTS, 0.0, 999.0));
        assert_eq!(some(&[3.0]).collect::<Vec<_>>(), [(0, 3.0)]);
        assert_eq!(some(&[]).count(), 0);
    }
}
