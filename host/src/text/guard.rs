//! Libraries that read foreign bytes, and may panic at damaged ones.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}
static SILENCED: Once = Once::new();

/// What a library makes of foreign bytes; none where it panics, of which nothing is printed.
pub(crate) fn unless_it_panics<T>(reading: impl FnOnce() -> T) -> Option<T> {
    SILENCED.call_once(|| {
        let told = take_hook();
        set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                told(panic);
            }
        }));
    });
    let before = GUARDED.replace(true);
    let read = catch_unwind(AssertUnwindSafe(reading));
    GUARDED.set(before);
    read.ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_gives_nothing_and_what_is_outside_panics_as_before() {
        assert_eq!(unless_it_panics(|| 7), Some(7));
        let none: Option<()> = unless_it_panics(|| panic!("damaged"));
        assert_eq!(none, None);
        assert!(!GUARDED.get());
        assert!(catch_unwind(|| panic!("not guarded")).is_err());
    }
}
