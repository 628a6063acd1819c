//! Kernels of afmid, for any program: slices in, plain structs out; no files, no pipeline, no clock, nothing that lives
//! as long as the process.
//!
//! The paper that pages name is Stark et al. 2005, doi 10.1063/1.2137887.
//!
//! Front doors, each with its model, shapes, cost, source and an example from data to numbers, with errors where there
//! are any:
//!
//! | module | from | to |
//! |---|---|---|
//! | [`ringdown`] | free decays of one or many events | frequencies, quality factors, amplitudes, shapes |
//! | [`pem`] | input and output | the innovations form of the paper's Eq. 8 with its covariance |
//! | [`subspace`] | input and output, or a decay | poles, without a start |
//! | [`frf_modes`] | frequency responses of many channels | modes, shapes, a stabilisation diagram |
//! | [`block_oriented`] | input and output | linear parts before and behind a static curve |
//! | [`diagnosis`] | runs, decays, an axis in its loop, a steady oscillation | what a linear model gets wrong, by name |
//! | [`grey`] | input and output, numbers that are known | modes with static shares, real poles, a delay |
//! | [`spectra`] | records | ETFE, smoothed responses, power spectra, thermal fits |
//! | [`contact`] | poles in contact and free | contact stiffness and damping |
//! | [`events::decay`] | records | where free decays begin and end |
//! | [`harmonics`] | a steady oscillation | frequency, amplitudes and phases of its harmonics |
//! | [`phase_sign`] | a frequency response | whether its imaginary parts have the sign of `exp(+i w t)` |
//! | [`modes`] | a model with its covariance | frequencies, quality factors, static shares, zeros |
//! | [`simulate`] | a lever, a contact, a detector | records with their truth |
//!
//! From the ground up, each using only those before it:
//! [`linear_algebra`], [`signal`], [`statistics`], [`effects`], [`Monitor`] - [`optimise`] - [`events`] -
//! [`calibration`], [`causes`], [`force`], [`harmonics`], [`model`], [`simulate`] - [`spectra`], [`modes`], [`ringdown`],
//! [`subspace`], [`vector_fitting`], [`phase_sign`] - [`contact`], [`pem`] - [`block_oriented`], [`grey`], [`stabilisation`],
//! [`validation`] - [`diagnosis`], [`frf_modes`]. Kernels that fit many times take a [`Monitor`]:
//! [`ringdown::fit_counted_ringdowns`], [`validation::choose_order`], [`validation::bootstrap`],
//! [`block_oriented::fit_block_oriented`].
//!
//! ```
//! use afmid_kernels::statistics::{chi_square_tail, median_and_scale};
//!
//! // a chi-square of 18.3 with ten degrees of freedom is exceeded once in twenty times
//! assert!((chi_square_tail(18.307, 10) - 0.05).abs() < 1e-5);
//! // an outlier moves neither the centre nor the scale
//! let (centre, scale) = median_and_scale(&mut [1.0, 2.0, 3.0, 4.0, 1e9]);
//! assert!(centre == 3.0 && scale < 2.0);
//! ```

pub mod block_oriented;
pub mod calibration;
pub mod causes;
pub mod contact;
pub mod diagnosis;
pub mod effects;
pub mod events;
pub mod force;
pub mod frf_modes;
pub mod grey;
pub mod harmonics;
pub mod linear_algebra;
pub mod model;
pub mod modes;
mod monitor;
pub mod optimise;
pub mod pem;
pub mod phase_sign;
pub mod ringdown;
pub mod signal;
pub mod simulate;
pub mod spectra;
pub mod stabilisation;
pub mod statistics;
pub mod subspace;
pub mod validation;
pub mod vector_fitting;

pub use faer::{Mat, c64};
pub use monitor::{Monitor, Unwatched, Watch};

#[cfg(test)]
mod draws;
#[cfg(test)]
mod fixture;
