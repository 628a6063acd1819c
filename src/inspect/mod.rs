//! What a recorded file holds, and whether it holds a ringdown.

mod channel;
mod config;
mod file;
mod folder;
mod json;
mod no_sensor;
mod ringing;
mod text;
mod verdict;

pub use channel::{Channel, Values};
pub use file::{Inspected, Outcome, inspect};
pub use folder::files_of;
pub use json::inspected_json;
pub use ringing::{counted, first_samples};
pub use text::{file_text, folder_text};
pub use verdict::{LEAST_CODES, LEAST_SAMPLES};
