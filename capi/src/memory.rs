//! What is read from and written to the caller's memory.
//!
//! What can be checked is: NULL, alignment, sizes beyond any use. That a pointer leads to as much
//! memory as its count says is the caller's word.

use std::ffi::{CStr, c_char};
use std::slice;

use super::status::{Failure, Result, n3p_status};

/// The most points, vertices or cells of one call, and the most bytes of a text. Beyond it a count
/// is a mistake.
pub const N3P_MAX_COUNT: usize = 1 << 24;

fn checked<T>(pointer: *const T, argument: &str) -> Result<()> {
    let fault = match pointer {
        p if p.is_null() => "is NULL",
        p if !p.is_aligned() => "is not aligned for what it points to",
        _ => return Ok(()),
    };
    Err(Failure::bad_input(format!("{argument} {fault}")))
}

/// The struct at `pointer`.
///
/// # Safety
///
/// Where it is neither NULL nor misaligned, it points to a `T`.
pub(crate) unsafe fn read<T: Copy>(pointer: *const T, argument: &str) -> Result<T> {
    checked(pointer, argument)?;
    // SAFETY: neither NULL nor misaligned, so it points to a `T` by the caller's word.
    Ok(unsafe { pointer.read() })
}

/// The same of a struct that may be left out by NULL.
///
/// # Safety
///
/// As [`read`].
pub(crate) unsafe fn read_or<T: Copy>(pointer: *const T, argument: &str, other: T) -> Result<T> {
    if pointer.is_null() {
        return Ok(other);
    }
    // SAFETY: the caller's word is the same.
    unsafe { read(pointer, argument) }
}

/// The `count` values at `pointer`, which may be NULL where there are none.
///
/// # Safety
///
/// Where it is neither NULL nor misaligned and `count` is at most [`N3P_MAX_COUNT`], it points to so
/// many values, which nobody changes during `'a`.
pub(crate) unsafe fn read_all<'a, T: Copy>(
    pointer: *const T,
    count: usize,
    argument: &str,
) -> Result<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    checked(pointer, argument)?;
    if count > N3P_MAX_COUNT {
        let most = N3P_MAX_COUNT;
        let text = format!("{argument} has a count of {count}; expected at most {most}");
        return Err(Failure::bad_input(text));
    }
    const { assert!(N3P_MAX_COUNT * size_of::<T>() <= isize::MAX as usize) };
    // SAFETY: neither NULL nor misaligned, no more than the caller gives his word for, and no more
    // than a slice may have.
    Ok(unsafe { slice::from_raw_parts(pointer, count) })
}

/// The text at `pointer`.
///
/// # Safety
///
/// Where it is not NULL, it points to bytes that end with a NUL and that nobody changes during `'a`.
pub(crate) unsafe fn read_text<'a>(pointer: *const c_char, argument: &str) -> Result<&'a str> {
    checked(pointer, argument)?;
    // SAFETY: not NULL, so it ends with a NUL by the caller's word.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Failure::bad_input(format!("{argument} is not text (UTF-8)")))
}

/// A place for one result.
pub(crate) struct Place<T>(*mut T);

impl<T> Place<T> {
    /// # Safety
    ///
    /// Where it is neither NULL nor misaligned, `pointer` leads to room for a `T` until this place
    /// is gone.
    pub unsafe fn new(pointer: *mut T, argument: &str) -> Result<Self> {
        checked(pointer, argument)?;
        Ok(Self(pointer))
    }

    pub fn put(&self, value: T) {
        // SAFETY: as `new` was promised. What was there is no Rust value that wants dropping.
        unsafe { self.0.write(value) }
    }
}

/// Writes all of `values` to `buffer`, which has room for `capacity` of them, or none where that is
/// too few; their number to `count`.
///
/// # Safety
///
/// Where they are neither NULL nor misaligned, `buffer` leads to room for `capacity` values and
/// `count` to room for a number.
pub(crate) unsafe fn fill<T>(
    values: impl ExactSizeIterator<Item = T>,
    buffer: *mut T,
    capacity: usize,
    count: *mut usize,
) -> Result<()> {
    // SAFETY: the caller's word for `count`.
    let count = unsafe { Place::new(count, "count") }?;
    let needed = values.len();
    count.put(needed);
    if capacity > 0 {
        checked(buffer, "buffer")?;
    }
    if capacity < needed {
        let message = format!("buffer has room for {capacity}; expected room for {needed}");
        return Err(Failure { status: n3p_status::N3P_BUFFER_TOO_SMALL, message });
    }
    for (i, value) in values.take(needed).enumerate() {
        // SAFETY: `i < needed <= capacity`, and there is room for `capacity` by the caller's word.
        unsafe { buffer.add(i).write(value) };
    }
    Ok(())
}
