//! A plugin's process, and what comes out of it.

#[cfg(target_os = "linux")]
mod confinement;
#[cfg(target_os = "linux")]
mod descendants;
#[cfg(target_os = "linux")]
mod host;
mod lines;
mod log;
#[cfg(not(target_os = "linux"))]
mod no_host;
mod running;

#[cfg(target_os = "linux")]
pub(super) use confinement::not_enforced;
#[cfg(target_os = "linux")]
pub(super) use descendants::kill_descendants;
#[cfg(target_os = "linux")]
pub use host::{Host, host_main};
pub(super) use lines::{Line, read_lines, shown};
#[cfg(not(target_os = "linux"))]
pub use no_host::{Host, host_main};
#[cfg(not(target_os = "linux"))]
pub(super) use no_host::{kill_descendants, not_enforced};
pub(super) use running::Process;

/// Begins the names of the folders of exchanges.
pub(super) const FOLDER: &str = "afmid-plugin.";
