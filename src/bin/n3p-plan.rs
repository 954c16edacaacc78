//! One scene in, one path out.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use n3p::cli::{self, BadInput, CostArgs, MapArgs, OrBadInput, PolicyArgs, TermsArgs};
use n3p::curves::TrajectoryLimits;
use n3p::curves::smoothing::StandstillSteering;
use n3p::curves::trajectory::TrajectoryReport;
use n3p::episode;
use n3p::episode::{Case, Episode, EpisodeConfig, Judge, SpotReport};
use n3p::output::drawing::{Drawing, scene_svg};

use n3p::files::{check_writable, reason, write_whole};
use n3p::geometry::{Pose, signed_angle};
use n3p::n3p::{Method, MethodSettings, Models, catalogue};
use n3p::output::{TrajectoryFile, trajectory_svg};
use n3p::planners::goals::{self, PassedOver, Terms};
use n3p::planners::{Budget, Effort, NoPath, Problem, ProblemError};
use n3p::vehicle::Vehicle;
use n3p::world::Scene;
use n3p::world::maps::Geographic;

/// Plans a path for one parking scene.
///
/// Exit code 0: a path was found; 3: there is none (the reason is printed).
#[derive(Parser)]
#[command(version = cli::VERSION)]
struct Args {
    /// The scene, .json or TPCAP .csv.
    #[arg(long, value_name = "FILE", required_unless_present_any = ["list_models", "map"])]
    scene: Option<PathBuf>,
    /// A map instead: an occupancy grid (.yaml), points (.csv, .pcd), .geojson, CommonRoad (.xml), OpenDRIVE
    /// (.xodr), or a scene.
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    map: Option<PathBuf>,
    /// List the models there are, for which vehicles, and from where; then stop.
    #[arg(long = "models")]
    list_models: bool,
    /// The method [default: n3p where a model fits the scene, else ha-rs].
    #[arg(long, value_name = "NAME")]
    method: Option<Method>,
    /// A trained model; may be given several times [default: knn.bin, or
    /// mlp-TYPE.safetensors or rl-ENV.safetensors, in the working folder or in models/].
    #[arg(long = "model", value_name = "FILE")]
    models: Vec<String>,
    #[command(flatten)]
    policy: PolicyArgs,
    #[command(flatten)]
    terms: TermsArgs,
    #[command(flatten)]
    cost: CostArgs,
    /// Write the path to this .json, .csv or .geojson file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw scene and path to this SVG file.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write the trajectory, the path in time, to this .csv, .json or .geojson file, as poses and twists to
    /// this .ros.json file, or as a recording for viewers, with the scene, to this .mcap file. The steering is continuous then, as with --standstill-steering at-changes,
    /// where such a path is found; else the car stops to steer.
    #[arg(long, value_name = "FILE", value_parser = TrajectoryFile::file_name)]
    trajectory: Option<PathBuf>,
    /// Draw the speed, the steering angle and the curvature of the trajectory over time to this SVG file.
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    trajectory_svg: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    /// Expansion budget.
    #[arg(long, default_value_t = 200_000, value_name = "N")]
    max_expansions: usize,
    /// What becomes of a first path: "first" takes it as it is, "usual" looks for better where it
    /// costs more than usual, "most" always does, with half of the budget.
    #[arg(long, default_value_t, value_name = "first|usual|most")]
    effort: Effort,
    #[command(flatten)]
    limits: Limits,
    #[command(flatten)]
    maps: MapArgs,
}

