//! Maps: what people have of the place to park in, read into what a [`Scene`] holds.
//!
//! A map may lack what a scene needs: start, goal and vehicle. [`Map::read`] takes any file there is a reader for, and
//! [`Map::scene`] adds what is missing. In reading order: `cloud` and `pcd` (points), `geojson` with `rings` and `geographic` (from WGS-84 to
//! metres and back); with the feature `maps` also `grid` with `image` and `cells` (occupancy grids), `commonroad` and
//! `opendrive` with `xml`. Scene files are maps as well. The formats are described in `docs/formats.md`.

pub(crate) mod cells;
mod cloud;
#[cfg(feature = "maps")]
mod commonroad;
mod geographic;
mod geojson;
mod geojson_file;
#[cfg(feature = "maps")]
mod grid;
#[cfg(feature = "maps")]
mod image;
#[cfg(feature = "maps")]
mod opendrive;
mod pcd;
mod rings;
#[cfg(feature = "maps")]
mod xml;

use std::path::{Path, PathBuf};
use std::{fs, io};

pub use geographic::Geographic;
pub(crate) use geojson_file::{collection, feature, line_string, point};

use super::free_spots::{FreeSpot, free_spots};
use super::goals::GoalTolerance;
use super::scene::{SceneError, stem};
use super::scene_file::parse_json;
use super::{DrivableArea, LowObstacles, ParkingType, PreviousPath, Scene, tpcap};
use crate::geometry::{Pose, wrap_angle};
use crate::vehicle::{Margins, Vehicle};

/// A place to park in, in its own frame; metres and radians. Fields are those of a [`Scene`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// Name; that of the file where it says none.
    pub name: String,
    /// Where it comes from, for people.
    pub source: String,
    /// The car, where the map says.
    pub vehicle: Option<Vehicle>,
    /// The car's outline from above.
    pub contour: Vec<[f64; 2]>,
    /// Clearance to keep on each side of the car.
    pub margins: Option<Margins>,
    /// Where the car starts, where the map says.
    pub start: Option<Place>,
    /// Angle of the front wheels there, radians.
    pub start_steer: f64,
    /// The path that the car follows already, if there is one.
    pub previous: Option<PreviousPath>,
    /// Where the car may park, where the map says.
    pub goals: Vec<Place>,
    /// Marked places to park in. They are goals where nothing else is.
    pub spots: Vec<Spot>,
    /// How far from its goal a path may end.
    pub goal_tolerance: Option<GoalTolerance>,
    /// How the goal lies in its spot.
    pub parking_type: Option<ParkingType>,
    /// Solid polygons.
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// Chains of walls.
    pub polylines: Vec<Vec<[f64; 2]>>,
    /// Single points.
    pub points: Vec<[f64; 2]>,
    /// What only wheels must keep off.
    pub low: LowObstacles,
    /// Where the car's body must stay.
    pub drivable_area: Option<DrivableArea>,
    /// The rear axle stays in `[xmin, ymin, xmax, ymax]`.
    pub bounds: Option<[f64; 4]>,
    /// Where on Earth the map's frame lies, where it is known.
    pub geographic: Option<Geographic>,
    /// The file, for messages.
    path: PathBuf,
}

/// A pose, and of what: not every format means the rear axle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Of the rear axle's centre.
    RearAxle(Pose),
    /// Of the middle of the car's body.
    Middle(Pose),
}

impl Place {
    /// The pose of the rear axle's centre.
    pub fn rear_axle(self, vehicle: &Vehicle) -> Pose {
        match self {
            Self::RearAxle(pose) => pose,
            Self::Middle(pose) => vehicle.rear_axle(pose),
        }
    }
}

/// A marked place to park in.
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    /// What the file calls it.
    pub name: String,
    /// Its middle; the heading along its length, either way.
    pub middle: Pose,
    /// Along the heading, metres.
    pub length: f64,
    /// Across it, metres.
    pub width: f64,
}

