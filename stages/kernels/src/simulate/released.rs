//! One release at an instant that is given, from a load that is given: what a measured event is compared with.

use super::afm_system::AfmSystem;
use super::contact::Contact;
use super::hidden_motion::Hidden;
use super::motion::{Drive, Run, Sampling};
use super::noise_free::Cut;
use super::optics::Optics;
use super::ramp::TriangleRamp;
use super::recorder::Microscope;
use crate::effects::{Effects, Instant};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A release to be simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Release {
    /// Static deflection before it, V: positive, the signal stands at minus this.
    pub amplitude_v: f64,
    /// Time from the release to sample `before` of the window, s; of either sign.
    pub lead_s: f64,
    /// Where and when in the archive: causes that run along it are taken there.
    pub at: Instant,
}

/// Samples for which a lever under modal forces settles while it is held.
const SETTLE: usize = 3000;
/// Range of a piezo that stands still, and a catch that lies beyond it: the tip is held, and once let go never caught
/// again.
const STILL: TriangleRamp = TriangleRamp { frequency_hz: 0.0, range_m: 10.0, phase: 0.75 };
const NEVER_M: f64 = -1.0;

impl Microscope {
    /// The signal of one release in volts, without thermal motion, noise, added signals and converter.
    ///
    /// # Model
    /// The base stands still; the tip is held by the contact until it is let go, whatever the tension.
    /// # Method
    /// The integrator of [`simulate_hidden`](crate::simulate::hidden_motion::simulate_hidden) at zero temperature:
    /// exact linear propagation, loads on straight lines, modal forces by Strang splitting, optics on points between
    /// samples. The instants of the samples are shifted, so that the release falls anywhere between two.
    /// # Accuracy
    /// That of `simulate_hidden`.
    pub fn released(&self, release: &Release, effects: &Effects, cut: Cut) -> Vec<f64> {
        let mut lever = self.lever.clone();
        let change = effects.frequency_change(&release.at);
        lever.modes.iter_mut().for_each(|mode| mode.frequency_hz *= 1.0 + change);
        let contact = Contact { snap_in_gap_m: NEVER_M, ..self.contact };
        let system = AfmSystem::with_effects(&lever, &contact, &self.detector, 0.0, effects);
        let stiffness = contact.stiffness_n_per_m;
        // held at rest the lever stands at `-height k_c / (k_c + k)`
        let deflection_m = release.amplitude_v / self.detector.sensitivity_v_per_m;
        let height_m = deflection_m * (stiffness + lever.stiffness_n_per_m) / stiffness;
        let hold = [f64::MAX];
        let drive = Drive { ramp: STILL, surface_m: -height_m, pull_off_n: &hold };
        let interval_s = 1.0 / self.sample_rate_hz;
        let settle = if effects.bend_the_motion() { SETTLE } else { 0 };
        let samples = settle + cut.samples;
        let start_s = release.lead_s - (settle + cut.before) as f64 * interval_s;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let sampling = Sampling { start_s, interval_s, samples };
        let mut run = Run::start(&system, &lever, &contact, &drive, sampling, &mut rng);
        let volts_per_m = self.detector.sensitivity_v_per_m;
        let bent = effects.bend_the_motion() || effects.outlast_the_release();
        let mut hidden = bent.then(|| Hidden::new(effects, &lever, volts_per_m, interval_s));
        let mut optics =
            (!effects.optics.is_empty()).then(|| Optics::new(&system, &self.detector, effects, interval_s));
        let mut volts = Vec::with_capacity(samples);
        let mut held = true;
        for k in 0..samples {
            let added = optics.as_mut().map_or(0.0, |optics| optics.added_m(&run));
            let direct = system.signal_direct_m_per_n * run.force_n();
            volts.push(volts_per_m * (run.signal_m() + direct + added));
            let end_s = start_s + (k + 1) as f64 * interval_s;
            if held && end_s > 0.0 {
                run.advance_within(&mut hidden, 0.0, &mut rng);
                run.let_go(&mut hidden);
                held = false;
                run.advance_within(&mut hidden, end_s, &mut rng);
            } else {
                run.advance_whole(&mut hidden, end_s, &mut rng);
            }
        }
        volts.drain(..settle);
        volts
    }
}

impl Run<'_> {
    fn advance_whole(&mut self, hidden: &mut Option<Hidden<'_>>, end_s: f64, rng: &mut ChaCha8Rng) {
        match hidden {
            Some(hidden) => self.advance_hidden(hidden, end_s, rng),
            None => self.advance_to(end_s, rng),
        }
    }

    /// Lets the tip go now.
    fn let_go(&mut self, hidden: &mut Option<Hidden<'_>>) {
        let force_n = self.force_n();
        self.change(force_n);
        if let Some(hidden) = hidden {
            self.note_change(hidden);
        }
    }
}
