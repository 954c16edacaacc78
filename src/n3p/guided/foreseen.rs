//! What `n3p` foresees: which known manoeuvres to try first, and what a plan may cost.

use super::GuidedPlanner;
use super::known::{Known, USUAL, directly, is_in_sight, least};
use crate::planners::Problem;
use crate::selectors::foresight::{Codes, Outlook};

/// So many of the most promising manoeuvres are tried.
const PROMISING: usize = 16;
/// What costs so many times what is foreseen is taken at once: the network errs by as much (its card).
const AT_ONCE: f64 = 1.02;
/// A plan will do that costs at most so many times what is foreseen; for one that costs so many times as much
/// other ways than along known manoeuvres are tried, or it is searched for once more. All chosen in the
/// world "wide" and at home, seed 92.
const WILL_DO: f64 = 1.2;
const OFF_FORESEEN: f64 = 1.3;
pub(super) const FAR_FROM_FORESEEN: f64 = 1.6;
/// What is foreseen to cost so many times the estimate is not believed.
const ABSURD: f64 = 10.0;

impl Known {
    /// Whether it costs clearly more than the best plan was foreseen to cost, or nothing is foreseen.
    pub(super) fn is_off_foreseen(&self) -> bool {
        self.foreseen.is_none_or(|foreseen| self.cost > OFF_FORESEEN * foreseen)
    }

    /// Whether it costs about what the best plan was foreseen to cost, or less; `None` without foresight.
    pub(super) fn is_as_foreseen(&self) -> Option<bool> {
        self.foreseen.map(|foreseen| self.cost <= WILL_DO * foreseen)
    }
}

/// The manoeuvres of a library in the order in which foresight would try them; buffers are reused.
#[derive(Default)]
pub(super) struct Ranking {
    outlook: Outlook,
    scores: Vec<f32>,
    order: Vec<u32>,
}

impl Ranking {
    /// The most promising manoeuvres come first; the others are left out.
    fn order(&mut self, codes: &Codes, estimates: &[f32]) -> &[u32] {
        let Self { outlook, scores, order } = self;
        codes.scores(outlook, estimates, scores);
        order.clear();
        let (score, mut least) = (|index: u32| scores[index as usize], f32::NEG_INFINITY);
        for (index, &own) in (0..).zip(scores.iter()) {
            if order.len() == PROMISING && own <= least {
                continue;
            }
            order.truncate(PROMISING - 1);
            let at = order.partition_point(|&better| score(better) >= own);
            order.insert(at, index);
            least = score(order[order.len() - 1]);
        }
        order
    }
}

impl GuidedPlanner {
    /// The cheapest of the most promising manoeuvres, if one of them can be driven, and what the best plan is
    /// foreseen to cost, if anything is foreseen.
    pub(super) fn look_ahead(&mut self, problem: &Problem) -> (Option<Known>, Option<f64>) {
        let Self { libraries, library_search, checked, hars, foresight, ranking, .. } = self;
        let prepared = &libraries[0];
        let foresight = foresight.as_ref().filter(|_| is_in_sight(problem));
        let Some((foresight, codes)) = foresight.zip(prepared.codes.as_ref()) else {
            return (None, None);
        };
        let cost = hars.cost(&problem.vehicle);
        let (library, verdicts, any) = (&prepared.library, &mut checked.common, f64::INFINITY);
        let mut look_up = library_search.look_up(library, verdicts, problem, &cost, any);
        let estimates = look_up.least_estimates(prepared.straights);
        let least = least(problem, &cost, estimates);
        ranking.outlook = foresight.look(problem, prepared.stance, [estimates.0, estimates.1]);
        let foreseen = ranking.outlook.cost;
        // It never saw the like.
        if foreseen > ABSURD * least {
            return (None, None);
        }
        let order = ranking.order(codes, look_up.estimates());
        let first = look_up.promising(order, any, AT_ONCE * foreseen);
        let mut best = first.map(|plan| prepared.known(plan, least));
        // Where that is far above what estimates say these have a say, too: elsewhere than where it has
        // learnt the network errs.
        if let Some(known) = best.as_ref().filter(|known| known.cost > USUAL * least)
            && let Some(better) = look_up.cheapest(Some(known.cost), any, 0)
        {
            best = Some(prepared.known(better, least));
        }
        // Where nothing bounds the spot no change of gear may be needed, whatever is foreseen.
        if ranking.outlook.in_the_open
            && let Some(known) = &best
            && let Some(leg) =
                hars.direct_below(problem, problem.start, &hars.goal_set(problem), known.cost)
        {
            best = Some(directly(leg, least));
        }
        (best, Some(foreseen))
    }
}
