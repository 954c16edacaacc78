//! [`answer`](crate::answer) for a browser: three functions and no more, so that no tool is needed to
//! make bindings. `page/worker.js` is the other side.

use std::alloc::{Layout, alloc, dealloc};

/// Room for `size` bytes, which the page fills; NULL where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn take(size: usize) -> *mut u8 {
    match Layout::array::<u8>(size) {
        // SAFETY: the layout has a size.
        Ok(layout) if size > 0 => unsafe { alloc(layout) },
        _ => std::ptr::null_mut(),
    }
}

/// Gives room back.
///
/// # Safety
///
/// `room` is from [`take`] or [`ask`], `size` is its size, and nobody uses it any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn give_back(room: *mut u8, size: usize) {
    if let (false, Ok(layout)) = (room.is_null(), Layout::array::<u8>(size)) {
        // SAFETY: as the caller says.
        unsafe { dealloc(room, layout) };
    }
}

/// The answer to a request: four bytes that say how long it is, the lowest first, and its text.
///
/// # Safety
///
/// `request` is from [`take`] and `size` is its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ask(request: *const u8, size: usize) -> *mut u8 {
    // SAFETY: as the caller says.
    let request = unsafe { std::slice::from_raw_parts(request, size) };
    let answer = crate::answer(&String::from_utf8_lossy(request));
    let length = (answer.len() as u32).to_le_bytes();
    let mut bytes = Vec::with_capacity(length.len() + answer.len());
    bytes.extend(length);
    bytes.extend(answer.bytes());
    Box::into_raw(bytes.into_boxed_slice()).cast()
}
