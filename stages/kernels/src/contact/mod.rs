//! Stiffness and damping of the contact between tip and sample, from the resonances that it shifts.
//!
//! # Model
//! The tip's compliance `G(s) = (1/k) (sum_n c_n w_n^2 / (s^2 + w_n / Q_n s + w_n^2) + 1 - sum_n c_n)`; the contact
//! `kappa(s) = k_c + eta s + mu s^2`. Poles of the coupled lever are where `1 + kappa G = 0`. [`contact_stiffness`] takes
//! poles alone, [`joint_contact`] poles and residues of both ringings.
//! # Shapes
//! N free modes with a tip share each, M coupled poles, M <= N; covariances over real and imaginary part in turn.
//! # Cost
//! Some ten evaluations of M N terms: microseconds.
//! # Source
//! U. Rabe, K. Janser and W. Arnold, Rev. Sci. Instrum. 67 (1996) 3281; A. C. Aitken, Proc. R. Soc. Edinb. 55 (1936) 42
//! (generalised least squares).
//!
//! ```
//! use afmid_kernels::contact::{CoupledPoles, FreeLever, contact_stiffness, coupled_poles};
//! use afmid_kernels::ringdown::{Estimate, ModeEstimate};
//! let mode = |f, q| ModeEstimate {
//!     frequency_hz: Estimate { value: f, std: 0.1 },
//!     quality_factor: Estimate { value: q, std: 0.1 },
//! };
//! let modes = vec![mode(46.3e3, 40.8), mode(247.4e3, 193.2)];
//! let stiffness = Estimate { value: 3.8, std: 0.0 };
//! let lever = FreeLever::new(stiffness, modes, vec![0.97, 0.03], 0.0)?;
//! // the poles of this lever on a contact of 60 N/m, known to 100 rad/s
//! let start = [faer::c64::new(-5e4, 1.2e6), faer::c64::new(-5e4, 3e6)];
//! let poles = coupled_poles(&lever, [60.0, 8e-6], &start).ok_or("no poles")?;
//! let contact = contact_stiffness(&lever, &CoupledPoles::independent(&poles, 100.0))?;
//! let stiffness = contact.stiffness_n_per_m;
//! assert!((stiffness.value - 60.0).abs() < 1e-6 && stiffness.std > 0.0);
//! println!("{:.2} N/m +- {:.2} N/m", stiffness.value, stiffness.std);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod coupled;
mod detector;
mod estimate;
mod joint;
mod joint_model;
mod joint_result;
#[cfg(test)]
mod joint_tests;
mod law;
mod least_squares;
mod lever;
mod quantities;
mod ringing;
#[cfg(test)]
mod tests;

pub use coupled::{CoupledPoles, coupled_poles};
pub use estimate::{ContactEstimate, ErrorBudget, PoleContact, contact_stiffness};
pub use joint::{JointOptions, LawChoice, joint_contact};
pub use joint_result::{ContactResonance, JointBudget, JointContact, ResidueTest};
pub use law::ContactLaw;
pub use lever::FreeLever;
pub use ringing::Ringing;

/// Tip shares of the first four modes of a beam that carries a small load at its end: `simulate.afm`'s, an assumption
/// about the lever.
pub const LOADED_BEAM_SHARES: [f64; 4] = [0.9713, 0.0247, 0.0032, 0.0008];