/// Limits of the trajectory; those of speed are the scene's.
#[derive(clap::Args)]
#[command(next_help_heading = "With --trajectory")]
#[group(requires = "trajectory")]
struct Limits {
    /// Largest acceleration and braking, m/s².
    #[arg(long, value_name = "M/S2", value_parser = acceleration, allow_negative_numbers = true)]
    #[arg(default_value_t = TrajectoryLimits::default().forward_acceleration)]
    acceleration: f64,
    /// The same in backward gear [default: as --acceleration].
    #[arg(long, value_name = "M/S2", value_parser = acceleration, allow_negative_numbers = true)]
    backward_acceleration: Option<f64>,
    /// Largest lateral acceleration, m/s².
    #[arg(long, value_name = "M/S2", value_parser = acceleration, allow_negative_numbers = true)]
    #[arg(default_value_t = TrajectoryLimits::default().lateral_acceleration)]
    lateral_acceleration: f64,
    /// How fast the acceleration changes at most, m/s³.
    #[arg(long, value_name = "M/S3", value_parser = jerk, allow_negative_numbers = true)]
    #[arg(default_value_t = TrajectoryLimits::default().jerk)]
    jerk: f64,
    /// How fast the front wheels turn, rad/s [default: the vehicle's].
    #[arg(long, value_name = "RAD/S", value_parser = steer_rate, allow_negative_numbers = true)]
    steer_rate: Option<f64>,
    /// Stop wherever the steering angle jumps, and turn the wheels there.
    #[arg(long)]
    stop_to_steer: bool,
}

fn acceleration(text: &str) -> std::result::Result<f64, String> {
    cli::within(text, TrajectoryLimits::ACCELERATIONS, "m/s²")
}

fn jerk(text: &str) -> std::result::Result<f64, String> {
    cli::within(text, TrajectoryLimits::JERKS, "m/s³")
}

fn steer_rate(text: &str) -> std::result::Result<f64, String> {
    cli::within(text, TrajectoryLimits::STEER_RATES, "rad/s")
}

impl Args {
    /// The file, the scene that it is or, with what else is given, becomes, and where on Earth that lies.
    fn scene(&self) -> Result<(&Path, Scene, Option<Geographic>)> {
        let Some(file) = self.map.as_deref() else {
            let file = self.scene.as_deref().expect("clap asks for it");
            if self.maps.is_given() {
                let text =
                    "--start, --goal, --vehicle: --scene has all of them; give --map FILE instead";
                return Err(BadInput(text.to_owned()).into());
            }
            return Ok((file, Scene::read(file).or_bad_input()?, None));
        };
        let request = self.maps.request()?;
        let map = self.maps.read(file)?;
        let scene = map.scene(&request).or_bad_input()?;
        Ok((file, scene, map.geographic))
    }

    /// Where the wheels may turn at standstill: as told, else as little as need be where the path is to be
    /// driven.
    fn standstill(&self) -> StandstillSteering {
        let usual = match self.trajectory {
            Some(_) if !self.limits.stop_to_steer => StandstillSteering::AtChanges,
            _ => StandstillSteering::Anywhere,
        };
        self.terms.standstill_steering.unwrap_or(usual)
    }
}

impl Limits {
    fn settings(&self, vehicle: &Vehicle) -> TrajectoryLimits {
        TrajectoryLimits {
            forward_acceleration: self.acceleration,
            backward_acceleration: self.backward_acceleration.unwrap_or(self.acceleration),
            lateral_acceleration: self.lateral_acceleration,
            jerk: self.jerk,
            steer_rate: self.steer_rate.unwrap_or(vehicle.steer_rate),
            stop_to_steer: self.stop_to_steer,
        }
    }
}

/// Who looks at the path before anybody drives it.
#[cfg(feature = "lab")]
const JUDGE: Judge = n3p::lab::evaluation::oracle::JUDGE;
#[cfg(not(feature = "lab"))]
const JUDGE: Judge = episode::CERTIFICATE;

fn main() -> ExitCode {
    // SAFETY: the first statement of the program, which has started no thread.
    #[cfg(feature = "lab")]
    unsafe {
        n3p::lab::training::single_threaded();
    };
    cli::run(|| plan(&cli::parse()))
}

