//! Stages in any language: processes that speak newline-delimited JSON on stdio. `docs/plugins.md` is their
//! specification.
//!
//! ```text
//! [plugins] or PATH -> Candidate (consent?) -> Process (handshake, describe)
//!     -> Plugin (a row without a type) -> run, run, run ...
//! ```
//!
//! Nothing starts without consent for command, folder and the bytes of its files. A process is started once per worker
//! and reused over items. Nothing that it does is trusted: lines are bounded, times are limited, what it made is
//! checked before it is stored, and whatever goes wrong is an error that names the plugin.

mod children;
mod conformance;
mod consent;
mod describe;
mod error;
mod exchange;
mod hearing;
mod launch;
mod message;
mod plugins;
mod pool;
mod process;
mod row;
mod schema;
mod served;
mod session;
mod stage;

pub use children::kill_children;
pub use conformance::{Check, check};
pub use consent::{Ask, Candidate, MadeOf, Rule, Trust, Trusted, is_seal};
pub use error::PluginError;
#[doc(hidden)]
pub use hearing::hear;
pub use launch::Launch;
pub use plugins::{AllStages, Described, Plugins};
pub use process::{Host, host_main};
pub use served::{InProcess, Refused, Served};

/// The versions of the protocol that this program speaks.
const PROTOCOL: std::ops::RangeInclusive<u64> = 1..=1;
