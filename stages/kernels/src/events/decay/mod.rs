//! Free decays in a record of one or several channels: where they begin, where they drown in the noise.
//!
//! [`find_decays`] returns stretches that a sum of decaying exponentials describes, ready for a fit; a steady
//! oscillation is recognised as one and not taken for a decay.
//!
//! # Model
//! Quiet, an event, `sum_j Re(rho_j exp(s_j t))` in noise, the same again; offset and drift slower than the ringing.
//! # Shapes
//! C channels of N samples of the same instants.
//! # Cost
//! Some `100 N C` operations.
//! # Source
//! R. V. Allen, Bull. Seismol. Soc. Am. 68 (1978) 1521; G. R. B. de Prony, J. Ec. Polytech. 1 (1795) 24.
//!
//! ```
//! use afmid_kernels::events::decay::{DecaySearchOptions, find_decays};
//!
//! // 100 Hz, Q = 50, hit at 0.2 s, 5 kHz
//! let y: Vec<f64> = (0..5000)
//!     .map(|k| {
//!         let (t, noise) = (k as f64 / 5e3 - 0.2, 1e-3 * ((k * k) as f64).sin());
//!         if t < 0.0 { noise } else { (-6.3 * t).exp() * (628.3 * t).sin() + noise }
//!     })
//!     .collect();
//! let found = find_decays(&[&y], 5e3, &DecaySearchOptions::default())?;
//! assert_eq!(found.decays.len(), 1);
//! assert!(found.decays[0].range.start.abs_diff(1000) < 20);
//! # Ok::<(), afmid_kernels::events::decay::DecaySearchError>(())
//! ```

mod backward;
mod beat;
#[cfg(test)]
mod beat_tests;
mod change;
mod clipping;
mod drive;
mod envelope;
mod error;
mod excursion;
mod extent;
mod found;
mod handling;
mod noise_floor;
#[cfg(test)]
mod noise_tests;
mod onsets;
mod options;
mod random;
mod search;
#[cfg(test)]
mod search_tests;
#[cfg(test)]
mod simulated;
mod steadiness;
mod struck;
#[cfg(test)]
mod struck_tests;
#[cfg(test)]
mod tests;

pub use error::DecaySearchError;
pub use found::{ChannelDecay, DecayEnd, DecaySearch, Decline, DismissedDecay, DismissedReason, FreeDecay, Steady};
pub use options::{DecaySearchOptions, DecayTrigger};
pub use search::find_decays;
