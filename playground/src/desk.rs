//! Planners, kept warm: making one reads a model, and its first plan prepares what it knows.

use n3p::n3p::{GuidedPlanner, MethodSettings};
use n3p::planners::Planner;
use n3p::{Method, Models, Vehicle};

use crate::ask::Failure;

/// Of so many vehicles the models are kept, and so many planners.
const VEHICLES: usize = 3;
const PLANNERS: usize = 8;

/// What one thread plans with; the latest first.
#[derive(Default)]
pub struct Desk {
    models: Vec<(Vehicle, Models)>,
    planners: Vec<(Vehicle, Method, Box<dyn Planner + Send>)>,
    telling: Vec<(Vehicle, GuidedPlanner)>,
}

impl Desk {
    /// The models that serve a vehicle.
    pub fn models(&mut self, vehicle: &Vehicle) -> Result<&Models, Failure> {
        if !to_front(&mut self.models, |(known, _)| known == vehicle) {
            let models = Models::compiled_in(vehicle).map_err(|e| Failure::of(None, e))?;
            put(&mut self.models, VEHICLES, (*vehicle, models));
        }
        Ok(&self.models[0].1)
    }

    /// The planner of a method for a vehicle.
    pub fn planner(
        &mut self,
        method: Method,
        vehicle: &Vehicle,
    ) -> Result<&mut (dyn Planner + Send), Failure> {
        if !to_front(&mut self.planners, |(v, m, _)| v == vehicle && *m == method) {
            let models = self.models(vehicle)?;
            let built = method.build(models, &MethodSettings::default());
            let lacks_model = |_| {
                let message =
                    format!("{method} has no model for this vehicle; take n3p or a search");
                Failure::of(Some("method"), message)
            };
            put(&mut self.planners, PLANNERS, (*vehicle, method, built.map_err(lacks_model)?));
        }
        Ok(self.planners[0].2.as_mut())
    }

    /// The planner of `n3p` that tells what it tries; `None` for a vehicle without a model.
    pub fn telling(&mut self, vehicle: &Vehicle) -> Result<Option<&mut GuidedPlanner>, Failure> {
        if !to_front(&mut self.telling, |(known, _)| known == vehicle) {
            let models = self.models(vehicle)?;
            let Some(selector) = models.selector(Method::N3P, vehicle) else { return Ok(None) };
            let MethodSettings { planner, n3p, .. } = MethodSettings::default();
            let guided = GuidedPlanner::ranked(Method::N3P.name(), selector, planner, n3p)
                .with_foresight(models.foresight().cloned());
            put(&mut self.telling, VEHICLES, (*vehicle, guided));
        }
        Ok(Some(&mut self.telling[0].1))
    }
}

/// Moves the first that `is_it` to the front; false where there is none.
fn to_front<T>(all: &mut [T], is_it: impl Fn(&T) -> bool) -> bool {
    let Some(at) = all.iter().position(is_it) else { return false };
    all[..=at].rotate_right(1);
    true
}

/// Puts one in front; of more than `most` the last goes.
fn put<T>(all: &mut Vec<T>, most: usize, one: T) {
    all.truncate(most - 1);
    all.insert(0, one);
}
