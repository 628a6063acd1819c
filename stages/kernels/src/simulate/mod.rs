//! An AFM in the time domain: force, lever, detector, recorder, each in its own file.
//!
//! [`ModalLever`] and [`Contact`] make the two linear regimes of [`AfmSystem`]; [`simulate_motion`] propagates them exactly
//! along a [`TriangleRamp`] and switches at the events; [`Microscope::record`] adds [`ReadoutNoise`] and the [`Adc`].
//! [`PhaseProblem`] chooses start phases so that an archive holds a stated number of events.
//!
//! # Model
//! Modes of a lever on a moved base, free or in contact with a spring and a damper; between events linear, propagated
//! exactly (matrix exponential). Crossings are found to 1e-8 of a sample.
//! `m_n q_n'' + m_n w_n / Q_n q_n' + m_n w_n^2 q_n = F + thermal noise` for each mode; the tip moves by the sum of the
//! modes' tip shares, the detector sees that of their detector shares behind its real poles.
//! # Shapes
//! One channel of N samples, and the events with time, height and force.
//! # Cost
//! O(modes^2) per sample.
//! # Source
//! C. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395 (matrix exponential with noise); H. B. Callen and T. A. Welton,
//! Phys. Rev. 83 (1951) 34 (thermal force).
//!
//! ```
//! use afmid_kernels::simulate::{AfmSystem, Contact, Detector, Drive, EventKind, ModalLever, Mode, Sampling, TriangleRamp, simulate_motion};
//! use rand::SeedableRng;
//!
//! // one mode at 46.3 kHz, Q = 41, on a surface that holds the tip with 330 nN; 5 MS/s, no thermal motion
//! let mode = Mode { frequency_hz: 46.3e3, quality_factor: 41.0, tip_share: 1.0, detector_share: 1.0 };
//! let lever = ModalLever { stiffness_n_per_m: 3.8, modes: vec![mode] };
//! let contact = Contact { stiffness_n_per_m: 60.0, damping_n_s_per_m: 8e-6, snap_in_gap_m: 4e-9, adhesion_n: 330e-9, adhesion_scatter: 0.0 };
//! let detector = Detector { sensitivity_v_per_m: 1e7, pole_hz: vec![1.3e6], delay_s: 0.0 };
//! let system = AfmSystem::new(&lever, &contact, &detector, 0.0);
//! let ramp = TriangleRamp { frequency_hz: 5.58, range_m: 200e-9, phase: 0.0 };
//! let pull_off_s = ramp.passes_s(1, -22e-9 + contact.pull_off_height_m(3.8, 330e-9));
//! let sampling = Sampling { start_s: pull_off_s - 1e-3, interval_s: 2e-7, samples: 10_000 };
//! let drive = Drive { ramp, surface_m: -22e-9, pull_off_n: &[330e-9] };
//! let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
//! let motion = simulate_motion(&system, &lever, &contact, &drive, sampling, &mut random);
//! assert_eq!(motion.events[0].kind, EventKind::SnapOff);
//! // the lever is bent by 87 nm just before
//! let before = ((motion.events[0].time_s - sampling.start_s) / sampling.interval_s) as usize - 1;
//! assert!((motion.signal_m[before] + 330e-9 / 3.8).abs() < 1e-10);
//! ```

mod adc;
mod afm_system;
mod archive;
mod chain;
mod contact;
mod detector;
mod discretisation;
mod error;
mod hidden_motion;
mod lever;
mod motion;
mod noise_free;
mod optics;
#[cfg(test)]
pub(crate) mod paper;
mod phases;
mod propagator;
mod ramp;
mod readout_noise;
mod recorder;
mod released;
mod square;
#[cfg(test)]
mod tests;
mod truth;

pub use crate::events::EventKind;
pub use adc::Adc;
pub use afm_system::{AfmSystem, BOLTZMANN_J_PER_K};
pub use archive::{Archive, ArchiveLayout};
pub use contact::{ADHESION_CUT, Contact};
pub use detector::Detector;
pub use discretisation::{LinearSystem, Step};
pub use error::SimulateError;
pub use hidden_motion::simulate_hidden;
pub use lever::{ModalLever, Mode};
pub use motion::{ContactEvent, Drive, Motion, Sampling, simulate_motion};
pub use noise_free::Cut;
pub use phases::{PhaseProblem, RecordPlan, Target};
pub use ramp::TriangleRamp;
pub use readout_noise::{Drift, PINK_LOWEST_HZ, ReadoutNoise};
pub use recorder::{Microscope, PiezoMonitor, Place, RecordedEvent, Scatter, SimulatedRecord, archive_stream, counted};
pub use released::Release;
pub use square::Square;
pub use truth::{Counts, EventTruth, RecordTruth, Truth, counts, record_truth};
