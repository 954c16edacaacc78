//! `n3p-train`: trains selectors from a data set.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use candle_core::Device;
use clap::{Args, Parser, Subcommand};
use n3p::cli::{self, BadInput, OrBadInput};
use n3p::environment::courses::{Course, Stratum};
use n3p::lab::dataset::Dataset;
use n3p::lab::training::foresight::{ForesightConfig, LibraryLog};
use n3p::lab::training::quality::{Errors, Reach};
use n3p::lab::training::rl::{Begin, RlConfig};
use n3p::lab::training::worlds::WorldsConfig;
use n3p::lab::training::{self, MlpConfig, TrainingError};
use n3p::selectors::artefact;
use n3p::toml_file::Setting;
use n3p::world::ParkingType;

/// Trains selectors from data sets, and driving policies; each becomes one model file.
#[derive(Parser)]
#[command(version = cli::VERSION)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Trains the network of one parking type, or of every type of the data set
    ///
    /// May be interrupted at any moment: the best network so far is in its file. A model card,
    /// a training log and the loss curve are written beside it.
    Mlp(MlpArgs),
    /// Stores the solved samples of one or all types for nearest-neighbour queries
    ///
    /// A model card and a training log are written beside the model.
    Knn(KnnArgs),
    /// Condenses data sets of several vehicles into manoeuvres for any vehicle, and trains networks
    /// that see the vehicle's shape
    ///
    /// A model card, a training log and the loss curves are written beside the model.
    Fleet(FleetArgs),
    /// Trains the network that foresees what known manoeuvres are worth in a scene
    ///
    /// A model card, a training log and the loss curve are written beside the model.
    Foresight(ForesightArgs),
    /// Writes the networks of a model as ONNX files, for other runtimes
    ///
    /// Raw features in, raw outputs out; the model's card says which.
    Onnx(OnnxArgs),
    /// Trains a driving policy by soft actor-critic
    ///
    /// May be interrupted at any moment: the best policy so far is in its file, and --resume goes
    /// on from the last checkpoint to the same end. A model card, a training log and the curve
    /// are written beside it.
    Rl(RlArgs),
}

#[derive(Args)]
struct Common {
    /// Parking type; all of the data set when omitted
    #[arg(long = "type", value_name = "TYPE")]
    kind: Option<ParkingType>,
    /// Folder of the data set
    #[arg(long, value_name = "DIR", default_value = "datasets/paper")]
    data: PathBuf,
}

/// Settings of a training.
#[derive(Args)]
struct Settings {
    /// Settings of the training, a TOML file; the defaults when omitted
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A setting instead of the file's, such as epochs=5 or sac.discount=0.99; may be given several times
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Setting>,
    /// Seed of all that is drawn, such as weights, order and worlds; overrides the settings
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
}

#[derive(Args)]
struct MlpArgs {
    #[command(flatten)]
    common: Common,
    /// Model file [default: models/mlp-TYPE.safetensors]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
}

#[derive(Args)]
struct KnnArgs {
    #[command(flatten)]
    common: Common,
    /// Model file
    #[arg(long, value_name = "FILE", default_value = "models/knn.bin")]
    out: PathBuf,
    /// Generated worlds of each type in which manoeuvres are learnt, too; 0 for none
    #[arg(long, value_name = "N", default_value_t = WorldsConfig::default().count)]
    worlds: u32,
    /// Seed of the worlds; that of the data set when omitted
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Samples stored of each cell, at most; the manoeuvres are learnt from all
    #[arg(long, value_name = "N", default_value_t = u32::MAX, hide_default_value = true,
        value_parser = clap::value_parser!(u32).range(1..))]
    samples_per_cell: u32,
}

#[derive(Args)]
struct FleetArgs {
    /// Folder of a data set; give one of each vehicle
    #[arg(long, value_name = "DIR", required = true)]
    data: Vec<PathBuf>,
    /// Model file
    #[arg(long, value_name = "FILE", default_value = "models/fleet.safetensors")]
    out: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Generated worlds of each type in which manoeuvres are learnt, too; 0 for none
    #[arg(long, value_name = "N", default_value_t = WorldsConfig::default().count)]
    worlds: u32,
}

#[derive(Args)]
struct ForesightArgs {
    /// A model whose manoeuvres it learns with; may be given several times. Bare names are looked for in
    /// the working folder, then in models/
    #[arg(long, value_name = "FILE", default_values = ["knn.bin", "knn-tpcap.bin", "fleet.safetensors"])]
    model: Vec<PathBuf>,
    /// Model file
    #[arg(long, value_name = "FILE", default_value = "models/foresight.safetensors")]
    out: PathBuf,
    #[command(flatten)]
    settings: Settings,
}