fn plan(args: &Args) -> Result<ExitCode> {
    if args.list_models {
        return list_models(args.json);
    }
    let (file, scene, on_earth) = args.scene()?;
    let file = file.display();
    let terms = args.terms.terms();
    let problem = goals::first_problem(&scene, terms).map_err(|e| {
        let than = format!(" (--allow-contact {} m is not enough)", args.terms.allow_contact);
        let more = if args.terms.allow_contact > 0.0 { &than } else { "" };
        BadInput(format!("{file}: {e}{more}; move it to where the car fits"))
    })?;
    let unwritable = |path: &Path, e: io::Error| {
        let text =
            format!("{}: cannot be written: {}; choose another file", path.display(), reason(&e));
        anyhow::Error::from(BadInput(text))
    };
    let outputs = args.out.iter().chain(&args.svg).chain(&args.trajectory);
    for path in outputs.chain(&args.trajectory_svg) {
        check_writable(path).map_err(|e| unwritable(path, e))?;
    }
    let (method, models) = choose(args, &scene, &problem)?;
    let mut planner = method.build(&models, &args.cost.settings()?).or_bad_input()?;
    let case = Case { kind: problem.kind, level: None, set: String::new(), scene };
    // One run, as it comes: the time includes what a first call costs.
    let budget = Budget { max_expansions: args.max_expansions, effort: args.effort };
    let usual = EpisodeConfig::new(budget);
    // Who drives a path wants one that can be driven without stops to steer.
    let terms = Terms { standstill: args.standstill(), ..terms };
    let once = EpisodeConfig { repeats: 0, terms, ..usual };
    let mut episode = episode::run(&case, planner.as_mut(), &once, &JUDGE)?;
    let is_not_smooth = episode.result.outcome.as_ref().err() == Some(&NoPath::NotSmooth);
    let stops = is_not_smooth && args.terms.standstill_steering.is_none();
    if stops {
        log::warn!(
            "no path on which the steering is continuous was found: the car stops to steer on this one"
        );
        let terms = Terms { standstill: StandstillSteering::Anywhere, ..terms };
        episode = episode::run(&case, planner.as_mut(), &EpisodeConfig { terms, ..once }, &JUDGE)?;
    }
    tell(&case.scene, &episode);
    let kept = &episode.problem;
    if kept.margin < args.terms.margin && kept.contact.is_none() {
        log::warn!(
            "start or goal is nearer to an obstacle than --margin {}: the path may come as near as \
             {} m to that obstacle",
            args.terms.margin,
            kept.margin
        );
    }
    // From here on the scene has the goal that was chosen.
    let whole = case.scene;
    let scene = whole.with_goal(whole.all_goals()[episode.goal_index]);

    if let (Some(out), Some(path)) = (&args.out, &episode.path) {
        path.write_as(out, on_earth).or_bad_input()?;
    }
    if let Some(svg) = &args.svg {
        let picture = picture(&whole, &scene, &episode, method, &models);
        write_whole(svg, picture.as_bytes()).map_err(|e| unwritable(svg, e))?;
    }
    // Nobody should drive a path that the independent check refuses.
    let trajectory = match (&args.trajectory, episode.result.driven()) {
        (Some(file), Some(path)) if episode.row.ok => {
            let (frame, limits) = (&episode.problem.frame, args.limits.settings(&scene.vehicle));
            let stop_to_steer = limits.stop_to_steer || stops;
            let limits = TrajectoryLimits { stop_to_steer, ..limits };
            let made = TrajectoryFile::new(&scene, frame, &path, method.name(), limits)?;
            made.write_with(file, &scene, on_earth).map_err(|e| unwritable(file, e))?;
            if let Some(svg) = &args.trajectory_svg {
                let plot = trajectory_svg(&made);
                write_whole(svg, plot.as_bytes()).map_err(|e| unwritable(svg, e))?;
            }
            Some(made.report)
        }
        _ => None,
    };
    if args.json {
        let Episode { row, path, problem, .. } = &episode;
        let (spot, margin) = (SpotReport::new(&episode, &models), problem.margin);
        let covered = episode.result.covered;
        let contact = problem.contact.as_ref();
        let contact =
            contact.map(|c| serde_json::json!({"start": c.start_depth, "goal": c.goal_depth}));
        let goal = path.as_ref().filter(|_| !whole.goals.is_empty()).map(|_| episode.goal_index);
        let mut result = serde_json::json!({
            "row": row, "path": path, "margin_m": margin, "covered": covered, "spot": spot,
            "goal_index": goal, "contact_m": contact,
        });
        if let Some(report) = &trajectory {
            result["trajectory"] = serde_json::json!(report);
        }
        cli::print(result)?;
    } else {
        let spot = SpotReport::new(&episode, &models).map(|s| {
            format!(
                "
{s}"
            )
        });
        let time = trajectory.as_ref().map(in_time);
        cli::print(
            summary(&whole, &episode) + &spot.unwrap_or_default() + &time.unwrap_or_default(),
        )?;
    }
    match (&episode.path, episode.row.ok) {
        (None, _) => Ok(ExitCode::from(cli::EXIT_NO_PATH)),
        (Some(_), true) => Ok(ExitCode::SUCCESS),
        (Some(_), false) => anyhow::bail!(
            "{file}: our bug: the path was {}: {}",
            episode.row.reason,
            episode.row.checked
        ),
    }
}

