//! Puts the git revision into `env!("N3P_GIT_REVISION")`: data sets and artefacts carry it.
//!
//! `unknown` outside a checkout of this project, `+dirty` appended when a compiled file differs
//! from the commit.

use std::path::Path;
use std::process::Command;

/// What the build compiles; a change here recompiles anyway, so `+dirty` never goes stale.
const COMPILED: [&str; 4] = ["src", "Cargo.toml", "Cargo.lock", "build.rs"];

fn main() {
    for path in COMPILED {
        rerun_if_changed(path);
    }
    let revision = revision().unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=N3P_GIT_REVISION={revision}");
}

fn revision() -> Option<String> {
    // A copy of the sources inside somebody else's repository has no revision of its own.
    git(&["ls-files", "--error-unmatch", "Cargo.toml"])?;
    let branch = git(&["rev-parse", "--symbolic-full-name", "HEAD"]).unwrap_or_default();
    for file in ["HEAD", "logs/HEAD", "packed-refs", branch.as_str()] {
        if let Some(path) = git(&["rev-parse", "--git-path", file]) {
            rerun_if_changed(&path);
        }
    }
    let commit = git(&["rev-parse", "HEAD"])?;
    let mut status = vec!["--no-optional-locks", "status", "--porcelain", "--"];
    status.extend(COMPILED);
    let dirty = if git(&status)?.is_empty() { "" } else { "+dirty" };
    Some(format!("{commit}{dirty}"))
}

/// Cargo reruns forever for a path that does not exist, so such a path is left out.
fn rerun_if_changed(path: &str) {
    if Path::new(path).exists() {
        println!("cargo::rerun-if-changed={path}");
    }
}

/// What git prints; `None` when it is missing or refuses.
fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok()?;
    if !output.status.success() {
        return None;
    }
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