impl Spot {
    /// The poses of a car parked in its middle, both ways, headings in (−π, π]; none where the car is longer or wider.
    pub fn goals(&self, vehicle: &Vehicle) -> Vec<Pose> {
        let Pose { x, y, heading } = self.middle;
        let fits = vehicle.length <= self.length && vehicle.width <= self.width;
        let ways: &[f64] = if fits { &[0.0, std::f64::consts::PI] } else { &[] };
        let parked = |turn| vehicle.rear_axle(Pose::new(x, y, wrap_angle(heading + turn)));
        ways.iter().map(parked).collect()
    }
}

/// How a map is to be read, where its format leaves that open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapOptions {
    /// Whether cells of a grid of which nothing is known are obstacles. Not so by default: navigation stacks let their
    /// planners through them.
    pub unknown_is_occupied: bool,
    /// Least and largest z of a cloud's points that count, metres.
    pub heights: [f64; 2],
    /// Whether the borders of CommonRoad's lanelets are walls.
    pub borders: bool,
    /// Whether coordinates of GeoJSON are metres, also where the file does not say so.
    pub metres: bool,
}

impl Default for MapOptions {
    fn default() -> Self {
        let heights = [f64::NEG_INFINITY, f64::INFINITY];
        Self { unknown_is_occupied: false, heights, borders: false, metres: false }
    }
}

/// What is added to a map, or put in the place of what it has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapRequest {
    /// Rear-axle pose to start from.
    pub start: Option<Pose>,
    /// Rear-axle poses to park at, of which any will do.
    pub goals: Vec<Pose>,
    /// The car.
    pub vehicle: Option<Vehicle>,
}

/// Kinds of files, by their names' endings.
const KINDS: &str = ".yaml (occupancy grid), .csv or .pcd (points), .geojson, .json, .xml (CommonRoad) or .xodr (OpenDRIVE)";

impl Map {
    /// Reads a map of any known format as it is usually meant.
    pub fn read(path: &Path) -> Result<Map, SceneError> {
        Self::read_with(path, &MapOptions::default())
    }

    /// Reads a map of any known format, told by the ending of its name and its first words.
    pub fn read_with(path: &Path, options: &MapOptions) -> Result<Map, SceneError> {
        Self::of_files(path, options, &|path| fs::read(path))
    }

    /// The same where `bytes` says what files hold: the one at `path`, and of occupancy grids the image beside it.
    pub fn of_files(
        path: &Path,
        options: &MapOptions,
        bytes: &dyn Fn(&Path) -> io::Result<Vec<u8>>,
    ) -> Result<Map, SceneError> {
        let file = MapFile { path, bytes };
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let read =
            || (file.bytes)(path).map_err(|error| SceneError::Read { path: path.into(), error });
        let mut map = match &ending.to_ascii_lowercase()[..] {
            "yaml" | "yml" => file.grid(&file.text(read()?)?, options)?,
            "pcd" => pcd::read(&read()?, options, file)?,
            "csv" => {
                let text = file.text(read()?)?;
                match cloud::is_cloud(&text) {
                    true => cloud::csv(&text, options, file)?,
                    false => tpcap::parse(&text, path)?.into(),
                }
            }
            "geojson" => geojson::read(&file.text(read()?)?, options, file)?,
            "json" => {
                let text = file.text(read()?)?;
                match geojson::is_geojson(&text) {
                    true => geojson::read(&text, options, file)?,
                    false => parse_json(&text, path)?.into(),
                }
            }
            "xml" | "xodr" => file.xml(&file.text(read()?)?, options)?,
            "pgm" | "png" => {
                return Err(file.format("is the image of an occupancy grid; expected its .yaml"));
            }
            _ => return Err(file.format(format!("is no map; expected {KINDS}"))),
        };
        map.path = path.to_owned();
        if map.name.is_empty() {
            map.name = stem(path);
        }
        Ok(map)
    }

