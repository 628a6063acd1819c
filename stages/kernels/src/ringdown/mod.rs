//! Ringdowns of several events, fitted jointly at the limit of their noise.
//!
//! # Model
//! Releases ([`fit_ringdowns`]): `y_e(k) = a_e sum_j Re(rho_j exp(s_j (k T - t_e))) + offset_e + slope_e x_k + n(k)`, x
//! from -1 to 1 over the event; poles `s_j` and residues `rho_j` are shared, amplitude, onset, offset and slope each
//! event's own; n thermal, 1/f and white. Decays in several channels ([`fit_channels`]): poles shared, the residues of
//! each event and channel its own. A mode has the frequency `abs(s) / 2 pi` and the quality factor `abs(s) / (-2 Re s)`.
//! # Shapes
//! Events of one length each, C channels of one length per event; covariance over real and imaginary part of each pole
//! in turn.
//! # Cost
//! [`fit_ringdowns`] about 3 ms per record of 8192 samples and round of noise; [`fit_channels`] `N C (4 modes)^2` per
//! step; [`fit_decay`], one record in white noise, 0.4 ms.
//! # Source
//! S. M. Kay, Fundamentals of Statistical Signal Processing I (1993), chapter 7; G. H. Golub and V. Pereyra, SIAM J.
//! Numer. Anal. 10 (1973) 413.
//!
//! ```
//! use afmid_kernels::ringdown::{DecayOptions, NoiseSource, RingdownOptions, fit_decay, fit_ringdowns};
//! // one damped cosine, sampled at 1 MS/s: 50 kHz, Q = 40
//! let (w, a) = (std::f64::consts::TAU * 50e3, std::f64::consts::PI * 50e3 / 40.0);
//! let wave = |k: f64| (-a * 1e-6 * k).exp() * (w * 1e-6 * k).cos() + 1e-4 * (k * k).sin();
//! let y: Vec<f64> = (0..4096).map(|k| wave(f64::from(k))).collect();
//! let options = RingdownOptions { modes: 1, real_poles: 0, noise: NoiseSource::White, ..RingdownOptions::default() };
//! let fit = fit_ringdowns(&[&y], &[], 1e-6, &options)?;
//! let mode = fit.modes()[0];
//! assert!((mode.quality_factor.value - 40.0).abs() < 5.0 * mode.quality_factor.std);
//! // a single record in white noise needs less, and gets it in a fraction of the time
//! let quick = fit_decay(&y, 1e-6, &DecayOptions { modes: 1, real_poles: 0, ..DecayOptions::default() })?;
//! assert!((quick.modes()[0].frequency_hz.value - mode.frequency_hz.value).abs() < mode.frequency_hz.std);
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```
//!
//! Several channels, shapes with them; the number of modes found by the data:
//!
//! ```
//! use afmid_kernels::ringdown::{ChannelOptions, fit_channels};
//! // 100 Hz, damping 1 %, seen by two sensors of opposite sign, 2 kHz
//! let wave = |gain: f64, seed: usize| -> Vec<f64> {
//!     let noise = |k: usize| 1e-3 * ((k * k * (seed + 1)) as f64).sin();
//!     (0..1500).map(|k| gain * (-6.283e-3 * 0.5 * k as f64).exp() * (0.31416 * k as f64).sin() + noise(k)).collect()
//! };
//! let (first, second) = (wave(1.0, 1), wave(-0.5, 2));
//! let fit = fit_channels(&[vec![&first, &second]], &[], 5e-4, &ChannelOptions::default())?;
//! let damping = fit.modes()[0].damping_ratio();
//! assert!(fit.poles.len() == 1 && (damping.value - 0.01).abs() < 5.0 * damping.std + 1e-5);
//! assert!((fit.shapes[0].points[1].value.re + 0.5).abs() < 0.01);
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

mod absorbed;
mod bootstrap;
mod channels;
mod choice;
#[cfg(test)]
mod choice_tests;
mod compressed;
mod coordinates;
mod decay;
mod estimate;
mod fit;
mod fitted;
mod freedom;
mod gap_start;
#[cfg(test)]
mod gap_tests;
mod gaps;
mod guess;
mod knowledge;
#[cfg(test)]
mod knowledge_tests;
mod ladder;
mod limits;
mod modal_form;
pub mod moving;
mod noise;
mod noise_estimate;
mod normal;
mod options;
mod projected;
mod records;
mod result;
mod search;
mod start;
#[cfg(test)]
mod tests;
mod whitener;
mod whittle;

/// What the diagnosis shares with the fit: whitening, the basis, normal equations.
pub(crate) mod internals {
    pub use super::choice::fit_all_that_rings;
    pub use super::coordinates::{pole_of, slopes};
    pub use super::estimate::mode;
    pub use super::modal_form::{columns, shared, signal, weights};
    pub use super::noise_estimate::noise_of_stretches;
    pub use super::whitener::{LANES, Whitener};
    pub use super::whittle::hann;
}

pub use channels::{
    AmplitudeCourse, ChannelNoise, ChannelOptions, ChannelRingdown, Dropped, DroppedMode, FollowedDecay, HarmonicOf,
    HitSystems, MOVES, ModeCourse, ModeShape, ModesWanted, Motion, OrderTried, RankOne, RecordFit, ShapePoint,
    fit_channels, follow_channels, follow_fitted, hit_systems,
};
pub use choice::{CountedRingdown, HELD_OUT_EVENTS, ModeCount, fit_counted_ringdowns};
pub use decay::{Decay, DecayOptions, fit_decay};
pub use estimate::{Estimate, ModeEstimate, Ringdown, RingdownVerdict};
pub use fit::fit_ringdowns;
pub use knowledge::{Knowledge, Known, Quantity};
pub use modal_form::{EventParameters, Exponential};
pub use noise::{RingdownNoise, ThermalMode, Wander};
pub use normal::Prior;
pub use options::{NoiseSource, RingdownOptions};
pub use whitener::Whitener;
