//! A plugin's process: started, written to, read from, ended. No call of it waits without a limit.

use std::io::Write;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use super::Host;
use super::lines::{self, Line, MOST_BYTES, read_lines};
use super::log::Log;
use crate::plugin::error::PluginError;
use crate::plugin::launch::Launch;

/// How long a process may take to end after it was asked to.
const GRACE: Duration = Duration::from_secs(3);

/// Lines that wait to be read, each of at most [`MOST_BYTES`]; beside them one that is being read. A plugin that says
/// more waits until it is heard.
const MOST_LINES: usize = 1;

/// A running plugin. Dropping it ends the process and everything that it started in its group.
#[derive(Debug)]
pub(in crate::plugin) struct Process {
    child: Child,
    requests: Option<Sender<Vec<u8>>>,
    lines: Receiver<Line>,
    log: Log,
    hosted: bool,
    ended: bool,
}

impl Process {
    /// Starts it in a process group of its own, under a host if there is one; `folder` is that of the exchange. Errors:
    /// the system refuses.
    pub(in crate::plugin) fn start(
        launch: &Launch,
        host: Option<&Host>,
        folder: &Path,
        temporary: &Path,
    ) -> Result<Self, PluginError> {
        let mut command = match host {
            Some(host) => host.command(launch, folder),
            None => {
                let mut command = Command::new(&launch.program);
                command.args(&launch.arguments);
                command
            }
        };
        // its temporary files go with the folder, unless the config names another place
        command.env("TMPDIR", temporary).envs(&launch.environment).current_dir(&launch.folder);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let failed = |error: std::io::Error| {
            let what = format!("cannot be started: {}: {error}", launch.program.display());
            PluginError::new(what, "try its command in a shell")
        };
        let mut child = command.spawn().map_err(failed)?;
        let (input, output, errors) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let ((requests, to_write), (found, lines)) = (mpsc::channel::<Vec<u8>>(), mpsc::sync_channel(MOST_LINES));
        let (log, follow) = match errors.map(|errors| Log::of(OwnedFd::from(errors).into())).transpose() {
            Ok(Some((log, follow))) => (log, Some(follow)),
            Ok(None) => (Log::default(), None),
            Err(error) => {
                kill(&mut child, host.is_some());
                return Err(failed(error));
            }
        };
        // one thread per pipe: a plugin that does not read, or that fills stderr, blocks a thread of its own and
        // nothing else
        let threads = [
            spawn("stdin", move || {
                let Some(mut input) = input else { return };
                while let Ok(request) = to_write.recv() {
                    if input.write_all(&request).and_then(|()| input.flush()).is_err() {
                        return;
                    }
                }
            }),
            spawn("stdout", move || {
                if let Some(output) = output {
                    read_lines(output, MOST_BYTES, |line| found.send(line).is_ok());
                }
            }),
            spawn("stderr", move || follow.into_iter().for_each(|follow| follow())),
        ];
        let process = Self { child, requests: Some(requests), lines, log, hosted: host.is_some(), ended: false };
        match threads.into_iter().find_map(Result::err) {
            Some(error) => Err(failed(error)),
            None => Ok(process),
        }
    }

    /// Sends a line. A process that is gone is noticed when its answer is waited for.
    pub(in crate::plugin) fn send(&self, line: &str) {
        if let Some(requests) = &self.requests {
            let _ = requests.send(format!("{line}\n").into_bytes());
        }
    }

