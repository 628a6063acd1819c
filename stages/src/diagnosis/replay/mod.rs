//! Measured events simulated again: each with its own load and instant, by the integrator of the simulator.

mod event;
mod fit;

pub use event::{ReplayedEvent, Replayer};
