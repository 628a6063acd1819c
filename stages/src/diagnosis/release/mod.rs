//! Diagnosis of releases: what a linear lever and detector leave unexplained in snap-off events, and why.

mod answer;
mod joint;
mod lever;
mod residuals;
mod screen;
mod search;
mod start;
mod stepper;
mod window;

pub use answer::answer;
pub use joint::{Hold, Hypothesis, JointFit, Problem, SeenMode, State, aligned, fit, suggested};
pub use lever::{Lever, LeverMode};
pub use residuals::{Tile, common, peaks, residuals, tiles, whitened};
pub use screen::{Screen, Sign, screen};
pub use search::{Named, Naming, NamingOptions, name_causes, scene};
pub use start::{Start, start};
pub use stepper::{Release, differences};
pub use window::{Cut, EventWindow};
