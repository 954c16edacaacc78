//! The planner: whatever the scene, a path that holds, or a reason; within its budget, and twice the same.

use std::cell::RefCell;
use std::collections::HashMap;

use arbitrary::{Arbitrary, Result, Unstructured};
use n3p::curves::TrajectoryLimits;
use n3p::curves::smoothing::StandstillSteering;
use n3p::output::Driven;
use n3p::planners::goals::{self, Terms};
use n3p::planners::{Budget, Effort, Planner};
use n3p::world::Scene;
use n3p::{Method, Models, Vehicle};

use crate::{check, scenes};

/// A scene, and what is asked.
pub struct Asked {
    pub scene: Scene,
    pub method: &'static str,
    pub terms: Terms,
    pub budget: Budget,
}

impl<'a> Arbitrary<'a> for Asked {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let method = ["n3p", "n3p", "n3p", "ha-rs", "ha", "mhha", "sha"];
        let method = *u.choose(&method)?;
        let mut terms = Terms::default();
        if u8::arbitrary(u)? % 4 == 0 {
            terms.margin = f64::from(u8::arbitrary(u)?) / 1000.0;
        }
        if u8::arbitrary(u)? % 4 == 0 {
            terms.contact = f64::from(u8::arbitrary(u)? % 200) / 1000.0;
        }
        if u8::arbitrary(u)? % 3 == 0 {
            terms.standstill = *u.choose(&StandstillSteering::ALL)?;
        }
        let effort = *u.choose(&Effort::ALL)?;
        // Few, so that a plan takes little time; at times so many that searches become careful.
        let most = if u8::arbitrary(u)? % 16 == 0 { u16::MAX } else { 2000 };
        let max_expansions = usize::from(u16::arbitrary(u)? % most);
        let budget = Budget { max_expansions, effort };
        Ok(Self { scene: scenes::scene(u)?, method, terms, budget })
    }
}

type Known = HashMap<(&'static str, String), Box<dyn Planner + Send>>;

/// Plans by a planner that stays, as a parker's do. `None` where the models do not serve the vehicle.
pub fn with_planner<T>(asked: &Asked, plan: impl FnOnce(&mut dyn Planner) -> T) -> Option<T> {
    thread_local! {
        static PLANNERS: RefCell<Known> = RefCell::default();
    }
    PLANNERS.with_borrow_mut(|known| {
        let key = (asked.method, format!("{:?}", asked.scene.vehicle));
        let planner = match known.entry(key) {
            std::collections::hash_map::Entry::Occupied(known) => known.into_mut(),
            std::collections::hash_map::Entry::Vacant(new) => new.insert(build(asked)?),
        };
        Some(plan(planner.as_mut()))
    })
}

fn build(asked: &Asked) -> Option<Box<dyn Planner + Send>> {
    let vehicle: &Vehicle = &asked.scene.vehicle;
    let method: Method = asked.method.parse().expect("a method's name");
    let models = Models::compiled_in(vehicle).expect("what is compiled in is whole");
    models.check_vehicle(method, "fuzz", vehicle).ok()?;
    method.build(&models, &Default::default()).ok()
}

/// The planner on a structured random scene.
pub fn planner(data: &[u8]) {
    let Ok(asked) = Asked::arbitrary(&mut Unstructured::new(data)) else { return };
    with_planner(&asked, |planner| tried(planner, &asked));
}

fn tried(planner: &mut dyn Planner, asked: &Asked) {
    let Asked { scene, terms, budget, .. } = asked;
    let Ok(planned) = goals::plan(planner, scene, *terms, *budget) else { return };
    // Each goal has the budget, and once more for the poses beside it.
    let most = 2 * scene.all_goals().len() * budget.max_expansions;
    let spent = planned.result.expansions;
    assert!(spent <= most, "{spent} expansions, allowed {most}");
    let again = goals::plan(planner, scene, *terms, *budget).expect("it was a problem before");
    assert_eq!(again.result.outcome, planned.result.outcome, "two plans of one scene differ");
    assert_eq!(again.result.expansions, spent);
    let Some(driven) = planned.result.driven() else { return };
    let goal = scene.all_goals()[planned.goal_index];
    let tolerance = scene.goal_tolerance.unwrap_or_default();
    let end = planned.problem.frame.world_from_local(driven.end());
    let rounding = 1e-6 + 8.0 * goal.resolution();
    assert!(tolerance.holds(goal, end, rounding), "ends at {end:?}, not at {goal:?}");
    let to_goal = scene.with_goal(goal);
    check::path(&to_goal, &planned.problem.frame, &driven, terms.contact);
    for stop_to_steer in [false, true] {
        let limits = TrajectoryLimits { stop_to_steer, ..TrajectoryLimits::default() };
        let ends = [scene.start, goal];
        let driven = Driven::new(ends, &scene.vehicle, &planned.problem.frame, &driven, &limits);
        let moments = driven.expect("the usual limits").moments;
        let rises = moments
            .windows(2)
            .all(|m| m[0].time <= m[1].time && m[0].distance <= m[1].distance + 1e-9);
        assert!(rises, "time or distance falls");
        let finite = |v: f64| v.is_finite();
        assert!(moments.iter().all(|m| finite(m.time) && finite(m.speed) && m.pose.is_finite()));
        assert!(
            moments.last().is_none_or(|m| m.speed.abs() < 1e-6),
            "it does not stand at the end"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Inputs of the fuzzer are about something: most scenes have a path, by every method.
    #[test]
    fn most_scenes_are_planned() {
        let mut planned = HashMap::<&str, [u32; 2]>::new();
        for n in 0..300_u32 {
            let bytes: Vec<u8> = (0..400).map(|i| (n * 7919 + i * i * 31 + i * n) as u8).collect();
            let asked = Asked::arbitrary(&mut Unstructured::new(&bytes)).unwrap();
            let found = with_planner(&asked, |planner| {
                let planned = goals::plan(planner, &asked.scene, asked.terms, asked.budget);
                planned.is_ok_and(|p| p.result.outcome.is_ok())
            });
            let count = planned.entry(asked.method).or_default();
            count[0] += 1;
            count[1] += u32::from(found == Some(true));
        }
        println!("{planned:?}");
        assert!(planned.len() >= 4 && planned["n3p"][1] * 2 > planned["n3p"][0], "{planned:?}");
    }
}
