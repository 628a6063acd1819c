//! What a linear simulation gets wrong: the catalogue of causes, each a file.
//!
//! A [`Cause`] adds [`Effects`] to a simulation. The simulator integrates them in time to hide them, the diagnosis evaluates them with its own
//! numerics to find them, and the extended model simulates with them afterwards.

mod cause;
mod effects;

mod cubic_detector;
mod duffing;
mod extra_mode;
mod finite_rupture;
mod quadratic_detector;
mod tether_tail;

pub use cause::{About, Cause, Domain, Identifiable, Parameter, Part, Scene, within_limits};
pub use effects::{
    Added, Effects, ExtraMode, FrequencyChange, Instant, Intersample, LinearSection, ModalForce, Motion, RemainingLoad,
    StaticMap,
};

/// Every built-in cause.
pub const CATALOGUE: &[&dyn Cause] = &[
    &quadratic_detector::QuadraticDetector,
    &cubic_detector::CubicDetector,
    &duffing::Duffing,
    &extra_mode::ExtraModeCause,
    &finite_rupture::FiniteRupture,
    &tether_tail::TetherTail,
];

/// The cause of that id.
pub fn find(id: &str) -> Option<&'static dyn Cause> {
    CATALOGUE.iter().copied().find(|cause| cause.about().id == id)
}