/// What models there are, a line each; one that cannot be used is told, and the exit code says so.
fn list_models(json: bool) -> Result<ExitCode> {
    let (mut listings, mut faults) = (Vec::new(), Vec::new());
    for entry in catalogue() {
        match entry {
            Ok(listing) => listings.push(listing),
            Err(fault) => faults.push(fault.to_string()),
        }
    }
    if json {
        cli::print(serde_json::json!({ "models": listings, "unusable": faults }))?;
    } else {
        let lines: Vec<String> =
            listings.iter().map(|l| l.to_string().trim_end().to_owned()).collect();
        cli::print(if lines.is_empty() { "no models".to_owned() } else { lines.join("\n") })?;
    }
    match &faults[..] {
        [] => Ok(ExitCode::SUCCESS),
        faults => Err(BadInput(faults.join("; ")).into()),
    }
}

/// The method and its models: as told, or the best that fits the scene.
fn choose(args: &Args, scene: &Scene, problem: &Problem) -> Result<(Method, Models)> {
    let policy = args.policy.driver()?;
    let usual = if policy.is_some() { Method::POLICY } else { Method::N3P };
    let method = args.method.unwrap_or(usual);
    if policy.is_some() && method != Method::POLICY {
        let text = format!("--policy: --method is {method}, not policy; leave one of them out");
        return Err(BadInput(text).into());
    }
    let models = match &args.models[..] {
        [] => Models::usual(&[method], Some(&scene.vehicle)),
        given => Models::load(given),
    };
    let models = models.or_bad_input()?.with_policy(policy);
    let fits = || -> Result<()> {
        method.build(&models, &MethodSettings::default()).or_bad_input()?;
        models.check_vehicle(method, &scene.name, &scene.vehicle).or_bad_input()?;
        let check = |kind| models.check_kind(method, &scene.vehicle, kind);
        problem.kind.map_or(Ok(()), check).or_bad_input()
    };
    let told = args.method.is_some() || !args.models.is_empty();
    match (if method.needs_model() { fits() } else { Ok(()) }, told) {
        (Ok(()), _) => Ok((method, models)),
        (Err(reason), true) => Err(reason),
        (Err(reason), false) => {
            log::info!("planning with ha-rs: {reason:#}");
            Ok((Method::HA_RS, models))
        }
    }
}

