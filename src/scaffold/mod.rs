//! Beginnings: configs for recordings that were looked at, stages of one's own.

mod channels;
mod choice;
mod first_file;
mod pipeline;
mod recordings;
mod stage;
mod stated;

pub use choice::choose;
pub use pipeline::{Wanted, pipeline};
pub use recordings::look;
pub use stage::{python, rust};
