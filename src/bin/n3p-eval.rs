//! Every method on the same scenes: rows, tables beside the paper's, a report.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use n3p::cli::{self, BadInput, CostArgs, OrBadInput, PolicyArgs, TermsArgs};
use n3p::episode::{Case, Row};
use n3p::files::Keeper;
use n3p::lab::driving::{DriveConfig, drive};
use n3p::lab::evaluation::report::{self, Provenance};
use n3p::lab::evaluation::suite::{self, Drawn, SuiteConfig, SuiteError, World};
use n3p::lab::evaluation::{Outputs, RunRecord, drives, metrics, quality};
use n3p::lab::progress;
use n3p::lab::training;
use n3p::n3p::{Method, Models};
use n3p::planners::{Budget, Effort};
use n3p::vehicle::Vehicle;
use n3p::world::generate::GeneratorConfig;
use n3p::world::{Level, ParkingType};

/// Evaluates planning methods on generated scenes, or on a folder of scene files.
#[derive(Parser)]
#[command(version = cli::VERSION)]
struct Args {
    /// A trained model; may be given several times. Bare names are looked for in the
    /// working folder, then in models/ [default: what the methods named need, such as
    /// knn.bin, from the same places].
    #[arg(long = "model", value_name = "FILE")]
    models: Vec<String>,
    #[command(flatten)]
    policy: PolicyArgs,
    /// Parking type [default: all that the models of the methods know; all where none needs a model].
    #[arg(long = "type", value_enum, value_name = "TYPE")]
    kind: Option<ParkingType>,
    /// Where generated scenes lie: "home", parking lots as in the paper; "wide", the same with sizes
    /// drawn far wider; "lots", whole car parks and streets, for which nothing is trained or chosen.
    /// May be given several times [default: home].
    #[arg(long = "world", value_enum, value_name = "WORLD", conflicts_with = "scenes")]
    worlds: Vec<World>,
    /// Difficulty of the generated scenes at home [default: all].
    #[arg(long, value_enum, conflicts_with = "scenes")]
    level: Option<Level>,
    /// Methods, separated by commas [default: all that the models allow].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    methods: Vec<Method>,
    /// Generated scenes per type, at home per type and level.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=suite::MAX_COUNT as i64))]
    count: u32,
    /// Seed of the generated scenes and of the intervals.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Vehicle of the generated scenes, a TOML file such as experiments/vehicles/tpcap.toml
    /// [default: that of the first model].
    #[arg(long, value_name = "FILE", conflicts_with = "scenes")]
    vehicle: Option<PathBuf>,
    /// Evaluate the scene files of this folder instead of generated scenes.
    #[arg(long, value_name = "DIR", conflicts_with = "count")]
    scenes: Option<PathBuf>,
    /// Write each path to DIR/SCENE.METHOD.json.
    #[arg(long, value_name = "DIR")]
    paths: Option<PathBuf>,
    /// Write rows (CSV, Parquet) and reports (Markdown, HTML) to this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on where an interrupted run with the same arguments stopped: its rows are kept.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Print rows and summaries as JSON instead of tables.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    terms: TermsArgs,
    #[command(flatten)]
    cost: CostArgs,
    /// Expansion budget per scene and method.
    #[arg(long, default_value_t = 200_000, value_name = "N")]
    max_expansions: usize,
    /// What becomes of a first path: "first" takes it as it is, "usual" looks for better where it
    /// costs more than usual, "most" always does, with half of the budget.
    #[arg(long, default_value_t, value_name = "first|usual|most")]
    effort: Effort,
    /// Drive each path in closed loop, with an ordinary controller, in a car with lags and errors; a table
    /// says what became of it, and DIR/drives.csv of --out has a line each.
    #[arg(long)]
    drive: bool,
    #[command(flatten)]
    driving: Driving,
    /// Worker threads; more than one disturbs the times, never the results.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
}

/// What the driven car has to put up with.
#[derive(clap::Args)]
#[command(next_help_heading = "With --drive")]
#[group(requires = "drive")]
struct Driving {
    /// Standard deviation of each measured position, metres.
    #[arg(long, value_name = "METRES", value_parser = noise, allow_negative_numbers = true)]
    #[arg(default_value_t = DriveConfig::default().position_noise_m)]
    position_noise: f64,
    /// Of where each obstacle stands, metres.
    #[arg(long, value_name = "METRES", value_parser = noise, allow_negative_numbers = true)]
    #[arg(default_value_t = DriveConfig::default().obstacle_noise_m)]
    obstacle_noise: f64,
    /// How much farther than the steering limit by which paths are planned the wheels turn, as a share of it.
    #[arg(long, value_name = "SHARE", value_parser = share, allow_negative_numbers = true)]
    #[arg(default_value_t = DriveConfig::default().steer_reserve)]
    steer_reserve: f64,
    /// Time constant of the steering, seconds.
    #[arg(long, value_name = "SECONDS", value_parser = lag, allow_negative_numbers = true)]
    #[arg(default_value_t = DriveConfig::default().steering_lag_s)]
    steering_lag: f64,
}

