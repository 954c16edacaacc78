//! What the binaries share: arguments, output, logging, exit codes.
//!
//! Exit codes: 0 done, 1 our bug or I/O, 2 bad input or usage, 3 no path. Errors go to
//! stderr in one or two plain lines.

#[cfg(feature = "scene")]
pub mod map_commands;
mod maps;

use std::fmt::Display;
use std::io::{self, Write};
use std::ops::RangeInclusive;
use std::process::ExitCode;
use std::sync::Arc;

use clap::error::ErrorKind;
use log::LevelFilter;

use crate::curves::smoothing::StandstillSteering;
use crate::files::reason;
use crate::n3p::{Driver, MethodSettings, more};
use crate::planners::cost::CostModel;
use crate::planners::goals::Terms;
use crate::planners::{HybridAStarConfig, Problem, Shape};

pub use maps::{MapArgs, Unknown, vehicle};

/// Exit code of a planner that found no path.
pub const EXIT_NO_PATH: u8 = 3;

/// What `--version` says: of which release and revision a program is, so that machines that share work can tell.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("N3P_GIT_REVISION"), ")");

/// Marks an error as the user's to mend: exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadInput(pub String);

/// Turns any library error into [`BadInput`].
pub trait OrBadInput<T> {
    /// The value, or an error with exit code 2.
    fn or_bad_input(self) -> anyhow::Result<T>;
}

impl<T, E: Display> OrBadInput<T> for Result<T, E> {
    fn or_bad_input(self) -> anyhow::Result<T> {
        self.map_err(|e| BadInput(e.to_string()).into())
    }
}

/// The command line; a wrong one ends the process with exit code 2 and two lines on stderr.
pub fn parse<A: clap::Parser>() -> A {
    A::try_parse().unwrap_or_else(|error| {
        // Help and version are asked for, or all that can be said.
        if !error.use_stderr()
            || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
        {
            error.exit();
        }
        eprintln!("{}\nFor more information, try '--help'.", in_one_line(&error.to_string()));
        std::process::exit(2)
    })
}

/// A message of clap's without its paragraphs on usage.
fn in_one_line(message: &str) -> String {
    let usage = |part: &&str| part.starts_with("Usage:") || part.starts_with("For more");
    let parts = message.split("\n\n").filter(|part| !usage(part));
    parts.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

/// Prints `text` and a line break to stdout. A reader that has had enough (`| head`) is no
/// error.
pub fn print(text: impl Display) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(anyhow::anyhow!("standard output: {}", reason(&e)))
        }
        _ => Ok(()),
    }
}

/// Parses a time limit: a millisecond to a day, in seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    within(text, 1e-3..=86_400.0, "seconds")
}

/// Parses a number within `range`, in `unit`.
pub fn within(text: &str, range: RangeInclusive<f64>, unit: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|n| range.contains(n));
    let (low, high) = (range.start(), range.end());
    number.ok_or_else(|| format!("expected a number between {low} and {high} {unit}"))
}

/// Parses the metres of `--margin`.
pub fn margin(text: &str) -> Result<f64, String> {
    within(text, 0.0..=Problem::MAX_MARGIN, "metres")
}

/// Parses the metres of `--allow-contact`.
pub fn contact(text: &str) -> Result<f64, String> {
    within(text, 0.0..=Problem::MAX_CONTACT, "metres")
}

/// Parses the metres of `--least-move` and `--last-straight`.
pub fn shape(text: &str) -> Result<f64, String> {
    within(text, 0.0..=Shape::MOST, "metres")
}

/// Runs a binary's body and maps its error to stderr and an exit code.
pub fn run(body: impl FnOnce() -> anyhow::Result<ExitCode>) -> ExitCode {
    let level = std::env::var("N3P_LOG").ok().and_then(|level| level.parse().ok());
    env_logger::Builder::new()
        .filter_level(level.unwrap_or(LevelFilter::Info))
        .format(|line, record| writeln!(line, "{:>5} {}", record.level(), record.args()))
        .init();
    match body() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.downcast_ref::<BadInput>().is_some() { 2 } else { 1 })
        }
    }
}

