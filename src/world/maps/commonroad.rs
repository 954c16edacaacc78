//! CommonRoad scenarios, versions 2018b and 2020a: what stands still and the first planning problem.
//!
//! Positions are those of the middle of a vehicle's body. A goal region becomes its middle, and the tolerance that fits into
//! it. What moves is left out with a warning. Format: commonroad.in.tum.de, "XML scenario format".

use std::f64::consts::{PI, TAU};

use roxmltree::Document;

use super::xml::{Element, child, children, field, finite};
use super::{Map, MapFile, MapOptions, Place, Spot};
use crate::geometry::Polygon;
use crate::geometry::{Pose, Vec2, distance_to_segment, wrap_angle};
use crate::world::GoalTolerance;
use crate::world::scene::SceneError;

pub(super) fn read(
    document: &Document,
    options: &MapOptions,
    file: MapFile,
) -> Result<Map, SceneError> {
    let root = document.root_element();
    let name = root.attribute("benchmarkID").unwrap_or_default().to_owned();
    let mut map = Map { name, source: "CommonRoad scenario".to_owned(), ..Map::default() };
    let reader = Reader { file };
    // In 2018b obstacles of all kinds have one name and a role.
    let is_static =
        |o: &Element| child(*o, "role").is_none_or(|role| role.text() == Some("static"));
    let all = || children(root, "obstacle");
    for obstacle in children(root, "staticObstacle").chain(all().filter(is_static)) {
        let shape = reader.child(obstacle, "shape")?;
        let state = reader.child(obstacle, "initialState")?;
        let position = reader.child(reader.child(state, "position")?, "point")?;
        let [x, y] = reader.point(position)?;
        let heading = reader.exact(state, "orientation")?;
        reader.outlines(shape, Pose::new(x, y, heading), &mut map.obstacles)?;
    }
    // Buildings and the like have their place in their shape.
    for obstacle in children(root, "environmentObstacle") {
        let shape = reader.child(obstacle, "shape")?;
        reader.outlines(shape, Pose::default(), &mut map.obstacles)?;
    }
    let moving = ["dynamicObstacle", "phantomObstacle"]
        .map(|name| children(root, name).count())
        .into_iter()
        .sum::<usize>()
        + all().filter(|o| !is_static(o)).count();
    if moving > 0 {
        log::warn!("{}: {moving} moving obstacles are left out", file.path.display());
    }
    let lanelets = children(root, "lanelet").count();
    if lanelets > 0 && !options.borders && map.obstacles.is_empty() {
        log::info!(
            "{}: nothing stands beside its {lanelets} lanelets; take their borders for walls with --borders",
            file.path.display()
        );
    }
    if options.borders {
        for lanelet in children(root, "lanelet") {
            for side in ["leftBound", "rightBound"] {
                let bound = reader.child(lanelet, side)?;
                map.polylines.push(reader.points(bound)?);
            }
        }
    }
    let problems = children(root, "planningProblem").count();
    if problems > 1 {
        log::warn!("{}: of {problems} planning problems the first is taken", file.path.display());
    }
    if let Some(problem) = child(root, "planningProblem") {
        reader.problem(problem, &mut map)?;
    }
    Ok(map)
}

/// A region so many times as long as wide has a direction of its own.
const LONG: f64 = 1.2;

struct Reader<'a> {
    file: MapFile<'a>,
}

/// A region to end in: its middle, how far from it one may end, and its direction where it has one.
struct Region {
    middle: [f64; 2],
    radius: f64,
    heading: Option<f64>,
}

