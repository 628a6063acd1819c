//! Files that are either whole or not there, temporary names, and what tells two states of a file apart.

mod file_state;
#[cfg(test)]
pub(crate) mod fixture;
mod known_hashes;
mod replace;
mod temporary;

pub use afmid_formats::{open_regular, read_regular};
pub(crate) use file_state::FileState;
pub(crate) use known_hashes::KnownHashes;
pub(crate) use replace::{Replacement, replace_unsynced};
pub use replace::{probe, replace_file, replace_with};
#[cfg(test)]
pub(crate) use temporary::host;
pub(crate) use temporary::{stale, temporary_path};
pub use temporary::{sweep, sweep_beside};
