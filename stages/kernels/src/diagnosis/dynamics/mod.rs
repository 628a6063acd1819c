//! What is simulated: the linear dynamics that identification found, and what causes add to them.

mod added;
mod forces;
mod lane;
mod modal;
mod model;
mod motion;
mod outputs;
mod propagator;
mod section;
mod sensed;
#[cfg(test)]
mod tests;

pub use added::Added;
pub(super) use added::is_choice;
pub(super) use lane::LANES;
pub use modal::{Modal, Weights};
pub use model::{Model, State};
pub(super) use motion::Run;
pub use motion::Span;
pub(super) use outputs::{motions, outputs};
pub use section::{Kind, Section};
pub use sensed::Sensed;
