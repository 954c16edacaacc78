//! Whatever kills, fills, forbids, truncates, swaps or races: going on afterwards ends with the same bytes.
//!
//! Every program that writes is killed (−9) at random moments, `N3P_FAULT_KILLS` times each, 2 times where
//! that is not said; docs/reliability.md has what 100 times came to.

#![cfg(all(feature = "lab", unix))]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use assert_cmd::cargo::cargo_bin;
use n3p::lab::evaluation::rows::read_csv;
use n3p::lab::volume::ShardRecord;
use n3p::rng::{Stream, rng};
use rand::RngExt;

/// Something that writes files into a folder, and goes on where it was stopped.
struct Task {
    name: &'static str,
    program: &'static str,
    /// `OUT` stands for the folder.
    arguments: &'static [&'static str],
}

const COLLECT: Task = Task {
    name: "collect",
    program: "n3p-collect",
    arguments: &[
        "--type",
        "reverse",
        "--config",
        "collect.toml",
        "--threads",
        "1",
        "--resume",
        "--out",
        "OUT",
    ],
};
const KNN: Task = Task {
    name: "train knn",
    program: "n3p-train",
    arguments: &[
        "knn",
        "--data",
        "data",
        "--type",
        "reverse",
        "--worlds",
        "5",
        "--out",
        "OUT/knn.bin",
    ],
};
const MLP: Task = Task {
    name: "train mlp",
    program: "n3p-train",
    arguments: &[
        "mlp",
        "--data",
        "data",
        "--type",
        "reverse",
        "--set",
        "epochs=2",
        "--out",
        "OUT/mlp.safetensors",
    ],
};
const FLEET: Task = Task {
    name: "train fleet",
    program: "n3p-train",
    arguments: &[
        "fleet",
        "--data",
        "data",
        "--worlds",
        "0",
        "--set",
        "epochs=1",
        "--out",
        "OUT/fleet.safetensors",
    ],
};
const RL: Task = Task {
    name: "train rl",
    program: "n3p-train",
    arguments: &[
        "rl",
        "--env",
        "simple",
        "--config",
        "rl.toml",
        "--resume",
        "--out",
        "OUT/rl.safetensors",
    ],
};
const EVAL: Task = Task {
    name: "eval",
    program: "n3p-eval",
    arguments: &[
        "--methods",
        "ha,n3p",
        "--count",
        "4",
        "--drive",
        "--paths",
        "OUT/paths",
        "--resume",
        "--out",
        "OUT",
    ],
};
const EXPERIMENT: Task = Task {
    name: "experiment",
    program: "n3p-experiment",
    arguments: &["run", "tiny.toml", "--out", "OUT"],
};
const VOLUME: Task = Task {
    name: "volume",
    program: "n3p-experiment",
    arguments: &["volume", "volume.toml", "--samples", "OUT/samples", "--out", "OUT"],
};
const ALL: [&Task; 8] = [&COLLECT, &KNN, &MLP, &FLEET, &RL, &EVAL, &EXPERIMENT, &VOLUME];

const COLLECT_TOML: &str = r#"
samples_per_cell = 10
max_expansions = 300
cells_per_shard = 1
[grid]
lane_width = { min = 4.0, max = 5.0, step = 1.0 }
bay_spot_width = { min = 2.3, max = 3.3, step = 0.5 }
parallel_spot_width = { min = 6.0, max = 8.0, step = 1.0 }
dead_end = { min = 4.0, max = 12.0, step = 8.0 }
back = 7.0
bay_depth = 5.5
parallel_depth = 2.4
"#;
const RL_TOML: &str = "
episodes = 30
environments = 2
warm_up = 100
steps_per_update = 16
replay = 400
report_every = 5
validation_count = 1
[env]
horizon = 30
[sac]
batch = 8
";
const TINY_TOML: &str = r#"
version = 1
name = "tiny"
seed = 3
[collect]
samples_per_cell = 10
max_expansions = 2000
[collect.grid]
lane_width = { min = 5.0, max = 6.0, step = 1.0 }
bay_spot_width = { min = 2.4, max = 3.4, step = 1.0 }
parallel_spot_width = { min = 6.5, max = 7.5, step = 1.0 }
dead_end = { min = 6.0, max = 8.0, step = 2.0 }
back = 10.0
bay_depth = 5.5
parallel_depth = 2.4
[train.knn]
worlds = 5
[train.mlp]
epochs = 1
validation_share = 0.25
[evaluate]
methods = ["ha-rs", "mlp-n3p", "n3p"]
types = ["reverse"]
levels = ["easy"]
count = 3
seed = 11
"#;
const VOLUME_TOML: &str =
    "version = 1\nseed = 5\ncount = 60\nscenes_per_shard = 6\nmap_coordinates = 1e6\n";

