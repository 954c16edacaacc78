//! What stands in a scene, as it is given: outlines and what they mean.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::scene::InvalidField;
use super::{ObstacleError, Obstacles, Scene};
use crate::geometry::{Aabb, Polygon, Polyline, Pose, Vec2, is_within};

/// What only wheels must keep off, such as kerbs and wheel stops: the body passes over it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LowObstacles {
    /// Simple polygons, closed implicitly; two vertices are a line.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// Open chains of two or more vertices.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub polylines: Vec<Vec<[f64; 2]>>,
    /// Single points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
}

impl LowObstacles {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.obstacles.is_empty() && self.polylines.is_empty() && self.points.is_empty()
    }
}

/// Where the car's body must stay: within a simple polygon and out of its holes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrivableArea {
    /// The border, closed implicitly.
    pub outer: Vec<[f64; 2]>,
    /// What is left out of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holes: Vec<Vec<[f64; 2]>>,
}

impl DrivableArea {
    /// Whether a point lies within the border (on it, it may go either way); holes are not looked at.
    pub fn contains(&self, p: Vec2) -> bool {
        let next = self.outer.iter().cycle().skip(1);
        let point = |&[x, y]: &[f64; 2]| Vec2::new(x, y);
        is_within(p, self.outer.iter().zip(next).map(|(a, b)| (point(a), point(b))))
    }
}

/// How the vertices of an outline belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A solid polygon.
    Solid,
    /// The closed border of the drivable area.
    Border,
    /// Walls one after the other, not closed.
    Chain,
    /// A single point.
    Point,
}

/// One thing that a car must keep off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline<'a> {
    /// The list of the scene that holds it.
    list: &'static str,
    /// Its index there; none where there is but one.
    index: Option<usize>,
    /// How its vertices belong together.
    pub shape: Shape,
    /// Its vertices, in the scene's frame.
    pub vertices: &'a [[f64; 2]],
    /// Whether it is low: only wheels must keep off.
    pub is_low: bool,
}

impl Outline<'_> {
    /// Its vertices as vectors.
    pub fn points(&self) -> impl Iterator<Item = Vec2> + '_ {
        self.vertices.iter().map(|&[x, y]| Vec2::new(x, y))
    }

    /// It alone as geometry, in the scene's frame.
    pub fn geometry(&self) -> Result<Obstacles, ObstacleError> {
        match self.shape {
            Shape::Point => geometry(std::iter::empty(), self.vertices, |v| v),
            _ => geometry(std::iter::once(*self), &[], |v| v),
        }
    }

    /// Its edges: the last vertex leads to the first where it is closed, and to itself elsewhere, so that every vertex
    /// begins one edge.
    pub fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        let last = match self.shape {
            Shape::Solid | Shape::Border => self.vertices.first(),
            Shape::Chain | Shape::Point => self.vertices.last(),
        };
        let last = last.map(|&[x, y]| Vec2::new(x, y));
        self.points().zip(self.points().skip(1).chain(last))
    }
}

impl fmt::Display for Outline<'_> {
    /// The field of the scene, such as `obstacles[3]`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let low = if self.is_low { "low." } else { "" };
        write!(f, "{low}{}", self.list)?;
        self.index.map_or(Ok(()), |i| write!(f, "[{i}]"))
    }
}

/// Polygons, chains and points, one after the other.
fn listed<'a>(
    obstacles: &'a [Vec<[f64; 2]>],
    polylines: &'a [Vec<[f64; 2]>],
    points: &'a [[f64; 2]],
    is_low: bool,
) -> impl Iterator<Item = Outline<'a>> {
    let outline = move |list, shape| {
        move |(i, vertices): (usize, &'a [[f64; 2]])| {
            // Two vertices enclose nothing.
            let shape =
                if shape == Shape::Solid && vertices.len() == 2 { Shape::Chain } else { shape };
            Outline { list, index: Some(i), shape, vertices, is_low }
        }
    };
    let each = |lists: &'a [Vec<[f64; 2]>]| lists.iter().map(Vec::as_slice).enumerate();
    let points = points.chunks(1).enumerate().map(outline("points", Shape::Point));
    each(obstacles)
        .map(outline("obstacles", Shape::Solid))
        .chain(each(polylines).map(outline("polylines", Shape::Chain)))
        .chain(points)
}

