//! GeoJSON: polygons, lines and points with what they are in their properties.
//!
//! Coordinates are WGS-84, as the standard (RFC 7946) has it, and become metres about the middle of the file or its
//! `origin`; with `"units": "metres"` they are metres already.

use serde_json::{Map as Members, Value};

use super::rings::without_holes;
use super::{Geographic, Map, MapFile, MapOptions, Place, Spot};
use crate::geometry::Pose;
use crate::world::DrivableArea;
use crate::world::scene::SceneError;

/// Types that GeoJSON's objects have.
const TYPES: [&str; 9] = [
    "FeatureCollection",
    "Feature",
    "GeometryCollection",
    "Point",
    "MultiPoint",
    "LineString",
    "MultiLineString",
    "Polygon",
    "MultiPolygon",
];

/// Whether the text of a `.json` file is GeoJSON.
pub(super) fn is_geojson(text: &str) -> bool {
    #[derive(serde::Deserialize)]
    struct Typed {
        #[serde(rename = "type")]
        kind: String,
    }
    text.contains("\"type\"")
        && serde_json::from_str::<Typed>(text).is_ok_and(|typed| TYPES.contains(&&typed.kind[..]))
}

pub(super) fn read(text: &str, options: &MapOptions, file: MapFile) -> Result<Map, SceneError> {
    let value: Value = serde_json::from_str(text)
        .map_err(|e| file.format(format!("is not valid JSON: {e}; expected GeoJSON")))?;
    let Value::Object(root) = &value else {
        return Err(file.format("is no object; expected GeoJSON"));
    };
    let mut reader = Reader { file, map: members(root, file)?, role: Role::Obstacle };
    let mut geometries = Vec::new();
    reader.collect(root, "", &mut geometries)?;
    if reader.is_metres(root, options)? {
        reader.map.geographic = None;
    } else {
        let origin = match reader.map.geographic {
            Some(origin) => origin,
            None => middle(&geometries, file)?,
        };
        for geometry in &mut geometries {
            geometry.project(origin, file)?;
        }
        reader.map.geographic = Some(origin);
    }
    for geometry in geometries {
        reader.take(geometry)?;
    }
    Ok(reader.map)
}

/// What a geometry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Obstacle,
    Low,
    DrivableArea,
    Bounds,
    Spot,
    Start,
    Goal,
    /// Of a plan that was written, or what cars drive on: nothing to avoid.
    Path,
}

impl Role {
    const NAMES: [(&'static str, Role); 8] = [
        ("obstacle", Role::Obstacle),
        ("low", Role::Low),
        ("drivable_area", Role::DrivableArea),
        ("bounds", Role::Bounds),
        ("spot", Role::Spot),
        ("start", Role::Start),
        ("goal", Role::Goal),
        ("path", Role::Path),
    ];
}

/// A geometry before it is projected.
struct Geometry<'a> {
    /// Where it stands in the file, for messages.
    field: String,
    role: Role,
    properties: Option<&'a Members<String, Value>>,
    shape: Shape,
}

enum Shape {
    Point([f64; 2]),
    Line(Vec<[f64; 2]>),
    /// The outer ring and its holes, not repeating their first vertex.
    Polygon(Vec<Vec<[f64; 2]>>),
}

