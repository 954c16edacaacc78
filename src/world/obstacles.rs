//! Obstacle geometry without an index.

use crate::geometry::{Aabb, Polygon, PolygonError, Polyline, Vec2};

/// Solid polygons, walls and single points, all in one frame; every coordinate is finite.
///
/// What is not valid cannot become obstacles: a planner that leaves out what it does not
/// understand would drive through it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Obstacles {
    polygons: Vec<Polygon>,
    polylines: Vec<Polyline>,
    points: Vec<Vec2>,
}

/// An obstacle that is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObstacleError {
    /// A polygon or a polyline has a vertex that is NaN or infinite.
    #[error("{kind} {index} is not valid: it {fault}")]
    Shape {
        /// `polygon` or `polyline`.
        kind: &'static str,
        /// Its index among those of its kind.
        index: usize,
        /// What is wrong with it.
        fault: PolygonError,
    },
    /// A coordinate of a point is NaN or infinite.
    #[error("point {0} is not a finite point")]
    Point(usize),
}

impl Obstacles {
    /// Takes obstacles and checks every coordinate.
    pub fn new(
        polygons: Vec<Polygon>,
        polylines: Vec<Polyline>,
        points: Vec<Vec2>,
    ) -> Result<Self, ObstacleError> {
        let is_finite = |p: &Vec2| p.x.is_finite() && p.y.is_finite();
        // A polygon that was moved into a frame that is not finite has lost its coordinates.
        let check = |kind, index, vertices: &[Vec2]| match vertices
            .iter()
            .position(|v| !is_finite(v))
        {
            Some(i) => Err(ObstacleError::Shape { kind, index, fault: PolygonError::NotFinite(i) }),
            None => Ok(()),
        };
        for (i, p) in polygons.iter().enumerate() {
            check("polygon", i, p.vertices())?;
        }
        for (i, p) in polylines.iter().enumerate() {
            check("polyline", i, p.vertices())?;
        }
        match points.iter().position(|p| !is_finite(p)) {
            Some(i) => Err(ObstacleError::Point(i)),
            None => Ok(Self { polygons, polylines, points }),
        }
    }

    /// Solid polygons; they may touch or overlap.
    pub fn polygons(&self) -> &[Polygon] {
        &self.polygons
    }

    /// Walls of no thickness.
    pub fn polylines(&self) -> &[Polyline] {
        &self.polylines
    }

    /// Single points, as a range sensor sees them.
    pub fn points(&self) -> &[Vec2] {
        &self.points
    }

    /// Those for which `holds`, each asked alone, and the others.
    pub fn partition(&self, holds: impl Fn(&Obstacles) -> bool) -> (Obstacles, Obstacles) {
        let mut parts = (Obstacles::default(), Obstacles::default());
        let mut take = |one: Obstacles| {
            let part = if holds(&one) { &mut parts.0 } else { &mut parts.1 };
            part.polygons.extend(one.polygons);
            part.polylines.extend(one.polylines);
            part.points.extend(one.points);
        };
        self.each().for_each(&mut take);
        parts
    }

    /// How many vertices and points there are.
    pub fn vertices(&self) -> usize {
        let polygons = self.polygons.iter().map(|p| p.vertices().len());
        let walls = self.polylines.iter().map(|w| w.vertices().len());
        polygons.chain(walls).sum::<usize>() + self.points.len()
    }

    /// Those whose boxes touch `near`, and the others.
    pub fn split_at(&self, near: &Aabb) -> (Obstacles, Obstacles) {
        fn split<T: Clone>(all: &[T], is_near: impl Fn(&T) -> bool) -> (Vec<T>, Vec<T>) {
            all.iter().cloned().partition(is_near)
        }
        let (polygons, other_polygons) = split(&self.polygons, |p| p.aabb().intersects(near));
        let (polylines, other_polylines) = split(&self.polylines, |w| w.aabb().intersects(near));
        let (points, other_points) = split(&self.points, |p| near.contains(*p));
        let far = Obstacles {
            polygons: other_polygons,
            polylines: other_polylines,
            points: other_points,
        };
        (Obstacles { polygons, polylines, points }, far)
    }

    /// These and others.
    pub fn and(mut self, others: Obstacles) -> Obstacles {
        self.polygons.extend(others.polygons);
        self.polylines.extend(others.polylines);
        self.points.extend(others.points);
        self
    }

    /// Those whose boxes touch `near`.
    pub fn within(&self, near: &Aabb) -> Obstacles {
        fn some<T: Clone>(all: &[T], is_near: impl Fn(&T) -> bool) -> Vec<T> {
            all.iter().filter(|one| is_near(one)).cloned().collect()
        }
        Obstacles {
            polygons: some(&self.polygons, |p| p.aabb().intersects(near)),
            polylines: some(&self.polylines, |w| w.aabb().intersects(near)),
            points: some(&self.points, |p| near.contains(*p)),
        }
    }

    /// Each of them alone.
    pub fn each(&self) -> impl Iterator<Item = Obstacles> + '_ {
        let none = Obstacles::default;
        let polygons = self.polygons.iter();
        let polygons = polygons.map(move |p| Obstacles { polygons: vec![p.clone()], ..none() });
        let walls = self.polylines.iter();
        let walls = walls.map(move |w| Obstacles { polylines: vec![w.clone()], ..none() });
        let points = self.points.iter().map(move |&p| Obstacles { points: vec![p], ..none() });
        polygons.chain(walls).chain(points)
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.polygons.is_empty() && self.polylines.is_empty() && self.points.is_empty()
    }

    /// Every edge of polygons and polylines, and every point as an edge of length zero.
    pub fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        let points = self.points.iter().map(|&p| (p, p));
        let walls = self.polylines.iter().flat_map(Polyline::edges);
        self.polygons.iter().flat_map(Polygon::edges).chain(walls).chain(points)
    }

    /// The smallest box around everything.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(self.edges().map(|(a, _)| a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;

    #[test]
    fn nothing_that_is_not_finite_becomes_an_obstacle() {
        let nan = Vec2::new(0.0, f64::NAN);
        assert_eq!(
            Obstacles::new(vec![], vec![], vec![Vec2::zeros(), nan]),
            Err(ObstacleError::Point(1))
        );
        let lost =
            Polygon::rectangle(Pose::new(f64::INFINITY, 0.0, 0.0), Aabb::new(0., 0., 1., 1.));
        assert!(Obstacles::new(vec![lost], vec![], vec![]).is_err());
    }
}
