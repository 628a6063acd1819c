//! The force that acted: the input of the identification.
//!
//! Nobody measures the force in the contact. At a rupture it is known all the same: before it the lever bends
//! quasi-statically under the load, after it there is none. Both lines are extrapolated to the moment `t0`, and their
//! difference is the input, in volts of static deflection, so that the quasi-static gain is one.
//!
//! ```
//! use afmid_kernels::force::{Weighting, fit_line};
//! // the lever under a load that grows, until sample 2000; noise of 0.7 mV
//! let y: Vec<f64> = (0..2000).map(|k| -0.9 - 1e-5 * k as f64 + 1e-3 * ((k * k) as f64).sin()).collect();
//! let before = fit_line(&y, 0, 2000, Weighting::Uniform, true);
//! let (load, std) = (before.at(2000.0), before.std_at(2000.0, 0.7e-3));
//! // at its end a line is known to twice the noise over the root of the samples
//! assert!((load + 0.92).abs() < 3.0 * std && (std / (2.0 * 0.7e-3 / 2000.0_f64.sqrt()) - 1.0).abs() < 1e-2);
//! ```

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
