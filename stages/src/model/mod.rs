//! Parametric estimates: prediction error method, modes, zeros.

mod error;
mod innovations;
mod orthogonal;
pub mod pem;
mod subspace;

pub use error::ModelError;
pub use innovations::{InnovationsModel, Section};
pub use subspace::Subspace;