#[derive(Args)]
struct OnnxArgs {
    /// The model: mlp-TYPE.safetensors, fleet.safetensors or foresight.safetensors. A bare name is looked for
    /// in the working folder, then in models/
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// Folder of the files, MODEL.onnx or MODEL-NETWORK.onnx
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

#[derive(Args)]
struct RlArgs {
    /// Where it learns: in abstracted environments (simple) or in generated scenes (eval)
    #[arg(long = "env", value_name = "ENV")]
    course: Course,
    /// Episodes; overrides the settings
    #[arg(long, value_name = "N")]
    episodes: Option<usize>,
    /// Policy file [default: models/rl-ENV.safetensors]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
    /// Go on from the checkpoint beside the policy file, if there is one
    #[arg(long)]
    resume: bool,
}

fn main() -> ExitCode {
    // SAFETY: the first statement of the program, which has started no thread.
    unsafe { training::single_threaded() };
    let cli = cli::parse::<Cli>();
    cli::run(|| match &cli.command {
        Command::Mlp(args) => mlp(args),
        Command::Knn(args) => knn(args),
        Command::Fleet(args) => fleet(args),
        Command::Foresight(args) => foresight(args),
        Command::Onnx(args) => onnx(args),
        Command::Rl(args) => rl(args),
    })
}

fn mlp(args: &MlpArgs) -> anyhow::Result<ExitCode> {
    let config = mlp_config(&args.settings)?;
    if args.out.is_some() && args.common.kind.is_none() {
        let text = "--out names one file, but every type gets its own: give --type, too";
        return Err(BadInput(text.to_owned()).into());
    }
    let out = |kind: ParkingType| {
        let default = || PathBuf::from(format!("models/mlp-{kind}.safetensors"));
        args.out.clone().unwrap_or_else(default)
    };
    let possible = args.common.kind.map_or(ParkingType::ALL.to_vec(), |kind| vec![kind]);
    for kind in possible {
        artefact::check_writable(&out(kind)).or_bad_input()?;
    }
    let (data, kinds) = read(&args.common)?;
    for kind in kinds {
        let out = out(kind);
        let (metadata, samples) = (&data.metadata, &data.samples);
        let log = training::mlp::train(metadata, samples, kind, &config, &out)
            .map_err(|e| exit_code(e, &args.common.data))?;
        cli::print(format!(
            "{}: {} rows, best of {} epochs is {}; {}",
            out.display(),
            log.train_rows,
            log.losses.len(),
            log.best_epoch,
            quality(log.validation_rows, &log.validation, &log.reach),
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// How good a network is on `rows` kept apart.
fn quality(rows: usize, errors: &Errors, reach: &Reach) -> String {
    format!(
        "on {rows} unseen rows the median error is {:.2} m, {:.1}°; {:.0} % have a free curve to the \
         goal, {:.0} % one from the start, too",
        errors.position_median_m,
        errors.heading_median_rad.to_degrees(),
        100.0 * reach.to_goal,
        100.0 * reach.direct,
    )
}

/// The settings of a file, or the usual ones, with another seed if asked for.
fn mlp_config(Settings { config, set, seed }: &Settings) -> anyhow::Result<MlpConfig> {
    let mut config = MlpConfig::read(config.as_deref(), set).or_bad_input()?;
    config.seed = seed.unwrap_or(config.seed);
    config.validate().or_bad_input()?;
    Ok(config)
}

fn knn(args: &KnnArgs) -> anyhow::Result<ExitCode> {
    WorldsConfig { count: args.worlds, ..WorldsConfig::default() }.validate().or_bad_input()?;
    artefact::check_writable(&args.out).or_bad_input()?;
    let (data, kinds) = read(&args.common)?;
    let seed = args.seed.unwrap_or(data.metadata.seed);
    let worlds = WorldsConfig { count: args.worlds, seed };
    let begin = Instant::now();
    let config = training::knn::KnnConfig { worlds, samples_per_cell: args.samples_per_cell };
    let log = training::knn::train(&data.metadata, &data.samples, &kinds, &config, &args.out)
        .map_err(|e| exit_code(e, &args.common.data))?;
    for training::knn::KnnKindLog { kind, samples, occupied_cells, manoeuvres, .. } in &log.kinds {
        cli::print(format!(
            "{kind}: {samples} samples in {occupied_cells} cells, {manoeuvres} manoeuvres"
        ))?;
    }
    let (size, seconds) = (log.bytes as f64 / f64::from(1 << 20), begin.elapsed().as_secs_f64());
    cli::print(format!("{}: {size:.2} MiB, built in {seconds:.2} s", args.out.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn fleet(args: &FleetArgs) -> anyhow::Result<ExitCode> {
    let config = mlp_config(&args.settings)?;
    let worlds = WorldsConfig { count: args.worlds, seed: config.seed };
    worlds.validate().or_bad_input()?;
    artefact::check_writable(&args.out).or_bad_input()?;
    let sets = args.data.iter().map(|folder| Dataset::read(folder, None).or_bad_input());
    let sets = sets.collect::<anyhow::Result<Vec<_>>>()?;
    for (i, (set, folder)) in sets.iter().zip(&args.data).enumerate() {
        let bad = |what: String| BadInput(format!("--data {}: {what}", folder.display()));
        let solved = |kind| set.solved().filter(|s| s.cell.kind() == kind).count();
        let least = training::mlp::LEAST_SAMPLES;
        if let Some(kind) = ParkingType::SQUARE.into_iter().find(|k| solved(*k) < least) {
            let count = solved(kind);
            let text =
                format!("it has {count} solved samples of type {kind}; at least {least} needed");
            return Err(bad(text).into());
        }
        if set.metadata.grid != sets[0].metadata.grid {
            let first = args.data[0].display();
            return Err(
                bad(format!("its grid is not that of {first}; collect with one grid")).into()
            );
        }
        let like = |other: &Dataset| other.metadata.vehicle.is_like(&set.metadata.vehicle);
        if let Some(other) = sets[..i].iter().position(like) {
            let other = args.data[other].display();
            return Err(bad(format!("its vehicle is that of {other}; give one set each")).into());
        }
    }
    let log = training::fleet::train(&sets, &config, &worlds, &args.out).map_err(|e| {
        if e.is_bad_input() { BadInput(e.to_string()).into() } else { anyhow::Error::from(e) }
    })?;
    for k in &log.kinds {
        cli::print(format!(
            "{}: {} manoeuvres from {} samples; {}",
            k.kind,
            k.manoeuvres,
            k.samples,
            quality(k.validation_rows, &k.validation, &k.reach),
        ))?;
    }
    cli::print(format!(
        "{}: {} vehicles, {} bytes",
        args.out.display(),
        log.fleet.len(),
        log.bytes
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn foresight(args: &ForesightArgs) -> anyhow::Result<ExitCode> {
    let Settings { config, set, seed } = &args.settings;
    let mut config = ForesightConfig::read(config.as_deref(), set).or_bad_input()?;
    config.seed = seed.unwrap_or(config.seed);
    config.validate().or_bad_input()?;
    artefact::check_writable(&args.out).or_bad_input()?;
    let models = training::foresight::load(&args.model).or_bad_input()?;
    let log = training::foresight::train(models, &config, &args.out).map_err(|e| {
        if e.is_bad_input() { BadInput(e.to_string()).into() } else { anyhow::Error::from(e) }
    })?;
    for LibraryLog { model, vehicle, kind, validation: v, .. } in &log.libraries {
        cli::print(format!(
            "{model}, {:.2} m, {kind}: in {} scenes the first 3 hold the best in {:.0} % (by estimates {:.0} %), \
             the first 12 in {:.0} % ({:.0} %); cost foreseen to {:.1} % (median), {:.0} % (P95)",
            vehicle.length,
            v.scenes,
            100.0 * v.in_first,
            100.0 * v.in_first_by_estimate,
            100.0 * v.in_order,
            100.0 * v.in_order_by_estimate,
            100.0 * v.cost_median,
            100.0 * v.cost_p95,
        ))?;
    }
    cli::print(format!(
        "{}: best of {} epochs is {}; {} bytes",
        args.out.display(),
        log.losses.len(),
        log.best_epoch,
        log.bytes
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn onnx(args: &OnnxArgs) -> anyhow::Result<ExitCode> {
    let files = training::onnx::export(&artefact::find_model(&args.model), &args.out);
    for file in files.or_bad_input()? {
        cli::print(file.display().to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn rl(args: &RlArgs) -> anyhow::Result<ExitCode> {
    let Settings { config, set, seed } = &args.settings;
    let mut config = RlConfig::read(config.as_deref(), set).or_bad_input()?;
    config.episodes = args.episodes.unwrap_or(config.episodes);
    config.seed = seed.unwrap_or(config.seed);
    config.validate().or_bad_input()?;
    let default = || PathBuf::from(format!("models/rl-{}.safetensors", args.course.name()));
    let out = args.out.clone().unwrap_or_else(default);
    artefact::check_writable(&out).or_bad_input()?;
    let begin = if args.resume { Begin::Resume } else { Begin::Anew };
    let log =
        training::rl::train(args.course, &config, &out, begin, &Device::Cpu).map_err(|e| {
            if e.is_bad_input() { BadInput(e.to_string()).into() } else { anyhow::Error::from(e) }
        })?;
    let best = log.best();
    let problems = Stratum::COUNT * config.validation_count;
    cli::print(format!(
        "{}: the best of {} points is that of {} episodes, which parks in {} of {problems} \
         validation problems; {} steps, {} updates in all",
        out.display(),
        log.points.len(),
        best.episodes,
        best.validated().total(),
        log.points.last().map_or(0, |p| p.steps),
        log.points.last().map_or(0, |p| p.updates),
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// The data set, and the parking types to train: the one asked for or all it holds.
fn read(args: &Common) -> anyhow::Result<(Dataset, Vec<ParkingType>)> {
    let data = Dataset::read(&args.data, args.kind).or_bad_input()?;
    let kinds = args.kind.map_or_else(|| data.kinds(), |kind| vec![kind]);
    Ok((data, kinds))
}

/// Keeps apart what the user can mend and what not.
fn exit_code(error: TrainingError, data: &Path) -> anyhow::Error {
    if error.is_bad_input() {
        BadInput(format!("{}: {error}", data.display())).into()
    } else {
        error.into()
    }
}
