//! What a linear oscillator gets wrong in a measured input and output.

mod answer;
mod bench;
mod blocks;
mod choice;
mod diagnose;
mod error;
mod fit;
mod input;
mod linear_algebra;
mod misfit;
mod model;
mod options;
mod oscillator;
mod propagator;
mod screen;
mod start;
mod story;
#[cfg(test)]
mod tests;
mod validation;

pub use bench::{Bench, Part, Recorded};
pub use diagnose::{SystemDiagnosis, diagnose_system};
pub use error::SystemError;
pub use fit::Fit;
pub use input::FineInput;
pub use misfit::Misfit;
pub use model::{Added, Model};
pub use options::SystemOptions;
pub use oscillator::{Oscillator, Span, free_run};
pub use story::{Binned, Spectra, SystemStory};
