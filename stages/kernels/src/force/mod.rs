//! The force that acted: the input of the identification.
//!
//! Nobody measures the force in the contact. At a rupture it is known all the same: before it the lever bends
//! quasi-statically under the load, after it there is none. Both lines are extrapolated to the moment `t0`, and their
//! difference is the input, in volts of static deflection, so that the quasi-static gain is one.

mod error;
mod extrapolate;
mod line;
mod reconstruct;
mod t0;

pub use error::ForceError;
pub use extrapolate::{ExtrapolationSettings, Lines, Pair, ZeroLine, extrapolate, pair};
pub use line::{Line, Weighting, correlation_inflation, fit_line};
pub use reconstruct::{
    ForcePrior, IdentifiedModel, Reconstruction, ReconstructionSettings, Rise, band_inflation, reconstruct, rise,
};
pub use t0::{T0, T0Settings, find_t0};
