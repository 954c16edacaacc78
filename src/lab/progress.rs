//! Progress bars.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar with ETA on stderr; hidden when stderr is not a terminal.
#[allow(clippy::missing_panics_doc, reason = "the template is a constant")]
pub fn bar(len: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(len), ProgressDrawTarget::stderr());
    let style = "{prefix:>10} [{bar:40}] {pos}/{len} {elapsed} ETA {eta} {msg}";
    bar.set_style(
        ProgressStyle::with_template(style).expect("a valid template").progress_chars("=> "),
    );
    bar.set_prefix(what.to_owned());
    bar
}
