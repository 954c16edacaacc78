//! The card of a policy.

use std::fmt::Write;
use std::path::Path;

use super::log::RlLog;
use crate::environment::courses::{Course, Stratum};
use crate::lab::dataset::card::percent;
use crate::lab::training::card::{VERSION, name};
use crate::world::ParkingType;

/// The card of the policy in `out`.
pub(super) fn card(out: &Path, log: &RlLog) -> String {
    let (file, c, best) = (name(out), &log.config, log.best());
    let v = &c.vehicle;
    let learnt = match log.course {
        Course::Simple => {
            "abstracted environments: a lane and a spot, walls around, sizes and starts drawn as \
             the scene generator draws them for its levels"
        }
        Course::Eval => {
            "generated scenes of other seeds than those that evaluate: half of them like those, half with \
             sizes drawn far wider"
        }
    };
    let mut validation = String::new();
    for kind in ParkingType::SQUARE {
        let share = |v: &super::log::Validation| percent(v.share(kind, c.validation_count));
        let _ =
            writeln!(validation, "| {kind} | {} | {} |", share(&best.sampled), share(&best.mean));
    }
    let (sampled, mean) = (best.sampled.mean_steps, best.mean.mean_steps);
    let last = log.points.last().expect("a card is written after a point");
    let settings = toml::to_string(c).expect("settings are plain values");
    let problems = Stratum::COUNT * c.validation_count;
    format!(
        "\
# Model card: {file}

A policy that parks step by step: it sees distances around the car, where the goal lies and which
steps are free, and answers with steering and speed. Trained by soft actor-critic after HOPE
(docs/policies.md says what it sees and does, docs/design-notes.md what differs). Written by n3p {VERSION}.

## What it is for

The method `rl-{course}` of the tables: a baseline. Every half second it drives one step, until a
free Reeds-Shepp curve leads into the spot. Contact ends a step early and is never entered; the
whole path is checked before it is returned. It is no controller: nothing real is in the loop.

## Limits

- **No guarantee to arrive**: a scene may run out of steps.
- **One vehicle**: length {length} m, width {width} m, wheelbase {wheelbase} m, rear overhang {rear} m, steering
  limit {steer:.4} rad, {forward} m/s forward and {backward} m/s backward. For any other the policy is refused.
- **Learnt in** {learnt}.

## Training

| | |
|---|---|
| Episodes until this policy | {episodes} |
| Episodes in all | {all} |
| Steps, updates in all | {steps}, {updates} |
| Seed of the training, of the validation | {seed}, {validation_seed} |

The curve is in `{stem}.training.svg`, its numbers in `{stem}.training.json`.

## How good it is

Share of {problems} validation problems that are parked within {horizon} steps:

| type | drawn actions | mean action within the mask |
|---|--:|--:|
{validation}
They take {sampled:.1} and {mean:.1} steps on average, those along the last curve included.

## Settings

```toml
{settings}```
",
        course = log.course.name(),
        length = v.length,
        width = v.width,
        wheelbase = v.wheelbase,
        rear = v.rear_overhang,
        steer = v.max_steer,
        forward = v.forward_speed,
        backward = v.backward_speed,
        episodes = best.episodes,
        all = last.episodes,
        steps = last.steps,
        updates = last.updates,
        seed = c.seed,
        validation_seed = c.validation_seed,
        stem = out.file_stem().unwrap_or_default().to_string_lossy(),
        horizon = c.env.horizon,
    )
}