impl Geometry<'_> {
    fn vertices(&mut self) -> Box<dyn Iterator<Item = &mut [f64; 2]> + '_> {
        match &mut self.shape {
            Shape::Point(point) => Box::new(std::iter::once(point)),
            Shape::Line(line) => Box::new(line.iter_mut()),
            Shape::Polygon(rings) => Box::new(rings.iter_mut().flatten()),
        }
    }

    fn project(&mut self, origin: Geographic, file: MapFile) -> Result<(), SceneError> {
        let field = self.field.clone();
        for vertex in self.vertices() {
            let [longitude, latitude] = *vertex;
            if !(-180.0..=180.0).contains(&longitude) || !(-90.0..=90.0).contains(&latitude) {
                let text = format!(
                    "= {vertex:?} is no longitude and latitude; for metres add \"units\": \"metres\" (option --metres)"
                );
                return Err(file.invalid(format!("{field}.coordinates"), text));
            }
            // The middle meridian of the projection is that of the origin.
            let apart = origin.degrees_from(*vertex);
            if apart > FARTHEST {
                let text = format!(
                    "= {vertex:?} is {apart:.0} degrees from {:?}, the origin; expected a place within {FARTHEST}",
                    [origin.longitude, origin.latitude]
                );
                return Err(file.invalid(format!("{field}.coordinates"), text));
            }
            *vertex = origin.to_local(*vertex);
        }
        Ok(())
    }
}

/// Farther from its origin than so many degrees a map is no place to park in, and its metres are none.
const FARTHEST: f64 = 5.0;

/// The middle of everything, degrees.
fn middle(geometries: &[Geometry], file: MapFile) -> Result<Geographic, SceneError> {
    let mut all = geometries.iter().flat_map(|g| match &g.shape {
        Shape::Point(point) => std::slice::from_ref(point).iter().collect::<Vec<_>>(),
        Shape::Line(line) => line.iter().collect(),
        Shape::Polygon(rings) => rings.iter().flatten().collect(),
    });
    let Some(&[lon, lat]) = all.next() else {
        return Err(file.format("has no geometry; expected obstacles, or \"units\": \"metres\""));
    };
    // Longitudes that differ by more than half a turn lie on either side of ±180°.
    let near = |v: f64| v - 360.0 * ((v - lon) / 360.0).round();
    let extent = all.fold([lon, lat, lon, lat], |[x0, y0, x1, y1], &[x, y]| {
        [x0.min(near(x)), y0.min(y), x1.max(near(x)), y1.max(y)]
    });
    let longitude = f64::midpoint(extent[0], extent[2]);
    let longitude = longitude - 360.0 * (longitude / 360.0).round();
    Ok(Geographic { longitude, latitude: f64::midpoint(extent[1], extent[3]) })
}

/// What the file says of the whole: the members that scenes have besides geometry.
fn members(root: &Members<String, Value>, file: MapFile) -> Result<Map, SceneError> {
    fn member<T: serde::de::DeserializeOwned>(
        root: &Members<String, Value>,
        name: &str,
        file: MapFile,
    ) -> Result<Option<T>, SceneError> {
        let value = root.get(name).filter(|value| !value.is_null());
        let read = |value: &Value| {
            T::deserialize(value)
                .map_err(|e| file.invalid(name, format!("is not as it should be: {e}")))
        };
        value.map(read).transpose()
    }
    let map = Map {
        name: member(root, "name", file)?.unwrap_or_default(),
        source: member(root, "source", file)?.unwrap_or_else(|| "GeoJSON".to_owned()),
        vehicle: member(root, "vehicle", file)?,
        contour: member(root, "contour", file)?.unwrap_or_default(),
        margins: member(root, "margins", file)?,
        goal_tolerance: member(root, "goal_tolerance", file)?,
        parking_type: member(root, "parking_type", file)?,
        geographic: member(root, "origin", file)?,
        ..Map::default()
    };
    if let Some(Geographic { longitude, latitude }) = map.geographic
        && !(longitude.abs() <= 180.0 && latitude.abs() < 90.0)
    {
        let text =
            format!("is [{longitude}, {latitude}]; expected longitude and latitude in degrees");
        return Err(file.invalid("origin", text));
    }
    Ok(map)
}

struct Reader<'a> {
    file: MapFile<'a>,
    map: Map,
    role: Role,
}

