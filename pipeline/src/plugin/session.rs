//! A conversation with a plugin: the handshake, then requests and answers, one at a time.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::PROTOCOL;
use super::consent::Candidate;
use super::error::PluginError;
use super::launch::Launch;
use super::message::{Handshake, Introduction, Progress, Reply};
use super::pool::Pool;
use super::process::{Process, not_enforced, shown};
use crate::files::temporary_folder;

/// A plugin that was started and has introduced itself, with a folder for what is exchanged.
#[derive(Debug)]
pub(super) struct Session {
    pub(super) candidate: Candidate,
    pub(super) handshake: Handshake,
    /// What it could do beyond what it may, as far as nobody enforces it; none if all is enforced.
    pub(super) not_enforced: Option<String>,
    protocol: u64,
    process: Process,
    folder: TempDir,
    requests: u64,
}

/// Where the handshake is written down.
const FORM: &str =
    r#"the first line is {"afmid_stage": 1, "protocol": {"min": 1, "max": 1}, "name": "...", "version": "..."}"#;

impl Session {
    /// Starts a plugin and reads its handshake. Errors: it is not what the candidate says; it does not start, says
    /// something else, or speaks another protocol.
    pub(super) fn start(candidate: &Candidate, pool: &Pool) -> Result<Self, PluginError> {
        candidate.check_unchanged(&pool.hashes)?;
        let launch = &candidate.launch;
        let none = |error: std::io::Error| {
            let what = format!("needs a temporary folder, and none can be made: {error}");
            PluginError::new(what, "check TMPDIR and the space on its disk")
        };
        let folder = temporary_folder("plugin").map_err(none)?;
        let temporary = folder.path().join("tmp");
        std::fs::create_dir(&temporary).map_err(none)?;
        let mut process = Process::start(launch, pool.host.as_ref(), folder.path(), &temporary)?;
        let deadline = Instant::now() + launch.start_timeout();
        let greeted = process.receive(deadline, "before its handshake").and_then(|line| handshake(&line));
        // what was started is what was hashed only if nothing has changed since
        match greeted.and_then(|greeted| candidate.check_unchanged(&pool.hashes).map(|()| greeted)) {
            Ok((handshake, protocol)) => {
                let candidate = candidate.clone();
                let not_enforced = match pool.host {
                    Some(_) if candidate.is_confined() => not_enforced(),
                    Some(_) => Some("where it writes, TCP: its config says `confined = false`".to_owned()),
                    None => Some("where it writes, TCP: this program starts plugins without a host".to_owned()),
                };
                Ok(Self { candidate, handshake, not_enforced, protocol, process, folder, requests: 0 })
            }
            Err(error) => Err(PluginError { log: process.kill(), ..error }),
        }
    }

    pub(super) fn launch(&self) -> &Launch {
        &self.candidate.launch
    }

    /// Asks what it is. Errors: as [`Session::request`].
    pub(super) fn introduction(&mut self) -> Result<Introduction, PluginError> {
        let params = json!({ "protocol": self.protocol });
        let description = self.request("describe", &params, self.launch().start_timeout(), &mut |_| {})?;
        Ok(Introduction { handshake: self.handshake.clone(), description })
    }

