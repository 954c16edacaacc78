//! `n3p-play`: the page on which cars are dragged while N3P plans.

use std::io::Write;
use std::process::{Command, ExitCode};

use n3p_play::server::{Server, runtime};

const USAGE: &str = "\
Serves the playground of N3P to this machine's browser, until it is interrupted.

Usage: n3p-play [--port N] [--open]

  --port N  listen on this port of 127.0.0.1 [default: 8642; 0: any that is free]
  --open    open the page in the usual browser
  --help    print this";

struct Arguments {
    port: u16,
    open: bool,
}

fn main() -> ExitCode {
    let arguments = match parse(std::env::args().skip(1)) {
        Ok(Some(arguments)) => arguments,
        Ok(None) => {
            say(USAGE);
            return ExitCode::SUCCESS;
        }
        Err(message) => {
            eprintln!("error: {message}\nUsage: n3p-play [--port N] [--open]");
            return ExitCode::from(2);
        }
    };
    match run(&arguments) {
        Ok(never) => match never {},
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(1)
        }
    }
}

fn run(arguments: &Arguments) -> Result<std::convert::Infallible, String> {
    let runtime = runtime().map_err(|e| format!("cannot start: {e}"))?;
    runtime.block_on(async {
        let port = arguments.port;
        let server = Server::listen(port).await.map_err(|e| {
            format!("cannot listen on port {port} of 127.0.0.1: {e}; try another, such as --port 0")
        })?;
        let url = server.url();
        say(&url);
        if arguments.open {
            open(&url);
        }
        Ok(server.serve().await)
    })
}

/// Prints a line, to whoever still reads.
fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Asks the desktop for a browser; where there is none the address is on the screen.
fn open(url: &str) {
    let (program, before): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("cmd", &["/C", "start", ""])
    } else {
        ("xdg-open", &[])
    };
    if let Err(e) = Command::new(program).args(before).arg(url).spawn() {
        eprintln!("cannot open a browser with {program}: {e}; open the address yourself");
    }
}

/// What is asked for; `None` where it is help.
fn parse(mut words: impl Iterator<Item = String>) -> Result<Option<Arguments>, String> {
    let mut arguments = Arguments { port: 8642, open: false };
    while let Some(word) = words.next() {
        match word.as_str() {
            "--help" | "-h" => return Ok(None),
            "--open" => arguments.open = true,
            "--port" => {
                let port = words.next().unwrap_or_default();
                let is_none = |_| format!("--port is {port:?}; expected a number from 0 to 65535");
                arguments.port = port.parse().map_err(is_none)?;
            }
            other => {
                return Err(format!("unknown argument {other:?}; expected --port N or --open"));
            }
        }
    }
    Ok(Some(arguments))
}
