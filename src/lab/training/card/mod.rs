//! Model cards: what a model is, where it comes from and how good it is, in Markdown.
//!
//! A card says nothing of the day, the machine or the build, so that the same data, settings and
//! seed give the same bytes. Programs read the log instead ([`super::log_path`]).

mod fleet;
mod knn;
mod mlp;

use std::fmt::Write;
use std::path::Path;

pub(super) use fleet::fleet;
pub(super) use knn::knn;
pub(super) use mlp::mlp;

use super::quality::{Errors, Reach};
use super::worlds::WorldsConfig;
use crate::lab::dataset::Metadata;
use crate::world::ParkingType;
use crate::world::cell::Axis;

pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Inputs of every selector.
const INPUTS: &str = "\
All lengths are in metres, all angles in radians. A pose is that of the rear axle's centre in the
spot frame: the origin is the centre of the parked body, +x points along the lane in the direction
of travel, +y from the spot toward the lane; headings are counter-clockwise positive.

| in | unit | |
|---|---|---|
| x, y, θ | m, m, rad | where the car starts; θ in (−π, π] |
| lane width, spot width, dead end | m, m, m | the cell: free space around the spot, rounded down to the grid below; the dead end is the way from the spot's centre along +x to the end of the lane |
";

/// Provenance of the data and the grid. `rows`: all and solved ones of each type.
fn data(metadata: &Metadata, sha256: &str, rows: &[(ParkingType, usize, usize)]) -> String {
    let m = metadata;
    let mut counts = String::new();
    for &(kind, all, solved) in rows {
        let share = percent(solved as f64 / all as f64);
        let cells = m.grid.cell_count(kind);
        let _ = writeln!(counts, "| {kind} | {cells} | {all} | {solved} ({share}) |");
    }
    let mut axes = String::new();
    let mut axis = |name: &str, axis: &Axis| {
        let last = axis.value(axis.len() - 1);
        let [min, max, step] = [axis.min, last, axis.step].map(number);
        let _ = writeln!(axes, "| {name} | {min} | {max} | {step} |");
    };
    let mut depths = Vec::new();
    axis("lane width", &m.grid.lane_width);
    for (is_bay, spots) in [(true, "bays"), (false, "parallel spots")] {
        let Some((kind, ..)) = rows.iter().find(|r| r.0.is_bay() == is_bay) else { continue };
        axis(&format!("spot width, {spots}"), m.grid.spot_width(*kind));
        depths.push(format!("{spots} are {} m deep", number(m.grid.depth(*kind))));
    }
    axis("dead end", &m.grid.dead_end);
    let slants = match rows.iter().any(|r| r.0 == ParkingType::Angled) {
        true => {
            let Axis { min, max, step } = m.grid.slant_deg;
            format!(
                "Angled bays: at {min}° to {max}° from the direction of travel to the way out by \
                 {step}°, 90° left out, tail in\nand nose in; their dead end is the way from the \
                 middle of the spot's mouth.\n"
            )
        }
        false => String::new(),
    };
    let (back, depths) = (number(m.grid.back), depths.join(", "));
    let [behind, turn] = [m.start_behind, m.start_heading_max.to_degrees()].map(number);
    format!(
        "\
## Data

| | |
|---|---|
| SHA-256 of settings and rows (`data_sha256`) | `{sha256}` |
| Seed | {seed} |
| Starts | {per_cell} in each cell's lane and up to {behind} m behind it, headings within ±{turn}° |
| Solved by | Hybrid A* with at most {budget} expansions, the cheapest of up to {solutions} solutions |

| type | cells | rows | solved |
|---|--:|--:|--:|
{counts}
The grid of cells:

| metres | from | to | step |
|---|--:|--:|--:|
{axes}
A cell's lane reaches {back} m back from the spot's centre; {depths}. The largest dead end also
stands for none at all.
{slants}",
        seed = m.seed,
        per_cell = m.samples_per_cell,
        budget = m.max_expansions,
        solutions = m.solutions,
    )
}

