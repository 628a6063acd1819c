//! Stages in any language: processes that speak newline-delimited JSON on stdio. `docs/plugins.md` is their specification.
//!
//! ```text
//! [plugins] or PATH -> Launch -> Process (handshake, describe) -> Plugin (a row without a type) -> run, run, run ...
//! ```
//!
//! A process is started once per worker and reused over items. Nothing that it does is trusted: lines are bounded, times are limited, what it
//! made is checked before it is stored, and whatever goes wrong is an error that names the plugin.

mod conformance;
mod describe;
mod error;
mod exchange;
mod fingerprint;
mod hearing;
mod launch;
mod lines;
mod log;
mod message;
mod pool;
mod process;
mod row;
mod schema;
mod session;
mod stage;

pub use conformance::{Check, check};
#[doc(hidden)]
pub use hearing::hear;
pub use launch::Launch;
pub use pool::shut_down;
pub(crate) use row::entry;

/// The versions of the protocol that this program speaks.
const PROTOCOL: std::ops::RangeInclusive<u64> = 1..=1;