impl Reader<'_> {
    /// Whether coordinates are metres.
    fn is_metres(
        &self,
        root: &Members<String, Value>,
        options: &MapOptions,
    ) -> Result<bool, SceneError> {
        match root.get("units").map(|units| units.as_str().unwrap_or_default()) {
            Some("metres" | "meters" | "m") => return Ok(true),
            Some("degrees") | None => {}
            Some(_) => {
                let text = format!("is {}; expected \"metres\" or \"degrees\"", root["units"]);
                return Err(self.file.invalid("units", text));
            }
        }
        if options.metres {
            return Ok(true);
        }
        let crs = root.get("crs").and_then(|crs| crs.pointer("/properties/name"));
        match crs.and_then(Value::as_str) {
            None => Ok(false),
            Some(name) if name.contains("CRS84") || name.ends_with("4326") => Ok(false),
            Some(name) => {
                let text = format!("is {name}; expected WGS-84, or metres (option --metres)");
                Err(self.file.invalid("crs", text))
            }
        }
    }

    /// Adds the geometries of an object of GeoJSON.
    fn collect<'a>(
        &mut self,
        object: &'a Members<String, Value>,
        field: &str,
        out: &mut Vec<Geometry<'a>>,
    ) -> Result<(), SceneError> {
        let file = self.file;
        let kind = object.get("type").and_then(Value::as_str).unwrap_or_default();
        let within =
            |name: &str| if field.is_empty() { name.to_owned() } else { format!("{field}.{name}") };
        match kind {
            "FeatureCollection" | "GeometryCollection" => {
                let name = if kind == "FeatureCollection" { "features" } else { "geometries" };
                let Some(Value::Array(list)) = object.get(name) else {
                    return Err(file.invalid(within(name), "is missing; expected a list"));
                };
                for (i, value) in list.iter().enumerate() {
                    let field = format!("{}[{i}]", within(name));
                    let Value::Object(object) = value else {
                        return Err(file.invalid(field, "is no object; expected a part of GeoJSON"));
                    };
                    self.collect(object, &field, out)?;
                }
            }
            "Feature" => {
                let properties = object.get("properties").and_then(Value::as_object);
                self.role = self.role_of(properties, field)?;
                if let Some(Value::Object(geometry)) = object.get("geometry") {
                    let from = out.len();
                    self.collect(geometry, &within("geometry"), out)?;
                    out[from..].iter_mut().for_each(|g| g.properties = properties);
                }
                self.role = Role::Obstacle;
            }
            _ => {
                let field = if field.is_empty() { "geometry".to_owned() } else { field.to_owned() };
                let coordinates = object.get("coordinates").unwrap_or(&Value::Null);
                for shape in self.shapes(kind, coordinates, &field)? {
                    out.push(Geometry {
                        field: field.clone(),
                        role: self.role,
                        properties: None,
                        shape,
                    });
                }
            }
        }
        Ok(())
    }

    fn role_of(
        &self,
        properties: Option<&Members<String, Value>>,
        field: &str,
    ) -> Result<Role, SceneError> {
        let Some(properties) = properties else { return Ok(Role::Obstacle) };
        let Some(key) = ["role", "kind"].into_iter().find(|&key| properties.contains_key(key))
        else {
            return Ok(of_tags(properties));
        };
        let name = properties[key].as_str();
        let role = Role::NAMES.iter().find(|(known, _)| Some(*known) == name);
        role.map(|(_, role)| *role).ok_or_else(|| {
            let known = Role::NAMES.map(|(name, _)| name).join(", ");
            let text = format!("is {}; expected one of {known}", properties[key]);
            self.file.invalid(format!("{field}.properties.{key}"), text)
        })
    }

    fn shapes(
        &self,
        kind: &str,
        coordinates: &Value,
        field: &str,
    ) -> Result<Vec<Shape>, SceneError> {
        let field = format!("{field}.coordinates");
        let position = |value: &Value| self.position(value, &field);
        let line = |value: &Value| -> Result<Vec<[f64; 2]>, SceneError> {
            self.list(value, &field)?.iter().map(position).collect()
        };
        let polygon = |value: &Value| -> Result<Shape, SceneError> {
            let rings = self.list(value, &field)?.iter().map(line);
            let mut rings = rings.collect::<Result<Vec<_>, _>>()?;
            for ring in &mut rings {
                if ring.len() > 1 && ring.first() == ring.last() {
                    ring.pop();
                }
                if ring.len() < 3 {
                    let text = "has a ring of fewer than 3 corners; expected at least 4 positions, the last the first again";
                    return Err(self.file.invalid(&field, text));
                }
            }
            match rings.is_empty() {
                true => Err(self.file.invalid(&field, "is empty; expected at least one ring")),
                false => Ok(Shape::Polygon(rings)),
            }
        };
        let walls = |value: &Value| -> Result<Shape, SceneError> {
            let line = line(value)?;
            match line.len() {
                0 | 1 => {
                    Err(self.file.invalid(&field, "has fewer than 2 positions; expected a line"))
                }
                _ => Ok(Shape::Line(line)),
            }
        };
        match kind {
            "Point" => Ok(vec![Shape::Point(position(coordinates)?)]),
            "MultiPoint" => Ok(line(coordinates)?.into_iter().map(Shape::Point).collect()),
            "LineString" => Ok(vec![walls(coordinates)?]),
            "MultiLineString" => self.list(coordinates, &field)?.iter().map(walls).collect(),
            "Polygon" => Ok(vec![polygon(coordinates)?]),
            "MultiPolygon" => self.list(coordinates, &field)?.iter().map(polygon).collect(),
            _ => {
                let field = field.trim_end_matches(".coordinates");
                let text = format!("is {kind:?}; expected one of {}", TYPES.join(", "));
                Err(self.file.invalid(format!("{field}.type"), text))
            }
        }
    }

    fn list<'v>(&self, value: &'v Value, field: &str) -> Result<&'v [Value], SceneError> {
        let wrong = || self.file.invalid(field, "is no list; expected lists of positions [x, y]");
        value.as_array().map(Vec::as_slice).ok_or_else(wrong)
    }

    fn position(&self, value: &Value, field: &str) -> Result<[f64; 2], SceneError> {
        let number = |i: usize| value.get(i).and_then(Value::as_f64);
        match (number(0), number(1)) {
            (Some(x), Some(y)) => Ok([x, y]),
            _ => {
                let given: String = value.to_string().chars().take(60).collect();
                Err(self.file.invalid(field, format!("has {given}; expected a position [x, y]")))
            }
        }
    }

    /// Puts a geometry where it belongs.
    fn take(&mut self, geometry: Geometry) -> Result<(), SceneError> {
        let Geometry { field, role, properties, shape } = geometry;
        let flag = |name: &str| properties.is_some_and(|p| p.get(name) == Some(&Value::Bool(true)));
        let (file, map) = (self.file, &mut self.map);
        match (role, shape) {
            (Role::Path, _) => {}
            (Role::Obstacle, Shape::Point(point)) => map.points.push(point),
            (Role::Obstacle, Shape::Line(line)) if flag("wall") => map.obstacles.push(line),
            (Role::Obstacle, Shape::Line(line)) => map.polylines.push(line),
            (Role::Obstacle, Shape::Polygon(rings)) => map.obstacles.push(without_holes(rings)),
            (Role::Low, Shape::Point(point)) => map.low.points.push(point),
            (Role::Low, Shape::Line(line)) if flag("wall") => map.low.obstacles.push(line),
            (Role::Low, Shape::Line(line)) => map.low.polylines.push(line),
            (Role::Low, Shape::Polygon(rings)) => map.low.obstacles.push(without_holes(rings)),
            (Role::DrivableArea, Shape::Polygon(mut rings)) => {
                if map.drivable_area.is_some() {
                    return Err(file.invalid(field, "is a second drivable area; expected one"));
                }
                let holes = rings.split_off(1);
                let outer = rings.swap_remove(0);
                map.drivable_area = Some(DrivableArea { outer, holes });
            }
            (Role::Bounds, Shape::Polygon(rings)) => {
                let around = rings[0].iter().fold(
                    [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY],
                    |[x0, y0, x1, y1], &[x, y]| [x0.min(x), y0.min(y), x1.max(x), y1.max(y)],
                );
                map.bounds = Some(around);
            }
            (Role::Spot, Shape::Polygon(rings)) => {
                let name = properties.and_then(|p| p.get("name")).and_then(Value::as_str);
                map.spots.push(Spot::around(name.unwrap_or_default(), &rings[0]));
            }
            // Of a mapped spot often only the middle or a line is known, which does not tell how it lies.
            (Role::Spot, _) => {}
            (Role::Start, Shape::Point(point)) => {
                if map.start.is_some() {
                    return Err(file.invalid(field, "is a second start; expected one"));
                }
                map.start = Some(place(point, properties, &field, file)?);
            }
            (Role::Goal, Shape::Point(point)) => {
                map.goals.push(place(point, properties, &field, file)?);
            }
            (Role::Start | Role::Goal, _) => {
                return Err(file.invalid(
                    format!("{field}.type"),
                    "is no Point; a start and a goal are points",
                ));
            }
            (Role::DrivableArea | Role::Bounds, _) => {
                return Err(file.invalid(
                    format!("{field}.type"),
                    "is no Polygon; an area and bounds are polygons",
                ));
            }
        }
        Ok(())
    }
}

