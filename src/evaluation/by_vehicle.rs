//! One method whose models were trained for several vehicles.

use crate::planners::{Budget, NoPath, PlanResult, Planner, Problem};
use crate::vehicle::Vehicle;

/// Plans with the planner of the problem's vehicle, or of the first that covers it.
pub(super) struct ByVehicle {
    planners: Vec<(Vehicle, Box<dyn Planner + Send>)>,
}

impl ByVehicle {
    /// The planners of a method, each with the vehicle its models were trained for; `None`
    /// without any.
    #[expect(clippy::new_ret_no_self, reason = "one planner needs nobody to choose")]
    pub fn new(
        mut planners: Vec<(Vehicle, Box<dyn Planner + Send>)>,
    ) -> Option<Box<dyn Planner + Send>> {
        match planners.len() {
            0 => None,
            1 => planners.pop().map(|(_, planner)| planner),
            _ => Some(Box::new(Self { planners })),
        }
    }
}

impl Planner for ByVehicle {
    fn name(&self) -> &str {
        self.planners[0].1.name()
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let wanted = &problem.vehicle;
        let own = self.planners.iter().position(|(vehicle, _)| vehicle.is_like(wanted));
        let serving =
            own.or_else(|| self.planners.iter().position(|(vehicle, _)| vehicle.covers(wanted)));
        match serving {
            Some(at) => self.planners[at].1.plan(problem, budget),
            None => PlanResult::none(NoPath::Failed("no model for this vehicle"), 0),
        }
    }
}