impl Task {
    /// The program, to write into `out`; its settings lie in `home`.
    fn command(&self, home: &Path, out: &Path) -> Command {
        let arguments = self.arguments.iter().map(|a| a.replace("OUT", &out.display().to_string()));
        let mut command = Command::new(cargo_bin(self.program));
        command.current_dir(home).args(arguments).env("N3P_LOG", "off");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn finish(&self, home: &Path, out: &Path) -> Output {
        let output = self.command(home, out).output().unwrap();
        assert!(output.status.success(), "{}: {}", self.name, told(&output));
        output
    }
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The settings of all tasks, and a folder for their results.
fn home() -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    let files = [
        ("collect.toml", COLLECT_TOML),
        ("rl.toml", RL_TOML),
        ("tiny.toml", TINY_TOML),
        ("volume.toml", VOLUME_TOML),
    ];
    files.iter().for_each(|(name, text)| fs::write(home.path().join(name), text).unwrap());
    // What trainings learn from, collected once.
    static DATA: OnceLock<tempfile::TempDir> = OnceLock::new();
    let data = DATA.get_or_init(|| {
        let data = tempfile::tempdir().unwrap();
        let mut command = Command::new(cargo_bin("n3p-collect"));
        command.args(["--config", "collect.toml", "--out"]).arg(data.path().join("data"));
        // Fewer cells, wide enough for some samples of every type.
        for set in ["grid.lane_width.min=6.0", "grid.lane_width.max=6.0", "max_expansions=2000"] {
            command.args(["--set", set]);
        }
        let output = command.current_dir(home.path()).output().unwrap();
        assert!(output.status.success(), "{}", told(&output));
        data
    });
    std::os::unix::fs::symlink(data.path().join("data"), home.path().join("data")).unwrap();
    home
}

fn every_file(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { every_file(&path, found) } else { found.push(path) }
    }
}

/// What a task left, without what tells times: rows without them, reports and their tables not at all.
fn snapshot(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = Vec::new();
    every_file(folder, &mut files);
    let mut snapshot = BTreeMap::new();
    for path in files {
        let name = path.strip_prefix(folder).unwrap().display().to_string();
        let ends = |ending: &str| name.ends_with(ending);
        let bytes = match () {
            () if ends("rows.csv") => {
                let rows = read_csv(&path).unwrap();
                format!("{:?}", rows.iter().map(|r| r.untimed()).collect::<Vec<_>>()).into_bytes()
            }
            () if name.starts_with("shard-") && ends(".json") => {
                let number = name["shard-".len()..][..6].parse().unwrap();
                let record = ShardRecord::read(folder, number).expect("whole");
                serde_json::to_vec(&record.results).unwrap()
            }
            () if ends("report.md") || ends("report.html") || ends("rows.parquet") => Vec::new(),
            () if ends(".training.jsonl") || ends("volume.json") || ends("volume.md") => Vec::new(),
            () => fs::read(&path).unwrap(),
        };
        snapshot.insert(name, bytes);
    }
    snapshot
}

fn assert_same(task: &Task, what: &str, expected: &BTreeMap<String, Vec<u8>>, folder: &Path) {
    let found = snapshot(folder);
    let names = |of: &BTreeMap<String, Vec<u8>>| of.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&found), names(expected), "{}, {what}", task.name);
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "{}, {what}: {name} differs", task.name);
    }
}

/// What each task leaves when nothing happens to it, and how long that takes.
fn undisturbed(task: &Task, home: &Path) -> (BTreeMap<String, Vec<u8>>, Duration) {
    type Known = OnceLock<BTreeMap<&'static str, OnceLock<(BTreeMap<String, Vec<u8>>, Duration)>>>;
    static KNOWN: Known = OnceLock::new();
    let known = KNOWN.get_or_init(|| ALL.map(|t| (t.name, OnceLock::new())).into());
    known[task.name]
        .get_or_init(|| {
            let out = home.join("undisturbed");
            let begun = Instant::now();
            task.finish(home, &out);
            let took = begun.elapsed();
            let left = snapshot(&out);
            fs::remove_dir_all(&out).unwrap();
            (left, took)
        })
        .clone()
}

