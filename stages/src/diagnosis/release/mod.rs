//! Diagnosis of releases: what a linear lever and detector leave unexplained in snap-off events, and why.

mod align;
mod answer;
mod basis;
mod change;
mod joint;
mod lever;
mod lever_modes;
mod normal;
mod problem;
mod residuals;
mod screen;
mod search;
mod signals;
mod start;
mod state;
mod stepper;
mod story;
mod story_events;
mod story_spectra;
mod window;

pub use align::{aligned, suggested};
pub use answer::answer;
pub use joint::{JointFit, fit};
pub use lever::{Lever, LeverMode};
pub use problem::{Problem, SeenMode};
pub use residuals::{Tile, common, peaks, residuals, tiles, whitened};
pub use screen::{Screen, Sign, screen};
pub use search::{Named, Naming, NamingOptions, name_causes, scene};
pub use start::{Start, start};
pub use state::{Hold, Hypothesis, State};
pub use stepper::{Pace, Release, differences};
pub use story::{Story, story};
pub use story_events::EventStory;
pub use story_spectra::MeanSpectra;
pub use window::{Cut, EventWindow};
