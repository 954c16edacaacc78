//! Experiments: the whole pipeline from one versioned file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser, Subcommand};
use n3p::cli::{self, BadInput, OrBadInput};
use n3p::files::reason;
use n3p::lab::evaluation::{report, rows};
use n3p::lab::experiments::{ExperimentConfig, ExperimentError, Given, runner};
use n3p::lab::training;
use n3p::toml_file::Setting;
use n3p::vehicle::Vehicle;

/// Runs experiments: collect, train, evaluate and report, all from one file.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Runs an experiment, or goes on where an interrupted run stopped.
    Run {
        /// The experiment, such as experiments/quick.toml.
        file: PathBuf,
        /// Folder of the results [default: results/NAME beside the file].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        #[command(flatten)]
        given: GivenArgs,
    },
    /// Runs an experiment anew and compares its rows with the ones on record; everything
    /// but times must agree. Exit code 1 if not.
    Reproduce {
        /// The experiment.
        file: PathBuf,
        /// Folder of the new results [default: a temporary one].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        #[command(flatten)]
        given: GivenArgs,
    },
    /// Lists the experiments of a folder.
    List {
        /// The folder.
        #[arg(default_value = "experiments")]
        folder: PathBuf,
    },
}

#[derive(Args)]
struct GivenArgs {
    /// Data set to train from instead of collecting one; it must have the experiment's settings
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folder of models to evaluate instead of collecting and training: knn.bin
    /// (knn-angled.bin for angled bays), mlp-TYPE.safetensors, rl-ENV.safetensors
    #[arg(long, value_name = "DIR", conflicts_with = "data")]
    models: Option<PathBuf>,
    /// Folder of policies (rl-ENV.safetensors) to evaluate instead of training them, where the
    /// other models are made
    #[arg(long, value_name = "DIR", conflicts_with = "models")]
    policies: Option<PathBuf>,
    /// Another vehicle than the experiment's, a TOML file; its name joins that of the results
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// A setting instead of the file's, such as evaluate.count=20; may be given several times
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Setting>,
}

impl From<&GivenArgs> for Given {
    fn from(args: &GivenArgs) -> Self {
        Self {
            data: args.data.clone(),
            models: args.models.clone(),
            policies: args.policies.clone(),
        }
    }
}

/// Differences printed in full.
const SHOWN: usize = 20;

fn main() -> ExitCode {
    // SAFETY: the first statement of the program, which has started no thread.
    unsafe { training::single_threaded() };
    let args = cli::parse::<Cli>();
    cli::run(|| match &args.command {
        Command::Run { file, out, given } => run(file, out.as_deref(), given),
        Command::Reproduce { file, out, given } => reproduce(file, out.as_deref(), given),
        Command::List { folder } => list(folder),
    })
}

/// The experiment, with the vehicle given.
fn read(file: &Path, args: &GivenArgs) -> Result<ExperimentConfig> {
    let config = ExperimentConfig::read(file, &args.set).or_bad_input()?;
    let Some(path) = &args.vehicle else { return Ok(config) };
    let vehicle = Vehicle::read(path).or_bad_input()?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let name: String = stem.chars().map(|c| if plain(c) { c } else { '-' }).collect();
    Ok(config.with_vehicle(vehicle, &name))
}

fn run(file: &Path, out: Option<&Path>, args: &GivenArgs) -> Result<ExitCode> {
    let (config, given) = (read(file, args)?, &Given::from(args));
    let out = out.map_or_else(|| results(file, &config), Path::to_owned);
    let rows = runner::run(&config, given, &out).map_err(exit_code)?;
    cli::print(report::text(&rows, config.evaluate.seed).trim_end())?;
    cli::print(format!("{}: all that was made; start with report.html", out.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn reproduce(file: &Path, out: Option<&Path>, args: &GivenArgs) -> Result<ExitCode> {
    let (config, given) = (read(file, args)?, &Given::from(args));
    let recorded = results(file, &config).join("rows.csv");
    if !recorded.exists() {
        let text = format!(
            "{}: no rows on record to compare with; make some: n3p-experiment run {}{}",
            recorded.display(),
            file.display(),
            args.vehicle.as_ref().map_or(String::new(), |v| format!(" --vehicle {}", v.display())),
        );
        return Err(BadInput(text).into());
    }
    let expected = rows::read_csv(&recorded).or_bad_input()?;
    if out.is_some_and(|out| same_folder(out, &results(file, &config))) {
        let text = "--out is the folder of the rows to compare with; choose another one";
        return Err(BadInput(text.to_owned()).into());
    }
    let temporary = tempfile::tempdir()?;
    let found = runner::run(&config, given, out.unwrap_or(temporary.path())).map_err(exit_code)?;
    cli::print(report::text(&found, config.evaluate.seed).trim_end())?;
    if let Some(out) = out {
        cli::print(format!("{}: start with report.html", out.display()))?;
    }
    let lines = runner::differences(&expected, &found);
    if lines.is_empty() {
        cli::print(format!("{} rows agree with {}", found.len(), recorded.display()))?;
        return Ok(ExitCode::SUCCESS);
    }
    for line in lines.iter().take(SHOWN) {
        cli::print(line)?;
    }
    cli::print(format!("{} differences from {}", lines.len(), recorded.display()))?;
    Ok(ExitCode::FAILURE)
}

fn same_folder(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn list(folder: &Path) -> Result<ExitCode> {
    let cannot = |e: std::io::Error| {
        BadInput(format!("{}: {}; give a folder of experiments", folder.display(), reason(&e)))
    };
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .map_err(cannot)?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<std::io::Result<_>>()
        .map_err(cannot)?;
    files.retain(|f| f.extension().is_some_and(|e| e == "toml"));
    files.sort();
    for file in files {
        match ExperimentConfig::read(&file, &[]) {
            Ok(config) => cli::print(format!("{}: {}", file.display(), config.description))?,
            Err(error) => cli::print(error)?,
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// `results/NAME` beside the experiment's file.
fn results(file: &Path, config: &ExperimentConfig) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join("results").join(&config.name)
}

fn exit_code(error: ExperimentError) -> anyhow::Error {
    if error.is_bad_input() { BadInput(error.to_string()).into() } else { error.into() }
}
