//! Where no process can be made the parent of what others leave behind: plugins run in a process group, and no more.

use std::path::Path;
use std::process::Command;

use rustix::process::Pid;

use crate::plugin::launch::Launch;

/// A program that stands between this one and a plugin: there is none on this system.
#[derive(Debug, Clone)]
pub struct Host(std::convert::Infallible);

impl Host {
    /// None on this system.
    pub fn this_program() -> Option<Self> {
        None
    }

    pub(super) fn command(&self, _launch: &Launch, _folder: &Path) -> Command {
        match self.0 {}
    }
}

/// Nothing on this system.
pub fn host_main() -> Option<u8> {
    None
}

/// What leaves its group is not found on this system.
pub(in crate::plugin) fn kill_descendants(_root: Pid) {}

/// Nothing is enforced on this system.
pub(in crate::plugin) fn not_enforced() -> Option<String> {
    Some("where it writes, TCP: only Linux confines it".to_owned())
}
