//! Planning.

use std::iter::zip;
use std::ptr;

use n3p::geometry::Pose;
use n3p::vehicle::Margins;
use n3p::world::{GoalTolerance, Scene};
use n3p::{Method, Models, Parker, Plan, PlanError, Request};

use super::handles::Table;
use super::lot::{held, n3p_lot};
use super::memory::{N3P_MAX_COUNT, Place, read, read_all, read_or, read_text};
use super::plan::{Kept, PLANS, n3p_plan};
use super::scene::{SCENES, n3p_scene};
use super::status::{Failure, Result, guarded, n3p_status};
use super::types::{n3p_margins, n3p_options, n3p_pose, n3p_request, n3p_vehicle, parking_type};

/// Plans for one vehicle.
pub enum n3p_parker {}

static PARKERS: Table<Parker> = Table::new("n3p_parker", 3);

/// Makes a parker for a vehicle, with the models that are compiled in; to be freed by
/// n3p_parker_free. NULL options are the defaults.
#[doc = safety!(
    "`vehicle` and `options` lead to such structs, `options.method` to text that ends with a NUL, and \
     nobody changes these meanwhile; `parker` leads to room for a handle apart from them."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_parker_new(
    vehicle: *const n3p_vehicle,
    options: *const n3p_options,
    parker: *mut *mut n3p_parker,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let parker = unsafe { Place::new(parker, "parker") }?;
        parker.put(ptr::null_mut());
        // SAFETY: what this function asks for.
        let vehicle = unsafe { read(vehicle, "vehicle") }?.into();
        // SAFETY: what this function asks for.
        let options = unsafe { read_or(options, "options", n3p_options::DEFAULT) }?;
        let made = if options.method.is_null() {
            Parker::new(vehicle)?
        } else {
            // SAFETY: what this function asks for.
            let method = method(unsafe { read_text(options.method, "options.method") }?)?;
            vehicle.validate().map_err(n3p::ParkerError::from)?;
            let models = Models::compiled_in(&vehicle).map_err(n3p::ParkerError::from)?;
            Parker::by(method, vehicle, models)?
        };
        let made = made.margin(options.margin)?.allow_contact(options.allow_contact)?;
        let made = made.standstill_steering(options.standstill_steering()?);
        parker.put(PARKERS.open(made.budget(options.budget()?)));
        Ok(())
    })
}

/// The method of this name that can be planned by: all but policies, for which there is no engine.
fn method(name: &str) -> Result<Method> {
    let methods = || Method::all().filter(|method| !method.is_policy());
    methods().find(|method| method.name() == name).ok_or_else(|| {
        let what = match name.parse::<Method>() {
            Ok(policy) => format!("{policy} is a policy, which this library cannot drive"),
            Err(_) => format!("unknown method {name:?}"),
        };
        let expected: Vec<_> = methods().map(Method::name).collect();
        Failure::bad_input(format!(
            "options.method: {what}; expected one of {}",
            expected.join(", ")
        ))
    })
}

/// Frees a parker; NULL is none. Plans of other threads that are under way end well.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_parker_free(parker: *mut n3p_parker) -> n3p_status {
    guarded(|| PARKERS.close(parker))
}

/// Plans from `start` to `goal` among what stands in `lot`. `plan` is to be freed by n3p_plan_free;
/// it is NULL unless the function returns N3P_OK.
#[doc = safety!("`plan` leads to room for a handle.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_parker_plan(
    parker: *const n3p_parker,
    start: n3p_pose,
    goal: n3p_pose,
    lot: *const n3p_lot,
    plan: *mut *mut n3p_plan,
) -> n3p_status {
    let planned = |parker: &Parker| {
        Ok(parker.plan_request(&Request::new(start.into(), goal.into()), &*held(lot, "lot")?)?)
    };
    // SAFETY: what this function asks for.
    unsafe { plan_by(parker, planned, plan) }
}