impl Reader<'_> {
    fn child<'a>(&self, of: Element<'a>, name: &'a str) -> Result<Element<'a>, SceneError> {
        child(of, name)
            .ok_or_else(|| self.file.invalid(field(of), format!("has no <{name}>; expected one")))
    }

    fn number(&self, of: Element, name: &str) -> Result<f64, SceneError> {
        let element = self.child(of, name)?;
        let text = element.text().unwrap_or_default();
        let wrong = || {
            self.file
                .invalid(field(element), format!("is {:?}; expected a finite number", text.trim()))
        };
        finite(text).ok_or_else(wrong)
    }

    /// A length, which is positive.
    fn length(&self, of: Element, name: &str) -> Result<f64, SceneError> {
        match self.number(of, name)? {
            v if v > 0.0 => Ok(v),
            v => {
                Err(self.file.invalid(field(of), format!("has {name} {v:?}; expected more than 0")))
            }
        }
    }

    fn point(&self, of: Element) -> Result<[f64; 2], SceneError> {
        Ok([self.number(of, "x")?, self.number(of, "y")?])
    }

    fn points(&self, of: Element) -> Result<Vec<[f64; 2]>, SceneError> {
        children(of, "point").map(|point| self.point(point)).collect()
    }

    fn polygon(&self, of: Element) -> Result<Vec<[f64; 2]>, SceneError> {
        let mut points = self.points(of)?;
        if points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        if points.len() < 3 {
            let text = format!("has {} points; expected at least 3", points.len());
            return Err(self.file.invalid(field(of), text));
        }
        Ok(points)
    }

    /// An exact value, or the middle of an interval.
    fn exact(&self, of: Element, name: &str) -> Result<f64, SceneError> {
        let element = self.child(of, name)?;
        if child(element, "exact").is_some() {
            return self.number(element, "exact");
        }
        let [from, to] = self.interval(element)?;
        Ok(f64::midpoint(from, to))
    }

    fn interval(&self, element: Element) -> Result<[f64; 2], SceneError> {
        Ok([self.number(element, "intervalStart")?, self.number(element, "intervalEnd")?])
    }

    /// Where a shape's middle lies in its own frame.
    fn centre(&self, shape: Element) -> Result<[f64; 2], SceneError> {
        child(shape, "center").map_or(Ok([0.0; 2]), |centre| self.point(centre))
    }

    fn orientation(&self, shape: Element) -> Result<f64, SceneError> {
        child(shape, "orientation").map_or(Ok(0.0), |_| self.number(shape, "orientation"))
    }

    /// A rectangle's half length, half width and pose.
    fn rectangle(&self, shape: Element) -> Result<(f64, f64, Pose), SceneError> {
        let (length, width) = (self.length(shape, "length")?, self.length(shape, "width")?);
        let [x, y] = self.centre(shape)?;
        Ok((length / 2.0, width / 2.0, Pose::new(x, y, self.orientation(shape)?)))
    }

    /// The outlines of a shape at `pose`: a circle as a polygon around it.
    fn outlines(
        &self,
        shape: Element,
        pose: Pose,
        out: &mut Vec<Vec<[f64; 2]>>,
    ) -> Result<(), SceneError> {
        let before = out.len();
        let place = |local: &[[f64; 2]]| -> Vec<[f64; 2]> {
            local.iter().map(|&[x, y]| pose.point_to_parent(Vec2::new(x, y)).into()).collect()
        };
        for shape in shape.children().filter(Element::is_element) {
            out.push(place(&match shape.tag_name().name() {
                "rectangle" => {
                    let (x, y, at) = self.rectangle(shape)?;
                    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
                    corners.map(|[x, y]| at.point_to_parent(Vec2::new(x, y)).into()).to_vec()
                }
                "circle" => {
                    let [x, y] = self.centre(shape)?;
                    circle([x, y], self.length(shape, "radius")?)
                }
                "polygon" => self.polygon(shape)?,
                _ => continue,
            }));
        }
        match out.len() > before {
            true => Ok(()),
            false => Err(self
                .file
                .invalid(field(shape), "has no rectangle, circle or polygon; expected one")),
        }
    }

    fn problem(&self, problem: Element, map: &mut Map) -> Result<(), SceneError> {
        let state = self.child(problem, "initialState")?;
        let [x, y] = self.point(self.child(self.child(state, "position")?, "point")?)?;
        map.start = Some(Place::Middle(Pose::new(x, y, self.exact(state, "orientation")?)));
        let mut tolerance = GoalTolerance {
            position_m: GoalTolerance::MAX_POSITION,
            heading_rad: GoalTolerance::MAX_HEADING,
        };
        for goal in children(problem, "goalState") {
            let Some(position) = child(goal, "position") else {
                log::warn!(
                    "{}: a goal without a position is left out: it says only when to arrive or how fast",
                    self.file.path.display()
                );
                continue;
            };
            let regions = self.regions(position)?;
            let (middle, half) = match child(goal, "orientation") {
                None => (None, GoalTolerance::MAX_HEADING),
                Some(element) if child(element, "exact").is_some() => {
                    (Some(self.number(element, "exact")?), 0.0)
                }
                Some(element) => {
                    let [from, to] = self.interval(element)?;
                    let half = ((to - from).rem_euclid(TAU + 1e-9) / 2.0).min(PI);
                    (Some(wrap_angle(from + half)), half)
                }
            };
            for Region { middle: [x, y], radius, heading } in regions {
                // Without a heading the car may stand either way along the region.
                let headings = match (middle, heading) {
                    (Some(middle), _) => vec![middle],
                    (None, Some(along)) => vec![along, wrap_angle(along + PI)],
                    (None, None) => vec![0.0, PI, PI / 2.0, -PI / 2.0],
                };
                map.goals.extend(headings.into_iter().map(|h| Place::Middle(Pose::new(x, y, h))));
                tolerance.position_m = tolerance.position_m.min(radius);
                tolerance.heading_rad = tolerance.heading_rad.min(half);
            }
        }
        if !map.goals.is_empty() {
            map.goal_tolerance = Some(tolerance);
        }
        Ok(())
    }

    /// The regions of a goal's position. One that is a lanelet says nothing of where in it to stand.
    fn regions(&self, position: Element) -> Result<Vec<Region>, SceneError> {
        let mut regions = Vec::new();
        for shape in position.children().filter(Element::is_element) {
            match shape.tag_name().name() {
                "rectangle" => {
                    let (x, y, at) = self.rectangle(shape)?;
                    let heading = if x >= y { at.heading } else { at.heading + PI / 2.0 };
                    let heading = Some(wrap_angle(heading));
                    regions.push(Region { middle: [at.x, at.y], radius: x.min(y), heading });
                }
                "circle" => {
                    let radius = self.length(shape, "radius")?;
                    regions.push(Region { middle: self.centre(shape)?, radius, heading: None });
                }
                "polygon" => regions.push(self.around(shape)?),
                "point" => {
                    regions.push(Region { middle: self.point(shape)?, radius: 0.0, heading: None });
                }
                "lanelet" => log::warn!(
                    "{}: a goal that is a lanelet is left out: it does not say where to stand",
                    self.file.path.display()
                ),
                _ => {}
            }
        }
        Ok(regions)
    }

    /// The largest disc around the middle of a polygon's corners that is inside; along it, where it is clearly longer than wide.
    fn around(&self, shape: Element) -> Result<Region, SceneError> {
        let points = self.polygon(shape)?;
        let corners: Vec<Vec2> = points.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
        let middle = corners.iter().sum::<Vec2>() / corners.len() as f64;
        let polygon =
            Polygon::new(corners).map_err(|e| self.file.invalid(field(shape), e.to_string()))?;
        if !polygon.contains(middle) {
            let text =
                "is a goal whose middle lies outside it; give a goal instead (option --goal)";
            return Err(self.file.invalid(field(shape), text));
        }
        let away = polygon.edges().map(|(a, b)| distance_to_segment(middle, a, b));
        let radius = away.fold(f64::INFINITY, f64::min);
        let around = Spot::around("", &points);
        let is_long = around.length > LONG * around.width;
        let heading = is_long.then_some(around.middle.heading);
        Ok(Region { middle: middle.into(), radius, heading })
    }
}

/// A polygon around a circle, 1 % of the radius outside it at most.
pub(super) fn circle([x, y]: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    const CORNERS: u32 = 24;
    let step = TAU / f64::from(CORNERS);
    let reach = radius / (step / 2.0).cos();
    let corner = |i: u32| {
        let (sin, cos) = (f64::from(i) * step).sin_cos();
        [x + reach * cos, y + reach * sin]
    };
    (0..CORNERS).map(corner).collect()
}
