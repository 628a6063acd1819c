//! The content-addressed cache of stage results, and files that are either whole or not there.
//!
//! A stage's result lies in `DIR/KEY.h5`; the key is a hash of everything that the result depends on. Several processes
//! may use one folder at once: every file is written under a name of its own, synced and renamed. Beside it lies
//! `DIR/KEY.json`: what the key was made of, in words ([`Origin`]). Any file may go at any moment ([`free`]): a run has
//! what it needs in memory or open, the next one computes it again.

mod arithmetic;
mod folder;
mod free;
mod key;
mod names;
mod origin;
mod pending_stage;
mod stock;

#[cfg(test)]
mod free_tests;
#[cfg(test)]
mod tests;

pub use arithmetic::arithmetic;
pub use folder::Cache;
pub use free::{Freed, Gone, Limits, Why, free};
pub use key::{KeyParts, key};
pub use origin::{Origin, OriginFile, OriginInput};
pub(crate) use pending_stage::PendingStage;
pub use stock::{Sort, Stock, Stored};
