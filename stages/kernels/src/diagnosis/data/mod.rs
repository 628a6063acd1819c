//! What was measured: runs of one system, stretches of them to learn from and to judge on.

mod bench;
mod input;
mod layout;
mod record;
mod thinned;

pub use bench::Bench;
pub(super) use bench::LEAST_SAMPLES;
pub use input::FineInput;
pub(super) use layout::Layout;
pub use record::{Part, PartStart, Record, Stretch};
pub(super) use thinned::Thinned;
