//! Codes, messages, and the guard around every function.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use n3p::{ParkerError, PlanError};

/// What a function came to. The numbers are also the exit codes of n3p-plan, as far as those go.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum n3p_status {
    /// Done.
    N3P_OK = 0,
    /// A bug of the library. Whatever it happened to can still be used.
    N3P_INTERNAL = 1,
    /// What was given cannot be used: a number that is none, NULL, a handle that is not open, a
    /// start that is not free. The message says which, and what would be right.
    N3P_BAD_INPUT = 2,
    /// There is no path, or none was found within the budget.
    N3P_NO_PATH = 3,
    /// The buffer is too small, and nothing was written to it; the count says how much it takes. Of
    /// a text the length says it, which counts no NUL: the buffer needs a capacity of one more.
    N3P_BUFFER_TOO_SMALL = 4,
}

/// Why a function did not do what it was asked.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    pub status: n3p_status,
    pub message: String,
}

pub(crate) type Result<T> = std::result::Result<T, Failure>;

impl Failure {
    pub fn bad_input(message: impl Into<String>) -> Self {
        Self { status: n3p_status::N3P_BAD_INPUT, message: message.into() }
    }
}

impl From<ParkerError> for Failure {
    fn from(error: ParkerError) -> Self {
        Self::bad_input(error.to_string())
    }
}

impl From<PlanError> for Failure {
    fn from(error: PlanError) -> Self {
        let status = match error {
            PlanError::Problem(_) | PlanError::NoGoal | PlanError::OtherVehicle => {
                n3p_status::N3P_BAD_INPUT
            }
            PlanError::NoPath(_) => n3p_status::N3P_NO_PATH,
        };
        Self { status, message: error.to_string() }
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// Runs the body of a function. Its failure becomes the thread's last message, and so does a panic.
pub(crate) fn guarded(body: impl FnOnce() -> Result<()>) -> n3p_status {
    let failure = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => return n3p_status::N3P_OK,
        Ok(Err(failure)) => failure,
        Err(panic) => {
            let message = format!("a bug of n3p, please report it: {}", told(panic.as_ref()));
            Failure { status: n3p_status::N3P_INTERNAL, message }
        }
    };
    let message = failure.message.replace('\0', "?");
    // A thread that is ending has no place for messages any more.
    let _ = LAST.try_with(|last| {
        *last.borrow_mut() = CString::new(message).unwrap_or_default();
    });
    failure.status
}

/// What a panic said.
fn told(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without words")
}

/// The message of the last call of this thread that did not return N3P_OK; "" where there was none.
/// English, without a line break at its end. Valid until the next such call of this thread.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// The library's version, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn n3p_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => unreachable!(),
        };
    VERSION.as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last() -> String {
        // SAFETY: the message of this thread, which no call replaces meanwhile.
        unsafe { CStr::from_ptr(n3p_last_error()) }.to_str().unwrap().to_owned()
    }

    #[test]
    fn a_panic_becomes_a_code() {
        assert_eq!(last(), "");
        assert_eq!(guarded(|| panic!("no {}", 7)), n3p_status::N3P_INTERNAL);
        assert_eq!(last(), "a bug of n3p, please report it: no 7");
        assert_eq!(guarded(|| Ok(())), n3p_status::N3P_OK);
        assert_eq!(guarded(|| Err(Failure::bad_input("a\0b"))), n3p_status::N3P_BAD_INPUT);
        assert_eq!(last(), "a?b");
    }
}