fn noise(text: &str) -> Result<f64, String> {
    cli::within(text, 0.0..=1.0, "metres")
}

fn share(text: &str) -> Result<f64, String> {
    cli::within(text, 0.0..=0.5, "of the limit")
}

fn lag(text: &str) -> Result<f64, String> {
    cli::within(text, 0.0..=2.0, "seconds")
}

impl Driving {
    fn config(&self, seed: u64) -> DriveConfig {
        DriveConfig {
            position_noise_m: self.position_noise,
            obstacle_noise_m: self.obstacle_noise,
            steering_lag_s: self.steering_lag,
            steer_reserve: self.steer_reserve,
            seed,
            ..DriveConfig::default()
        }
    }
}

fn main() -> ExitCode {
    // SAFETY: the first statement of the program, which has started no thread.
    unsafe { training::single_threaded() };
    cli::run(|| evaluate(&cli::parse()))
}

/// The outputs, the rows that an interrupted run left there, and what keeps the folder.
fn begin(
    args: &Args,
    cases: &[Case],
    models: &Models,
    config: &SuiteConfig,
    driving: Option<&DriveConfig>,
) -> Result<(Outputs, Vec<Row>, Option<Keeper>)> {
    let paths = args.paths.as_deref();
    let Some(out) = &args.out else {
        return Ok((Outputs::create(None, paths).or_bad_input()?, Vec::new(), None));
    };
    let scenes: Vec<_> = cases.iter().map(|c| (&c.scene, c.kind, c.level, &c.set)).collect();
    let settings = serde_json::json!({
        "methods": config.methods, "models": models.checksums().or_bad_input()?,
        "settings": format!("{:?}", config.settings), "effort": config.budget.effort, "seed": args.seed,
        "max_expansions": config.budget.max_expansions, "terms": format!("{:?}", config.terms),
        "driving": driving, "policy": format!("{:?}", args.policy), "paths": args.paths.is_some(),
    });
    let scenes = serde_json::to_vec(&scenes)?;
    let record = RunRecord::new(&[settings.to_string().as_bytes(), &scenes]);
    let Some(keeper) = record.claim(out, args.resume).or_bad_input()? else {
        let out = out.display();
        let text = format!(
            "--resume: {out} holds rows of other arguments, models, scenes or of another build; give \
             --out a new folder, or leave --resume out to begin anew"
        );
        return Err(BadInput(text).into());
    };
    let (outputs, done) = if args.resume {
        Outputs::resume(out, paths, cases, &config.methods).or_bad_input()?
    } else {
        (Outputs::create(Some(out), paths).or_bad_input()?, Vec::new())
    };
    Ok((outputs, done, Some(keeper)))
}