/// What manoeuvres serve.
fn in_worlds(WorldsConfig { count, seed }: &WorldsConfig) -> String {
    match count {
        0 => "The manoeuvres are those that serve many rows.".to_owned(),
        _ => format!(
            "The manoeuvres are those that serve\n{count} generated worlds of each type (seed {seed}), \
             their sizes drawn far wider than those of any level;\nwhat is used most comes first."
        ),
    }
}

/// Tables of errors, of so many rows, and reach.
fn metrics(kinds: &[(ParkingType, usize, Errors, Reach)]) -> String {
    if kinds.is_empty() {
        return "No cell has two samples, so there is nothing to ask for.\n".to_owned();
    }
    let (mut far, mut reached) = (String::new(), String::new());
    for (kind, rows, e, r) in kinds {
        let metres = [e.position_mean_m, e.position_median_m, e.position_p95_m];
        let metres = metres.map(|v| format!("{v:.3} m")).join(" | ");
        let angles = [e.heading_mean_rad, e.heading_median_rad, e.heading_p95_rad];
        let angles = angles.map(|v| format!("{:.2}°", v.to_degrees())).join(" | ");
        let _ = writeln!(far, "| {kind} | {rows} | {metres} | {angles} |");
        let shares = [r.to_goal, r.wanted_to_goal, r.direct, r.wanted_direct];
        let shares = shares.map(percent).join(" | ");
        let _ = writeln!(reached, "| {kind} | {} | {shares} |", r.rows);
    }
    format!(
        "\
Distance and difference of headings between the answer and the wanted pose:

| type | rows | distance, mean | median | P95 | heading, mean | median | P95 |
|---|--:|--:|--:|--:|--:|--:|--:|
{far}
Share of poses with a free Reeds-Shepp curve (and a straight) into the spot, and share that a free
curve from the start reaches as well, so that two curves are the whole plan. Judged in the cells
and the lane behind them; scenes leave more room:

| type | rows | into the spot: answers | wanted | from the start, too: answers | wanted |
|---|--:|--:|--:|--:|--:|
{reached}"
    )
}

fn vehicle(metadata: &Metadata) -> String {
    let v = &metadata.vehicle;
    let sizes = [v.length, v.width, v.wheelbase, v.rear_overhang];
    let [length, width, wheelbase, overhang] = sizes.map(number);
    let (steer, degrees) = (v.max_steer, v.max_steer.to_degrees());
    format!(
        "{length} m long, {width} m wide, wheelbase {wheelbase} m, rear overhang {overhang} m,\n  \
         steering up to {steer:.4} rad ({degrees:.1}°)"
    )
}

fn spots(kind: ParkingType) -> &'static str {
    match kind {
        ParkingType::Forward => "forward bays (nose in)",
        ParkingType::Reverse => "reverse bays (tail in)",
        ParkingType::Parallel => "parallel spots",
        ParkingType::Angled => "angled bays (30° to 150°, nose in or tail in)",
    }
}

