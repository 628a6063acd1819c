//! The model that all parametric estimates share: the innovations form in sections of order two, its parameters, its
//! zeros, its Kalman gain.
mod error;
mod innovations;
mod parametrisation;
mod riccati;
mod transmission;

pub use error::ModelError;
pub(crate) use error::finite;
pub(crate) use innovations::kalman_gains;
pub use innovations::{InnovationsModel, InputGains, Section};
pub use parametrisation::held_apart;
pub(crate) use parametrisation::{
    Coefficients, LIMIT, coordinates, roots, section_order, sections, sections_of_roots, slopes,
};
pub(crate) use riccati::kalman_gain;
pub use transmission::transmission_zeros;
