//! Policies from outside: the two examples, and everything that files and programs can do wrong.

#![cfg(feature = "lab")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use n3p::environment::{Action, BEAMS, MASK, Observation};
use n3p::lab::rl::onnx::{OnnxError, OnnxPolicy};
use n3p::lab::rl::process::ProcessPolicy;
use n3p::lab::rl::{Policy, PolicyFault};
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use rand::Rng;

/// Long enough for a program to start on a busy machine.
const PATIENT: Duration = Duration::from_secs(20);
/// For programs that will not answer.
const SHORT: Duration = Duration::from_millis(500);
/// A program that answers for ever.
const GOOD: &str = r#"while read question; do echo '{"steer": 0.5, "speed": -1}'; done"#;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Open space around a car whose goal lies at `(x, y)` with `heading`.
fn seen(step: u32, [x, y, heading]: [f64; 3]) -> Observation {
    let distance = x.hypot(y);
    let bearing = y.atan2(x);
    let target = [distance, bearing.cos(), bearing.sin(), heading.cos(), heading.sin()];
    Observation { step, lidar: [8.0; BEAMS], target: target.map(|v| v as f32), mask: [1.0; MASK] }
}

fn act(policy: &mut impl Policy, step: u32) -> Result<Action, PolicyFault> {
    policy.act(&seen(step, [6.0, -2.0, -1.0]), &mut rng(1, Stream::Scene, 0))
}

/// `sh` with a script, which is one quoted word.
fn sh(script: &str, limit: Duration) -> ProcessPolicy {
    let script = shlex::try_quote(script).unwrap();
    ProcessPolicy::start(&format!("sh -c {script}"), limit).unwrap()
}

fn greedy_process() -> ProcessPolicy {
    let script = root().join("examples/policies/greedy.py");
    ProcessPolicy::start(&format!("python3 '{}'", script.display()), PATIENT).unwrap()
}

fn greedy_onnx() -> OnnxPolicy {
    OnnxPolicy::load(&root().join("examples/policies/greedy.onnx")).unwrap()
}

/// Drives a car in open space, and returns how near it comes to its goal.
fn nearest(policy: &mut impl Policy, mut goal: [f64; 3]) -> f64 {
    let vehicle = Vehicle::default();
    let mut nearest = f64::INFINITY;
    for step in 0..40 {
        nearest = nearest.min(goal[0].hypot(goal[1]));
        let action = policy.act(&seen(step, goal), &mut rng(1, Stream::Scene, 0)).unwrap();
        assert!(action.steer.abs() <= 1.0 && action.speed.abs() <= 1.0, "{action:?}");
        let full = if action.speed < 0.0 { 0.5 } else { 1.0 };
        let curvature = (action.steer * vehicle.max_steer).tan() / vehicle.wheelbase;
        let turn = curvature * action.speed * full;
        let chord = action.speed * full * (if turn == 0.0 { 1.0 } else { turn.sin() / turn });
        let (x, y) = (goal[0] - chord, goal[1] - chord * (turn / 2.0).tan());
        let (sin, cos) = turn.sin_cos();
        goal = [x * cos + y * sin, y * cos - x * sin, goal[2] - turn];
    }
    nearest
}

const GOALS: [[f64; 3]; 4] =
    [[12.0, 0.0, 0.0], [9.0, -4.0, -1.5], [-6.0, 2.0, 0.4], [8.0, -3.0, 1.57]];

#[test]
fn the_onnx_example_drives_to_the_goal() {
    for goal in GOALS {
        let distance = nearest(&mut greedy_onnx(), goal);
        assert!(distance < 1.5, "{distance} m from {goal:?}");
    }
}

#[test]
#[ignore = "needs python3 on the PATH"]
fn the_python_example_drives_to_the_goal() {
    for goal in GOALS {
        let distance = nearest(&mut greedy_process(), goal);
        assert!(distance < 1.5, "{distance} m from {goal:?}");
    }
}

