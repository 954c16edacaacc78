//! The C interface, called in any order with any numbers, handles that are closed or of another kind, NULL,
//! and buffers of any size. Nothing may be a bug of the library, and nothing may be written beyond a buffer.

#[path = "../../capi/src/lib.rs"]
#[allow(dead_code, reason = "only what is called from here is used")]
mod capi;

use std::ffi::{CStr, c_char, c_void};
use std::ptr;

use arbitrary::{Arbitrary, Result, Unstructured};

use self::capi::lot::*;
use self::capi::parker::*;
use self::capi::plan::*;
use self::capi::scene::*;
use self::capi::status::{n3p_last_error, n3p_status};
use self::capi::types::*;
use crate::door::{number, some};

/// A sequence of calls.
pub fn c_door(data: &[u8]) {
    let mut calls =
        Calls { u: Unstructured::new(data), handles: vec![ptr::null_mut()], parkers: 0 };
    for _ in 0..40 {
        if calls.u.is_empty() || calls.one().is_err() {
            break;
        }
    }
    // Whatever is still open is closed, as what it is; as what it is not it is refused.
    for handle in calls.handles {
        let closed = [
            n3p_lot_free(handle.cast()),
            n3p_scene_free(handle.cast()),
            n3p_plan_free(handle.cast()),
            n3p_parker_free(handle.cast()),
        ];
        let count = closed.iter().filter(|s| **s == n3p_status::N3P_OK).count();
        assert!(count <= 1 || handle.is_null(), "one handle was of {count} kinds");
    }
}

struct Calls<'a> {
    u: Unstructured<'a>,
    handles: Vec<*mut c_void>,
    parkers: usize,
}

