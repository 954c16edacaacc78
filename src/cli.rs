//! What the binaries share: exit codes, logging, progress bars.
//!
//! Exit codes: 0 done, 1 our bug or I/O, 2 bad input or usage, 3 no path. Errors go to
//! stderr in one or two plain lines.

use std::fmt::Display;
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tracing_subscriber::EnvFilter;

/// Exit code of a planner that found no path.
pub const EXIT_NO_PATH: u8 = 3;

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

/// Runs a binary's body and maps its error to stderr and an exit code.
pub fn run(body: impl FnOnce() -> anyhow::Result<ExitCode>) -> ExitCode {
    let filter = EnvFilter::try_from_env("N3P_LOG").unwrap_or_else(|_| EnvFilter::new("info"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::IsTerminal::is_terminal(&std::io::stderr()))
        .with_target(false)
        .without_time()
        .init();
    match body() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.downcast_ref::<BadInput>().is_some() { 2 } else { 1 })
        }
    }
}

/// A progress bar with ETA on stderr; hidden when stderr is not a terminal.
pub fn progress(len: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(len), ProgressDrawTarget::stderr());
    let style = "{prefix:>10} [{bar:40}] {pos}/{len} {elapsed} ETA {eta} {msg}";
    bar.set_style(
        ProgressStyle::with_template(style).expect("a valid template").progress_chars("=> "),
    );
    bar.set_prefix(what.to_owned());
    bar
}
