//! What `n3p-scene` does with maps: convert, check and draw them, and list their parking spaces.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use serde_json::json;

use super::{BadInput, MapArgs, OrBadInput, print};
use crate::files::{reason, write_whole};
use crate::geometry::{Polygon, Pose, Vec2};
use crate::output::drawing::{Drawing, scene_svg};
use crate::planners::{Problem, ProblemError};
use crate::vehicle::Vehicle;
use crate::world::free_spots::SpotKind;
use crate::world::maps::Spot;
use crate::world::{Map, MapRequest, Scene};

/// A map, and where what becomes of it is written.
#[derive(clap::Args)]
pub struct Written {
    /// The map: .yaml (occupancy grid), .csv or .pcd (points), .geojson, .json, .xml (CommonRoad), .xodr (OpenDRIVE).
    #[arg(value_name = "FILE")]
    map: PathBuf,
    /// The file to write.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    #[command(flatten)]
    args: MapArgs,
    /// Mark the places where the vehicle may park, found between what stands there, instead of marked ones.
    #[arg(long)]
    find_spots: bool,
}

/// Maps to look at.
#[derive(clap::Args)]
pub struct Checked {
    /// The maps or scenes.
    #[arg(value_name = "FILE", required = true)]
    maps: Vec<PathBuf>,
    #[command(flatten)]
    args: MapArgs,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// A map to park in.
#[derive(clap::Args)]
pub struct Listed {
    /// The map. Where it marks no parking spaces (OpenDRIVE, or GeoJSON with the role "spot"), they are looked for
    /// between what stands there.
    #[arg(value_name = "FILE")]
    map: PathBuf,
    #[command(flatten)]
    args: MapArgs,
    /// Look for places between what stands there also where spots are marked.
    #[arg(long)]
    find: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Written {
    /// The map with what was given besides.
    fn read(&self) -> Result<Map> {
        let mut map = self.args.read(&self.map)?;
        let request = self.args.request()?;
        map.add(&request);
        if self.find_spots {
            let found = map.free_spots(&vehicle(&map)?).or_bad_input()?;
            map.spots = found.into_iter().map(|free| free.spot).collect();
        }
        Ok(map)
    }

    /// Writes the map as a scene (`.json`) or as GeoJSON.
    pub fn convert(&self) -> Result<ExitCode> {
        let map = self.read()?;
        let ending = self.out.extension().and_then(|e| e.to_str()).unwrap_or_default();
        match &ending.to_ascii_lowercase()[..] {
            "json" => {
                map.scene(&self.args.request()?).or_bad_input()?.write(&self.out).or_bad_input()?
            }
            "geojson" => self.write(&(map.to_geojson() + "\n"))?,
            _ => {
                let out = self.out.display();
                let text = format!(
                    "{out}: cannot be written as such; expected .json (a scene) or .geojson"
                );
                return Err(BadInput(text).into());
            }
        }
        print(format!("{}: {}", self.out.display(), counts(&map)))?;
        Ok(ExitCode::SUCCESS)
    }

    /// Draws the map as SVG.
    pub fn draw(&self) -> Result<ExitCode> {
        let map = self.read()?;
        let request = self.args.request()?;
        let spots = map.spots.iter().map(|spot| {
            let corners = spot.corners().into_iter().map(Vec2::from);
            Polygon::new(corners.collect())
        });
        let spots = spots.collect::<Result<Vec<_>, _>>().or_bad_input()?;
        let svg = match map.scene(&request) {
            Ok(scene) => {
                let other_goals = scene.goals.iter().skip(1).copied().collect();
                scene_svg(&scene, &Drawing { other_goals, spots, ..Drawing::default() })
            }
            // Without start and goal the place alone.
            Err(_) => {
                let [x0, y0, x1, y1] = map.extent().ok_or_else(|| {
                    BadInput(format!("{}: holds nothing to draw", self.map.display()))
                })?;
                let middle = Pose::new(f64::midpoint(x0, x1), f64::midpoint(y0, y1), 0.0);
                let mut map = map;
                map.add(&MapRequest {
                    start: Some(middle),
                    goals: vec![middle],
                    vehicle: map.vehicle.is_none().then(Vehicle::default),
                });
                let scene = map.scene(&MapRequest::default()).or_bad_input()?;
                scene_svg(&scene, &Drawing { is_place_alone: true, spots, ..Drawing::default() })
            }
        };
        self.write(&svg)?;
        Ok(ExitCode::SUCCESS)
    }

    fn write(&self, text: &str) -> Result<()> {
        write_whole(&self.out, text.as_bytes()).map_err(|e| {
            let (out, why) = (self.out.display(), reason(&e));
            BadInput(format!("{out}: cannot be written: {why}; choose another file")).into()
        })
    }
}

impl Checked {
    /// Says of each map what it is, and of scenes whether their start and goals are free.
    pub fn check(&self) -> Result<ExitCode> {
        for path in &self.maps {
            let mut map = self.args.read(path)?;
            map.add(&self.args.request()?);
            let is_scene = map.start.is_some()
                && map.vehicle.is_some()
                && !(map.goals.is_empty() && map.spots.is_empty());
            let scene =
                is_scene.then(|| map.scene(&Default::default())).transpose().or_bad_input()?;
            let places = scene.as_ref().map(places).transpose()?;
            if self.json {
                print(json!({
                    "file": path, "name": map.name, "source": map.source,
                    "obstacles": map.obstacles.len(), "polylines": map.polylines.len(),
                    "points": map.points.len(), "spots": map.spots.len(), "extent_m": map.extent(),
                    "has_start": map.start.is_some(), "goals": map.goals.len(),
                    "origin_wgs84": map.geographic, "vehicle": map.vehicle, "free_goals": places,
                }))?;
                continue;
            }
            let size = map.extent().map_or("nothing".to_owned(), |[x0, y0, x1, y1]| {
                format!("{:.1} × {:.1} m from ({x0:.2}, {y0:.2})", x1 - x0, y1 - y0)
            });
            let mut lines = vec![
                format!("{}: {}", path.display(), map.source),
                format!("  holds    {}", counts(&map)),
                format!("  extent   {size}"),
            ];
            if let Some(origin) = map.geographic {
                lines.push(format!("  origin   {}° E, {}° N", origin.longitude, origin.latitude));
            }
            if let (Some(free), Some(scene)) = (places, &scene) {
                lines.push(format!(
                    "  start    free; {free} of {} goals free",
                    scene.all_goals().len()
                ));
            } else {
                let lacks = [
                    ("start", map.start.is_none()),
                    ("goal", map.goals.is_empty() && map.spots.is_empty()),
                    ("vehicle", map.vehicle.is_none()),
                ];
                let lacks: Vec<&str> =
                    lacks.iter().filter(|(_, is)| *is).map(|(name, _)| *name).collect();
                lines.push(format!("  lacks    {}", lacks.join(", ")));
            }
            print(lines.join("\n"))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// How many goals of a scene are free. That its start is not, or none of them, is an error.
fn places(scene: &Scene) -> Result<usize> {
    let (mut free, mut first) = (0, None);
    for (i, &goal) in scene.all_goals().iter().enumerate() {
        match Problem::new(&scene.with_goal(goal)) {
            Ok(_) => free += 1,
            Err(ProblemError::GoalInCollision(_, conflict)) => {
                first.get_or_insert((scene.goal_field(i), conflict));
            }
            Err(other) => return Err(BadInput(format!("{}: {other}", scene.name)).into()),
        }
    }
    match (free, first) {
        (0, Some((field, conflict))) => {
            let text = format!("{}: no goal is free: {field} {conflict}", scene.name);
            Err(BadInput(text).into())
        }
        _ => Ok(free),
    }
}

impl Listed {
    /// Prints the parking spaces of a map, marked or found, with the poses of a car in them.
    pub fn list(&self) -> Result<ExitCode> {
        let mut map = self.args.read(&self.map)?;
        map.add(&self.args.request()?);
        let vehicle = vehicle(&map)?;
        let is_found = self.find || map.spots.is_empty();
        let all: Vec<(Option<SpotKind>, Spot)> = if is_found {
            let found = map.free_spots(&vehicle).or_bad_input()?.into_iter();
            found.map(|free| (Some(free.kind), free.spot)).collect()
        } else {
            map.spots.iter().map(|spot| (None, spot.clone())).collect()
        };
        let mut spots = Vec::new();
        for (kind, spot) in &all {
            spots.push((kind, spot, free_goals(&map, spot, &vehicle)?));
        }
        if self.json {
            let spots = spots.iter().map(|(kind, spot, goals)| {
                json!({
                    "name": spot.name, "type": kind, "middle": spot.middle, "length_m": spot.length,
                    "width_m": spot.width, "goals": goals,
                })
            });
            print(json!({ "spots": spots.collect::<Vec<_>>() }))?;
            return Ok(ExitCode::SUCCESS);
        }
        let free = spots.iter().filter(|(_, _, goals)| !goals.is_empty());
        let mut lines: Vec<String> = free.map(|(_, spot, goals)| line(spot, goals)).collect();
        let (all, free, map) = (spots.len(), lines.len(), self.map.display());
        lines.push(if is_found {
            format!("{map}: {free} free spots found for the vehicle")
        } else {
            format!("{map}: {free} of {all} spots are free for the vehicle")
        });
        print(lines.join("\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The vehicle for which spots are free.
fn vehicle(map: &Map) -> Result<Vehicle> {
    let missing =
        || BadInput("--vehicle: is missing; spots are free for a vehicle".to_owned()).into();
    map.vehicle.ok_or_else(missing)
}

fn line(spot: &Spot, goals: &[Pose]) -> String {
    let pose = |p: &Pose| format!("{:.3},{:.3},{:.4}", p.x, p.y, p.heading);
    let goals: Vec<String> = goals.iter().map(pose).collect();
    let Spot { name, length, width, .. } = spot;
    format!("{name:<16} {length:.2} × {width:.2} m  --goal {}", goals.join(";"))
}

/// The poses of a car in a spot at which it touches nothing.
fn free_goals(map: &Map, spot: &Spot, vehicle: &Vehicle) -> Result<Vec<Pose>> {
    let mut free = Vec::new();
    for goal in spot.goals(vehicle) {
        let request = MapRequest { start: Some(goal), goals: vec![goal], vehicle: Some(*vehicle) };
        let scene = map.scene(&request).or_bad_input()?;
        match Problem::new(&scene) {
            Ok(_) => free.push(goal),
            Err(ProblemError::StartInCollision(..) | ProblemError::GoalInCollision(..)) => {}
            Err(other) => return Err(BadInput(other.to_string()).into()),
        }
    }
    Ok(free)
}

/// How much there is of what.
fn counts(map: &Map) -> String {
    let low = &map.low;
    let lows = low.obstacles.len() + low.polylines.len() + low.points.len();
    let counts = [
        (map.obstacles.len(), "obstacle"),
        (map.polylines.len(), "polyline"),
        (map.points.len(), "point"),
        (lows, "low thing"),
        (map.spots.len(), "spot"),
        (usize::from(map.drivable_area.is_some()), "drivable area"),
        (usize::from(map.start.is_some()), "start"),
        (map.goals.len(), "goal"),
    ];
    let counts = counts.iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> =
        counts.map(|(n, what)| format!("{n} {what}{}", if *n == 1 { "" } else { "s" })).collect();
    if counts.is_empty() { "nothing".to_owned() } else { counts.join(", ") }
}