/// Plans a request, which may have several goals, a tolerance and a parking type, among what stands
/// in `lot`. `plan` as in n3p_parker_plan.
#[doc = safety!(
    "`request` leads to such a struct and its `goals` to `goal_count` poses, which nobody changes \
     meanwhile; `plan` leads to room for a handle apart from them."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_parker_plan_request(
    parker: *const n3p_parker,
    request: *const n3p_request,
    lot: *const n3p_lot,
    plan: *mut *mut n3p_plan,
) -> n3p_status {
    let planned = |parker: &Parker| {
        let lot = held(lot, "lot")?;
        // SAFETY: what this function asks for.
        let request = unsafe { to_request(&read(request, "request")?) }?;
        Ok(parker.plan_request(&request, &lot)?)
    };
    // SAFETY: what this function asks for.
    unsafe { plan_by(parker, planned, plan) }
}

/// Plans a scene, whose vehicle must be the parker's. `plan` as in n3p_parker_plan.
#[doc = safety!("`plan` leads to room for a handle.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_parker_plan_scene(
    parker: *const n3p_parker,
    scene: *const n3p_scene,
    plan: *mut *mut n3p_plan,
) -> n3p_status {
    let planned = |parker: &Parker| Ok(parker.plan_scene(SCENES.get(scene, "scene")?.as_ref())?);
    // SAFETY: what this function asks for.
    unsafe { plan_by(parker, planned, plan) }
}

/// Puts what `planned` comes to into `plan`.
///
/// # Safety
///
/// Where it is neither NULL nor misaligned, `plan` leads to room for a handle.
unsafe fn plan_by(
    parker: *const n3p_parker,
    planned: impl FnOnce(&Parker) -> Result<Plan>,
    plan: *mut *mut n3p_plan,
) -> n3p_status {
    guarded(|| {
        // SAFETY: the caller's word.
        let plan = unsafe { Place::new(plan, "plan") }?;
        plan.put(ptr::null_mut());
        let parker = PARKERS.get(parker, "parker")?;
        plan.put(PLANS.open(Kept::new(planned(&parker)?)));
        Ok(())
    })
}

/// Plans `count` requests by all cores, each in its lot, which several may share; the plans are the
/// same as one by one. `plans` and `statuses`, which may be NULL, have room for as many: of a
/// request that has no plan, the plan is NULL and the status says why.
///
/// Returns N3P_OK where all have plans, and else the status of the first that has none, which the
/// message is about. Where an argument cannot be used nothing is planned: all plans are NULL, and
/// all statuses are what is returned.
#[doc = safety!(
    "`requests` and `lots` lead to `count` values each, every request's `goals` to its `goal_count` \
     poses, and nobody changes these meanwhile; `plans` and `statuses` lead to room for `count` \
     values each, apart from them and from each other."
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_parker_plan_batch(
    parker: *const n3p_parker,
    requests: *const n3p_request,
    lots: *const *const n3p_lot,
    count: usize,
    plans: *mut *mut n3p_plan,
    statuses: *mut n3p_status,
) -> n3p_status {
    // SAFETY: what this function asks for.
    let (plans, statuses) = match unsafe { places(plans, statuses, count) } {
        Ok(places) => places,
        Err(failure) => return guarded(|| Err(failure)),
    };
    let put = |i: usize, plan, status| {
        plans[i].put(plan);
        if let Some(place) = statuses.get(i) {
            place.put(status);
        }
    };
    // So that nothing is left undefined, whatever happens.
    (0..count).for_each(|i| put(i, ptr::null_mut(), n3p_status::N3P_INTERNAL));
    let mut results = Vec::new();
    let status = guarded(|| {
        let parker = PARKERS.get(parker, "parker")?;
        // SAFETY: what this function asks for.
        results = unsafe { planned(&parker, requests, lots, count) }?;
        Ok(())
    });
    if status != n3p_status::N3P_OK {
        (0..count).for_each(|i| put(i, ptr::null_mut(), status));
        return status;
    }
    guarded(|| {
        let mut first = Ok(());
        for (i, result) in results.into_iter().enumerate() {
            match result {
                Ok(plan) => put(i, PLANS.open(Kept::new(plan)), n3p_status::N3P_OK),
                Err(error) => {
                    let Failure { status, message } = error.into();
                    put(i, ptr::null_mut(), status);
                    let message = format!("requests[{i}]: {message}");
                    first = first.and(Err(Failure { status, message }));
                }
            }
        }
        first
    })
}

