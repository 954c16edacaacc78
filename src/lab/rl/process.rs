//! Policies that are other programs, in any language.
//!
//! One JSON object per line. The question, on the program's standard input:
//! `{"step": 0, "lidar": [120 numbers], "target": [5], "mask": [42]}`, as in [`Observation`]. The
//! answer, on its standard output: `{"steer": -0.4, "speed": 1.0}`, as in [`Action`]. An answer may
//! repeat `step`, which must then be the question's; other keys are ignored. Each question has to
//! be answered, and nothing else printed: a line that nobody asked for is a fault. What the
//! program prints to standard error appears as it is.
//!
//! Whatever the program does, the caller neither waits longer than the limit nor holds more than a
//! few lines. After a fault the program is killed, on Unix with whatever it started (all that is still in its
//! process group), the rest of the episode repeats the fault, and
//! the next episode starts the program anew. Otherwise one process serves all episodes.

use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel,
};
use std::thread;
use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{Policy, PolicyFault};
use crate::environment::{Action, Observation};
use crate::files::reason;

/// Bytes of the longest line that is read whole; an answer has about fifty.
const LONGEST_LINE: u64 = 64 * 1024;
/// Characters of a wrong answer that a warning shows.
const SHOWN: usize = 80;

/// A command line that cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// A quote that is never closed, or a backslash at the end.
    #[error("policy `{0}`: a quote is not closed; write the command as in a shell")]
    Quotes(String),
    /// Nothing to start.
    #[error("policy: the command is empty; give a program and its arguments")]
    Empty,
    /// There is no such program.
    #[error("policy `{command}`: there is no program {program:?}; install it or give its path")]
    Missing {
        /// The command line.
        command: String,
        /// Its first word.
        program: String,
    },
    /// The operating system refused.
    #[error("policy `{command}`: cannot be started: {}; it must be a program", reason(.error))]
    Refused {
        /// The command line.
        command: String,
        /// Why.
        error: io::Error,
    },
}

/// A policy that is another program.
#[derive(Debug)]
pub struct ProcessPolicy {
    command: String,
    words: Vec<String>,
    limit: Duration,
    /// The program, or the fault that ended it.
    state: Result<Running, PolicyFault>,
}

impl ProcessPolicy {
    /// Starts `command`: words as in a shell, with quotes, but no shell is run. Each answer,
    /// the first one with the program's own start, may take up to `limit`.
    pub fn start(command: &str, limit: Duration) -> Result<Self, ProcessError> {
        let words = shlex::split(command).ok_or(ProcessError::Quotes(command.to_owned()))?;
        let program = words.first().ok_or(ProcessError::Empty)?;
        let running = Running::spawn(&words).map_err(|error| match error.kind() {
            ErrorKind::NotFound => {
                ProcessError::Missing { command: command.to_owned(), program: program.clone() }
            }
            _ => ProcessError::Refused { command: command.to_owned(), error },
        })?;
        Ok(Self { command: command.to_owned(), words, limit, state: Ok(running) })
    }
}

impl Policy for ProcessPolicy {
    fn act(
        &mut self,
        observation: &Observation,
        _rng: &mut ChaCha8Rng,
    ) -> Result<Action, PolicyFault> {
        if observation.step == 0 && self.state.is_err() {
            self.state = Running::spawn(&self.words).map_err(|error| {
                log::warn!("policy `{}`: cannot be started: {}", self.command, reason(&error));
                PolicyFault::Ended
            });
        }
        let running = self.state.as_mut().map_err(|fault| *fault)?;
        let Failure { fault, what } = match running.ask(observation, self.limit) {
            Ok(action) => return Ok(action),
            Err(failure) => failure,
        };
        let what = if fault == PolicyFault::Ended { running.end() } else { what };
        let (command, step) = (&self.command, observation.step);
        log::warn!("policy `{command}`, step {step}: {what}; the next episode restarts it");
        self.state = Err(fault);
        Err(fault)
    }
}

/// A question, as it is written.
#[derive(Serialize)]
struct Question<'a> {
    step: u32,
    lidar: &'a [f32],
    target: &'a [f32],
    mask: &'a [f32],
}

/// An answer, as it is read. `null` is how JavaScript and others write NaN.
#[derive(Deserialize)]
struct Answer {
    // The attribute makes a missing key an error instead of `None`.
    #[serde(deserialize_with = "Option::deserialize")]
    steer: Option<f64>,
    #[serde(deserialize_with = "Option::deserialize")]
    speed: Option<f64>,
    step: Option<u32>,
}

/// What went wrong with a question, in words for the log.
struct Failure {
    fault: PolicyFault,
    what: String,
}

impl Failure {
    fn new(fault: PolicyFault, what: impl Into<String>) -> Self {
        Self { fault, what: what.into() }
    }

    fn of_line(fault: PolicyFault, what: &str, line: &[u8]) -> Self {
        let start = &line[..line.len().min(4 * SHOWN)];
        let shown: String = String::from_utf8_lossy(start).trim_end().chars().take(SHOWN).collect();
        Self::new(fault, format!("{what}: {shown:?}"))
    }
}

