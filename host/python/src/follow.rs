//! Long work: Python's lock is let go of, Ctrl-C ends it, and whoever wants to hears how far it is.

use crate::errors::raised;
use jointwatch::text::work::{Progress, Watch};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

/// How often a signal is looked for, and progress told.
const EVERY: Duration = Duration::from_millis(50);

/// Does work in threads of its own.
///
/// `progress` is called with what is being done, how much of it is done (or None), and how many
/// steps were taken so far. What it raises ends the work, as Ctrl-C does.
pub(crate) fn followed<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> jointwatch::Result<T> + Send,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let worker = Arc::clone(&watch);
    std::thread::scope(|scope| {
        let (send, mut receive) = mpsc::channel();
        scope.spawn(move || {
            let done = worker.follow(|| work(&worker));
            // The receiver waits until something comes.
            let _ = send.send(done.and_then(Option::transpose));
        });
        let mut raised_here = None;
        let mut told = Progress::default();
        loop {
            let answer;
            (receive, answer) = py.allow_threads(move || {
                let answer = receive.recv_timeout(EVERY);
                (receive, answer)
            });
            match answer {
                Ok(_) if raised_here.is_some() => break,
                Ok(done) => {
                    return raised(py, done)?.ok_or_else(|| PyKeyboardInterrupt::new_err(()));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err(
                        "the library failed within; what it printed says where",
                    ));
                }
                Err(RecvTimeoutError::Timeout) if raised_here.is_none() => {
                    let heard = py
                        .check_signals()
                        .and_then(|()| tell(progress, &watch, &mut told));
                    if let Err(error) = heard {
                        watch.stop();
                        raised_here = Some(error);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
        Err(raised_here.unwrap_or_else(|| PyKeyboardInterrupt::new_err(())))
    })
}

/// Tells what is new.
fn tell(progress: Option<&Bound<'_, PyAny>>, watch: &Watch, told: &mut Progress) -> PyResult<()> {
    let Some(progress) = progress else {
        return Ok(());
    };
    let said = watch.said();
    if said != *told {
        progress.call1((&said.what, said.share, said.steps))?;
        *told = said;
    }
    Ok(())
}
