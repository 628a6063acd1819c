//! Beginnings: configs for recordings that were looked at.

mod pipeline;
mod recordings;

pub use pipeline::{Wanted, pipeline};
pub use recordings::look;