/// A program at work. Dropping it kills it.
///
/// Two threads stand between us and its pipes, so that nothing it does or leaves undone can block
/// the caller: a program that never reads blocks the writer once the pipe is full (after some
/// twenty questions of 2 KiB), one that floods blocks in its own pipe once the reader holds two
/// lines. The threads end when the pipes do.
#[derive(Debug)]
struct Running {
    child: Child,
    /// Whether it was waited for: its number may be another's by now.
    ended: bool,
    questions: SyncSender<Vec<u8>>,
    lines: Receiver<Vec<u8>>,
}

impl Running {
    fn spawn(words: &[String]) -> io::Result<Self> {
        let (program, arguments) = words.split_first().ok_or(ErrorKind::InvalidInput)?;
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        // A group of its own, so that what it starts ends with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (questions, to_write) = sync_channel(1);
        let (read, lines) = sync_channel(1);
        // From here on dropping it kills the program, also where a thread cannot be had.
        let running = Self { child, ended: false, questions, lines };
        let (stdin, stdout) = pipes.ok_or(ErrorKind::BrokenPipe)?;
        thread::Builder::new().spawn(move || write_questions(stdin, &to_write))?;
        thread::Builder::new().spawn(move || read_lines(stdout, &read))?;
        Ok(running)
    }

    /// Asks one question and waits for its answer.
    fn ask(&mut self, observation: &Observation, limit: Duration) -> Result<Action, Failure> {
        let ended = || Failure::new(PolicyFault::Ended, "");
        match self.lines.try_recv() {
            Ok(line) => {
                let what = "it printed a line that nobody asked for";
                return Err(Failure::of_line(PolicyFault::NoAction, what, &line));
            }
            Err(TryRecvError::Disconnected) => return Err(ended()),
            Err(TryRecvError::Empty) => {}
        }
        match self.questions.try_send(question(observation)) {
            Ok(()) => {}
            Err(TrySendError::Disconnected(_)) => return Err(ended()),
            Err(TrySendError::Full(_)) => {
                return Err(Failure::new(PolicyFault::TimedOut, "it does not read its questions"));
            }
        }
        match self.lines.recv_timeout(limit) {
            Ok(line) => answer(&line, observation.step),
            Err(RecvTimeoutError::Disconnected) => Err(ended()),
            Err(RecvTimeoutError::Timeout) => {
                let what = format!("no answer within {} s", limit.as_secs_f64());
                Err(Failure::new(PolicyFault::TimedOut, what))
            }
        }
    }

    /// Makes sure that it has ended, and says how it did.
    fn end(&mut self) -> String {
        // What has ended already cannot be killed, which is as good.
        #[cfg(unix)]
        if let (false, Some(group)) = (self.ended, group_of(&self.child)) {
            let _ = rustix::process::kill_process_group(group, rustix::process::Signal::KILL);
        }
        let _ = self.child.kill();
        self.ended = true;
        match self.child.wait() {
            Ok(status) => format!("it ended ({status})"),
            Err(error) => format!("it ended ({})", reason(&error)),
        }
    }
}

/// The process group that a child leads.
#[cfg(unix)]
fn group_of(child: &Child) -> Option<rustix::process::Pid> {
    rustix::process::Pid::from_raw(child.id().try_into().ok()?)
}

impl Drop for Running {
    fn drop(&mut self) {
        self.end();
    }
}

fn question(observation: &Observation) -> Vec<u8> {
    let Observation { step, lidar, target, mask } = observation;
    let question = Question { step: *step, lidar, target, mask };
    let mut line = serde_json::to_vec(&question).expect("plain numbers");
    line.push(b'\n');
    line
}

fn write_questions(mut stdin: ChildStdin, questions: &Receiver<Vec<u8>>) {
    // A program that has closed its input is found out when it does not answer.
    while questions.recv().is_ok_and(|line| stdin.write_all(&line).is_ok()) {}
}

/// Sends each line, its break included; one that is too long comes in parts, none of them JSON.
fn read_lines(stdout: ChildStdout, lines: &SyncSender<Vec<u8>>) {
    let mut stdout = BufReader::new(stdout);
    loop {
        let mut line = Vec::new();
        let read = stdout.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line);
        if !read.is_ok_and(|n| n > 0) || lines.send(line).is_err() {
            return;
        }
    }
}

fn answer(line: &[u8], step: u32) -> Result<Action, Failure> {
    let no_action = |why: &str| Failure::of_line(PolicyFault::NoAction, why, line);
    let answer: Answer = serde_json::from_slice(line)
        .or_else(|_| serde_json::from_str(&without_nan(line)))
        .map_err(|error| no_action(&format!("the answer is no action ({error})")))?;
    if answer.step.is_some_and(|s| s != step) {
        return Err(no_action("the answer is for another step"));
    }
    match (answer.steer, answer.speed) {
        (Some(steer), Some(speed)) => Ok(Action { steer, speed }),
        _ => Err(Failure::of_line(PolicyFault::NotFinite, "the answer is not finite", line)),
    }
}

/// The line with `null` where Python and others write what JSON has no word for.
fn without_nan(line: &[u8]) -> String {
    let line = String::from_utf8_lossy(line).into_owned();
    ["-Infinity", "Infinity", "NaN"].iter().fold(line, |line, word| line.replace(word, "null"))
}
