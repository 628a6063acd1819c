//! What a linear simulation gets wrong: the catalogue of causes, each a file.
//!
//! A [`Cause`] adds [`Effects`] to a simulation. The simulator integrates them in time to hide them, the diagnosis evaluates them with its own
//! numerics to find them, and the extended model simulates with them afterwards.

mod cause;
mod effects;

mod baseline_drift;
mod coulomb_friction;
mod cubic_detector;
mod duffing;
mod extra_mode;
mod finite_rupture;
mod input_dead_zone;
mod input_saturation;
mod intersample;
mod nonlinear_damping;
mod offset;
mod output_absolute;
mod output_cubic;
mod output_quadratic;
mod output_saturation;
mod quadratic_damping;
mod quadratic_detector;
mod quadratic_stiffness;
mod quintic_stiffness;
mod spurious_line;
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
    &baseline_drift::BaselineDrift,
    &coulomb_friction::CoulombFriction,
    &input_dead_zone::InputDeadZone,
    &input_saturation::InputSaturation,
    &intersample::IntersampleCause,
    &nonlinear_damping::NonlinearDamping,
    &offset::Offset,
    &output_absolute::OutputAbsolute,
    &output_cubic::OutputCubic,
    &output_quadratic::OutputQuadratic,
    &output_saturation::OutputSaturation,
    &quadratic_damping::QuadraticDamping,
    &quadratic_stiffness::QuadraticStiffness,
    &quintic_stiffness::QuinticStiffness,
    &spurious_line::SpuriousLine,
];

/// The cause of that id.
pub fn find(id: &str) -> Option<&'static dyn Cause> {
    CATALOGUE.iter().copied().find(|cause| cause.about().id == id)
}
