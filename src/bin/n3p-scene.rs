//! Scenes and maps: generated ones, and what others made.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser, Subcommand, ValueEnum};
use n3p::cli::map_commands::{Checked, Listed, Written};
use n3p::cli::{self, BadInput, OrBadInput};
use n3p::files::{reason, remove_leftovers};
use n3p::vehicle::Vehicle;
use n3p::world::bays::{Unusual, bay};
use n3p::world::clutter::clutter;
use n3p::world::generate::{GeneratorConfig, generate, some_wide};
use n3p::world::lots::lot;
use n3p::world::{Level, ParkingType, Scene};

/// Makes files of scenes, and reads maps.
#[derive(Parser)]
#[command(version = cli::VERSION)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Writes generated scenes, a function of the arguments alone, as files NAME.json.
    Generate(Generate),
    /// Writes a map as a scene (.json) or as GeoJSON (.geojson).
    Convert(Written),
    /// Reads maps and says what they hold; of scenes also whether start and goals are free.
    Check(Checked),
    /// Draws a map as SVG.
    Draw(Written),
    /// Lists the parking spaces of a map that are free, each with the goals to give.
    Spots(Listed),
}

#[derive(Args)]
struct Generate {
    /// Where the scenes lie: "home", parking lots as in the paper, of three levels; "wide", as there,
    /// with sizes drawn far wider; "lots", whole car parks and streets; "clutter", vehicles of all sizes among anything; "bays", unusual bays.
    #[arg(long, value_enum, value_name = "WORLD")]
    world: World,
    /// Parking type; may be given several times [default: all].
    #[arg(long = "type", value_enum, value_name = "TYPE")]
    kinds: Vec<ParkingType>,
    /// Difficulty in the world "home"; may be given several times [default: all].
    #[arg(long = "level", value_enum, value_name = "LEVEL")]
    levels: Vec<Level>,
    /// Scenes of each type and level (of each type and sort of bay; of clutter in all).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_COUNT))]
    count: u32,
    /// Seed of the scenes.
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Vehicle, a TOML file such as experiments/vehicles/tpcap.toml, in the worlds "home", "wide"
    /// and "lots" [default: a sedan 4.97 m long].
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Leave the parking type out of the files.
    #[arg(long)]
    no_hint: bool,
    /// Folder of the files; it may hold no other scenes.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum World {
    Home,
    Wide,
    Lots,
    Clutter,
    Bays,
}

/// The most scenes of one type and level.
const MAX_COUNT: i64 = 100_000;

fn main() -> ExitCode {
    cli::run(|| match cli::parse::<Cli>().command {
        Command::Generate(args) => write(&args),
        Command::Convert(args) => args.convert(),
        Command::Check(args) => args.check(),
        Command::Draw(args) => args.draw(),
        Command::Spots(args) => args.list(),
    })
}

fn write(args: &Generate) -> Result<ExitCode> {
    let scenes = scenes(args)?;
    if scenes.is_empty() {
        let text = "--type: the world bays has no scenes of that type; leave it out";
        return Err(BadInput(text.to_owned()).into());
    }
    let names: Vec<String> = scenes.iter().map(|s| format!("{}.json", s.file_stem())).collect();
    prepare(&args.out, &names)?;
    for (mut scene, name) in scenes.into_iter().zip(&names) {
        if args.no_hint {
            scene.parking_type = None;
        }
        scene.write(&args.out.join(name))?;
    }
    cli::print(format!("{}: {} scenes", args.out.display(), names.len()))?;
    Ok(ExitCode::SUCCESS)
}

/// Makes the folder, and refuses one with scenes that are not to be written: whoever reads the
/// folder would take them for these.
fn prepare(folder: &Path, names: &[String]) -> Result<()> {
    let unusable = |e: &std::io::Error| {
        let text = format!("{}: cannot be an output folder: {}", folder.display(), reason(e));
        anyhow::Error::from(BadInput(text + "; choose one you can write to"))
    };
    fs::create_dir_all(folder).and_then(|()| remove_leftovers(folder)).map_err(|e| unusable(&e))?;
    let mine: HashSet<&str> = names.iter().map(String::as_str).collect();
    for entry in fs::read_dir(folder).map_err(|e| unusable(&e))? {
        let name = entry.map_err(|e| unusable(&e))?.file_name().to_string_lossy().into_owned();
        let is_scene = [".json", ".csv"].iter().any(|end| name.to_lowercase().ends_with(end));
        if is_scene && !mine.contains(&name[..]) {
            let folder = folder.display();
            let text = format!("{folder}: holds another scene, {name}; give --out a new folder");
            return Err(BadInput(text).into());
        }
    }
    Ok(())
}

fn scenes(args: &Generate) -> Result<Vec<Scene>> {
    let useless = |option: &str, is_given: bool, has_use: &[World]| -> Result<()> {
        if !is_given || has_use.contains(&args.world) {
            return Ok(());
        }
        let world = args.world.to_possible_value().expect("none is skipped");
        let text =
            format!("{option}: the world {} has no use for it; leave it out", world.get_name());
        Err(BadInput(text).into())
    };
    useless(
        "--type",
        !args.kinds.is_empty(),
        &[World::Home, World::Wide, World::Lots, World::Bays],
    )?;
    useless("--level", !args.levels.is_empty(), &[World::Home])?;
    useless("--vehicle", args.vehicle.is_some(), &[World::Home, World::Wide, World::Lots])?;
    let vehicle = match &args.vehicle {
        Some(path) => Vehicle::read(path).or_bad_input()?,
        None => Vehicle::default(),
    };
    let kinds = ParkingType::ALL.into_iter().filter(|k| chosen(&args.kinds, k));
    let (seed, numbers) = (args.seed, 0..u64::from(args.count));
    let each = |make: &dyn Fn(u64) -> Scene| numbers.clone().map(make).collect::<Vec<_>>();
    Ok(match args.world {
        World::Home => {
            let config = GeneratorConfig::default();
            config.validate(&vehicle).or_bad_input()?;
            let levels = Level::ALL.into_iter().filter(|l| chosen(&args.levels, l));
            let settings = kinds.flat_map(|k| levels.clone().map(move |l| (k, l)));
            let of = |(k, l)| each(&|i| generate(&config, &vehicle, k, l, seed, i));
            settings.flat_map(of).collect()
        }
        World::Wide => {
            let count = args.count as usize;
            let of = kinds.map(|k| some_wide(&vehicle, k, seed, count));
            of.collect::<Result<Vec<_>, _>>().or_bad_input()?.concat()
        }
        World::Lots => kinds.flat_map(|k| each(&|i| lot(&vehicle, k, seed, i))).collect(),
        World::Clutter => each(&|i| clutter(seed, i)),
        World::Bays => {
            let of = |u: Unusual| u.kinds().iter().map(move |&k| (u, k));
            let sorts = Unusual::ALL.into_iter().flat_map(of);
            let sorts = sorts.filter(|(_, k)| chosen(&args.kinds, k));
            sorts.flat_map(|(u, k)| each(&|i| bay(u, k, seed, i))).collect()
        }
    })
}

/// Whether something is among those given, or none are.
fn chosen<T: PartialEq>(given: &[T], one: &T) -> bool {
    given.is_empty() || given.contains(one)
}
