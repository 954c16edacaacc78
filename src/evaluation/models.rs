//! The trained models of one run, whichever files they come from.

use std::sync::Arc;

use crate::geometry::Pose;
use crate::selectors::{Features, PoseSelector};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;
use crate::world::cell::Grid;

/// Models by family. Files may hold one parking type each; the first one given for a
/// type is used.
#[derive(Clone, Default)]
pub struct Models {
    knn: Vec<Arc<dyn PoseSelector>>,
    mlp: Vec<Arc<dyn PoseSelector>>,
    vehicle: Option<Vehicle>,
}

/// Models that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelsError {
    /// A file cannot be loaded.
    #[error("--model {name}: {message}")]
    Load {
        /// As given.
        name: String,
        /// Why, and what would be right.
        message: String,
    },
    /// Two files were trained for different vehicles or grids.
    #[error(
        "--model {name}: trained for another {what} than the models before it; evaluate them in separate runs"
    )]
    Mixed {
        /// As given.
        name: String,
        /// `vehicle` or `grid of cells`.
        what: &'static str,
    },
    /// The scene's vehicle is not the one trained for.
    #[error(
        "{scene}: vehicle: the models were trained for another vehicle ({trained}), the scene has \
         {found}; collect and train for this vehicle, or use --methods ha-rs"
    )]
    Vehicle {
        /// Name of the scene.
        scene: String,
        /// Dimensions of the models' vehicle.
        trained: String,
        /// Dimensions of the scene's vehicle.
        found: String,
    },
}

/// The two families of selectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    Knn,
    Mlp,
}

/// What one artefact holds.
struct Loaded {
    family: Family,
    selector: Arc<dyn PoseSelector>,
    vehicle: Vehicle,
}

impl Models {
    /// Loads every file of `names`; bare names are looked for in the working folder,
    /// then in `models/`.
    pub fn load(names: &[String]) -> Result<Self, ModelsError> {
        let mut models = Self::default();
        for name in names {
            let loaded = load_one(name)
                .map_err(|message| ModelsError::Load { name: name.clone(), message })?;
            models.add(name, loaded)?;
        }
        Ok(models)
    }

    fn add(&mut self, name: &str, loaded: Loaded) -> Result<(), ModelsError> {
        let mixed = |what| Err(ModelsError::Mixed { name: name.to_owned(), what });
        if self.vehicle.is_some_and(|v| !same_body(&v, &loaded.vehicle)) {
            return mixed("vehicle");
        }
        let family = match loaded.family {
            Family::Knn => &mut self.knn,
            Family::Mlp => &mut self.mlp,
        };
        if family.first().is_some_and(|s| s.grid() != loaded.selector.grid()) {
            return mixed("grid of cells");
        }
        self.vehicle = Some(loaded.vehicle);
        family.push(loaded.selector);
        Ok(())
    }

    /// The KNN selector, if any.
    pub fn knn(&self) -> Option<Arc<dyn PoseSelector>> {
        by_type(&self.knn)
    }

    /// The MLP selector, if any.
    pub fn mlp(&self) -> Option<Arc<dyn PoseSelector>> {
        by_type(&self.mlp)
    }

    /// The vehicle that the models were trained for; `None` without models.
    pub fn vehicle(&self) -> Option<Vehicle> {
        self.vehicle
    }

    /// Refuses a scene with another vehicle than the models'.
    pub fn check_vehicle(&self, scene: &str, vehicle: &Vehicle) -> Result<(), ModelsError> {
        match self.vehicle {
            Some(trained) if !same_body(&trained, vehicle) => Err(ModelsError::Vehicle {
                scene: scene.to_owned(),
                trained: dimensions(&trained),
                found: dimensions(vehicle),
            }),
            _ => Ok(()),
        }
    }
}

/// Whether two vehicles plan alike: speeds only matter for times.
fn same_body(a: &Vehicle, b: &Vehicle) -> bool {
    Vehicle { forward_speed: b.forward_speed, backward_speed: b.backward_speed, ..*a } == *b
}

fn dimensions(v: &Vehicle) -> String {
    format!(
        "{} × {} m, wheelbase {} m, rear overhang {} m, max_steer {:.4} rad",
        v.length, v.width, v.wheelbase, v.rear_overhang, v.max_steer
    )
}

/// Finds, reads and checks one artefact.
fn load_one(name: &str) -> Result<Loaded, String> {
    unimplemented!("selectors::artefact: find_model and Model::load for {name}")
}

/// One selector over files of different parking types.
struct ByType {
    parts: Vec<Arc<dyn PoseSelector>>,
}

fn by_type(parts: &[Arc<dyn PoseSelector>]) -> Option<Arc<dyn PoseSelector>> {
    match parts {
        [] => None,
        [one] => Some(one.clone()),
        parts => Some(Arc::new(ByType { parts: parts.to_vec() })),
    }
}

impl PoseSelector for ByType {
    fn select(&self, features: &Features, k: usize, out: &mut Vec<Pose>) {
        if let Some(part) = self.parts.iter().find(|p| p.kinds().contains(&features.cell.kind)) {
            part.select(features, k, out);
        }
    }

    fn grid(&self) -> &Grid {
        self.parts[0].grid()
    }

    fn kinds(&self) -> Vec<ParkingType> {
        let mut kinds: Vec<_> = self.parts.iter().flat_map(|p| p.kinds()).collect();
        kinds.sort();
        kinds.dedup();
        kinds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::cell::Cell;

    struct Fixed(ParkingType, Grid);

    impl PoseSelector for Fixed {
        fn select(&self, _: &Features, _: usize, out: &mut Vec<Pose>) {
            out.push(Pose::new(f64::from(self.0 as u8), 0.0, 0.0));
        }
        fn grid(&self) -> &Grid {
            &self.1
        }
        fn kinds(&self) -> Vec<ParkingType> {
            vec![self.0]
        }
    }

    fn loaded(kind: ParkingType, vehicle: Vehicle) -> Loaded {
        let selector = Arc::new(Fixed(kind, Grid::default()));
        Loaded { family: Family::Mlp, selector, vehicle }
    }

    #[test]
    fn files_of_one_type_each_answer_for_their_type() {
        let mut models = Models::default();
        for kind in ParkingType::ALL {
            models.add("m", loaded(kind, Vehicle::default())).unwrap();
        }
        let selector = models.mlp().unwrap();
        assert_eq!(selector.kinds().len(), 3);
        for kind in ParkingType::ALL {
            let cell = Cell { kind, lane_width: 5.0, spot_width: 3.0, dead_end: 8.0 };
            let mut out = Vec::new();
            selector.select(&Features::new(Pose::default(), cell), 1, &mut out);
            assert_eq!(out[0].x, f64::from(kind as u8));
        }
        assert!(models.knn().is_none());
    }

    #[test]
    fn another_vehicle_is_refused_another_speed_is_not() {
        let mut models = Models::default();
        models.add("a", loaded(ParkingType::Forward, Vehicle::default())).unwrap();
        let slow = Vehicle { forward_speed: 0.5, ..Vehicle::default() };
        let wide = Vehicle { width: 2.0, ..Vehicle::default() };
        assert!(models.check_vehicle("s", &slow).is_ok());
        let message = models.check_vehicle("s", &wide).unwrap_err().to_string();
        assert!(message.contains("another vehicle") && message.contains("1.86"), "{message}");
        assert!(models.add("b", loaded(ParkingType::Reverse, wide)).is_err());
    }
}
