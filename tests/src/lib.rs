//! Helpers for the tests that only the whole can show.