    /// The scene of this map with what is asked, validated.
    ///
    /// An error says what is missing: a scene has a vehicle, a start and at least one goal. Goals are those asked for, else
    /// the map's, else both ways into each of its spots that is large enough.
    pub fn scene(&self, request: &MapRequest) -> Result<Scene, SceneError> {
        let invalid = |field: &str, message: String| SceneError::Invalid {
            path: self.path.clone(),
            field: field.to_owned(),
            message,
        };
        let missing = |field, option| {
            invalid(field, format!("is missing: the map has none; give one (option {option})"))
        };
        let vehicle = request.vehicle.or(self.vehicle);
        let vehicle = vehicle.ok_or_else(|| missing("vehicle", "--vehicle FILE"))?;
        let start = self.start.map(|place| place.rear_axle(&vehicle));
        let is_own = request.start.is_none();
        let start = request.start.or(start);
        let start = start.ok_or_else(|| missing("start", "--start X,Y,HEADING"))?;
        let mut goals = request.goals.clone();
        if goals.is_empty() {
            goals = self.goals.iter().map(|place| place.rear_axle(&vehicle)).collect();
        }
        if goals.is_empty() {
            goals = self.spots.iter().flat_map(|spot| spot.goals(&vehicle)).collect();
            if goals.is_empty() && !self.spots.is_empty() {
                let (count, Vehicle { length, width, .. }) = (self.spots.len(), vehicle);
                let text = format!(
                    "is missing: none of {count} spots is {length} m long and {width} m wide"
                );
                return Err(invalid("goal", text + "; give one (option --goal X,Y,HEADING)"));
            }
        }
        let Some(&goal) = goals.first() else {
            return Err(missing("goal", "--goal X,Y,HEADING"));
        };
        let scene = Scene {
            name: self.name.clone(),
            source: self.source.clone(),
            vehicle,
            // Another car has another outline.
            contour: if self.vehicle == Some(vehicle) { self.contour.clone() } else { Vec::new() },
            margins: self.margins,
            start,
            goal,
            goals: if goals.len() > 1 { goals } else { Vec::new() },
            goal_tolerance: self.goal_tolerance,
            // It says how the map's own goal lies.
            parking_type: self.parking_type.filter(|_| request.goals.is_empty()),
            obstacles: self.obstacles.clone(),
            polylines: self.polylines.clone(),
            points: self.points.clone(),
            low: self.low.clone(),
            drivable_area: self.drivable_area.clone(),
            bounds: self.bounds,
            start_steer: if is_own { self.start_steer } else { 0.0 },
            previous: self.previous.clone().filter(|_| is_own),
        };
        scene.validate(&self.path)?;
        if let Some(warning) = scene.degrees() {
            log::warn!("{}: {warning}", self.path.display());
        }
        Ok(scene)
    }

    /// Places where a vehicle may park, found between what stands there, whether spots are marked or not.
    pub fn free_spots(&self, vehicle: &Vehicle) -> Result<Vec<FreeSpot>, SceneError> {
        let Some([x0, y0, x1, y1]) = self.extent() else { return Ok(Vec::new()) };
        let middle = Pose::new(f64::midpoint(x0, x1), f64::midpoint(y0, y1), 0.0);
        let vehicle = Some(*vehicle);
        let scene =
            self.scene(&MapRequest { start: Some(middle), goals: vec![middle], vehicle })?;
        free_spots(&scene)
            .map_err(|e| SceneError::Format { path: self.path.clone(), message: e.to_string() })
    }

    /// Puts what is asked for into the map.
    pub fn add(&mut self, request: &MapRequest) {
        if let Some(start) = request.start {
            self.start = Some(Place::RearAxle(start));
        }
        if !request.goals.is_empty() {
            self.goals = request.goals.iter().map(|&goal| Place::RearAxle(goal)).collect();
            // It said how the map's own goal lies.
            self.parking_type = None;
        }
        if let Some(vehicle) = request.vehicle {
            // Another car has another outline.
            if self.vehicle != Some(vehicle) {
                self.contour.clear();
            }
            self.vehicle = Some(vehicle);
        }
    }