    /// Sends a request and waits for its answer. Errors: the plugin says that it cannot (then it can be asked again),
    /// or anything else than the protocol happens (then it was killed).
    pub(super) fn request(
        &mut self,
        method: &str,
        params: &Value,
        timeout: Duration,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Value, PluginError> {
        let answered = self.exchange(method, params, timeout, progress);
        answered.map_err(|error| {
            let log = if error.alive { self.process.take_log() } else { self.process.kill() };
            PluginError { log, ..error }
        })
    }

    fn exchange(
        &mut self,
        method: &str,
        params: &Value,
        timeout: Duration,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Value, PluginError> {
        self.check_quiet()?;
        self.requests += 1;
        let id = self.requests;
        self.process.send(&json!({ "id": id, "method": method, "params": params }).to_string());
        let (deadline, doing) =
            (Instant::now() + timeout, format!("during `{method}` ({:.0} s allowed)", timeout.as_secs_f64()));
        loop {
            let line = self.process.receive(deadline, &doing)?;
            let reply = reply(&line, id, &doing)?;
            match (reply.progress, reply.result, reply.error) {
                (Some(done), None, None) => progress(done),
                (None, Some(result), None) => return Ok(result),
                (None, None, Some(refusal)) => {
                    let help = refusal.help.unwrap_or_else(|| "this comes from the plugin itself".to_owned());
                    return Err(PluginError::new(format!("refuses: {}", refusal.message), help).alive());
                }
                _ => {
                    let what = format!(
                        "answered with none or several of `result`, `error`, `progress`: {}",
                        shown(line.as_bytes())
                    );
                    return Err(PluginError::new(what, "an answer has exactly one of them"));
                }
            }
        }
    }

    /// Sees that it has written nothing since its last answer. Errors: it has.
    pub(super) fn check_quiet(&self) -> Result<(), PluginError> {
        let Some(line) = self.unasked(Duration::ZERO) else { return Ok(()) };
        let what = format!("wrote to stdout without being asked: {line}");
        Err(PluginError::new(what, "stdout is for the protocol alone: write everything else to stderr"))
    }

    /// A line that nobody asked for, if there is one within `wait`.
    pub(super) fn unasked(&self, wait: Duration) -> Option<String> {
        self.process.unasked(wait)
    }

    /// Files for the next request: what it is given, what it may write.
    pub(super) fn files(&self) -> (Exchange, Exchange) {
        let file = |what: &str| Exchange(self.folder.path().join(format!("{what}-{}.h5", self.requests + 1)));
        (file("in"), file("out"))
    }

    /// What it wrote to stderr since it was asked last.
    pub(super) fn take_log(&self) -> String {
        self.process.take_log()
    }

    /// Kills it, and returns its last words.
    pub(super) fn kill(&mut self) -> String {
        self.process.kill()
    }

    /// Asks it to end, without waiting for that.
    pub(super) fn ask_to_end(&mut self) {
        self.requests += 1;
        self.process.send(&json!({ "id": self.requests, "method": "shutdown" }).to_string());
        self.process.close_input();
    }

    /// Ends it by closing its input, and says how it ended. Errors: it does not end in time.
    pub(super) fn close(&mut self, wait: Duration) -> Result<String, PluginError> {
        self.process.close(wait)
    }
}

/// A file of the exchange: removed when it goes out of scope, whatever happened.
#[derive(Debug)]
pub(super) struct Exchange(PathBuf);

impl Exchange {
    pub(super) fn new(path: PathBuf) -> Self {
        Self(path)
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Exchange {
    fn drop(&mut self) {
        // it may never have been written
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The first line. Errors: it is something else, or of a plugin that speaks no version of the protocol that is known
/// here.
pub(super) fn handshake(line: &str) -> Result<(Handshake, u64), PluginError> {
    let found = || shown(line.as_bytes());
    let handshake: Handshake = serde_json::from_str(line)
        .map_err(|error| PluginError::new(format!("does not begin with a handshake: {} ({error})", found()), FORM))?;
    if handshake.afmid_stage != 1 || handshake.name.is_empty() || handshake.version.is_empty() {
        return Err(PluginError::new(format!("does not begin with a handshake: {}", found()), FORM));
    }
    let range = handshake.protocol;
    let common = range.max.min(*PROTOCOL.end());
    if common < range.min.max(*PROTOCOL.start()) {
        let (low, high) = (range.min, range.max);
        let what = format!(
            "speaks the versions {low} to {high} of the protocol, this program {} to {}",
            PROTOCOL.start(),
            PROTOCOL.end()
        );
        let older = if low > *PROTOCOL.end() {
            "use a newer afmid, or an older version of the plugin"
        } else {
            "use a newer version of the plugin"
        };
        return Err(PluginError::new(what, older));
    }
    Ok((handshake, common))
}

/// A line after it. Errors: it is no message, or not about the request `id`.
pub(super) fn reply(line: &str, id: u64, doing: &str) -> Result<Reply, PluginError> {
    let found = || shown(line.as_bytes());
    let help = "stdout is for the protocol alone, one JSON message a line: write everything else to stderr";
    let reply: Reply = serde_json::from_str(line).map_err(|error| {
        PluginError::new(format!("wrote something else than an answer {doing}: {} ({error})", found()), help)
    })?;
    match reply.id {
        Some(found) if found == id => Ok(reply),
        found_id => {
            let answered = found_id.map_or("no id".to_owned(), |found| format!("the id {found}"));
            let what = format!("answered with {answered}, wanted the id {id} of the request: {}", found());
            Err(PluginError::new(what, "an answer carries the id of its request"))
        }
    }
}
