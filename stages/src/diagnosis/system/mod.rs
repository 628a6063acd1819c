//! What a linear oscillator gets wrong in a measured input and output.

mod bench;
mod blocks;
mod error;
mod fit;
mod input;
mod linear_algebra;
mod model;
mod oscillator;
mod propagator;
mod start;

pub use bench::{Bench, Part, Recorded};
pub use error::SystemError;
pub use fit::Fit;
pub use input::FineInput;
pub use model::{Added, Model};
pub use oscillator::{Oscillator, Span, free_run};
pub fn try_baseline(b:&Bench)->Option<Fit>{start::baseline(b)}
