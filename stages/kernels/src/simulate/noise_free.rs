//! A release without noise, cut as an event's window: what a hidden cause does to it is known to a microvolt.

use super::afm_system::AfmSystem;
use super::hidden_motion::simulate_hidden;
use super::motion::{Drive, Sampling};
use super::recorder::{Microscope, Place};
use crate::effects::Effects;
use crate::events::EventKind;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Where the release lies in its window, and how long that is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cut {
    /// Samples before the release.
    pub before: usize,
    /// Samples of the window.
    pub samples: usize,
}

/// How long the attached lever settles before the window, samples.
const SETTLE: usize = 3000;

impl Microscope {
    /// One release of `pull_off_n` in volts, without thermal motion, noise and converter; nothing if none happens.
    ///
    /// # Method
    /// [`simulate_hidden`] at zero temperature, twice: the second time with the grid shifted so that the release lies at sample `before`.
    pub fn quiet_release(&self, pull_off_n: f64, effects: &Effects, place: Place, cut: Cut) -> Option<Vec<f64>> {
        let lever = self.lever_at(place, effects);
        let (contact, detector) = (&self.contact, &self.detector);
        let system = AfmSystem::with_effects(&lever, contact, detector, 0.0, effects);
        let pull_off = [pull_off_n];
        let drive = Drive { ramp: self.ramp, surface_m: -0.25 * self.ramp.range_m, pull_off_n: &pull_off };
        let height = drive.surface_m + contact.pull_off_height_m(lever.stiffness_n_per_m, pull_off_n);
        let pass_s = self.ramp.passes_s(1, height);
        let interval_s = 1.0 / self.sample_rate_hz;
        let lead = SETTLE + cut.before;
        let run = |start_s: f64, samples: usize| {
            let sampling = Sampling { start_s, interval_s, samples };
            let mut rng = ChaCha8Rng::seed_from_u64(0);
            simulate_hidden(&system, &lever, contact, detector, &drive, sampling, effects, &mut rng)
        };
        let start_s = pass_s - lead as f64 * interval_s;
        let release = |motion: &crate::simulate::motion::Motion| {
            motion.events.iter().find(|event| event.kind == EventKind::SnapOff).map(|event| event.time_s)
        };
        // causes move the release by some nanometres of travel: look for it in a few milliseconds
        let time_s = release(&run(start_s, 4 * lead))?;
        let start_s = start_s + time_s - pass_s;
        let motion = run(start_s, SETTLE + cut.samples);
        let volts = motion.signal_m.iter().enumerate().skip(SETTLE).map(|(k, signal)| {
            let at_s = start_s + k as f64 * interval_s;
            let instant = place.instant(at_s, self.ramp.height_m(self.ramp.half_cycle(at_s), at_s));
            let added: f64 = effects.added.iter().map(|added| added(&instant)).sum();
            let volts = detector.sensitivity_v_per_m * signal + added;
            effects.limits.map_or(volts, |(low, high)| volts.max(low).min(high))
        });
        Some(volts.collect())
    }
}
