//! The runner: independent stages in parallel, results from the cache where they are still valid.

mod changes;
mod error;
mod execute;
mod explain;
#[cfg(test)]
mod input_tests;
mod keys;
mod schedule;
#[cfg(test)]
mod tests;
mod writing;

pub use changes::{Change, changes};
pub use error::{Failed, RunError};
pub use execute::{Observer, Options, Quiet, failed_place, run, run_to_file};
pub use explain::{Decision, Explanation, Nearest, explain};
pub use keys::{RunKey, Surroundings, run_key, stage_seed};