pub(super) fn name(out: &Path) -> String {
    format!("`{}`", out.file_name().unwrap_or_default().to_string_lossy())
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// A number without the noise of its last digits.
fn number(v: f64) -> String {
    ((v * 1e6).round() / 1e6).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::MlpConfig;
    use super::super::curve::EpochLoss;
    use super::super::knn::{KnnKindLog, KnnLog, LeaveOneOut};
    use super::super::mlp::TrainingLog;
    use super::*;
    use crate::lab::dataset::CollectConfig;

    const KIND: ParkingType = ParkingType::Reverse;

    fn metadata() -> Metadata {
        CollectConfig { seed: 77, ..CollectConfig::default() }.metadata()
    }

    fn judged() -> LeaveOneOut {
        LeaveOneOut {
            errors: Errors {
                position_mean_m: 0.1234,
                position_median_m: 0.0567,
                position_p95_m: 0.789,
                heading_mean_rad: 0.1,
                heading_median_rad: 0.05,
                heading_p95_rad: 0.2,
            },
            reach: Reach {
                rows: 41,
                to_goal: 0.912,
                direct: 0.523,
                wanted_to_goal: 0.998,
                wanted_direct: 0.614,
            },
        }
    }

    fn mlp_log() -> TrainingLog {
        let loss = |i: usize| EpochLoss { train: 1.0 / i as f32, validation: 2.0 / i as f32 };
        TrainingLog {
            kind: KIND,
            config: MlpConfig { seed: 4321, behind: 6.5, epochs: 60, ..MlpConfig::default() },
            data_sha256: "abc123".to_owned(),
            train_rows: 370,
            validation_rows: 41,
            losses: (1..=40).map(loss).collect(),
            best_epoch: 39,
            validation: judged().errors,
            reach: judged().reach,
        }
    }

    fn knn_log(leave_one_out: Option<LeaveOneOut>) -> KnnLog {
        let kind = KnnKindLog {
            kind: KIND,
            rows: 500,
            samples: 411,
            solved: None,
            cells: 567,
            occupied_cells: 123,
            manoeuvres: 17,
            leave_one_out,
        };
        let (data_sha256, heading_radius) = ("abc123".to_owned(), 2.25);
        let worlds = WorldsConfig { count: 300, seed: 5 };
        KnnLog { data_sha256, seed: 77, worlds, heading_radius, bytes: 3 << 19, kinds: vec![kind] }
    }

    fn assert_tells(card: &str, parts: &[&str]) {
        for part in parts {
            assert!(card.contains(part), "\"{part}\" not in:\n{card}");
        }
    }

    /// The tables of both cards.
    const JUDGED: [&str; 2] = [
        "| reverse | 41 | 0.123 m | 0.057 m | 0.789 m | 5.73° | 2.86° | 11.46° |",
        "| reverse | 41 | 91.2 % | 99.8 % | 52.3 % | 61.4 % |",
    ];

    #[test]
    fn a_networks_card_tells_data_training_and_quality() {
        let (out, log) = (Path::new("some/net.safetensors"), mlp_log());
        let card = mlp(out, &metadata(), 500, &log);
        assert_tells(&card, &JUDGED);
        assert_tells(
            &card,
            &[
                "# Model card: `net.safetensors`",
                "`abc123`",
                "| Seed | 77 |",
                "| Seed | 4321 (",
                "| reverse | 567 | 500 | 411 (82.2 %) |",
                "Of the rows kept apart that were judged, 91.2 % had",
                "| Epochs | 40 of at most 60; stored is the network of epoch 39 |",
                "| 39 (best) | 0.02564 | 0.05128 |",
                "](<net.training.svg>)",
                "wheelbase 2.83 m",
                "up to 6.5 m behind the lane",
                "| spot width, bays | 2.3 | 4.3 | 0.25 |",
            ],
        );
        assert!(!card.contains("parallel") && !card.contains("some/"), "{card}");
        let (_, rest) = card.split_once("```toml\n").unwrap();
        let settings: MlpConfig = toml::from_str(rest.split_once("```").unwrap().0).unwrap();
        assert_eq!(settings, log.config, "the settings can be used again");
        assert_eq!(card, mlp(out, &metadata(), 500, &log));
    }

    #[test]
    fn a_card_does_not_tell_the_build_of_the_data() {
        let built = |revision: &str| {
            let (git_revision, crate_version) = (revision.to_owned(), revision.to_owned());
            Metadata { git_revision, crate_version, ..metadata() }
        };
        let [a, b] = ["aa", "bb"].map(|revision| {
            let (out, m) = (Path::new("m"), built(revision));
            mlp(out, &m, 500, &mlp_log()) + &knn(out, &m, &knn_log(Some(judged())))
        });
        assert_eq!(a, b);
    }

    #[test]
    fn a_knn_card_tells_data_content_and_quality() {
        let out = Path::new("knn.bin");
        let card = knn(out, &metadata(), &knn_log(Some(judged())));
        assert_tells(&card, &JUDGED);
        assert_tells(
            &card,
            &[
                "# Model card: `knn.bin`",
                "`abc123`",
                "| Seed | 77 |",
                "| reverse | 567 | 500 | 411 (82.2 %) |",
                "| reverse | 411 | 123 of 567 | 17 |",
                "1572864 bytes (1.50 MiB)",
                "r = 2.2500 m",
            ],
        );
        let lonely = knn(out, &metadata(), &knn_log(None));
        assert!(lonely.contains("No cell has two samples") && !lonely.contains("P95"), "{lonely}");
    }
}
