//! What is simulated: the linear dynamics that identification found, and what causes add to them.

mod added;
mod modal;
mod model;
mod motion;
mod propagator;
mod section;

pub use added::Added;
pub(super) use added::is_choice;
pub use modal::{Modal, Weights};
pub use model::{Model, State};
pub use motion::Span;
pub use section::{Kind, Section};
