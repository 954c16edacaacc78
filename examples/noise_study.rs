//! How much margin makes up for how much sensor noise?
//!
//! `cargo run --release --example noise_study -- [COUNT] [SEED]` prints two Markdown tables
//! (COUNT 20, SEED 31415 if left out).
//!
//! COUNT scenes of every type and level are generated: these are the truth. The planners see
//! them as a range sensor might: no polygons, only points on their outlines, at most 5 cm apart,
//! each of them off by a normal error of standard deviation σ in x and in y. They plan with the
//! margin of the table's line, and the path is checked against the *true* scene by the
//! independent oracle. The same errors, scaled by σ, serve every line, so lines differ by σ and
//! margin alone.
//!
//! In the first table every point has an error of its own. Some of many points are always too
//! near, so obstacles only look thicker than they are. In the second table all points of an
//! obstacle share one error: it stands elsewhere, as when the car's own position is uncertain.
//!
//! Columns: *blocked* scenes, where a point lies inside the car at its start or goal, so that
//! nothing is planned; scenes with *less* margin than asked, because a point is nearer than that
//! to start or goal; and of each method how often there was *no path* although the scene was not
//! blocked, how many of its paths hit (*collisions*) a true obstacle, and their mean length.
//! Points have no inside, which does not matter here: no gap between them lets a car through.

use n3p::episode::Case;
use n3p::lab::evaluation::oracle::{self, Violation};
use n3p::lab::evaluation::suite;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::output::PathFile;
use n3p::planners::{Budget, Planner, Problem};
use n3p::rng::{Stream, rng};
use n3p::world::{Level, ParkingType, Scene};
use rand::RngExt;
use rand_distr::StandardNormal;

/// Distance between neighbouring points of an outline, metres; at most.
const SPACING: f64 = 0.05;
/// Standard deviations of the noise, metres.
const NOISE: [f64; 5] = [0.0, 0.01, 0.02, 0.03, 0.05];
/// Margins asked for, metres.
const MARGINS: [f64; 5] = [Problem::MARGIN, 0.02, 0.05, 0.10, 0.15];
const METHODS: [Method; 2] = [Method::N3P, Method::HA_RS];
const BUDGET: Budget = Budget::new(50_000);

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let count = args.first().map_or(Ok(20), |s| s.parse())?;
    let seed = args.get(1).map_or(Ok(31415), |s| s.parse())?;

    let models = Models::load(&["models/knn.bin"])?;
    let vehicle = models.vehicle().unwrap_or_default();
    let cases = suite::at_home(&vehicle, &ParkingType::SQUARE, &Level::ALL, count, seed)?;
    let mut planners = Vec::new();
    for method in METHODS {
        planners.push(method.build(&models, &MethodSettings::default())?);
    }

    println!("{} scenes: {count} of each type and level, seed {seed}\n", cases.len());
    for errors in [Errors::OfPoints, Errors::OfObstacles] {
        table(errors, &cases, seed, &mut planners)?;
    }
    Ok(())
}

/// Prints the table of one kind of errors.
fn table(
    errors: Errors,
    cases: &[Case],
    seed: u64,
    planners: &mut [Box<dyn Planner + Send>],
) -> anyhow::Result<()> {
    let seen = (0..).zip(cases).map(|(index, case)| Seen::new(&case.scene, errors, seed, index));
    let seen: Vec<Seen> = seen.collect();
    println!("{}:\n", errors.title());
    print!("| σ, cm | margin, cm | blocked | less |");
    METHODS.iter().for_each(|m| print!(" `{m}`: no path | collisions | length, m |"));
    println!("\n|--:|--:|--:|--:|{}", "--:|--:|--:|".repeat(METHODS.len()));
    for sigma in NOISE {
        let scenes: Vec<Scene> = seen.iter().map(|s| s.scene(sigma)).collect();
        for margin in MARGINS {
            let problems: Vec<_> =
                scenes.iter().map(|s| Problem::with_margin(s, margin).ok()).collect();
            let blocked = problems.iter().filter(|p| p.is_none()).count();
            let less = problems.iter().flatten().filter(|p| p.margin < margin).count();
            print!("| {} | {} | {blocked} | {less} |", 100.0 * sigma, 100.0 * margin);
            for planner in planners.iter_mut() {
                let t = Tally::of(planner.as_mut(), cases, &problems)?;
                let length = t.metres / t.paths as f64;
                print!(" {} | {} of {} | {length:.2} |", t.no_path, t.collisions, t.paths);
            }
            println!();
        }
    }
    println!();
    Ok(())
}

/// What has an error of its own.
#[derive(Clone, Copy, PartialEq)]
enum Errors {
    OfPoints,
    OfObstacles,
}

impl Errors {
    fn title(self) -> &'static str {
        match self {
            Errors::OfPoints => "Every point has an error of its own",
            Errors::OfObstacles => "All points of an obstacle share one error",
        }
    }
}

/// A scene as points, and the error of each in units of σ.
struct Seen<'a> {
    truth: &'a Scene,
    points: Vec<[f64; 2]>,
    errors: Vec<[f64; 2]>,
}

impl<'a> Seen<'a> {
    /// The outlines of `truth`, the scene `index`.
    fn new(truth: &'a Scene, kind: Errors, seed: u64, index: u64) -> Self {
        let mut rng = rng(seed, Stream::Noise, index);
        let mut draw = || [(); 2].map(|()| rng.sample(StandardNormal));
        let (mut points, mut errors) = (Vec::new(), Vec::new());
        let obstacles = truth.geometry().expect("generated scenes are valid");
        for polygon in obstacles.polygons() {
            let shared = draw();
            for (a, b) in polygon.edges() {
                let steps = ((b - a).norm() / SPACING).ceil().max(1.0);
                for k in 0..steps as u32 {
                    points.push((a + (b - a) * (f64::from(k) / steps)).into());
                    errors.push(if kind == Errors::OfPoints { draw() } else { shared });
                }
            }
        }
        Self { truth, points, errors }
    }

    /// What the planner is given.
    fn scene(&self, sigma: f64) -> Scene {
        let points = self.points.iter().zip(&self.errors);
        let points = points.map(|([x, y], [ex, ey])| [x + sigma * ex, y + sigma * ey]).collect();
        Scene { obstacles: Vec::new(), points, ..self.truth.clone() }
    }
}

/// What became of the scenes that were not blocked.
#[derive(Default)]
struct Tally {
    no_path: usize,
    paths: usize,
    collisions: usize,
    metres: f64,
}

impl Tally {
    /// Plans `problems` and checks the paths against `cases`, the truth.
    fn of(
        planner: &mut dyn Planner,
        cases: &[Case],
        problems: &[Option<Problem>],
    ) -> anyhow::Result<Self> {
        let mut tally = Self::default();
        let problems = cases.iter().zip(problems).filter_map(|(c, p)| Some((c, p.as_ref()?)));
        for (Case { scene, .. }, problem) in problems {
            let Ok(path) = planner.plan(problem, BUDGET).outcome else {
                tally.no_path += 1;
                continue;
            };
            tally.paths += 1;
            tally.metres += path.length();
            let file = PathFile::new(scene, &problem.frame, &path, planner.name());
            match oracle::check(scene, &file) {
                Ok(_) => {}
                Err(Violation::Collision { .. }) => tally.collisions += 1,
                Err(other) => anyhow::bail!("{}: {other}", scene.name),
            }
        }
        Ok(tally)
    }
}
