//! Processes that wait for the next item: one per worker, reused.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::consent::Candidate;
use super::error::PluginError;
use super::process::Host;
use super::session::Session;
use crate::recording::InputFiles;

/// How long processes may take to end after they were asked to.
const GRACE: Duration = Duration::from_secs(3);

/// Processes that wait for the next item.
#[derive(Debug, Default)]
pub(super) struct Pool {
    idle: Mutex<Vec<Session>>,
    /// Hashes of programs and scripts.
    pub(super) hashes: InputFiles,
    /// What stands between this program and its plugins.
    pub(super) host: Option<Host>,
}

impl Pool {
    /// With a process between this program and each plugin.
    pub(super) fn hosted(host: Option<Host>) -> Self {
        Self { host, ..Self::default() }
    }

    /// A process of this plugin: an idle one, or a new one. Errors: it does not start; its files are no longer the
    /// candidate's.
    pub(super) fn take(&self, candidate: &Candidate) -> Result<Session, PluginError> {
        let mut idle = self.lock();
        if let Some(place) = idle.iter().position(|session| session.candidate == *candidate) {
            return Ok(idle.swap_remove(place));
        }
        drop(idle);
        Session::start(candidate, self)
    }

    /// Gives a process back. There are never more of a plugin than workers ran it at once.
    pub(super) fn put(&self, session: Session) {
        self.lock().push(session);
    }

    /// Ends all processes that wait. Where it is never called (the program was killed), the end of their input ends
    /// them.
    ///
    /// Returned is what is wrong with any: it wrote something that nobody had asked for.
    pub(super) fn shut_down(&self) -> Vec<String> {
        let mut idle = std::mem::take(&mut *self.lock());
        let not_quiet = |session: &Session| Some(session.check_quiet().err()?.message_for(session.candidate.name()));
        let wrong = idle.iter().filter_map(not_quiet).collect();
        idle.iter_mut().for_each(Session::ask_to_end);
        for session in &mut idle {
            // one that does not end is killed there
            let _ = session.close(GRACE);
        }
        wrong
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Session>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
