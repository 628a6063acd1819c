//! The process between this program and a plugin: it ends all that the plugin has started, whatever ends this program.
//!
//! ```text
//! program
//!     -> PROGRAM __plugin-host PID FOLDER HOW COMMAND...
//!     -> PROGRAM __plugin-start PID FOLDER HOW COMMAND... = the plugin
//! ```
//!
//! The host adopts what the plugin's processes leave behind, waits for the end of the plugin and for that of the
//! program, kills what is left, and removes the folder of the exchange where the program no longer can. The last step
//! lets the plugin die with its host, confines it, and becomes the plugin.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitOptions, WaitStatus, getpid, getppid, kill_process, pidfd_open, set_child_subreaper,
    set_parent_process_death_signal, wait,
};

use super::confinement::confine;
use super::descendants::kill_descendants;
use crate::own_command::{own_arguments, own_command};
use crate::plugin::launch::Launch;

const HOST: &str = "__plugin-host";
const START: &str = "__plugin-start";

/// The name of a host in lists of processes.
const HOST_NAME: &str = "plugin-host";

/// How a plugin is started.
const CONFINED: &str = "confined";
const FREE: &str = "free";

/// A program that calls [`host_main`] at its beginning, and so can stand between this one and a plugin.
#[derive(Debug, Clone)]
pub struct Host(());

impl Host {
    /// This program itself, even when its file has been replaced meanwhile. None: the system does not say where it is.
    pub fn this_program() -> Option<Self> {
        own_command(HOST_NAME).map(|_| Self(()))
    }

    /// The command that starts a plugin under it; `folder` is that of the exchange.
    pub(super) fn command(&self, launch: &Launch, folder: &Path) -> Command {
        let mut command = own_command(HOST_NAME).unwrap_or_else(|| Command::new(HOST_NAME));
        command
            .arg(HOST)
            .arg(std::process::id().to_string())
            .arg(folder)
            .arg(if launch.confined { CONFINED } else { FREE })
            .arg(&launch.program)
            .args(&launch.arguments);
        command
    }
}

/// What `main` of a program does first: if it was started to host a plugin it does that, and the exit code is returned.
/// Otherwise nothing.
pub fn host_main() -> Option<u8> {
    let mut arguments = own_arguments();
    let what = arguments.next()?;
    let (is_host, is_start) = (what == OsStr::new(HOST), what == OsStr::new(START));
    if !is_host && !is_start {
        return None;
    }
    let parent = arguments.next().and_then(|text| Pid::from_raw(text.to_str()?.parse().ok()?));
    let rest: Vec<OsString> = arguments.collect();
    Some(match (parent, rest.as_slice()) {
        (Some(parent), [folder, command @ ..]) if is_host && command.len() > 1 => {
            host(parent, Path::new(folder), command)
        }
        (Some(parent), [folder, how, program, arguments @ ..]) if is_start => {
            let confined = how == OsStr::new(CONFINED);
            start(parent, confined.then_some(Path::new(folder)), program, arguments)
        }
        _ => 2,
    })
}

fn host(parent: Pid, folder: &Path, command: &[OsString]) -> u8 {
    // where the system refuses, what leaves the plugin's group and outlives its parent is not found
    let _ = set_child_subreaper(Some(getpid()));
    let program = Program { parent, held: pidfd_open(parent, PidfdFlags::empty()).ok() };
    if !program.has_ended(Duration::ZERO) {
        let own = getpid().as_raw_nonzero().to_string();
        let mut start = own_command("plugin-start").unwrap_or_else(|| Command::new(HOST_NAME));
        match start.arg(START).arg(own).arg(folder).args(command).spawn() {
            Ok(child) => {
                let plugin = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
                return hosted(plugin, program, folder);
            }
            Err(error) => report_not_started(command.get(1), &error),
        }
    }
    127
}