    /// The smallest box `[xmin, ymin, xmax, ymax]` around everything, spots, start and goals included; none around
    /// nothing.
    pub fn extent(&self) -> Option<[f64; 4]> {
        let low = &self.low;
        let lists = [&self.obstacles, &self.polylines, &low.obstacles, &low.polylines];
        let area = self.drivable_area.iter().flat_map(|area| &area.outer);
        let places = self.start.iter().chain(&self.goals).map(|place| match place {
            Place::RearAxle(pose) | Place::Middle(pose) => [pose.x, pose.y],
        });
        let spots = self.spots.iter().map(|spot| [spot.middle.x, spot.middle.y]);
        let vertices = lists.into_iter().flatten().flatten();
        let vertices = vertices.chain(&self.points).chain(&low.points).chain(area).copied();
        let corners = self.bounds.into_iter().flat_map(|[x0, y0, x1, y1]| [[x0, y0], [x1, y1]]);
        vertices.chain(corners).chain(places).chain(spots).fold(None, |extent, [x, y]| {
            let [x0, y0, x1, y1] = extent.unwrap_or([x, y, x, y]);
            Some([x0.min(x), y0.min(y), x1.max(x), y1.max(y)])
        })
    }
}

impl From<Scene> for Map {
    fn from(scene: Scene) -> Map {
        let goals = scene.all_goals().iter().map(|&goal| Place::RearAxle(goal)).collect();
        Map {
            name: scene.name,
            source: scene.source,
            vehicle: Some(scene.vehicle),
            contour: scene.contour,
            margins: scene.margins,
            start: Some(Place::RearAxle(scene.start)),
            start_steer: scene.start_steer,
            previous: scene.previous,
            goals,
            goal_tolerance: scene.goal_tolerance,
            parking_type: scene.parking_type,
            obstacles: scene.obstacles,
            polylines: scene.polylines,
            points: scene.points,
            low: scene.low,
            drivable_area: scene.drivable_area,
            bounds: scene.bounds,
            ..Map::default()
        }
    }
}

/// The file that is read, for messages.
#[derive(Clone, Copy)]
struct MapFile<'a> {
    path: &'a Path,
    /// What files hold.
    bytes: &'a dyn Fn(&Path) -> io::Result<Vec<u8>>,
}

impl MapFile<'_> {
    /// The file is not the format it should be.
    fn format(self, message: impl Into<String>) -> SceneError {
        SceneError::Format { path: self.path.to_owned(), message: message.into() }
    }

    /// A field has a value that cannot be.
    fn invalid(self, field: impl Into<String>, message: impl Into<String>) -> SceneError {
        let (field, message) = (field.into(), message.into());
        SceneError::Invalid { path: self.path.to_owned(), field, message }
    }

    /// The text of the file, which is not empty.
    fn text(self, bytes: Vec<u8>) -> Result<String, SceneError> {
        let mut text = String::from_utf8(bytes)
            .map_err(|_| self.format("is not text (UTF-8); expected a map"))?;
        if text.starts_with('\u{feff}') {
            text.drain(..'\u{feff}'.len_utf8());
        }
        match text.trim().is_empty() {
            true => Err(self.format("is empty; expected a map")),
            false => Ok(text),
        }
    }

    #[cfg(feature = "maps")]
    fn grid(self, text: &str, options: &MapOptions) -> Result<Map, SceneError> {
        grid::read(text, options, self)
    }

    #[cfg(feature = "maps")]
    fn xml(self, text: &str, options: &MapOptions) -> Result<Map, SceneError> {
        let document = xml::parse(text, self)?;
        match document.root_element().tag_name().name() {
            "commonRoad" => commonroad::read(&document, options, self),
            "OpenDRIVE" => opendrive::read(&document, self),
            other => {
                Err(self
                    .format(format!("begins with <{other}>; expected <commonRoad> or <OpenDRIVE>")))
            }
        }
    }

    #[cfg(not(feature = "maps"))]
    fn grid(self, _: &str, _: &MapOptions) -> Result<Map, SceneError> {
        Err(self.format("is a map that this build cannot read; build with the feature maps"))
    }

    #[cfg(not(feature = "maps"))]
    fn xml(self, text: &str, options: &MapOptions) -> Result<Map, SceneError> {
        self.grid(text, options)
    }
}
