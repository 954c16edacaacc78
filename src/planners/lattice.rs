//! Dense visited set.
