//! What was planned.

use std::ffi::{CStr, CString, c_char};
use std::sync::{Arc, Mutex, OnceLock};

use n3p::Plan;
use n3p::curves::TrajectoryLimits;
use n3p::output::{Driven, PathFile};

use super::handles::Table;
use super::memory::{Place, fill, read_or};
use super::status::{Failure, Result, guarded, n3p_status};
use super::types::{
    n3p_limits, n3p_limits_default, n3p_moment, n3p_path_pose, n3p_summary, parking_number,
    short_name,
};

/// A path that the exact swept check has passed, and how it came about.
pub enum n3p_plan {}

pub(crate) static PLANS: Table<Kept> = Table::new("n3p_plan", 4);

/// A plan, with what somebody has asked for: who asks for a size first asks twice.
pub(crate) struct Kept {
    pub(crate) plan: Plan,
    poses: OnceLock<PathFile>,
    json: OnceLock<CString>,
    /// The path in time within the limits that were asked for last.
    driven: Mutex<Option<(TrajectoryLimits, Arc<Driven>)>>,
}

impl Kept {
    pub fn new(plan: Plan) -> Self {
        Self { plan, poses: OnceLock::new(), json: OnceLock::new(), driven: Mutex::default() }
    }

    fn poses(&self) -> &PathFile {
        self.poses.get_or_init(|| self.plan.poses())
    }

    fn json(&self) -> &CStr {
        let json = || CString::new(self.poses().to_json()).expect("JSON escapes what is NUL");
        self.json.get_or_init(json)
    }

    fn driven(&self, limits: &TrajectoryLimits) -> Result<Arc<Driven>> {
        let mut last = self.driven.lock().unwrap_or_else(|e| e.into_inner());
        if let Some((_, driven)) = last.as_ref().filter(|(of, _)| of == limits) {
            return Ok(driven.clone());
        }
        let driven = self.plan.trajectory(limits);
        let driven = driven.map_err(|e| Failure::bad_input(format!("limits: {e}")))?;
        Ok(last.insert((*limits, Arc::new(driven))).1.clone())
    }
}

/// Frees a plan; NULL is none.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_plan_free(plan: *mut n3p_plan) -> n3p_status {
    guarded(|| PLANS.close(plan))
}

/// What the plan came to.
#[doc = safety!("`summary` leads to room for such a struct.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_plan_summary(
    plan: *const n3p_plan,
    summary: *mut n3p_summary,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let summary = unsafe { Place::new(summary, "summary") }?;
        let plan = &PLANS.get(plan, "plan")?.plan;
        summary.put(n3p_summary {
            length: plan.length(),
            margin: plan.margin(),
            direction_changes: plan.direction_changes(),
            expansions: plan.expansions(),
            goal_index: plan.goal_index(),
            parking_type: parking_number(plan.parking_type()),
            method: short_name(plan.method().name()),
            route: short_name(plan.route().map_or("", |route| route.name())),
        });
        Ok(())
    })
}

/// Writes the path to `buffer`, which has room for `capacity` poses: poses at most 5 cm apart, the
/// first the start. `count` becomes their number; where that is more than `capacity`, nothing else
/// is written and the function returns N3P_BUFFER_TOO_SMALL. NULL with a capacity of 0 asks for the
/// number alone.
#[doc = safety!(
    "`buffer` leads to room for `capacity` poses, and `count` to room for a number apart from them."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_plan_poses(
    plan: *const n3p_plan,
    buffer: *mut n3p_path_pose,
    capacity: usize,
    count: *mut usize,
) -> n3p_status {
    guarded(|| {
        let plan = PLANS.get(plan, "plan")?;
        let file = plan.poses();
        let poses = (0..file.poses.len()).map(|i| {
            let [x, y, heading] = file.poses[i];
            let steer = file.steer[i];
            let [steer_from, steer_to] = [&file.steer_from, &file.steer_to]
                .map(|angles| angles.as_ref().map_or(steer, |angles| angles[i]));
            let gear = file.gears[i].into();
            n3p_path_pose { x, y, heading, steer, steer_from, steer_to, gear }
        });
        // SAFETY: what this function asks for.
        unsafe { fill(poses, buffer, capacity, count) }
    })
}

/// Writes the path in time to `buffer`, as n3p_plan_poses does: moments 0.05 s apart, and the end.
/// NULL limits are those of n3p_limits_default.
#[doc = safety!(
    "`limits` leads to such a struct, which nobody changes meanwhile; `buffer` leads to room for \
     `capacity` moments, and `count` to room for a number, apart from it and from each other."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_plan_trajectory(
    plan: *const n3p_plan,
    limits: *const n3p_limits,
    buffer: *mut n3p_moment,
    capacity: usize,
    count: *mut usize,
) -> n3p_status {
    guarded(|| {
        let plan = PLANS.get(plan, "plan")?;
        // SAFETY: what this function asks for.
        let limits = unsafe { read_or(limits, "limits", n3p_limits_default()) }?;
        let driven = plan.driven(&limits.into())?;
        // SAFETY: what this function asks for.
        unsafe { fill(driven.moments.iter().map(n3p_moment::from), buffer, capacity, count) }
    })
}

/// Writes the path to `buffer` as the JSON of path files (docs/formats.md), byte by byte what
/// n3p-plan --out writes, and a NUL. `length` becomes the number of bytes without the NUL: the
/// buffer needs a capacity of one more. Otherwise as n3p_plan_poses.
#[doc = safety!(
    "`buffer` leads to room for `capacity` bytes, and `length` to room for a number apart from them."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_plan_json(
    plan: *const n3p_plan,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let place = unsafe { Place::new(length, "length") }?;
        let plan = PLANS.get(plan, "plan")?;
        let text = plan.json().to_bytes_with_nul();
        let mut with_nul = 0;
        place.put(text.len() - 1);
        // SAFETY: what this function asks for of `buffer`.
        unsafe { fill(text.iter().map(|&b| b as c_char), buffer, capacity, &mut with_nul) }
    })
}