fn survives_kills(task: &Task) {
    let kills: u32 = std::env::var("N3P_FAULT_KILLS").map_or(2, |n| n.parse().unwrap());
    let (home, mut rng) = (home(), rng(7, Stream::Bootstrap, task.name.len() as u64));
    let (expected, took) = undisturbed(task, home.path());
    let out = home.path().join("killed");
    let (mut killed, mut finished) = (0, 0);
    while killed < kills {
        let mut child = task.command(home.path(), &out).spawn().unwrap();
        std::thread::sleep(took.mul_f64(rng.random_range(0.0..1.0)));
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            child.wait().unwrap();
            killed += 1;
            continue;
        }
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}: {}", task.name, told(&output));
        assert_same(task, "between kills", &expected, &out);
        fs::remove_dir_all(&out).unwrap();
        finished += 1;
    }
    task.finish(home.path(), &out);
    assert_same(task, "after kills", &expected, &out);
    println!("{}: {killed} kills, {} complete runs, {took:.1?} each", task.name, finished + 1);
}

#[test]
fn collect_survives_kills() {
    survives_kills(&COLLECT);
}

#[test]
fn knn_survives_kills() {
    survives_kills(&KNN);
}

#[test]
fn mlp_survives_kills() {
    survives_kills(&MLP);
}

#[test]
fn fleet_survives_kills() {
    survives_kills(&FLEET);
}

#[test]
fn policies_survive_kills() {
    survives_kills(&RL);
}

#[test]
fn evaluation_survives_kills() {
    survives_kills(&EVAL);
}

#[test]
fn experiments_survive_kills() {
    survives_kills(&EXPERIMENT);
}

#[test]
fn volume_survives_kills() {
    survives_kills(&VOLUME);
}

/// Bad input or a failing disk, told in a line or two; never a panic.
fn assert_told(task: &Task, what: &str, output: &Output) {
    let text = told(output);
    let code = output.status.code();
    assert!(matches!(code, Some(1 | 2)), "{}, {what}: {code:?} {text}", task.name);
    let lines = text.lines().filter(|l| !l.trim().is_empty()).count();
    assert!(
        (1..=3).contains(&lines) && !text.contains("panicked"),
        "{}, {what}: {text}",
        task.name
    );
}

/// A disk that is full after so many blocks of 512 bytes.
fn with_a_disk_of(blocks: u32, task: &Task, home: &Path, out: &Path) -> Output {
    let usual = task.command(home, out);
    // The signal that would end the process is not for files on a full disk: they get an error.
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.current_dir(home).env("N3P_LOG", "off").arg("-c").arg(script);
    command.arg(usual.get_program()).args(usual.get_args()).output().unwrap()
}