/// What was found out about goals and contact, on stderr.
fn tell(scene: &Scene, episode: &Episode) {
    for (index, reason) in &episode.passed_over {
        match reason {
            PassedOver::NotFree(ProblemError::GoalInCollision(_, conflict)) => {
                log::warn!("{} is left out: it {conflict}", scene.goal_field(*index));
            }
            // Of a single goal the result says it.
            PassedOver::NoPath(reason) if !scene.goals.is_empty() => {
                log::warn!("{} is left out: {reason}", scene.goal_field(*index));
            }
            _ => {}
        }
    }
    let Some(path) = &episode.path else { return };
    if !scene.goals.is_empty() {
        let (field, count) = (scene.goal_field(episode.goal_index), scene.goals.len());
        log::info!("the path leads to {field}, the cheapest of {count}");
    }
    if let (Some(end), true) = (path.poses.last(), scene.goal_tolerance.is_some()) {
        let goal = scene.all_goals()[episode.goal_index];
        let (apart, turn) = {
            let end = Pose::from(*end);
            (goal.distance(end), signed_angle(goal.heading, end.heading))
        };
        log::info!("it ends {apart:.3} m and {turn:.4} rad from there, within the tolerance");
    }
    if let Some(contact) = &episode.problem.contact {
        for (what, verb, depth) in
            [("start", "leaves", contact.start_depth), ("goal", "enters", contact.goal_depth)]
        {
            if depth > 0.0 {
                log::warn!(
                    "the {what} reaches {depth:.3} m into an obstacle: the path only {verb} it there"
                );
            }
        }
    }
}

fn summary(scene: &Scene, episode: &Episode) -> String {
    let row = &episode.row;
    // To a tenth of a millimetre: small vehicles keep a small part of the usual margin.
    let margin = (episode.problem.margin * 1e4).round() / 1e4;
    let time = row.plan_time_s * 1e3;
    let (Some(length), Some(changes)) = (row.length_m, row.direction_changes) else {
        let hint = if margin > Problem::MARGIN { "; try a smaller --margin" } else { "" };
        return format!(
            "{}: no path by {}: {} (margin {margin} m, after {} expansions, {time:.3} ms){hint}",
            row.scene, row.method, row.reason, row.nodes
        );
    };
    let clearance = row.min_clearance_m.map_or("nothing near".to_owned(), |c| format!("{c:.3} m"));
    let mut lines = vec![format!("{}: path by {}", row.scene, row.method)];
    if !scene.goals.is_empty() {
        lines.push(format!("  goal              {}", scene.goal_field(episode.goal_index)));
    }
    lines.extend([
        format!("  length            {length:.2} m"),
        format!("  direction changes {changes}"),
        format!("  clearance         {clearance}"),
        format!("  margin            {margin} m"),
        format!("  planning time     {time:.3} ms"),
        format!("  expansions        {}", row.nodes),
    ]);
    if let Some(guidance) = &episode.result.guidance {
        lines.push(format!("  route             {}", guidance.route.explanation()));
    }
    lines.join("\n")
}

/// What the trajectory takes, as lines of the summary.
fn in_time(report: &TrajectoryReport) -> String {
    let (time, standing) = (report.duration_s, report.standing_s);
    let jumps = match report.steer_jumps.len() {
        0 => "none".to_owned(),
        n => format!("{n}, up to {:.2} rad (none with --stop-to-steer)", report.max_steer_jump_rad),
    };
    format!(
        "\n  driving time      {time:.2} s, {standing:.2} s of it at standstill\n  \
         steering jumps    {jumps}"
    )
}

/// The scene with its chosen goal, and over it the path, what N3P made of the spot, and the goals that
/// the whole scene has besides.
fn picture(
    whole: &Scene,
    scene: &Scene,
    episode: &Episode,
    method: Method,
    models: &Models,
) -> String {
    let frame = &episode.problem.frame;
    let path = episode.result.outcome.as_ref().ok().map(|p| p.to_world(frame));
    let preparatory = episode.result.guidance.as_ref().and_then(|g| g.preparatory);
    let drawing = Drawing {
        method: Some(method.name()),
        other_goals: whole.goals.iter().copied().filter(|&goal| goal != scene.goal).collect(),
        path: path.as_ref(),
        regions: n3p::episode::regions(episode, models),
        preparatory: preparatory.map(|p| frame.world_from_local(p)),
        note: Some(episode.row.reason.as_str()).filter(|r| !r.is_empty()),
        ..Drawing::default()
    };
    scene_svg(scene, &drawing)
}
