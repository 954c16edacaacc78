//! One method whose models were trained for several vehicles.

use crate::planners::{Budget, HybridAStarConfig, NoPath, PlanResult, Planner, Problem};
use crate::vehicle::Vehicle;

type Boxed = Box<dyn Planner + Send>;

/// Plans with the planner of the problem's vehicle, or of the first that covers it, or with one
/// for any vehicle.
pub(super) struct ByVehicle {
    planners: Vec<(Vehicle, Boxed)>,
    any: Option<Boxed>,
}

impl ByVehicle {
    /// The planners of a method, each with the vehicle its models were trained for, and one for any
    /// other vehicle; `None` without any at all.
    #[expect(clippy::new_ret_no_self, reason = "one planner needs nobody to choose")]
    pub fn new(mut planners: Vec<(Vehicle, Boxed)>, any: Option<Boxed>) -> Option<Boxed> {
        match (planners.len(), &any) {
            (0, _) => any,
            (1, None) => planners.pop().map(|(_, planner)| planner),
            _ => Some(Box::new(Self { planners, any })),
        }
    }
}

impl Planner for ByVehicle {
    fn name(&self) -> &str {
        self.planners[0].1.name()
    }

    fn config(&self) -> HybridAStarConfig {
        self.planners[0].1.config()
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let wanted = &problem.vehicle;
        // Speeds matter to policies alone, and only for them do two vehicles differ in nothing else.
        let same = self.planners.iter().position(|(vehicle, _)| vehicle.drives_like(wanted));
        let like = || self.planners.iter().position(|(vehicle, _)| vehicle.is_like(wanted));
        let own = same.or_else(like);
        let serving =
            own.or_else(|| self.planners.iter().position(|(vehicle, _)| vehicle.covers(wanted)));
        match (serving, &mut self.any) {
            (Some(at), _) => self.planners[at].1.plan(problem, budget),
            (None, Some(any)) => any.plan(problem, budget),
            (None, None) => PlanResult::none(NoPath::Failed("no model for this vehicle"), 0),
        }
    }
}