/// What plans keep to.
#[derive(clap::Args)]
pub struct TermsArgs {
    /// Keep so many metres from obstacles, 0 to 1; less along the whole path where start or goal
    /// is nearer to one. Never less than 5 mm where they allow it.
    #[arg(long, default_value_t = 0.0, value_name = "METRES", value_parser = margin, allow_hyphen_values = true)]
    pub margin: f64,
    /// Allow start and goal to reach so many metres into an obstacle, 0 to 0.2, as localisation
    /// errs: such contact is only left, or only entered at the goal, and never deepened.
    #[arg(long, default_value_t = 0.0, value_name = "METRES", value_parser = contact, allow_hyphen_values = true)]
    pub allow_contact: f64,
    /// Where the steering wheel may be turned while the car stands: "never", "at-changes" of gear, or
    /// "anywhere", for paths of arcs. Elsewhere the wheels turn no faster than the vehicle allows.
    #[arg(long, value_name = "never|at-changes|anywhere")]
    pub standstill_steering: Option<StandstillSteering>,
    /// Let no move between changes of gear be shorter than so many metres, where there is room
    /// [default: 0.3 for a usual car with --standstill-steering never or at-changes, else 0].
    #[arg(long, value_name = "METRES", value_parser = shape, allow_negative_numbers = true)]
    pub least_move: Option<f64>,
    /// End paths with a straight of so many metres, where there is room and it takes no more than one more change
    /// of gear [default: 0.5 for a usual car with --standstill-steering never or at-changes, else 0].
    #[arg(long, value_name = "METRES", value_parser = shape, allow_negative_numbers = true)]
    pub last_straight: Option<f64>,
}

impl TermsArgs {
    /// The terms; arcs, where nothing else is asked for.
    pub fn terms(&self) -> Terms {
        let standstill = self.standstill_steering.unwrap_or_default();
        let shape = Shape { least_move: self.least_move, last_straight: self.last_straight };
        Terms { margin: self.margin, contact: self.allow_contact, standstill, shape }
    }
}

/// What plans prefer.
#[derive(clap::Args)]
pub struct CostArgs {
    /// A weight of the costs by which plans are chosen, such as gear_change=6; may be given several times. Per metre
    /// "forward" (1), "backward" (1.2), "clearance" (0.4, nearer to obstacles than "near", 0.2 m); per change "gear_change"
    /// (3, in metres for a usual car); per radian "steer" (0.05, and metre) and "steer_change" (0.2).
    #[arg(long = "cost", value_name = "WEIGHT=NUMBER")]
    weights: Vec<String>,
}

impl CostArgs {
    /// The usual settings of methods with these weights.
    pub fn settings(&self) -> anyhow::Result<MethodSettings> {
        let usual = MethodSettings::default();
        let mut cost = serde_json::to_value(usual.planner.cost)?;
        for weight in &self.weights {
            let wrong = || BadInput(format!("--cost {weight}: expected WEIGHT=NUMBER"));
            let (name, number) = weight.split_once('=').ok_or_else(wrong)?;
            let number: f64 = number.trim().parse().map_err(|_| wrong())?;
            cost[name.trim()] = serde_json::json!(number);
        }
        let bad = |e: &dyn Display| BadInput(format!("--cost: {e}"));
        let cost: CostModel = serde_json::from_value(cost).map_err(|e| bad(&e))?;
        cost.validate().map_err(|e| bad(&e))?;
        let planner = HybridAStarConfig { cost, ..usual.planner };
        Ok(MethodSettings { planner, ..usual })
    }
}

/// A driving policy from outside.
#[derive(Debug, clap::Args)]
pub struct PolicyArgs {
    /// A driving policy from outside, the method "policy": an .onnx file, or the command of a
    /// program (see docs/policies.md).
    #[arg(long, value_name = "FILE|COMMAND")]
    policy: Option<String>,
    /// Seconds that the program of --policy may take for an answer.
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, requires = "policy", value_parser = seconds, allow_negative_numbers = true)]
    policy_limit: f64,
}

impl PolicyArgs {
    /// Whether there is one.
    pub fn is_given(&self) -> bool {
        self.policy.is_some()
    }

    /// The policy, opened once to see that it can be.
    pub fn driver(&self) -> anyhow::Result<Option<Arc<dyn Driver>>> {
        let open = |policy: &String| {
            more::open_policy(policy, self.policy_limit).map_err(|e| BadInput(e).into())
        };
        self.policy.as_ref().map(open).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usage_is_left_out_and_tips_stay() {
        let message = "error: unexpected argument '--tpye'\n\n  tip: there is '--type'\n\n\
                       Usage: n3p-eval [OPTIONS]\n\nFor more information, try '--help'.\n";
        assert_eq!(
            in_one_line(message),
            "error: unexpected argument '--tpye' tip: there is '--type'"
        );
    }
}
