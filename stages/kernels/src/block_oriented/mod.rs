//! Block-oriented models.

mod curve;
mod fit;
mod model;
mod options;
mod rational;
mod refine;
mod result;
mod screening;
mod splits;
mod start;
#[cfg(test)]
mod tests;

pub use curve::Curve;
pub use fit::fit_block_oriented;
pub use model::{BlockModel, Structure};
pub use options::{BlockError, BlockOptions};
pub use rational::Rational;
pub use result::{BlockFit, BlockPole, CurveStrength, Tried};
