//! A training that is killed and resumed ends with the same curve and the same policy.

#![cfg(feature = "lab")]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use assert_cmd::cargo::cargo_bin;
use n3p::lab::rl::policy_file;
use n3p::lab::training::rl::{RlLog, checkpoint_path};

/// Small enough for a test: what matters is that everything random takes part.
const SETTINGS: &str = "
episodes = 60
environments = 3
warm_up = 300
steps_per_update = 16
replay = 700
report_every = 5
validation_count = 1

[env]
horizon = 40

[sac]
batch = 8
";

fn train(folder: &Path, more: &[&str]) -> Command {
    fs::write(folder.join("rl.toml"), SETTINGS).unwrap();
    let mut command = Command::new(cargo_bin!("n3p-train"));
    command.current_dir(folder).stdout(Stdio::null()).stderr(Stdio::piped());
    command.args(["rl", "--env", "eval", "--config", "rl.toml"]);
    command.args(["--out", "p.safetensors"]).args(more);
    command
}

fn finish(mut command: Command) {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Kills the training once it has left one more checkpoint; whether it was still running.
fn kill_after_a_checkpoint(mut child: Child, path: &Path) -> bool {
    let written = || fs::metadata(path).and_then(|m| m.modified()).ok();
    let (before, begin) = (written(), Instant::now());
    while written() == before && begin.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    let running = child.try_wait().unwrap().is_none();
    let _ = child.kill();
    child.wait().unwrap();
    running
}

#[test]
fn killed_and_resumed_is_as_if_never_killed() {
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    finish(train(whole.path(), &[]));
    let policy = parts.path().join("p.safetensors");
    let mut killed = 0;
    for _ in 0..4 {
        let child = train(parts.path(), &["--resume"]).spawn().unwrap();
        killed += u32::from(kill_after_a_checkpoint(child, &checkpoint_path(&policy)));
    }
    assert!(killed > 0, "every run ended before it could be killed");
    finish(train(parts.path(), &["--resume"]));
    let names = ["p.safetensors", "p.training.json", "p.training.svg", "p.card.md", "p.checkpoint"];
    for name in names {
        let read = |folder: &Path| fs::read(folder.join(name)).unwrap();
        assert!(read(whole.path()) == read(parts.path()), "{name} differs");
    }
    let text = fs::read_to_string(whole.path().join("p.training.json")).unwrap();
    let log: RlLog = serde_json::from_str(&text).unwrap();
    assert!(log.points.len() >= 8 && log.points.last().unwrap().updates > 20);
    let (header, _) = policy_file::load(&policy).unwrap();
    assert_eq!(header.episodes, log.best().episodes);
}

#[test]
fn what_would_be_lost_or_mixed_up_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    finish(train(dir.path(), &["--episodes", "12"]));
    let refused = |more: &[&str]| {
        let output = train(dir.path(), more).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    let policy = fs::read(dir.path().join("p.safetensors")).unwrap();
    let e = refused(&[]);
    assert!(
        e.contains("p.checkpoint: a checkpoint is here already") && e.contains("--resume"),
        "{e}"
    );
    let e = refused(&["--resume", "--seed", "5"]);
    assert!(e.contains("other settings"), "{e}");
    let e = refused(&["--resume", "--env", "simple"]);
    assert!(e.contains("cannot be used multiple times"), "{e}");
    let e = refused(&["--resume", "--set", "episode=9"]);
    assert!(e.contains("--set episode=9: unknown field `episode`"), "{e}");
    let e = refused(&["--resume", "--set", "episodes=0"]);
    assert!(e.contains("episodes is 0"), "{e}");
    let checkpoint = dir.path().join("p.checkpoint");
    let bytes = fs::read(&checkpoint).unwrap();
    for length in [0, 7, 100, bytes.len() / 2, bytes.len() - 1] {
        fs::write(&checkpoint, &bytes[..length]).unwrap();
        let output = train(dir.path(), &["--resume"]).output().unwrap();
        let e = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{length}: {e}");
        assert!(e.contains("p.checkpoint"), "{e}");
    }
    assert_eq!(fs::read(dir.path().join("p.safetensors")).unwrap(), policy);
    // More episodes go on from where fewer ended.
    fs::write(&checkpoint, &bytes).unwrap();
    finish(train(dir.path(), &["--resume"]));
}

#[test]
fn a_policy_that_is_gone_and_a_vehicle_that_fits_nowhere_are_told() {
    let dir = tempfile::tempdir().unwrap();
    finish(train(dir.path(), &["--episodes", "12"]));
    fs::remove_file(dir.path().join("p.safetensors")).unwrap();
    let output = train(dir.path(), &["--resume"]).output().unwrap();
    let e = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && e.contains("p.safetensors: no such file"), "{e}");
    let wide = "[vehicle]\nlength = 4.97\nwidth = 2.4\nwheelbase = 2.83\nrear_overhang = 1.1\n\
                max_steer = 0.6\n";
    fs::write(dir.path().join("wide.toml"), wide).unwrap();
    for course in ["simple", "eval"] {
        let mut command = Command::new(cargo_bin!("n3p-train"));
        command.current_dir(dir.path()).args(["rl", "--env", course, "--config", "wide.toml"]);
        let output = command.args(["--out", "q.safetensors"]).output().unwrap();
        let e = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && e.contains("bay_spot_width"), "{e}");
    }
}