type Places<T> = Vec<Place<T>>;

/// Where the results of a batch go; no statuses where nobody asks for them.
///
/// # Safety
///
/// Where they are neither NULL nor misaligned, both lead to room for `count` values.
unsafe fn places(
    plans: *mut *mut n3p_plan,
    statuses: *mut n3p_status,
    count: usize,
) -> Result<(Places<*mut n3p_plan>, Places<n3p_status>)> {
    if count > N3P_MAX_COUNT {
        let text = format!("count is {count}; expected at most {N3P_MAX_COUNT}");
        return Err(Failure::bad_input(text));
    }
    let asked = if statuses.is_null() { 0 } else { count };
    // SAFETY: wrapping, so that these are no promises; `Place` has the caller's word.
    let plans = (0..count).map(|i| unsafe { Place::new(plans.wrapping_add(i), "plans") });
    // SAFETY: as above.
    let statuses = (0..asked).map(|i| unsafe { Place::new(statuses.wrapping_add(i), "statuses") });
    Ok((plans.collect::<Result<_>>()?, statuses.collect::<Result<_>>()?))
}

/// The plans of a batch.
///
/// # Safety
///
/// As [`read_all`] of both arrays, and as [`to_request`] of every request.
unsafe fn planned(
    parker: &Parker,
    requests: *const n3p_request,
    lots: *const *const n3p_lot,
    count: usize,
) -> Result<Vec<std::result::Result<Plan, PlanError>>> {
    // SAFETY: the caller's word.
    let (requests, lots) =
        unsafe { (read_all(requests, count, "requests")?, read_all(lots, count, "lots")?) };
    let numbered = |what: &str, i: usize| format!("{what}[{i}]");
    let lots = lots.iter().enumerate().map(|(i, &lot)| held(lot, &numbered("lots", i)));
    let lots = lots.collect::<Result<Vec<_>>>()?;
    let requests = requests.iter().enumerate().map(|(i, request)| {
        // SAFETY: the caller's word.
        unsafe { to_request(request) }.map_err(|failure| Failure {
            message: format!("{}: {}", numbered("requests", i), failure.message),
            ..failure
        })
    });
    let requests = requests.collect::<Result<Vec<_>>>()?;
    let pairs: Vec<_> = zip(requests, lots.iter().map(AsRef::as_ref)).collect();
    Ok(parker.plan_batch(&pairs))
}

/// # Safety
///
/// Where they are neither NULL nor misaligned, the request's goals and contour lead to as many poses and
/// vertices as it says, which nobody changes meanwhile.
unsafe fn to_request(request: &n3p_request) -> Result<Request> {
    let count = request.goal_count;
    if !(1..=Scene::MAX_GOALS).contains(&count) {
        let most = Scene::MAX_GOALS;
        return Err(Failure::bad_input(format!("goal_count is {count}; expected 1 to {most}")));
    }
    // SAFETY: the caller's word.
    let goals = unsafe { read_all(request.goals, count, "goals") }?;
    let (position_m, heading_rad) = (request.position_tolerance, request.heading_tolerance);
    let contour = match request.contour_count {
        0 => &[],
        // SAFETY: pairs of numbers are aligned as numbers are, and the caller's word.
        count => unsafe { read_all(request.contour.cast::<[f64; 2]>(), count, "contour") }?,
    };
    let n3p_margins { front, rear, left, right, mirrors } = request.margins;
    let mirrors = (mirrors != 0.0).then_some(mirrors);
    let given = Margins { front, rear, left, right, mirrors };
    let previous = match request.previous.is_null() {
        true => None,
        false => Some(PLANS.get(request.previous, "previous")?),
    };
    let exact = position_m == 0.0 && heading_rad == 0.0;
    Ok(Request {
        start: request.start.into(),
        goals: goals.iter().map(|&goal| Pose::from(goal)).collect(),
        tolerance: (!exact).then_some(GoalTolerance { position_m, heading_rad }),
        parking_type: parking_type(request.parking_type)?,
        contour: contour.to_vec(),
        margins: (given != Margins::default()).then_some(given),
        start_steer: request.start_steer,
        previous: previous.map(|kept| kept.plan.previous()),
    })
}
