//! Prediction error method: the innovations form of Eq. 8, fitted by minimum one-step prediction error.

mod autoregression;
mod columns;
mod conclusion;
mod covariance;
mod data;
mod gradient;
mod identify;
mod linearised;
mod noise;
mod optimiser;
mod options;
mod parametrisation;
mod predictor;
mod products;
mod projection;
mod rotation;
mod secant;
mod starts;
mod state;
mod tangent;
#[cfg(test)]
mod tests;
mod turns;
mod whitening;

pub use covariance::ResidualColour;
pub(crate) use covariance::covariance as time_domain_covariance;
pub(crate) use data::complete as longest_complete;
pub use identify::{identify, refit, with_poles};
pub use optimiser::Ending;
pub use options::{Experiment, Focus, Identified, NoiseModel, PemOptions, Verdict};
pub(crate) use parametrisation::{Coefficients, roots, section_order, sections_of_roots};
pub(crate) use predictor::all_pole;