    /// The next line. Errors: it does not come in time, the process ends, it is no text or too long.
    pub(in crate::plugin) fn receive(&mut self, deadline: Instant, doing: &str) -> Result<String, PluginError> {
        let wait = deadline.saturating_duration_since(Instant::now());
        match self.lines.recv_timeout(wait) {
            Ok(Line::Text(text)) => Ok(text),
            Ok(Line::NotText(line)) => Err(PluginError::new(
                format!("wrote a line that is not UTF-8 {doing}: {line}"),
                "write JSON in UTF-8 to stdout, one message a line",
            )),
            Ok(Line::TooLong(line)) => Err(PluginError::new(
                format!("wrote a line of more than {} MiB {doing}: {line}", MOST_BYTES >> 20),
                "write arrays into the output file and their paths into the answer",
            )),
            Ok(Line::CutShort(line)) => {
                let status = self.status();
                let what =
                    format!("ended ({status}) in the middle of a line {doing}: {}", lines::shown(line.as_bytes()));
                Err(PluginError::new(what, "end every message with a newline and flush stdout"))
            }
            Err(RecvTimeoutError::Timeout) => Err(PluginError::new(
                format!("said nothing in time {doing}"),
                "raise `timeout_s` in [plugins], or mend it: it may hang, or not flush stdout",
            )),
            Err(RecvTimeoutError::Disconnected) => {
                let what = format!("ended ({}) {doing}", self.status());
                Err(PluginError::new(what, "run its command in a shell to see why"))
            }
        }
    }

    /// A line that came unasked for, if there is one within `wait`.
    pub(in crate::plugin) fn unasked(&self, wait: Duration) -> Option<String> {
        match self.lines.recv_timeout(wait).ok()? {
            Line::Text(line) => Some(lines::shown(line.as_bytes())),
            Line::NotText(line) | Line::TooLong(line) | Line::CutShort(line) => Some(line),
        }
    }

    /// What it wrote to stderr since it was asked last.
    pub(in crate::plugin) fn take_log(&self) -> String {
        self.log.take()
    }

    /// Kills the process and its group, and returns its last words.
    pub(in crate::plugin) fn kill(&mut self) -> String {
        self.end(Duration::ZERO);
        self.log.take_last()
    }

    /// Closes its input and waits for its end: whether it ended by itself, and how.
    pub(in crate::plugin) fn close(&mut self, wait: Duration) -> Result<String, PluginError> {
        self.requests = None;
        if self.wait(wait) {
            let status = self.status();
            self.end(Duration::ZERO);
            return Ok(status);
        }
        self.end(Duration::ZERO);
        let what = format!("did not end within {:.0} s after `shutdown`", wait.as_secs_f64());
        Err(PluginError::new(what, "end on `shutdown`, and when stdin ends"))
    }

    /// No more requests: what `shutdown` does for many at once, before it waits.
    pub(in crate::plugin) fn close_input(&mut self) {
        self.requests = None;
    }

    fn end(&mut self, wait: Duration) {
        if std::mem::replace(&mut self.ended, true) {
            return;
        }
        self.requests = None;
        self.wait(wait);
        kill(&mut self.child, self.hosted);
        // reaped: no zombie stays
        let _ = self.child.wait();
    }

    /// Waits for its end, at most so long: whether it came.
    fn wait(&mut self, most: Duration) -> bool {
        let deadline = Instant::now() + most;
        loop {
            match self.child.try_wait() {
                Ok(Some(_)) => return true,
                Ok(None) if Instant::now() < deadline => std::thread::sleep(Duration::from_millis(2)),
                Ok(None) | Err(_) => return false,
            }
        }
    }

    /// How it ended, for messages; it has closed its output.
    fn status(&mut self) -> String {
        self.wait(Duration::from_millis(500));
        match self.child.try_wait() {
            Ok(Some(status)) => status.to_string(),
            _ => "it closed stdout and goes on".to_owned(),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end(GRACE);
    }
}

fn spawn(pipe: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    std::thread::Builder::new().name(format!("plugin {pipe}")).spawn(work).map(drop)
}

/// Kills the process and what it started: all of it under a host, else as far as it stayed in its group.
fn kill(child: &mut Child, hosted: bool) {
    if let Some(group) = i32::try_from(child.id()).ok().and_then(rustix::process::Pid::from_raw) {
        // before the host, which knows what belongs to it. A number that was waited for may be another's.
        #[cfg(target_os = "linux")]
        if hosted && matches!(child.try_wait(), Ok(None)) {
            super::descendants::kill_descendants(group);
        }
        // an error means that nothing is left to kill
        let _ = rustix::process::kill_process_group(group, rustix::process::Signal::KILL);
    }
    let _ = child.kill();
}
