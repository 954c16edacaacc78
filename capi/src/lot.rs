//! What stands in a lot.

use std::sync::{Arc, Mutex};

use n3p::Lot;
use n3p::world::DrivableArea;

use super::handles::Table;
use super::memory::{N3P_MAX_COUNT, Place, read_all};
use super::status::{Failure, Result, guarded, n3p_status};

/// What stands in a lot, in any frame that it shares with start and goal.
pub enum n3p_lot {}

/// Plans keep what they were given: who adds meanwhile adds to a copy.
pub(crate) static LOTS: Table<Mutex<Arc<Lot>>> = Table::new("n3p_lot", 1);

/// What `lot` holds now.
pub(crate) fn held(lot: *const n3p_lot, argument: &str) -> Result<Arc<Lot>> {
    let lot = LOTS.get(lot, argument)?;
    let held = lot.lock().unwrap_or_else(|e| e.into_inner());
    Ok(held.clone())
}

fn change(lot: *mut n3p_lot, by: impl FnOnce(&mut Lot) -> &mut Lot) -> Result<()> {
    let lot = LOTS.get(lot, "lot")?;
    let mut held = lot.lock().unwrap_or_else(|e| e.into_inner());
    by(Arc::make_mut(&mut held));
    Ok(())
}

/// The points of `xy`: x and y of each in turn.
///
/// # Safety
///
/// Where it is neither NULL nor misaligned and `count` is at most [`N3P_MAX_COUNT`], `xy` points to
/// twice as many numbers.
unsafe fn read_points<'a>(xy: *const f64, count: usize) -> Result<&'a [[f64; 2]]> {
    // SAFETY: pairs of numbers are aligned as numbers are, and the caller's word is the same.
    let points = unsafe { read_all(xy.cast::<[f64; 2]>(), count, "xy") }?;
    match points.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
        Some(i) => {
            let [x, y] = points[i];
            let text = format!("point {i} of xy is ({x}, {y}); expected finite numbers");
            Err(Failure::bad_input(text))
        }
        None => Ok(points),
    }
}

/// The same where there must be some.
///
/// # Safety
///
/// As [`read_points`].
unsafe fn read_outline<'a>(xy: *const f64, count: usize) -> Result<&'a [[f64; 2]]> {
    if count < 2 {
        let text = format!("xy has a count of {count}; expected at least 2 vertices");
        return Err(Failure::bad_input(text));
    }
    // SAFETY: the caller's word is the same.
    unsafe { read_points(xy, count) }
}

/// Makes an empty lot, to be freed by n3p_lot_free.
#[doc = safety!("`lot` leads to room for a handle.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_new(lot: *mut *mut n3p_lot) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let lot = unsafe { Place::new(lot, "lot") }?;
        lot.put(LOTS.open(Mutex::default()));
        Ok(())
    })
}

/// Frees a lot; NULL is none.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_lot_free(lot: *mut n3p_lot) -> n3p_status {
    guarded(|| LOTS.close(lot))
}

/// Removes everything from a lot, the bounds too.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_lot_clear(lot: *mut n3p_lot) -> n3p_status {
    guarded(|| {
        change(lot, |lot| {
            *lot = Lot::new();
            lot
        })
    })
}

/// Adds a solid simple polygon, closed implicitly, its vertices in either direction; two vertices
/// are a wall. `xy` holds x and y of each vertex in turn, 2 `count` numbers.
#[doc = safety!("`xy` leads to 2 `count` numbers, which nobody changes meanwhile.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_polygon(
    lot: *mut n3p_lot,
    xy: *const f64,
    count: usize,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let vertices = unsafe { read_outline(xy, count) }?;
        change(lot, |lot| lot.polygon(vertices))
    })
}

/// Adds a line without thickness, such as a fence; `xy` as in n3p_lot_polygon.
#[doc = safety!("`xy` leads to 2 `count` numbers, which nobody changes meanwhile.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_polyline(
    lot: *mut n3p_lot,
    xy: *const f64,
    count: usize,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let vertices = unsafe { read_outline(xy, count) }?;
        change(lot, |lot| lot.polyline(vertices))
    })
}