fn hosted(plugin: Option<Pid>, program: Program, folder: &Path) -> u8 {
    // the plugin alone holds the pipes: their ends are seen when it ends or closes them
    if let Ok(nothing) = File::options().read(true).write(true).open("/dev/null") {
        let _ = rustix::stdio::dup2_stdin(&nothing);
        let _ = rustix::stdio::dup2_stdout(&nothing);
        let _ = rustix::stdio::dup2_stderr(&nothing);
    }
    let (program, folder) = (std::sync::Arc::new(program), folder.to_owned());
    let (watched, of_watch) = (std::sync::Arc::clone(&program), folder.clone());
    let watch = std::thread::Builder::new().spawn(move || {
        while !watched.has_ended(Duration::from_secs(3600)) {}
        kill_descendants(getpid());
        remove(&of_watch);
        std::process::exit(1);
    });
    // who cannot watch starts nothing
    if watch.is_err() {
        kill_descendants(getpid());
    }
    let status = reaped(plugin);
    kill_descendants(getpid());
    // a plugin that ends because the program is gone may be faster than the system is in telling it
    if program.has_ended(Duration::from_millis(20)) {
        remove(&folder);
    }
    ended_as(status)
}

/// Waits for the plugin, and for whatever else ends meanwhile.
fn reaped(plugin: Option<Pid>) -> Option<WaitStatus> {
    loop {
        match wait(WaitOptions::empty()) {
            Ok(Some((pid, status))) if Some(pid) == plugin => return Some(status),
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(_) => return None,
        }
    }
}

/// Ends as the plugin did, for the process that waits.
fn ended_as(status: Option<WaitStatus>) -> u8 {
    let Some(status) = status else { return 1 };
    if let Some(signal) = status.terminating_signal() {
        // a signal that ended the plugin ends this process too, or is caught by its runtime
        if let Some(signal) = Signal::from_named_raw(signal) {
            let _ = kill_process(getpid(), signal);
        }
        return u8::try_from(128 + signal).unwrap_or(1);
    }
    status.exit_status().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)
}

/// The program that has started this host.
#[derive(Debug)]
struct Program {
    parent: Pid,
    held: Option<OwnedFd>,
}

impl Program {
    /// Whether it has ended, or does within `wait`.
    fn has_ended(&self, wait: Duration) -> bool {
        // what was opened may be a later process of the same number: the parent is asked for as well
        if getppid() != Some(self.parent) {
            return true;
        }
        let Some(held) = &self.held else {
            // without a handle: looked at now and then
            std::thread::sleep(wait.min(Duration::from_millis(100)));
            return getppid() != Some(self.parent);
        };
        let limit = Timespec { tv_sec: wait.as_secs() as i64, tv_nsec: i64::from(wait.subsec_nanos()) };
        let waited = poll(&mut [PollFd::new(held, PollFlags::IN)], Some(&limit));
        matches!(waited, Ok(1..)) || getppid() != Some(self.parent)
    }
}

/// Removes the folder of the exchange, and nothing of another name.
fn remove(folder: &Path) {
    let own = folder.file_name().is_some_and(|name| name.to_string_lossy().starts_with(super::FOLDER));
    if own && std::fs::symlink_metadata(folder).is_ok_and(|metadata| metadata.is_dir()) {
        // what cannot be removed is swept later
        let _ = std::fs::remove_dir_all(folder);
    }
}

/// Becomes the plugin, which may write to `confined` alone if there is such a folder.
fn start(host: Pid, confined: Option<&Path>, program: &OsStr, arguments: &[OsString]) -> u8 {
    // it stays with what this process becomes; where the system refuses, the host's own end is not seen
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    if getppid() == Some(host) {
        if let Some(Err(error)) = confined.map(confine) {
            report_not_started(
                Some(&program.to_owned()),
                &format!("it cannot be confined ({error}): see `confined` in docs/plugins.md"),
            );
            return 127;
        }
        let error = Command::new(program).args(arguments).exec();
        report_not_started(Some(&program.to_owned()), &error);
    }
    127
}

/// On stderr, which the program shows.
fn report_not_started(program: Option<&OsString>, error: &dyn std::fmt::Display) {
    use std::io::Write;
    let program = program.map(|program| program.to_string_lossy().into_owned()).unwrap_or_default();
    let _ = writeln!(std::io::stderr(), "{program} cannot be started: {error}");
}
