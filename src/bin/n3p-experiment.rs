//! Experiments: the whole pipeline from one versioned file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser, Subcommand};
use n3p::cli::{self, BadInput, OrBadInput};
use n3p::files::reason;
use n3p::lab::dataset::Part;
use n3p::lab::evaluation::{report, rows};
use n3p::lab::experiments::{ExperimentConfig, ExperimentError, Given, runner};
use n3p::lab::training;
use n3p::lab::volume::{self, VolumeConfig, VolumeError, VolumeOptions};
use n3p::toml_file::Setting;
use n3p::vehicle::Vehicle;

/// Runs experiments: collect, train, evaluate and report, all from one file.
#[derive(Parser)]
#[command(version = cli::VERSION)]
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
    /// Plans very many scenes once each by n3p and has every path checked, or goes on where an interrupted
    /// run stopped. Exit code 1 where a path is refused.
    Volume(VolumeArgs),
    /// Lists the experiments of a folder.
    List {
        /// The folder.
        #[arg(default_value = "experiments")]
        folder: PathBuf,
    },
}

#[derive(Args)]
struct VolumeArgs {
    /// What to plan, such as experiments/volume/volume.toml.
    file: PathBuf,
    /// Folder of the records [default: results/NAME beside the file].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The share of this process, such as 2/3; the run that finds all shards finished writes the table.
    #[arg(long, default_value_t, value_name = "I/N")]
    shard: Part,
    /// Plan nothing: say as JSON what --out holds of each shard.
    #[arg(long, conflicts_with_all = ["shard", "samples", "write_scene"])]
    status: bool,
    /// Plan nothing: put together what the n processes of --shard left, and refuse what is missing, damaged
    /// or another's.
    #[arg(long, conflicts_with_all = ["status", "shard", "samples", "write_scene"])]
    merge: bool,
    /// Worker threads; they disturb times, never results.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Write scenes and paths to this folder for others to check, JSON lines for each shard.
    #[arg(long, value_name = "DIR")]
    samples: Option<PathBuf>,
    /// Of so many scenes write one.
    #[arg(long, default_value_t = 1, value_name = "N", requires = "samples", value_parser = clap::value_parser!(u64).range(1..))]
    sample_every: u64,
    /// Write the scene of this number to --out instead, as a file.
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["shard", "samples"])]
    write_scene: Option<u64>,
    /// A setting instead of the file's, such as count=1000; may be given several times
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Setting>,
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
        Command::Volume(args) => run_volume(args),
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

fn run_volume(args: &VolumeArgs) -> Result<ExitCode> {
    let config = VolumeConfig::read(&args.file, &args.set).or_bad_input()?;
    let stem = args.file.file_stem().unwrap_or_default();
    let usual = args.file.parent().unwrap_or(Path::new("")).join("results").join(stem);
    let out = args.out.clone().unwrap_or(usual);
    if let Some(number) = args.write_scene {
        let case = volume::draw::draw(&config, number);
        let path = out.join(format!("{}.json", case.scene.file_stem()));
        std::fs::create_dir_all(&out)
            .map_err(|error| BadInput(format!("--out: {}", reason(&error))))?;
        case.scene.write(&path).or_bad_input()?;
        cli::print(path.display())?;
        return Ok(ExitCode::SUCCESS);
    }
    let options = VolumeOptions {
        part: args.shard,
        threads: args.threads.into(),
        samples: args.samples.clone(),
        sample_every: args.sample_every,
    };
    let failed = |error: VolumeError| match error.is_bad_input() {
        true => BadInput(error.to_string()).into(),
        false => anyhow::Error::from(error),
    };
    if args.status {
        cli::print(volume::shards(&config, &out).map_err(failed)?.to_json())?;
        return Ok(ExitCode::SUCCESS);
    }
    let totals = match args.merge {
        true => volume::merge(&config, &out),
        false => volume::run(&config, &out, &options),
    };
    let totals = totals.map_err(failed)?;
    cli::print(totals.markdown().trim_end())?;
    cli::print(format!("{}: {} of {} shards finished", out.display(), totals.shards, totals.of))?;
    Ok(if totals.is_clean() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
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