#[test]
#[ignore = "needs python3 on the PATH"]
fn the_examples_agree() {
    let (mut process, mut onnx) = (greedy_process(), greedy_onnx());
    let (mut draws, mut unused) = (rng(5, Stream::Scene, 0), rng(1, Stream::Scene, 0));
    let mut draw = || f64::from(draws.next_u32()) / f64::from(u32::MAX);
    for step in 0..200 {
        let goal = [30.0 * draw() - 15.0, 20.0 * draw() - 10.0, 6.0 * draw() - 3.0];
        let mut seen = seen(step, goal);
        seen.mask.iter_mut().for_each(|m| *m = (10.0 * draw()).round() as f32 / 10.0);
        let a = process.act(&seen, &mut unused).unwrap();
        let b = onnx.act(&seen, &mut unused).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        assert!(near(a.steer, b.steer) && near(a.speed, b.speed), "{goal:?}: {a:?} {b:?}");
        assert_eq!(onnx.act(&seen, &mut unused), Ok(b), "twice the same");
    }
}

fn fixture(name: &str) -> PathBuf {
    root().join(format!("tests/fixtures/policies/{name}.onnx"))
}

/// The refusal of the file at `path`, which names it and takes one line.
fn refusal(path: &Path) -> String {
    let error: OnnxError = OnnxPolicy::load(path).err().unwrap_or_else(|| panic!("{path:?} loads"));
    let text = error.to_string();
    assert!(text.starts_with(&format!("policy {}: ", path.display())), "{text}");
    assert!(!text.contains('\n'), "{text}");
    text
}

#[test]
fn wrong_onnx_files_are_refused_at_load() {
    for (name, expected) in [
        ("missing", "cannot be read: no such file"),
        ("narrow_lidar", "input lidar is f32 [1, 64]; it must be f32 [1, 120]"),
        ("no_batch", "input target is f32 [5]; it must be f32 [1, 5]"),
        ("unknown_input", "unknown input \"image\"; a policy's inputs are lidar [1, 120], target"),
        ("int_mask", "input mask is i32 [1, 42]; it must be f32 [1, 42]"),
        ("no_action", "no output is called action, but [\"steer_and_speed\"]"),
        ("wide_action", "output action is f32 [1, 3]; it must be f32 [1, 2]"),
        ("int_action", "output action is i32 [1, 1]; it must be f32 [1, 2]"),
        ("undeclared", "output action is f32 [1, 5]; it must be f32 [1, 2]"),
        ("reshape", "fails on a plain observation"),
    ] {
        let text = refusal(&fixture(name));
        assert!(text.contains(expected), "{name}: {text}");
    }
    assert!(refusal(&root().join("examples")).contains("not a file"));
    assert!(refusal(&root().join("examples/policies/greedy.py")).contains("end in .onnx"));
    assert!(act(&mut OnnxPolicy::load(&fixture("symbolic")).unwrap(), 0).is_ok());
}

#[test]
fn damaged_onnx_files_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.onnx");
    let write = |bytes: &[u8]| fs::write(&path, bytes).unwrap();
    write(b"");
    assert!(refusal(&path).contains("empty"));
    write(b"{\"steer\": 0}");
    assert!(refusal(&path).contains("not an ONNX file"));

    let whole = fs::read(root().join("examples/policies/greedy.onnx")).unwrap();
    for length in (1..whole.len()).step_by(7).chain(whole.len() - 40..whole.len()) {
        write(&whole[..length]);
        refusal(&path);
    }
    let mut rng = rng(3, Stream::Scene, 0);
    for i in 0..2000 {
        let mut bytes = whole.clone();
        match i % 2 {
            0 => bytes[rng.next_u32() as usize % whole.len()] = rng.next_u32() as u8,
            _ => rng.fill_bytes(&mut bytes),
        }
        write(&bytes);
        // Many a flipped bit is only another weight.
        let _ = OnnxPolicy::load(&path);
    }
}

