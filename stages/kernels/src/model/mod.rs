//! The model that all parametric estimates share: the innovations form in sections of order two, its parameters, its
//! zeros, its Kalman gain.
//!
//! ```
//! use afmid_kernels::c64;
//! use afmid_kernels::model::{InnovationsModel, Section};
//! // one section: poles of modulus 0.98 at a tenth of the sample rate
//! let (radius, angle) = (0.98_f64, std::f64::consts::TAU * 0.1);
//! let a = [-2.0 * radius * angle.cos(), radius * radius];
//! let section = Section { order: 2, a, b: [0.0, 0.1], k: [0.0; 2] };
//! let model = InnovationsModel { sections: vec![section], feedthrough: 0.0, sample_time_s: 1e-6 };
//! // its response to a step settles at the transfer function at z = 1
//! let step = model.simulate(&[1.0; 2000], &[0.0; 2])?;
//! assert!((step[1999] - model.transfer(c64::new(1.0, 0.0)).re).abs() < 1e-12);
//! // a coefficient's standard error of 1e-4 makes the static gain uncertain by its sensitivity times as much
//! let std = 1e-4 * model.transfer_sensitivities(c64::new(1.0, 0.0))[0].re.abs();
//! assert!((std / (1e-4 * 0.1 / (1.0 + a[0] + a[1]).powi(2)) - 1.0).abs() < 1e-12);
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

mod error;
mod innovations;
mod parametrisation;
mod riccati;
mod transmission;

pub use error::ModelError;
pub(crate) use error::{finite, go_on};
pub(crate) use innovations::kalman_gains;
pub use innovations::{InnovationsModel, InputGains, Section};
pub use parametrisation::held_apart;
pub(crate) use parametrisation::{
    Coefficients, LIMIT, coordinates, roots, section_order, sections, sections_of_roots, slopes,
};
pub(crate) use riccati::kalman_gain;
pub use transmission::transmission_zeros;
