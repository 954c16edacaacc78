//! What a plot's line shows of a method: dots with quartiles, a ratio with its interval, home and away.

use std::fmt::Write;

use super::super::metrics::percentile;
use super::plots::{LEFT, num};

/// Dots drawn in a line; of more scenes, so many evenly spaced ranks.
pub const DOTS: usize = 150;

/// What a method's line shows.
pub enum Mark {
    /// The method does not apply here.
    Nothing,
    /// It is what the others are compared with.
    Reference,
    /// One dot for each scene, sorted, solved ones and failures.
    Values { solved: Vec<Dot>, failed: Vec<Dot> },
    /// A number with its interval, and the paper's number.
    Ratio { ratio: f64, low: f64, high: f64, paper: Option<f64> },
    /// A number at home and one away, each where there are such scenes.
    HomeAndAway { home: Option<f64>, away: Option<f64> },
}

/// The value of one scene.
#[derive(Clone, Copy)]
pub struct Dot {
    pub value: f64,
    /// Index of the scene in the gallery, if it is there.
    pub scene: Option<usize>,
}

impl Mark {
    /// The values that the axis must show.
    pub fn values(&self) -> Vec<f64> {
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

    /// In words, its values by `text`.
    pub fn describe(&self, text: fn(f64) -> String) -> String {
        match self {
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

    /// Draws it on the line at `y`; `place` says where values lie.
    pub fn draw(&self, svg: &mut String, place: impl Fn(f64) -> f64, y: f64) {
        let x = |v: f64| num(place(v));
        match self {
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
                        // Where both are the same, both are seen.
                        let r = if class == "mean" { 3.0 } else { 5.0 };
                        let _ = write!(
                            svg,
                            "<circle class=\"{class}\" cx=\"{cx}\" cy=\"{y}\" r=\"{r}\"/>"
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
                let at = |(i, dot): (usize, Dot)| (place(dot.value), spread(i), dot.scene);
                points(svg, "dots", "h0", some(solved).map(at));
                let all = merged(solved, failed);
                let at_share = |q| x(percentile(&all, q));
                let (q1, q3) = (at_share(0.25), at_share(0.75));
                let _ = write!(
                    svg,
                    "<path class=\"box\" d=\"M{} {y}H{q1}M{q3} {y}H{}M{q1} {}H{q3}v12H{q1}z\"/>\
                     <path class=\"median\" d=\"M{} {}v16\"/>",
                    at_share(0.05),
                    at_share(0.95),
                    y - 6.0,
                    at_share(0.5),
                    y - 8.0,
                );
                points(svg, "failed", CROSS, some(failed).map(at));
            }
        }
    }
}

/// A cross around where it begins.
pub const CROSS: &str = "m-2.5-2.5l5 5m0-5l-5 5";

/// Points as one path of a class, each begun where it lies and drawn by `sign`. The attribute `data-scenes` says
/// which scene of the gallery each is, nothing for those that are not there: the page leads from one to the other.
pub fn points(
    svg: &mut String,
    class: &str,
    sign: &str,
    points: impl Iterator<Item = (f64, f64, Option<usize>)>,
) {
    let (mut d, mut scenes) = (String::new(), Vec::new());
    for (x, y, scene) in points {
        let _ = write!(d, "M{} {}{sign}", num(x), num(y));
        scenes.push(scene.map_or(String::new(), |scene| scene.to_string()));
    }
    if scenes.is_empty() {
        return;
    }
    let scenes = scenes.join(",");
    let _ = write!(svg, "<path class=\"{class}\" d=\"{d}\" data-scenes=\"{scenes}\"/>");
}

fn merged(a: &[Dot], b: &[Dot]) -> Vec<f64> {
    let mut all: Vec<f64> = a.iter().chain(b).map(|dot| dot.value).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// At most [`DOTS`] of the sorted values with their ranks, evenly spaced, ends included.
fn some<T: Copy>(values: &[T]) -> impl Iterator<Item = (usize, T)> + '_ {
    let n = values.len().min(DOTS);
    (0..n).map(move |i| (i, values[i * (values.len() - 1) / (n - 1).max(1)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_reach_from_the_least_to_the_greatest() {
        let values: Vec<f64> = (0..1000).map(f64::from).collect();
        let picks: Vec<f64> = some(&values).map(|(_, v)| v).collect();
        assert_eq!((picks.len(), picks[0], picks[DOTS - 1]), (DOTS, 0.0, 999.0));
        assert_eq!(some(&[3.0]).collect::<Vec<_>>(), [(0, 3.0)]);
        assert_eq!(some::<f64>(&[]).count(), 0);
    }

    #[test]
    fn points_say_which_scene_they_are() {
        let mut svg = String::new();
        let list = [(1.0, 2.04, Some(3)), (4.5, 0.0, None), (5.0, 6.0, Some(0))];
        points(&mut svg, "dots", "h0", list.into_iter());
        points(&mut svg, "failed", CROSS, [].into_iter());
        let expected = r#"<path class="dots" d="M1 2h0M4.5 0h0M5 6h0" data-scenes="3,,0"/>"#;
        assert_eq!(svg, expected);
    }
}