#[test]
fn onnx_faults_are_told_and_leave_the_policy_whole() {
    let mut policy = OnnxPolicy::load(&fixture("by_distance")).unwrap();
    for (distance, expected) in [
        (3.0, Ok(Action { steer: 0.0, speed: 1.0 })),
        (0.5, Err(PolicyFault::NotFinite)),
        (9.0, Err(PolicyFault::NoAction)),
        (f64::NAN, Err(PolicyFault::NotFinite)),
        (3.0, Ok(Action { steer: 0.0, speed: 1.0 })),
    ] {
        let seen = seen(0, [distance, 0.0, 0.0]);
        assert_eq!(policy.act(&seen, &mut rng(1, Stream::Scene, 0)), expected, "{distance} m");
    }
}

/// A program that misbehaves when it is started first, and is good from then on: the fault is
/// `expected`, lasts for the episode, and is over with the next.
fn misbehaves_once(bad: &str, limit: Duration, expected: PolicyFault) {
    let folder = tempfile::tempdir().unwrap();
    let mark = folder.path().join("mark").display().to_string();
    let script = format!("if [ -e '{mark}' ]; then {GOOD}; exit; fi; : > '{mark}'; {bad}");
    let mut policy = sh(&script, limit);
    assert_eq!(act(&mut policy, 0), Err(expected), "{bad}");
    assert_eq!(act(&mut policy, 1), Err(expected), "{bad}, again");
    let good = Ok(Action { steer: 0.5, speed: -1.0 });
    assert_eq!(act(&mut policy, 0), good, "{bad}, anew");
    assert_eq!(act(&mut policy, 1), good, "{bad}, anew");
}

#[test]
fn programs_that_end() {
    for bad in ["exit 3", "read q; exit 0", "read q; kill -9 $$", "exec >&-; exec sleep 9"] {
        misbehaves_once(bad, PATIENT, PolicyFault::Ended);
    }
}

#[test]
fn programs_that_do_not_answer() {
    for bad in
        ["exec sleep 9", "exec <&-; exec sleep 9", "read q; printf '{\"steer\":'; exec sleep 9"]
    {
        let start = Instant::now();
        misbehaves_once(bad, SHORT, PolicyFault::TimedOut);
        assert!(start.elapsed() < Duration::from_secs(8), "{bad}: {:?}", start.elapsed());
    }
}

