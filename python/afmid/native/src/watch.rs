//! Long work under Python: the interpreter's lock is let go, and Ctrl-C ends it.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use afmid_pipeline::stage::Cancel;
use pyo3::prelude::*;

/// How often is looked for a signal.
const SIGNALS: Duration = Duration::from_millis(50);

/// What `work` returns. It runs on a thread of its own, without the interpreter's lock; this one looks for signals.
///
/// Errors: those of `work`; the exception that a signal's handler raised, once the work has ended.
pub fn watched<T: Send>(py: Python<'_>, work: impl FnOnce(Cancel) -> PyResult<T> + Send) -> PyResult<T> {
    let cancel = Cancel::default();
    let own = cancel.clone();
    let (found, raised) = py.detach(|| {
        std::thread::scope(|scope| {
            let (ended, ends) = channel::<()>();
            let worker = scope.spawn(move || {
                // dropped at the end, also where the work panics
                let _ended = ended;
                work(own)
            });
            let mut raised = None;
            while ends.recv_timeout(SIGNALS) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| py.check_signals()).err();
                    if raised.is_some() {
                        cancel.cancel();
                    }
                }
            }
            (worker.join(), raised)
        })
    });
    match (raised, found) {
        (Some(raised), _) => Err(raised),
        (None, Ok(found)) => found,
        (None, Err(panic)) => std::panic::resume_unwind(panic),
    }
}
