//! What a linear simulation gets wrong: the catalogue of causes, each a file.
//!
//! A [`Cause`] adds [`Effects`](crate::effects::Effects) to a simulation. The simulator integrates them in time to hide
//! them, the diagnosis evaluates them with its own numerics to find them, and the extended model simulates with them
//! afterwards.

mod cause;
mod needs;

mod absolute_stiffness;
mod ac_coupling;
mod adc_nonlinearity;
mod alignment_jitter;
mod asymmetric_friction;
mod backlash;
mod baseline_drift;
mod clipping;
mod clock_error;
mod constant_delay;
mod coulomb_friction;
mod creep;
mod cubic_coupling;
mod cubic_detector;
mod dead_band;
mod duffing;
mod extra_mode;
mod extra_pole;
mod feedthrough;
mod finite_rupture;
mod frequency_drift;
mod gain_step;
mod hammerstein_curve;
mod input_dead_zone;
mod input_saturation;
mod intensity_noise;
mod interference_fringe;
mod intersample;
mod mains_hum;
mod mass_change;
mod missing_samples;
mod mode_coupling;
mod near_surface_damping;
mod nonlinear_damping;
mod offset;
mod output_absolute;
mod output_cubic;
mod output_quadratic;
mod output_saturation;
mod photodiode_tail;
mod piezo_crosstalk;
mod piezo_ring;
mod quadratic_coupling;
mod quadratic_damping;
mod quadratic_detector;
mod quadratic_stiffness;
mod quintic_stiffness;
mod self_fringe;
mod slew_rate;
mod spurious_line;
mod tether_tail;
mod tip_sample_force;
mod two_step_rupture;
mod wiener_curve;
mod wiener_hammerstein_curve;

pub use cause::{About, Cause, Identifiable, Need, Parameter, Part, Scene, within_limits};
pub use needs::{releases_have, runs_have};

/// Every built-in cause, by id.
pub const CATALOGUE: &[&dyn Cause] = &[
    &absolute_stiffness::AbsoluteStiffness,
    &ac_coupling::AcCoupling,
    &adc_nonlinearity::AdcNonlinearity,
    &alignment_jitter::AlignmentJitter,
    &asymmetric_friction::AsymmetricFriction,
    &backlash::Backlash,
    &baseline_drift::BaselineDrift,
    &clipping::Clipping,
    &clock_error::ClockError,
    &constant_delay::ConstantDelay,
    &coulomb_friction::CoulombFriction,
    &creep::Creep,
    &cubic_coupling::CubicCoupling,
    &cubic_detector::CubicDetector,
    &dead_band::DeadBand,
    &duffing::Duffing,
    &extra_mode::ExtraModeCause,
    &extra_pole::ExtraPole,
    &feedthrough::Feedthrough,
    &finite_rupture::FiniteRupture,
    &frequency_drift::FrequencyDrift,
    &gain_step::GainStep,
    &hammerstein_curve::HammersteinCurve,
    &input_dead_zone::InputDeadZone,
    &input_saturation::InputSaturation,
    &intensity_noise::IntensityNoise,
    &interference_fringe::InterferenceFringe,
    &intersample::IntersampleCause,
    &mains_hum::MainsHum,
    &mass_change::MassChange,
    &missing_samples::MissingSamples,
    &mode_coupling::ModeCoupling,
    &near_surface_damping::NearSurfaceDamping,
    &nonlinear_damping::NonlinearDamping,
    &offset::Offset,
    &output_absolute::OutputAbsolute,
    &output_cubic::OutputCubic,
    &output_quadratic::OutputQuadratic,
    &output_saturation::OutputSaturation,
    &photodiode_tail::PhotodiodeTail,
    &piezo_crosstalk::PiezoCrosstalk,
    &piezo_ring::PiezoRing,
    &quadratic_coupling::QuadraticCoupling,
    &quadratic_damping::QuadraticDamping,
    &quadratic_detector::QuadraticDetector,
    &quadratic_stiffness::QuadraticStiffness,
    &quintic_stiffness::QuinticStiffness,
    &self_fringe::SelfFringe,
    &slew_rate::SlewRate,
    &spurious_line::SpuriousLine,
    &tether_tail::TetherTail,
    &tip_sample_force::TipSampleForce,
    &two_step_rupture::TwoStepRupture,
    &wiener_curve::WienerCurve,
    &wiener_hammerstein_curve::WienerHammersteinCurve,
];

/// The built-in cause of that id.
pub fn built_in(id: &str) -> Option<&'static dyn Cause> {
    CATALOGUE.iter().copied().find(|cause| cause.about().id == id)
}