fn evaluate(args: &Args) -> Result<ExitCode> {
    let policy = args.policy.driver()?;
    let vehicle = match &args.vehicle {
        Some(path) => Some(Vehicle::read(path).or_bad_input()?),
        None => None,
    };
    let models = match &args.models[..] {
        // Scenes have vehicles of their own.
        [] if args.scenes.is_some() => Models::usual(&args.methods, None),
        [] => Models::usual(&args.methods, Some(&vehicle.unwrap_or_default())),
        given => Models::load(given),
    };
    let models = models.or_bad_input()?.with_policy(policy);
    let config = SuiteConfig {
        methods: match &args.methods[..] {
            [] => Method::available(&models),
            given => given.to_vec(),
        },
        settings: args.cost.settings()?,
        budget: Budget { max_expansions: args.max_expansions, effort: args.effort },
        terms: args.terms.terms(),
        threads: args.threads.into(),
    };
    if args.policy.is_given() && !config.methods.contains(&Method::POLICY) {
        let text = "--policy: --methods does not name policy; add it there, or leave --policy out";
        return Err(BadInput(text.to_owned()).into());
    }
    config.build_all(&models).or_bad_input()?;
    let vehicle = vehicle.or(models.vehicle()).unwrap_or_default();
    let Chosen { cases, title, complaint } = choose(args, &vehicle, &config.methods, &models)?;
    suite::check(&cases, &models, &config).or_bad_input()?;
    let driving = args.drive.then(|| args.driving.config(args.seed));
    let (mut outputs, done, _keeper) = begin(args, &cases, &models, &config, driving.as_ref())?;

    let bar = progress::bar((cases.len() * config.methods.len()) as u64, "evaluate");
    bar.set_position(done.len() as u64);
    let mut narrow = BTreeSet::new();
    let rows = suite::run(&cases, &models, &config, done.len(), |case, episode| {
        if episode.problem.margin < args.terms.margin {
            narrow.insert(case.scene.name.clone());
        }
        bar.set_message(format!("{} {}", episode.row.method, episode.row.scene));
        bar.inc(1);
        let driven = driving.as_ref().and_then(|config| drive(case, episode, config));
        outputs.take(case, episode, &models, driven).map_err(anyhow::Error::from)
    });
    // As in the checks before: a suite that cannot run is the user's to mend, a full disk is not.
    let new = rows.map_err(|error| match error.downcast::<SuiteError>() {
        Ok(suite) => BadInput(suite.to_string()).into(),
        Err(other) => other,
    })?;
    let mut rows = done;
    rows.extend(new);
    bar.finish_and_clear();
    if !narrow.is_empty() {
        log::warn!(
            "in {} of {} scenes start or goal is nearer to an obstacle than --margin {}: whole \
             paths there may come as near",
            narrow.len(),
            cases.len(),
            args.terms.margin
        );
    }

    let provenance = Provenance::here(title, args.seed, config.budget, args.threads.into());
    let drives = outputs.drives().to_vec();
    outputs.finish("Evaluation", &cases, &mut rows, &[], &provenance)?;
    if args.json {
        let groups = metrics::summarise(&rows, args.seed);
        let quality = quality::summarise(&rows);
        let all = serde_json::json!({
            "provenance": provenance, "rows": rows, "groups": groups, "quality": quality,
            "drives": drives,
        });
        cli::print(format!("{all:#}"))?;
    } else {
        let mut text = report::text(&rows, args.seed);
        if args.drive {
            text += &format!("\n{}", drives::table(&drives).text());
        }
        cli::print(text.trim_end())?;
    }
    // Everything is written; the exit code still says that not everything was evaluated.
    complaint.map_or(Ok(ExitCode::SUCCESS), |text| Err(BadInput(text).into()))
}

/// The scenes to plan.
struct Chosen {
    cases: Vec<Case>,
    /// What to call them in the report.
    title: String,
    /// What could not be used, if anything.
    complaint: Option<String>,
}

fn choose(args: &Args, vehicle: &Vehicle, methods: &[Method], models: &Models) -> Result<Chosen> {
    if let Some(dir) = &args.scenes {
        let terms = args.terms.terms();
        let folder = suite::from_folder(dir, args.kind, terms).or_bad_input()?;
        folder.unusable.iter().for_each(|line| log::warn!("left out: {line}"));
        let complaint = folder.complaint();
        let left_out = complaint.as_ref().map_or(String::new(), |text| format!("; {text}"));
        let title = format!("{} from {}{left_out}", folder.cases.len(), dir.display());
        return Ok(Chosen { cases: folder.cases, title, complaint });
    }
    // Without --type: all that the models of the chosen methods know.
    let known =
        |k: &ParkingType| methods.iter().all(|m| models.check_kind(*m, vehicle, *k).is_ok());
    let kinds = match args.kind {
        Some(kind) => vec![kind],
        None => ParkingType::ALL.into_iter().filter(known).collect(),
    };
    let levels = args.level.map_or(Level::ALL.to_vec(), |l| vec![l]);
    let worlds = if args.worlds.is_empty() { &[World::Home][..] } else { &args.worlds };
    if args.level.is_some() && !worlds.contains(&World::Home) {
        let text = "--level: only the world home has levels; leave it out";
        return Err(BadInput(text.to_owned()).into());
    }
    let (generator, count) = (GeneratorConfig::default(), args.count as usize);
    let (kinds, levels, seed) = (&kinds, &levels, args.seed);
    let drawn = Drawn { generator: &generator, vehicle, kinds, levels, count, seed };
    let mut cases = Vec::new();
    for &world in worlds {
        cases.extend(drawn.cases(world).or_bad_input()?);
    }
    let title = drawn.title(cases.len(), worlds);
    Ok(Chosen { cases, title, complaint: None })
}
