//! Files that are either whole or not there, temporary names, what tells two states of a file apart, and which files
//! this program wrote.

mod file_state;
mod filled_folder;
#[cfg(test)]
pub(crate) mod fixture;
mod known_hashes;
mod mark;
mod own;
mod replace;
mod result_mark;
mod temporary;

pub use afmid_formats::{append_regular, open_regular, read_regular};
pub(crate) use file_state::FileState;
pub use filled_folder::{FilledFolder, LIST};
pub(crate) use known_hashes::KnownHashes;
pub use mark::{MARK, has_mark, marked, states_mark};
pub use own::{sweep_all_own, sweep_folders, sweep_own, temporary_folder};
pub(crate) use replace::{Replacement, replace_unsynced};
pub use replace::{probe, replace_file, replace_with};
pub(crate) use result_mark::{FORMAT_ATTRIBUTE, HDF5_SIGNATURE, SEAL, head, is_result, seal_line};
#[cfg(test)]
pub(crate) use temporary::host;
pub(crate) use temporary::{TemporaryName, stale, temporary_path};
pub use temporary::{is_temporary, sweep, sweep_below, sweep_beside};