#[test]
fn programs_that_answer_nonsense() {
    for (answer, expected) in [
        (r#"{"steer": NaN, "speed": 1}"#, PolicyFault::NotFinite),
        (r#"{"steer": 0, "speed": -Infinity}"#, PolicyFault::NotFinite),
        (r#"{"steer": null, "speed": 1}"#, PolicyFault::NotFinite),
        (r#"{"steer": 1e999, "speed": 1}"#, PolicyFault::NoAction),
        (r#"{"steer": 1}"#, PolicyFault::NoAction),
        (r#"{"steer": "left", "speed": 1}"#, PolicyFault::NoAction),
        (r#"{"steer": 1, "speed": 1, "speed": 1}"#, PolicyFault::NoAction),
        (r#"{"steer": 1, "speed": 1, "step": 7}"#, PolicyFault::NoAction),
        (r#"{"steer": 1, "speed": 1} {"steer": 1, "speed": 1}"#, PolicyFault::NoAction),
        ("Traceback (most recent call last):", PolicyFault::NoAction),
        ("", PolicyFault::NoAction),
    ] {
        misbehaves_once(&format!("read q; echo '{answer}'; exec sleep 9"), PATIENT, expected);
    }
    for flood in
        ["read q; exec yes", "exec yes", "exec cat /dev/zero", "read q; exec cat /dev/zero"]
    {
        misbehaves_once(flood, PATIENT, PolicyFault::NoAction);
    }
}

#[test]
fn answers_may_say_more_and_may_lack_the_last_line_break() {
    let answer = r#"{"note": "NaN", "step": 0, "speed": 1, "steer": 3}"#;
    let mut policy = sh(&format!("read q; printf '%s' '{answer}'"), PATIENT);
    assert_eq!(act(&mut policy, 0), Ok(Action { steer: 3.0, speed: 1.0 }));
    assert_eq!(act(&mut policy, 1), Err(PolicyFault::Ended));
}

#[test]
fn lines_that_nobody_asked_for_are_no_answers() {
    let line = r#"'{"steer": 0.5, "speed": -1}'"#;
    for two in [format!("yes {line}"), format!("read q; echo {line}; echo {line}; exec sleep 9")] {
        let mut policy = sh(&two, PATIENT);
        // The first may be taken for an answer.
        let _ = act(&mut policy, 0);
        sleep(SHORT);
        assert_eq!(act(&mut policy, 1), Err(PolicyFault::NoAction), "{two}");
    }
}

#[test]
fn a_program_that_answers_without_reading_cannot_block_the_caller() {
    let blind = r#"while :; do sleep 0.01; echo '{"steer": 0, "speed": 0}'; done"#;
    let mut policy = sh(blind, PATIENT);
    // Its pipe holds some thirty questions.
    assert!((0..300).any(|step| act(&mut policy, step).is_err()));
}

#[test]
fn one_process_serves_all_episodes_and_dies_with_the_policy() {
    let folder = tempfile::tempdir().unwrap();
    let pids = folder.path().join("pids");
    let mut policy = sh(&format!("echo $$ >> '{}'; {GOOD}", pids.display()), PATIENT);
    for step in [0, 1, 2, 0, 1] {
        act(&mut policy, step).unwrap();
    }
    let pids = fs::read_to_string(pids).unwrap();
    assert_eq!(pids.lines().count(), 1, "{pids}");
    let exists = || {
        let kill = Command::new("sh").arg("-c").arg(format!("kill -0 {}", pids.trim())).output();
        kill.unwrap().status.success()
    };
    assert!(exists());
    drop(policy);
    // Not even as a zombie.
    assert!(!exists());
}

/// What a program starts used to outlive it.
#[cfg(unix)]
#[test]
fn what_a_program_started_ends_with_it() {
    let hangs = "sleep 600 & echo $! >> 'PIDS'; sleep 600";
    let floods = "{ while :; do echo x; done; } & echo $! >> 'PIDS'; read q; sleep 600";
    let ends = "sleep 600 & echo $! >> 'PIDS'; read q; exit 3";
    let folder = tempfile::tempdir().unwrap();
    for (number, script) in [hangs, floods, ends].into_iter().enumerate() {
        let pids = folder.path().join(number.to_string());
        let mut policy = sh(&script.replace("PIDS", &pids.display().to_string()), SHORT);
        // A loaded machine may take longer to start a shell than the policy is given to answer.
        let started = || fs::read_to_string(&pids).ok().filter(|pid| pid.ends_with('\n'));
        let begun = Instant::now();
        while started().is_none() && begun.elapsed() < PATIENT {
            sleep(Duration::from_millis(5));
        }
        let pid = started().expect(script);
        let _ = act(&mut policy, 0);
        let _ = act(&mut policy, 1);
        drop(policy);
        // Whoever adopts it may be late to bury it: a zombie has ended.
        let runs = || {
            let stat = fs::read_to_string(format!("/proc/{}/stat", pid.trim()));
            stat.is_ok_and(|s| !s.contains(") Z "))
        };
        let begun = Instant::now();
        while runs() && begun.elapsed() < Duration::from_secs(5) {
            sleep(Duration::from_millis(5));
        }
        assert!(!runs(), "{script}");
    }
}

#[test]
fn commands_that_cannot_be_started_are_refused_at_once() {
    for (command, expected) in [
        ("", "the command is empty"),
        ("  ", "the command is empty"),
        ("sh -c 'exit", "`sh -c 'exit`: a quote is not closed"),
        ("no-such-program-of-n3p --x", "there is no program \"no-such-program-of-n3p\""),
        ("/", "`/`: cannot be started: permission denied"),
    ] {
        let error = ProcessPolicy::start(command, SHORT).expect_err(command).to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{command}: {error}");
    }
}