#[test]
fn a_full_disk_is_told_and_loses_nothing() {
    let home = home();
    for task in [&COLLECT, &KNN, &RL, &EVAL, &VOLUME] {
        let (expected, _) = undisturbed(task, home.path());
        let out = home.path().join("full");
        for blocks in [0, 1, 4] {
            let output = with_a_disk_of(blocks, task, home.path(), &out);
            assert_told(task, &format!("{blocks} blocks"), &output);
        }
        task.finish(home.path(), &out);
        assert_same(task, "after a full disk", &expected, &out);
        fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn a_place_that_cannot_be_written_is_told() {
    let home = home();
    let file = home.path().join("file");
    fs::write(&file, "not a folder").unwrap();
    let closed = home.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, std::os::unix::fs::PermissionsExt::from_mode(0o555)).unwrap();
    // Who may do everything may write there, too.
    let is_closed = fs::write(closed.join("try"), "").is_err();
    for task in ALL {
        let output = task.command(home.path(), &file.join("out")).output().unwrap();
        assert_told(task, "below a file", &output);
        assert_eq!(output.status.code(), Some(2), "{}: {}", task.name, told(&output));
        if is_closed {
            let output = task.command(home.path(), &closed.join("out")).output().unwrap();
            assert_told(task, "where nothing may be written", &output);
        }
    }
}

/// Each file cut in half, emptied, or replaced by another: told, or made again; never taken for what it
/// was.
#[test]
fn damaged_files_are_made_again_or_told() {
    let home = home();
    for task in [&COLLECT, &RL, &EVAL, &EXPERIMENT, &VOLUME] {
        let (expected, _) = undisturbed(task, home.path());
        let whole = home.path().join("whole");
        task.finish(home.path(), &whole);
        let names: Vec<&String> = expected.keys().collect();
        // Every so many-th: some tasks leave hundreds.
        let step = names.len().div_ceil(6);
        for (i, name) in names.iter().enumerate().step_by(step) {
            let other = names[(i + 1) % names.len()];
            let bytes = fs::read(whole.join(name)).unwrap();
            let swapped = fs::read(whole.join(other)).unwrap();
            for (what, instead) in
                [("cut", bytes[..bytes.len() / 2].to_vec()), ("swapped", swapped)]
            {
                let out = home.path().join("damaged");
                copy(&whole, &out);
                fs::write(out.join(name), instead).unwrap();
                let output = task.command(home.path(), &out).output().unwrap();
                let what = format!("{name} {what}");
                if output.status.success() {
                    // What a finished task does not read again may stay as it is.
                    let found = snapshot_but(&out, name);
                    let rest = expected.iter().filter(|(n, _)| n != name);
                    assert!(rest.eq(found.iter()), "{}, {what}: another file differs", task.name);
                } else {
                    assert_told(task, &what, &output);
                }
                fs::remove_dir_all(&out).unwrap();
            }
        }
        fs::remove_dir_all(&whole).unwrap();
    }
}

/// The snapshot without one file, which may not be readable.
fn snapshot_but(folder: &Path, name: &str) -> BTreeMap<String, Vec<u8>> {
    let _ = fs::remove_file(folder.join(name));
    snapshot(folder)
}

fn copy(from: &Path, to: &Path) {
    let mut files = Vec::new();
    every_file(from, &mut files);
    for file in files {
        let target = to.join(file.strip_prefix(from).unwrap());
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(file, target).unwrap();
    }
}

/// Each ends well, or is told that the other is at work; what is left is right.
#[test]
fn two_writers_do_not_mix() {
    let home = home();
    for task in ALL {
        let (expected, _) = undisturbed(task, home.path());
        let out = home.path().join("shared");
        let children = [(); 2].map(|()| task.command(home.path(), &out).spawn().unwrap());
        let mut ended_well = 0;
        for child in children {
            let output = child.wait_with_output().unwrap();
            if output.status.success() {
                ended_well += 1;
            } else {
                assert_told(task, "two writers", &output);
            }
        }
        assert!(ended_well > 0, "{}: neither came to an end", task.name);
        task.finish(home.path(), &out);
        assert_same(task, "after two writers", &expected, &out);
        fs::remove_dir_all(&out).unwrap();
    }
}

/// Planning keeps within the memory that docs/reliability.md states, of addresses, too.
#[test]
fn memory_is_bounded() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/scenes/parallel.json");
    let run = |kilobytes: u32, program: &str, arguments: &[&str]| {
        let script = format!("ulimit -v {kilobytes}; exec \"$0\" \"$@\"");
        let mut command = Command::new("sh");
        command.arg("-c").arg(script).arg(cargo_bin(program)).args(arguments).output().unwrap()
    };
    let output = run(64 * 1024, "n3p-plan", &["--scene", scene]);
    assert!(output.status.success(), "{}", told(&output));
    // With policies: their networks are the laboratory's.
    let methods = ["--methods", "ha,ha-rs,mhha,n3p,rl-eval", "--count", "1"];
    let output = run(1024 * 1024, "n3p-eval", &methods);
    assert!(output.status.success(), "{}", told(&output));
    let output = run(8 * 1024, "n3p-plan", &["--scene", scene]);
    assert!(!output.status.success(), "8 MB of addresses are too few for any program");
}

#[test]
fn an_evaluation_goes_on_only_as_what_it_was() {
    let home = home();
    let eval = |more: &[&str]| {
        let mut command = Command::new(cargo_bin("n3p-eval"));
        command.current_dir(home.path()).env("N3P_LOG", "off");
        command.args(["--methods", "ha", "--type", "reverse", "--level", "easy", "--out", "out"]);
        command.args(more).output().unwrap()
    };
    assert!(eval(&["--count", "4"]).status.success());
    let rows = home.path().join("out/rows.csv");
    let text = fs::read_to_string(&rows).unwrap();
    // Whole: nothing is planned again, times stay what they were.
    let output = eval(&["--count", "4", "--resume"]);
    assert!(output.status.success(), "{}", told(&output));
    assert_eq!(fs::read_to_string(&rows).unwrap(), text);
    // Two rows and a half, the second of another scene: one is kept.
    let lines: Vec<&str> = text.lines().collect();
    let half = format!("{}\n{}\n{}\n{}", lines[0], lines[1], lines[3], &lines[4][..20]);
    fs::write(&rows, half).unwrap();
    assert!(eval(&["--count", "4", "--resume"]).status.success());
    let again = fs::read_to_string(&rows).unwrap();
    assert_eq!(again.lines().nth(1), Some(lines[1]));
    let untimed = |text: &str| {
        fs::write(&rows, text).unwrap();
        read_csv(&rows).unwrap().iter().map(|r| r.untimed()).collect::<Vec<_>>()
    };
    assert_eq!(untimed(&again), untimed(&text));
    for other in [
        &["--count", "5"][..],
        &["--count", "4", "--seed", "2"],
        &["--count", "4", "--margin", "0.05"],
    ] {
        let output = eval(&[other, &["--resume"]].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(told(&output).contains("holds rows of other arguments"), "{}", told(&output));
    }
    assert_eq!(fs::read_to_string(&rows).unwrap(), text, "what is refused leaves the rows alone");
}
