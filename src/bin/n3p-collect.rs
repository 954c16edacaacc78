//! `n3p-collect`: solves parking in abstracted environments and stores the samples.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use n3p::cli::{self, BadInput, OrBadInput};
use n3p::files;
use n3p::lab::dataset::{
    self, CollectConfig, CollectError, CollectOptions, Part, Summary, TypeReport,
};
use n3p::lab::progress;
use n3p::toml_file::Setting;
use n3p::vehicle::Vehicle;
use n3p::world::ParkingType;

/// Collects training samples: Hybrid A* with Reeds-Shepp expansion in every cell of the grid.
///
/// May be interrupted at any moment; --resume then ends with the same bytes.
#[derive(Parser)]
#[command(version = cli::VERSION)]
struct Args {
    /// Parking type; forward, reverse and parallel when omitted
    #[arg(long = "type", value_name = "TYPE")]
    kind: Option<ParkingType>,
    /// Settings, a TOML file; the defaults when omitted
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The vehicle, a TOML file such as experiments/vehicles/tpcap.toml; overrides the settings
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Folder of the data set
    #[arg(long, value_name = "DIR", default_value = "datasets/default")]
    out: PathBuf,
    /// A setting instead of the file's, such as grid.back=8.0; may be given several times
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Setting>,
    /// Go on with what an earlier run left
    #[arg(long)]
    resume: bool,
    /// Collect only every n-th file, from the i-th on, as one of n processes
    #[arg(long, value_name = "I/N", default_value_t)]
    shard: Part,
    /// Collect nothing: say as JSON what the folder holds of each file
    #[arg(long, conflicts_with_all = ["resume", "shard"])]
    status: bool,
    /// Collect nothing: put together what the n processes of --shard left, and refuse what is missing,
    /// damaged or another's
    #[arg(long, conflicts_with_all = ["status", "resume", "shard"])]
    merge: bool,
    /// Worker threads; 0 for one per core
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: u16,
}

fn main() -> ExitCode {
    let args = cli::parse::<Args>();
    cli::run(|| run(&args))
}

fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let mut config = CollectConfig::read(args.config.as_deref(), &args.set).or_bad_input()?;
    if let Some(path) = &args.vehicle {
        config.vehicle = Vehicle::read(path).or_bad_input()?;
    }
    let kinds = args.kind.map_or(ParkingType::SQUARE.to_vec(), |kind| vec![kind]);
    let options = CollectOptions { resume: args.resume, part: args.shard };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads.into()).build()?;
    if args.status {
        let shards = pool.install(|| dataset::shards(&config, &args.out, &kinds));
        cli::print(shards.map_err(exit_code)?.to_json())?;
        return Ok(ExitCode::SUCCESS);
    }
    let begin = Instant::now();
    let bar = progress::bar(0, "collect");
    let result = pool.install(|| match args.merge {
        true => dataset::merge(&config, &args.out, &kinds),
        false => dataset::collect(&config, &args.out, &kinds, options, &bar),
    });
    bar.finish_and_clear();
    let reports = result.map_err(exit_code)?;
    let seconds = begin.elapsed().as_secs_f64();
    for report in &reports {
        cli::print(summary(report))?;
    }
    cli::print(format!("{}: {seconds:.1} s", args.out.display()))?;
    if reports.iter().all(|r| r.missing_shards == 0) {
        // Read back: what is on the disk counts.
        let set = Summary::read(&args.out, &kinds)?;
        cli::print(format!("checksum of settings and rows: {}", set.sha256))?;
        write_card(&args.out, set)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn exit_code(error: CollectError) -> anyhow::Error {
    if error.is_bad_input() { BadInput(error.to_string()).into() } else { error.into() }
}

/// Writes the card of all the types that are complete.
fn write_card(folder: &Path, collected: Summary) -> anyhow::Result<()> {
    let is_complete = |kind: &ParkingType| dataset::manifest::manifest_path(folder, *kind).exists();
    let kinds: Vec<ParkingType> = ParkingType::ALL.into_iter().filter(is_complete).collect();
    let set = match kinds.iter().all(|kind| collected.kinds.contains_key(kind)) {
        true => collected,
        false => Summary::read(folder, &kinds)?,
    };
    let card = dataset::card::card(&set);
    files::write_whole(&folder.join("card.md"), card.as_bytes())?;
    Ok(())
}

fn summary(report: &TypeReport) -> String {
    let TypeReport { kind, rows, solved, bytes, collected_rows, missing_shards } = report;
    let share = 100.0 * *solved as f64 / (*rows).max(1) as f64;
    let size = *bytes as f64 / f64::from(1 << 20);
    let missing = match missing_shards {
        0 => String::new(),
        n => format!("; {n} files are missing: collect the other parts, or --resume"),
    };
    format!(
        "{kind}: {rows} rows ({collected_rows} new), {share:.2} % solved, {size:.2} MiB{missing}"
    )
}
