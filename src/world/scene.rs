//! A scene: what a user gives a planner. Read from JSON, TPCAP CSV, or generated.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Obstacles, ParkingType};
use crate::geometry::{Polygon, Pose, Vec2};
use crate::vehicle::Vehicle;

/// A parking scene in its own (world) frame; metres and radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name, used in rows and file names.
    #[serde(default)]
    pub name: String,
    /// Where it comes from, for people.
    #[serde(default)]
    pub source: String,
    /// The car.
    pub vehicle: Vehicle,
    /// Rear-axle pose to start from.
    pub start: Pose,
    /// Rear-axle pose to park at.
    pub goal: Pose,
    /// A hint of how the goal lies in its spot.
    #[serde(default)]
    pub parking_type: Option<ParkingType>,
    /// Simple polygons, closed implicitly.
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// Obstacle points, as a range sensor sees them (an extension of the format).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// The rear axle stays in `[xmin, ymin, xmax, ymax]`.
    #[serde(default)]
    pub bounds: Option<[f64; 4]>,
}

/// A scene that cannot be used, and why.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{path}: cannot read scene: {error}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: std::io::Error,
    },
    /// The file is not the format it should be.
    #[error("{path}: {message}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong and what would be right.
        message: String,
    },
    /// A field has a value that no scene can have.
    #[error("{path}: {field}: {message}")]
    Invalid {
        /// The file (or the scene's name).
        path: PathBuf,
        /// The field.
        field: String,
        /// What is wrong and what would be right.
        message: String,
    },
}

impl Scene {
    /// Reads one scene from `.json` (the scene format) or `.csv` (TPCAP) and validates it.
    pub fn read(path: &Path) -> Result<Scene, SceneError> {
        let _ = path;
        unimplemented!("helper")
    }

    /// The obstacles as geometry, in the scene's frame. Call after [`Scene::validate`].
    pub fn geometry(&self) -> Obstacles {
        let vec = |&[x, y]: &[f64; 2]| Vec2::new(x, y);
        Obstacles {
            polygons: self
                .obstacles
                .iter()
                .filter_map(|o| Polygon::new(o.iter().map(vec).collect()).ok())
                .collect(),
            points: self.points.iter().map(vec).collect(),
        }
    }
}
