//! What a recorded file holds, and whether it can carry a ringdown.

mod channel;
mod config;
mod file;
mod json;
mod text;
mod verdict;

pub use channel::{Channel, Values};
pub use file::{Inspected, Outcome, inspect};
pub use json::inspected_json;
pub use text::{file_text, folder_text};
pub use verdict::LEAST_RATE_HZ;
