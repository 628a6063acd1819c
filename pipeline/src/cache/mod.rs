//! The content-addressed cache of stage results, and files that are either whole or not there.
//!
//! A stage's result lies in `DIR/KEY.h5`; the key is a hash of everything that the result depends on. Several processes may use one
//! folder at once: every file is written under a name of its own, synced and renamed.

mod folder;
mod key;
mod replace;

#[cfg(test)]
mod tests;

pub use folder::Cache;
pub use key::{KeyParts, key};
pub use replace::{probe, replace_file, sweep, write_result};
