//! Processes that wait for the next item: one per worker, reused.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::error::PluginError;
use super::fingerprint::Fingerprint;
use super::launch::Launch;
use super::session::Session;

static IDLE: Mutex<Vec<Session>> = Mutex::new(Vec::new());

/// How long processes may take to end after they were asked to.
const GRACE: Duration = Duration::from_secs(3);

/// A process of this plugin: an idle one, or a new one. Errors: it does not start.
pub(super) fn take(launch: &Launch, fingerprint: &Fingerprint) -> Result<Session, PluginError> {
    let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    let found = idle.iter().position(|session| session.launch == *launch && session.fingerprint == *fingerprint);
    if let Some(place) = found {
        return Ok(idle.swap_remove(place));
    }
    drop(idle);
    let mut session = Session::start(launch)?;
    if session.fingerprint != *fingerprint {
        session.kill();
        let help = "run again: its results belong to the files that it had at the start of the run";
        return Err(PluginError::new("was changed during the run", help));
    }
    Ok(session)
}

/// Gives a process back. There are never more of a plugin than workers ran it at once.
pub(super) fn put(session: Session) {
    IDLE.lock().unwrap_or_else(PoisonError::into_inner).push(session);
}

/// Ends all processes that wait. A program calls it before it ends; where it cannot (it was killed), the end of their input ends them.
pub fn shut_down() {
    let mut idle = std::mem::take(&mut *IDLE.lock().unwrap_or_else(PoisonError::into_inner));
    idle.iter_mut().for_each(Session::ask_to_end);
    for session in &mut idle {
        // one that does not end is killed there
        let _ = session.close(GRACE);
    }
}
