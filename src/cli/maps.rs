//! Arguments about maps.

use std::fs;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::{BadInput, OrBadInput};
use crate::files::reason;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::{Map, MapOptions, MapRequest, tpcap};

/// How maps are read, and what is added to them.
#[derive(clap::Args)]
#[command(next_help_heading = "Maps")]
pub struct MapArgs {
    /// Start: pose of the rear axle, metres and radians [default: the map's].
    #[arg(long, value_name = "X,Y,HEADING", value_parser = pose, allow_hyphen_values = true)]
    pub start: Option<Pose>,
    /// Goal, or several with ";" between them or given several times, of which any will do [default: the
    /// map's, else both ways into its parking spaces].
    #[arg(long = "goal", value_name = "X,Y,HEADING", value_parser = pose, allow_hyphen_values = true, value_delimiter = ';')]
    pub goals: Vec<Pose>,
    /// Vehicle: a .toml file such as experiments/vehicles/tpcap.toml, a .json file of a vehicle or a scene, or
    /// "accord", the sedan of the paper 4.97 m long, or "tpcap" [default: the map's].
    #[arg(long, value_name = "FILE|NAME")]
    pub vehicle: Option<PathBuf>,
    /// What cells of an occupancy grid are of which nothing is known.
    #[arg(long, value_enum, default_value_t = Unknown::Free, value_name = "free|occupied")]
    pub unknown: Unknown,
    /// Points of a cloud count from this height on, metres.
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    pub z_min: Option<f64>,
    /// Points of a cloud count up to this height, metres.
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    pub z_max: Option<f64>,
    /// Take the borders of CommonRoad's lanelets for walls.
    #[arg(long)]
    pub borders: bool,
    /// Take coordinates of GeoJSON for metres.
    #[arg(long)]
    pub metres: bool,
}

/// What cells are of which nothing is known.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Unknown {
    /// As navigation stacks take them for planning.
    Free,
    /// In the way.
    Occupied,
}

impl MapArgs {
    /// The map at `path`, read as told.
    pub fn read(&self, path: &Path) -> anyhow::Result<Map> {
        let options = MapOptions {
            unknown_is_occupied: self.unknown == Unknown::Occupied,
            heights: [self.z_min.unwrap_or(f64::NEG_INFINITY), self.z_max.unwrap_or(f64::INFINITY)],
            borders: self.borders,
            metres: self.metres,
        };
        Map::read_with(path, &options).or_bad_input()
    }

    /// What is added to a map.
    pub fn request(&self) -> anyhow::Result<MapRequest> {
        let vehicle = self.vehicle.as_deref().map(vehicle).transpose()?;
        Ok(MapRequest { start: self.start, goals: self.goals.clone(), vehicle })
    }

    /// Whether anything is said of what a map lacks.
    pub fn is_given(&self) -> bool {
        self.start.is_some() || !self.goals.is_empty() || self.vehicle.is_some()
    }
}

fn pose(text: &str) -> Result<Pose, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|v| v.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, heading]) if Pose::new(x, y, heading).is_finite() => {
            Ok(Pose::new(x, y, heading))
        }
        _ => Err("expected three finite numbers: x and y in metres, heading in radians".to_owned()),
    }
}

/// The vehicle of a file or of a name.
pub fn vehicle(path: &Path) -> anyhow::Result<Vehicle> {
    match (path.to_str(), path.extension().and_then(|e| e.to_str())) {
        (Some("accord"), _) => Ok(Vehicle::default()),
        (Some("tpcap"), _) => Ok(tpcap::vehicle()),
        (_, Some("json")) => vehicle_of_json(path),
        #[cfg(feature = "scene")]
        (_, Some("toml")) => Vehicle::read(path).or_bad_input(),
        _ => {
            let (name, kinds) = (path.display(), VEHICLES);
            Err(BadInput(format!("--vehicle: {name} is no vehicle; expected {kinds}")).into())
        }
    }
}

const VEHICLES: &str = if cfg!(feature = "scene") {
    "a .toml or .json file, accord or tpcap"
} else {
    "a .json file, accord or tpcap (.toml files with the feature scene)"
};

/// The vehicle that a JSON file is, or has.
fn vehicle_of_json(path: &Path) -> anyhow::Result<Vehicle> {
    let bad = |e: String| BadInput(format!("{}: {e}", path.display()));
    let text = fs::read_to_string(path)
        .map_err(|e| bad(format!("cannot read vehicle: {}", reason(&e))))?;
    let mut value: serde_json::Value =
        serde_json::from_str(&text).map_err(|e| bad(format!("is not valid JSON: {e}")))?;
    if let Some(vehicle) = value.get_mut("vehicle") {
        value = vehicle.take();
    }
    let vehicle: Vehicle =
        serde_json::from_value(value).map_err(|e| bad(format!("is no vehicle: {e}")))?;
    vehicle.validate().map_err(|e| bad(e.to_string()))?;
    Ok(vehicle)
}
