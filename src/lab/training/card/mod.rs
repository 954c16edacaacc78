//! Model cards: what a model is, where it comes from and how good it is, in Markdown.
//!
//! A card says nothing of the day, the machine or the build, so that the same data, settings and
//! seed give the same bytes. Programs read the log instead ([`super::log_path`]).

mod fleet;
mod foresight;
mod knn;
mod mlp;

use std::fmt::Write;
use std::path::Path;

pub(super) use fleet::fleet;
pub(super) use foresight::foresight;
pub(super) use knn::knn;
pub(super) use mlp::mlp;

use super::quality::{Errors, Reach};
use super::worlds::WorldsConfig;
use crate::lab::dataset::card::{data, number, percent, spots, vehicle};
use crate::world::ParkingType;

pub(super) use crate::lab::dataset::card::VERSION;

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

pub(super) fn name(out: &Path) -> String {
    format!("`{}`", out.file_name().unwrap_or_default().to_string_lossy())
}

#[cfg(test)]
mod tests {
    use super::super::MlpConfig;
    use super::super::curve::EpochLoss;
    use super::super::knn::{KnnKindLog, KnnLog, LeaveOneOut};
    use super::super::mlp::TrainingLog;
    use super::*;
    use crate::lab::dataset::{CollectConfig, Metadata};

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