impl Scene {
    /// Everything that a car must keep off: what stands there, the border of the drivable area and its holes, and what is
    /// low. Points come last of those that are not low.
    pub fn outlines(&self) -> impl Iterator<Item = Outline<'_>> {
        let LowObstacles { obstacles, polylines, points } = &self.low;
        self.high_outlines().chain(listed(obstacles, polylines, points, true))
    }

    /// [`Scene::outlines`] without what is low.
    pub fn high_outlines(&self) -> impl Iterator<Item = Outline<'_>> {
        self.solid_outlines().chain(listed(&[], &[], &self.points, false))
    }

    /// [`Scene::high_outlines`] without points, of which there may be millions.
    pub(super) fn solid_outlines(&self) -> impl Iterator<Item = Outline<'_>> {
        let area = self.drivable_area.iter().flat_map(|area| {
            let part = |list, index, shape, vertices| Outline {
                list,
                index,
                shape,
                vertices,
                is_low: false,
            };
            let border = part("drivable_area.outer", None, Shape::Border, &area.outer[..]);
            let holes = area.holes.iter().enumerate().map(move |(i, hole)| {
                part("drivable_area.holes", Some(i), Shape::Solid, &hole[..])
            });
            std::iter::once(border).chain(holes)
        });
        listed(&self.obstacles, &self.polylines, &[], false).chain(area)
    }

    /// The same scene without what lies outside of `area`; the drivable area stays as it is. `None` where there is too
    /// little for that to save time.
    pub fn within(&self, area: &Aabb) -> Option<Scene> {
        const FEW: usize = 5000;
        let count = |lists: &[Vec<[f64; 2]>]| lists.iter().map(Vec::len).sum::<usize>();
        let LowObstacles { obstacles, polylines, points } = &self.low;
        let lists = [&self.obstacles, &self.polylines, obstacles, polylines].map(|l| count(l));
        if lists.iter().sum::<usize>() + self.points.len() + points.len() <= FEW {
            return None;
        }
        let vec = |&[x, y]: &[f64; 2]| Vec2::new(x, y);
        let some = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
            points.iter().copied().filter(|p| area.contains(vec(p))).collect()
        };
        let is_near = |list: &&Vec<[f64; 2]>| Aabb::around(list.iter().map(vec)).intersects(area);
        let near = |lists: &[Vec<[f64; 2]>]| lists.iter().filter(is_near).cloned().collect();
        let (obstacles, polylines, points) = (near(obstacles), near(polylines), some(points));
        Some(Scene {
            name: self.name.clone(),
            source: self.source.clone(),
            contour: self.contour.clone(),
            goals: self.goals.clone(),
            previous: None,
            obstacles: near(&self.obstacles),
            polylines: near(&self.polylines),
            points: some(&self.points),
            low: LowObstacles { obstacles, polylines, points },
            drivable_area: self.drivable_area.clone(),
            ..*self
        })
    }

    /// Whether the middle of the car at `pose` lies within the drivable area, if there is one.
    pub fn is_in_area(&self, pose: Pose) -> bool {
        let middle = self.vehicle.body_center(pose).position();
        self.drivable_area.as_ref().is_none_or(|area| area.contains(middle))
    }

    /// What stands in the way of a car's body as geometry, in the scene's frame.
    pub fn geometry(&self) -> Result<Obstacles, ObstacleError> {
        self.geometry_by(|v| v)
    }

    /// [`Scene::geometry`] with every point mapped by `map`.
    pub fn geometry_by(&self, map: impl Fn(Vec2) -> Vec2) -> Result<Obstacles, ObstacleError> {
        geometry(self.solid_outlines(), &self.points, map)
    }

    /// What stands in the way of wheels alone, every point mapped by `map`.
    pub fn low_geometry_by(&self, map: impl Fn(Vec2) -> Vec2) -> Result<Obstacles, ObstacleError> {
        let LowObstacles { obstacles, polylines, points } = &self.low;
        geometry(listed(obstacles, polylines, &[], true), points, map)
    }

    /// Whether nothing is wrong with any of the points.
    fn points_are_fit(&self) -> bool {
        let fits = |v: f64, start: f64| {
            v.abs() <= Self::MAX_COORDINATE && (v - start).abs() <= Self::MAX_REACH
        };
        let Pose { x, y, .. } = self.start;
        self.points.iter().all(|p| fits(p[0], x) & fits(p[1], y))
    }

    /// Checks that every outline has enough vertices and `numbers` of each.
    pub(super) fn check_outlines(
        &self,
        numbers: impl Fn(&dyn Fn() -> String, &[f64]) -> Result<(), InvalidField>,
    ) -> Result<(), InvalidField> {
        // One by one only where one of them is wrong.
        let wrong: &[_] = if self.points_are_fit() { &[] } else { &self.points };
        let wrong_points = listed(&[], &[], wrong, false);
        let LowObstacles { obstacles, polylines, points } = &self.low;
        let low = listed(obstacles, polylines, points, true);
        for outline in self.solid_outlines().chain(wrong_points).chain(low) {
            for (j, vertex) in outline.vertices.iter().enumerate() {
                let field = || match outline.shape {
                    Shape::Point => outline.to_string(),
                    _ => format!("{outline}[{j}]"),
                };
                numbers(&field, vertex)?;
            }
            // Of `obstacles` two vertices are a wall; of the area's parts nothing is.
            let is_area = outline.list.starts_with("drivable_area");
            let (needed, what) = match (outline.list, is_area) {
                ("points", _) => continue,
                (_, true) => (3, "expected at least 3"),
                ("polylines", _) => (2, "a polyline needs at least 2"),
                _ => (2, r#"a polygon needs at least 3, a wall 2 (or use "points")"#),
            };
            if outline.vertices.len() < needed {
                let vertices = match outline.vertices.len() {
                    0 => "no vertices".to_owned(),
                    1 => "1 vertex".to_owned(),
                    n => format!("{n} vertices"),
                };
                let message = format!("has {vertices}; {what}");
                return Err(InvalidField { field: outline.to_string(), message });
            }
        }
        Ok(())
    }
}

fn geometry<'a>(
    outlines: impl Iterator<Item = Outline<'a>>,
    points: &[[f64; 2]],
    map: impl Fn(Vec2) -> Vec2,
) -> Result<Obstacles, ObstacleError> {
    let (mut polygons, mut walls) = (Vec::new(), Vec::new());
    for outline in outlines {
        let mut vertices = outline.points().map(&map);
        let added = match outline.shape {
            Shape::Point => continue,
            Shape::Solid => Polygon::new(vertices.collect()).map(|polygon| polygons.push(polygon)),
            Shape::Chain => Polyline::new(vertices.collect()).map(|wall| walls.push(wall)),
            Shape::Border => {
                let first = vertices.next();
                let ring = first.into_iter().chain(vertices).chain(first).collect();
                Polyline::new(ring).map(|wall| walls.push(wall))
            }
        };
        added.map_err(|fault| {
            let kind = if outline.shape == Shape::Solid { "polygon" } else { "polyline" };
            ObstacleError::Shape { kind, index: outline.index.unwrap_or(0), fault }
        })?;
    }
    let points = points.iter().map(|&[x, y]| map(Vec2::new(x, y)));
    Obstacles::new(polygons, walls, points.collect())
}
