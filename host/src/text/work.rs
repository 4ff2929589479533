//! Long work that somebody follows from outside: how far it is, and that it is to end.
//!
//! Whoever computes passes checkpoints (`step`) and says what it is at (`say`); both do nothing
//! where nobody follows. The follower's [`Watch`] is known to the threads that do the work, so that
//! no function hands it on. Work that is to end unwinds from its next checkpoint, as a query of an
//! incremental compiler does: nothing between there and [`Watch::follow`] keeps a half-done result.

use crate::text::error::{Error, Result};
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// As much as the main thread of a program has.
const STACK_BYTES: usize = 8 << 20;

/// What is known of work under way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub what: String,
    /// How much of that is done, 0 to 1, where it is known.
    pub share: Option<f64>,
    /// Checkpoints passed since the work began.
    pub steps: u64,
}

/// Follows one piece of work.
#[derive(Debug, Default)]
pub struct Watch {
    stop: AtomicBool,
    steps: AtomicU64,
    said: Mutex<(String, Option<f64>)>,
}

/// What the unwinding of stopped work carries.
struct Stopped;

thread_local! {
    static WATCH: RefCell<Option<Arc<Watch>>> = const { RefCell::new(None) };
}

impl Watch {
    /// Asks the work to end at its next checkpoint.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// What [`Watch::stop`] sets, for work that looks itself.
    pub fn stopped(&self) -> &AtomicBool {
        &self.stop
    }

    /// Says what is being done, and how much of it is done.
    pub fn say(&self, what: impl Into<String>, share: Option<f64>) {
        *self.said.lock().unwrap_or_else(PoisonError::into_inner) = (what.into(), share);
    }

    /// How far the work is.
    pub fn said(&self) -> Progress {
        let (what, share) = self
            .said
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        Progress {
            what,
            share,
            steps: self.steps.load(Ordering::Relaxed),
        }
    }

    /// Does work in threads that know this watch, as many as there are otherwise; `None` when it
    /// was stopped.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when there are no threads to be had.
    pub fn follow<T: Send>(self: &Arc<Self>, work: impl FnOnce() -> T + Send) -> Result<Option<T>> {
        let watch = Arc::clone(self);
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(rayon::current_num_threads())
            .stack_size(STACK_BYTES)
            .start_handler(move |_| WATCH.set(Some(Arc::clone(&watch))))
            .build()
            .map_err(|e| Error::failed(format!("threads could not be started ({e})")))?;
        match catch_unwind(AssertUnwindSafe(|| threads.install(work))) {
            Ok(done) => Ok(Some(done)),
            Err(what) if what.is::<Stopped>() => Ok(None),
            Err(what) => resume_unwind(what),
        }
    }
}

/// A checkpoint: work that is to end does not return from it.
pub(crate) fn step() {
    WATCH.with_borrow(|watch| {
        let Some(watch) = watch else {
            return;
        };
        watch.steps.fetch_add(1, Ordering::Relaxed);
        if watch.stop.load(Ordering::Relaxed) {
            // Not a panic: nothing is printed.
            resume_unwind(Box::new(Stopped));
        }
    });
}

/// Says what is being done, to whoever follows.
pub(crate) fn say(what: &str) {
    WATCH.with_borrow(|watch| {
        if let Some(watch) = watch {
            watch.say(what, None);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn work_ends_at_a_checkpoint_of_any_of_its_threads() {
        let watch = Arc::new(Watch::default());
        let done = watch.follow(|| {
            say("halves");
            (0..100).into_par_iter().map(|i| i / 2).sum::<u32>()
        });
        assert_eq!(done.unwrap(), Some(2450));
        assert_eq!(watch.said().what, "halves");

        let endless = watch.follow(|| {
            (0..4).into_par_iter().for_each(|_| {
                loop {
                    step();
                    watch.stop();
                }
            });
        });
        assert_eq!(endless.unwrap(), None);
        assert!(watch.said().steps >= 1);
        // Elsewhere nobody is stopped.
        step();
    }

    #[test]
    fn a_panic_of_the_work_stays_one() {
        let watch = Arc::new(Watch::default());
        let fallen = catch_unwind(AssertUnwindSafe(|| {
            watch.follow(|| resume_unwind(Box::new(7)))
        }));
        let what = fallen.map(|_: Result<Option<()>>| ()).unwrap_err();
        assert_eq!(what.downcast_ref::<i32>(), Some(&7));
    }
}