impl Calls<'_> {
    fn handle<T>(&mut self) -> Result<*mut T> {
        Ok(match u8::arbitrary(&mut self.u)? {
            255 => ptr::without_provenance_mut(usize::arbitrary(&mut self.u)?),
            n => self.handles[usize::from(n) % self.handles.len()].cast(),
        })
    }

    fn keep<T>(&mut self, status: n3p_status, handle: *mut T) {
        assert_eq!(status == n3p_status::N3P_OK, !handle.is_null(), "a handle and {status:?}");
        if !handle.is_null() {
            self.handles.push(handle.cast());
        }
    }

    fn pose(&mut self) -> Result<n3p_pose> {
        let u = &mut self.u;
        Ok(n3p_pose { x: number(u)?, y: number(u)?, heading: number(u)? })
    }

    fn one(&mut self) -> Result<()> {
        let status = self.call()?;
        assert_ne!(status, n3p_status::N3P_INTERNAL, "{}", told());
        if status != n3p_status::N3P_OK {
            assert!(!told().is_empty() && !told().contains('\n'), "{:?}", told());
        }
        Ok(())
    }

    fn call(&mut self) -> Result<n3p_status> {
        let call = u8::arbitrary(&mut self.u)? % 19;
        // SAFETY: every pointer below is NULL or leads to what the function asks for: the buffers are as
        // long as they are said to be.
        Ok(unsafe {
            match call {
                0 => {
                    let mut lot = ptr::null_mut();
                    let status = n3p_lot_new(&mut lot);
                    self.keep(status, lot);
                    status
                }
                1 => n3p_lot_free(self.handle()?),
                2 => n3p_lot_clear(self.handle()?),
                n @ 3..=5 => {
                    let xy = some(&mut self.u, 16, number)?;
                    let (lot, count) = (self.handle()?, xy.len() / 2);
                    match n {
                        3 => n3p_lot_polygon(lot, xy.as_ptr(), count),
                        4 => n3p_lot_polyline(lot, xy.as_ptr(), count),
                        _ => n3p_lot_points(lot, xy.as_ptr(), count),
                    }
                }
                6 => {
                    let [a, b] = [self.pose()?, self.pose()?];
                    n3p_lot_bounds(self.handle()?, a.x, a.y, b.x, b.y)
                }
                7 => {
                    let at = self.pose()?;
                    let cells = some(&mut self.u, 64, |u| u8::arbitrary(u))?;
                    let columns = usize::from(u8::arbitrary(&mut self.u)? % 9);
                    let rows = cells.len().checked_div(columns).unwrap_or(0);
                    n3p_lot_grid(
                        self.handle()?,
                        at.x,
                        at.y,
                        at.heading,
                        columns,
                        rows,
                        cells.as_ptr(),
                    )
                }
                8 => {
                    let text = some(&mut self.u, 200, |u| u8::arbitrary(u))?;
                    let mut scene = ptr::null_mut();
                    let status = n3p_scene_from_json(text.as_ptr().cast(), text.len(), &mut scene);
                    self.keep(status, scene);
                    status
                }
                9 => {
                    let text = include_bytes!("../../examples/scenes/reverse.json");
                    let mut scene = ptr::null_mut();
                    let status = n3p_scene_from_json(text.as_ptr().cast(), text.len(), &mut scene);
                    self.keep(status, scene);
                    status
                }
                10 => n3p_scene_free(self.handle()?),
                11 => self.new_parker()?,
                12 => n3p_parker_free(self.handle()?),
                13 => {
                    let (start, goal) = (self.pose()?, self.pose()?);
                    let mut plan = ptr::null_mut();
                    let status =
                        n3p_parker_plan(self.handle()?, start, goal, self.handle()?, &mut plan);
                    self.keep(status, plan);
                    status
                }
                14 => {
                    let mut plan = ptr::null_mut();
                    let status = n3p_parker_plan_scene(self.handle()?, self.handle()?, &mut plan);
                    self.keep(status, plan);
                    status
                }
                15 => self.plan_batch()?,
                16 => n3p_plan_free(self.handle()?),
                17 => self.poses()?,
                _ => self.trajectory()?,
            }
        })
    }

    fn new_parker(&mut self) -> Result<n3p_status> {
        self.parkers += 1;
        if self.parkers > 3 {
            return Ok(n3p_status::N3P_OK);
        }
        let mut vehicle = n3p_vehicle_default();
        let u = &mut self.u;
        if u8::arbitrary(u)? % 4 == 0 {
            vehicle.width = number(u)?;
            vehicle.max_steer = number(u)?;
            vehicle.steer_rate = number(u)?;
        }
        let method = *u.choose(&[c"ha-rs", c"ha", c"mhha", c"no", c""])?;
        let is_usual = u8::arbitrary(u)? % 4 > 0;
        let mut part = || if is_usual { Ok(0.0) } else { number(u) };
        let options = n3p_options {
            method: method.as_ptr(),
            margin: part()?,
            allow_contact: part()?,
            max_expansions: 1 + usize::from(u8::arbitrary(u)?),
            effort: i32::from(u8::arbitrary(u)? % 4),
            standstill_steering: i32::from(u8::arbitrary(u)? % 4),
        };
        let mut parker = ptr::null_mut();
        // SAFETY: all three lead to what they should.
        let status = unsafe { n3p_parker_new(&vehicle, &options, &mut parker) };
        self.keep(status, parker);
        Ok(status)
    }

    fn plan_batch(&mut self) -> Result<n3p_status> {
        let goals = [self.pose()?, self.pose()?];
        let count = usize::from(u8::arbitrary(&mut self.u)? % 3);
        let mut requests = Vec::new();
        let contour: Vec<f64> = (0..8).map(|_| number(&mut self.u)).collect::<Result<_>>()?;
        let mut lots: Vec<*const n3p_lot> = Vec::new();
        for _ in 0..count {
            let start = self.pose()?;
            let u = &mut self.u;
            requests.push(n3p_request {
                start,
                goals: goals.as_ptr(),
                goal_count: usize::from(u8::arbitrary(u)? % 3),
                position_tolerance: number(u)?,
                heading_tolerance: number(u)?,
                parking_type: i32::from(u8::arbitrary(u)? % 6),
                margins: n3p_margins {
                    front: number(u)?,
                    rear: number(u)?,
                    left: number(u)?,
                    right: number(u)?,
                    mirrors: number(u)?,
                },
                contour: contour.as_ptr(),
                contour_count: usize::from(u8::arbitrary(u)? % 5),
                start_steer: number(u)?,
                previous: ptr::null(),
            });
            if bool::arbitrary(u)? {
                let previous = self.handle()?;
                requests.last_mut().expect("one was pushed").previous = previous;
            }
            lots.push(self.handle()?);
        }
        let parker = self.handle()?;
        let mut plans = vec![ptr::null_mut(); count];
        let mut statuses = vec![n3p_status::N3P_OK; count];
        // SAFETY: the arrays have `count` elements each.
        let status = unsafe {
            n3p_parker_plan_batch(
                parker,
                requests.as_ptr(),
                lots.as_ptr(),
                count,
                plans.as_mut_ptr(),
                statuses.as_mut_ptr(),
            )
        };
        assert!(statuses.iter().all(|s| *s != n3p_status::N3P_INTERNAL), "{}", told());
        self.handles.extend(plans.iter().filter(|p| !p.is_null()).map(|p| p.cast::<c_void>()));
        Ok(status)
    }

    fn poses(&mut self) -> Result<n3p_status> {
        let plan: *mut n3p_plan = self.handle()?;
        let capacity = usize::from(u16::arbitrary(&mut self.u)? % 600);
        let mut buffer: Vec<n3p_path_pose> = Vec::with_capacity(capacity);
        let mut json: Vec<c_char> = Vec::with_capacity(capacity);
        let mut count = 0;
        // SAFETY: the buffers have room for what is said.
        unsafe {
            let mut summary = std::mem::MaybeUninit::uninit();
            let first = n3p_plan_summary(plan, summary.as_mut_ptr());
            if first == n3p_status::N3P_OK {
                assert!(summary.assume_init_ref().length.is_finite());
            }
            let status = n3p_plan_json(plan, json.as_mut_ptr(), json.capacity(), &mut count);
            if status == n3p_status::N3P_OK {
                assert_eq!(CStr::from_ptr(json.as_ptr()).count_bytes(), count);
            }
            Ok(n3p_plan_poses(plan, buffer.as_mut_ptr(), buffer.capacity(), &mut count))
        }
    }

    fn trajectory(&mut self) -> Result<n3p_status> {
        let plan: *mut n3p_plan = self.handle()?;
        let mut limits = n3p_limits_default();
        let u = &mut self.u;
        if bool::arbitrary(u)? {
            limits.jerk = number(u)?;
            limits.steer_rate = number(u)?;
            limits.lateral_acceleration = number(u)?;
            limits.stop_to_steer = i32::arbitrary(u)?;
        }
        let mut buffer: Vec<n3p_moment> = Vec::with_capacity(usize::from(u16::arbitrary(u)? % 600));
        let mut count = 0;
        // SAFETY: the buffer has room for what is said.
        Ok(unsafe {
            n3p_plan_trajectory(plan, &limits, buffer.as_mut_ptr(), buffer.capacity(), &mut count)
        })
    }
}

fn told() -> String {
    // SAFETY: the message of this thread, which no call replaces meanwhile.
    unsafe { CStr::from_ptr(n3p_last_error()) }.to_string_lossy().into_owned()
}
