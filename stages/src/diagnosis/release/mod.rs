//! Diagnosis of releases: what a linear lever and detector leave unexplained in snap-off events, and why.

mod joint;
mod lever;
mod residuals;
mod screen;
mod start;
mod stepper;
mod window;

pub use joint::{Hypothesis, JointFit, Problem, State, fit, suggested};
pub use lever::{Lever, LeverMode};
pub use residuals::{Tile, common, peaks, residuals, tiles, whitened};
pub use screen::{Screen, Sign, screen};
pub use start::{Start, start};
pub use stepper::{Release, differences};
pub use window::{Cut, EventWindow};