/// What a feature of OpenStreetMap is, whose tags are properties; anything that is not known is in the way.
fn of_tags(tags: &Members<String, Value>) -> Role {
    /// What says where cars drive, or of whole areas what they are for.
    const GROUND: [&str; 5] = ["boundary", "highway", "landuse", "place", "route"];
    let is = |key: &str, value: &str| tags.get(key).is_some_and(|given| given == value);
    let has = |key: &&str| tags.contains_key(*key);
    match () {
        () if is("amenity", "parking_space") => Role::Spot,
        () if is("barrier", "kerb") => Role::Low,
        () if ["barrier", "building"].iter().any(has) => Role::Obstacle,
        () if is("amenity", "parking") || GROUND.iter().any(has) => Role::Path,
        () => Role::Obstacle,
    }
}

/// The pose of a start or a goal at `point`.
fn place(
    [x, y]: [f64; 2],
    properties: Option<&Members<String, Value>>,
    field: &str,
    file: MapFile,
) -> Result<Place, SceneError> {
    let feature = field.trim_end_matches(".geometry");
    let property = |name: &str| properties.and_then(|properties| properties.get(name));
    let number = |name: &str| {
        let wrong = |value: &Value| {
            file.invalid(
                format!("{feature}.properties.{name}"),
                format!("is {value}; expected a number"),
            )
        };
        property(name).map(|value| value.as_f64().ok_or_else(|| wrong(value))).transpose()
    };
    let heading = match (number("heading")?, number("heading_deg")?) {
        (Some(heading), _) => heading,
        (None, Some(degrees)) => degrees.to_radians(),
        (None, None) => {
            let text = "is missing; expected radians from +x (east), counter-clockwise, or degrees as heading_deg";
            return Err(file.invalid(format!("{feature}.properties.heading"), text));
        }
    };
    let pose = Pose::new(x, y, heading);
    match property("pose_of").map(|value| value.as_str().unwrap_or_default()) {
        None | Some("rear_axle") => Ok(Place::RearAxle(pose)),
        Some("middle") => Ok(Place::Middle(pose)),
        Some(other) => {
            let text = format!("is {other:?}; expected \"rear_axle\" or \"middle\"");
            Err(file.invalid(format!("{feature}.properties.pose_of"), text))
        }
    }
}
