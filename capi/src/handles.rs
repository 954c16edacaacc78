//! Numbers in the place of pointers, so that a closed handle is found out.
//!
//! A handle looks like a pointer to C and is never followed: it is the key of a table. Keys are
//! never given out twice, so that a handle that was freed, or one of another kind, is told from an
//! open one for certain. Who uses a handle shares its owner, so that freeing it meanwhile does no
//! harm.

use std::collections::BTreeMap;
use std::ptr;
use std::sync::{Arc, Mutex, MutexGuard};

use super::status::{Failure, Result};

/// The open handles of one kind.
pub(crate) struct Table<T> {
    /// The kind's name in C.
    name: &'static str,
    /// Distinguishes the kind's keys from all others.
    kind: usize,
    state: Mutex<State<T>>,
}

struct State<T> {
    given_out: usize,
    open: BTreeMap<usize, Arc<T>>,
}

/// Keys of different kinds differ in their remainders.
const KINDS: usize = 8;

impl<T> Table<T> {
    pub const fn new(name: &'static str, kind: usize) -> Self {
        assert!(kind < KINDS);
        let state = State { given_out: 0, open: BTreeMap::new() };
        Self { name, kind, state: Mutex::new(state) }
    }

    fn state(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// A handle for `value`.
    pub fn open<H>(&self, value: T) -> *mut H {
        let value = Arc::new(value);
        let mut state = self.state();
        state.given_out += 1;
        let key = state.given_out * KINDS + self.kind;
        state.open.insert(key, value);
        ptr::without_provenance_mut(key)
    }

    /// What `handle` stands for; `argument` is its name, for messages.
    pub fn get<H>(&self, handle: *const H, argument: &str) -> Result<Arc<T>> {
        if handle.is_null() {
            return Err(Failure::bad_input(format!("{argument} is NULL")));
        }
        let found = self.state().open.get(&handle.addr()).cloned();
        found.ok_or_else(|| self.not_open(argument))
    }

    /// Closes `handle`; NULL is closed already.
    pub fn close<H>(&self, handle: *const H) -> Result<()> {
        if handle.is_null() {
            return Ok(());
        }
        // Dropped only after the table is free for others again.
        let found = self.state().open.remove(&handle.addr());
        found.map(drop).ok_or_else(|| self.not_open(&self.name["n3p_".len()..]))
    }

    fn not_open(&self, argument: &str) -> Failure {
        let name = self.name;
        Failure::bad_input(format!("{argument} is no open {name}: it was freed, or is another"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_and_foreign_handles_are_found_out() {
        let (numbers, words) = (Table::new("n3p_number", 0), Table::new("n3p_word", 1));
        let one: *mut () = numbers.open(1);
        let word: *mut () = words.open("one");
        assert_eq!(*numbers.get(one, "number").unwrap(), 1);
        assert!(numbers.get(word, "number").is_err());
        assert!(numbers.get(ptr::null::<()>(), "number").is_err());
        let shared = numbers.get(one, "number").unwrap();
        numbers.close(one).unwrap();
        assert_eq!(*shared, 1);
        let told = "number is no open n3p_number: it was freed, or is another";
        assert_eq!(numbers.get(one, "number").unwrap_err().message, told);
        assert_eq!(numbers.close(one).unwrap_err().message, told);
        assert_ne!(numbers.open::<()>(2), one);
        assert!(words.close(ptr::null::<()>()).is_ok());
    }
}