/// Adds a solid that only wheels must keep off, such as a traffic island; `xy` as in n3p_lot_polygon.
#[doc = safety!("`xy` leads to 2 `count` numbers, which nobody changes meanwhile.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_low_polygon(
    lot: *mut n3p_lot,
    xy: *const f64,
    count: usize,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let vertices = unsafe { read_outline(xy, count) }?;
        change(lot, |lot| lot.low_polygon(vertices))
    })
}

/// Adds a line that only wheels must keep off, such as a kerb; `xy` as in n3p_lot_polygon.
#[doc = safety!("`xy` leads to 2 `count` numbers, which nobody changes meanwhile.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_low_polyline(
    lot: *mut n3p_lot,
    xy: *const f64,
    count: usize,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let vertices = unsafe { read_outline(xy, count) }?;
        change(lot, |lot| lot.low_polyline(vertices))
    })
}

/// Keeps the car's body within a polygon, instead of one given before; `xy` as in n3p_lot_polygon. What is
/// left out of it are polygons that stand there.
#[doc = safety!("`xy` leads to 2 `count` numbers, which nobody changes meanwhile.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_drivable_area(
    lot: *mut n3p_lot,
    xy: *const f64,
    count: usize,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let outer = unsafe { read_outline(xy, count) }?.to_vec();
        change(lot, |lot| lot.drivable_area(DrivableArea { outer, holes: Vec::new() }))
    })
}

/// Adds points, as a range sensor sees them; `xy` as in n3p_lot_polygon.
#[doc = safety!("`xy` leads to 2 `count` numbers, which nobody changes meanwhile.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_points(
    lot: *mut n3p_lot,
    xy: *const f64,
    count: usize,
) -> n3p_status {
    guarded(|| {
        // SAFETY: what this function asks for.
        let points = unsafe { read_points(xy, count) }?;
        change(lot, |lot| lot.points(points.iter().copied()))
    })
}

/// Keeps the rear axle within a rectangle, instead of one given before.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_lot_bounds(
    lot: *mut n3p_lot,
    x_min: f64,
    y_min: f64,
    x_max: f64,
    y_max: f64,
) -> n3p_status {
    guarded(|| {
        let bounds = [x_min, y_min, x_max, y_max];
        // Not by what is wrong, so that NaN is.
        if !(bounds.iter().all(|v| v.is_finite()) && x_min < x_max && y_min < y_max) {
            let text = format!("bounds are {bounds:?}; expected each minimum below its maximum");
            return Err(Failure::bad_input(text));
        }
        change(lot, |lot| lot.bounds(bounds))
    })
}

/// Adds the occupied cells of a grid, those that are not 0. `cells` holds `rows` rows of `columns`
/// cells, the row of the lowest y first; (`x`, `y`) is the corner of the first cell with the lowest
/// x and y, and `resolution` the side of a cell, metres.
#[doc = safety!("`cells` leads to `columns` times `rows` bytes, which nobody changes meanwhile.")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn n3p_lot_grid(
    lot: *mut n3p_lot,
    x: f64,
    y: f64,
    resolution: f64,
    columns: usize,
    rows: usize,
    cells: *const u8,
) -> n3p_status {
    guarded(|| {
        let Some(count) = columns.checked_mul(rows).filter(|&count| count <= N3P_MAX_COUNT) else {
            let most = N3P_MAX_COUNT;
            let text = format!("a grid of {columns} by {rows}; expected at most {most} cells");
            return Err(Failure::bad_input(text));
        };
        if !(x.is_finite() && y.is_finite() && resolution.is_finite() && resolution > 0.0) {
            let text = format!(
                "a grid from ({x}, {y}) with cells of {resolution} m; expected finite numbers, and \
                 cells larger than 0"
            );
            return Err(Failure::bad_input(text));
        }
        // SAFETY: what this function asks for.
        let cells = unsafe { read_all(cells, count, "cells") }?;
        let occupied: Vec<bool> = cells.iter().map(|&cell| cell != 0).collect();
        change(lot, |lot| lot.grid([x, y], resolution, columns, &occupied))
    })
}
