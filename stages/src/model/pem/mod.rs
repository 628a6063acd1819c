//! Prediction error method: the innovations form of Eq. 8, fitted by minimum one-step prediction error.

mod autoregression;
mod covariance;
mod gradient;
mod identify;
mod noise;
mod optimiser;
mod parametrisation;
mod predictor;
mod projection;
mod starts;
mod tangent;
#[cfg(test)]
mod tests;

pub use covariance::ResidualColour;
pub use identify::{Experiment, Focus, Identified, NoiseModel, PemOptions, Verdict, identify, refit, with_poles};
pub use optimiser::Ending;
pub(crate) use parametrisation::{Coefficients, roots, section_order, sections_of_roots};
pub(crate) use predictor::all_pole;
