//! Archives for tests, cheap and of known truth: triangular ramp, snap-in, contact, rupture, one ringing mode, white
//! and 1/f noise, wander.
//!
//! Shares nothing with the estimators: samples are written in time, one by one.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{RecordEvent, RecordInput, RecordSummary, summarise};
use crate::events::EventKind;

/// Volts in a code of the converter.
const CODE_V: f64 = 1e-3;

/// An archive: what is hidden in it, all zero for nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Archive {
    pub records: usize,
    pub samples: usize,
    /// Amplitude, V, and frequency, Hz, of a sine whose phase differs from record to record.
    pub line: (f64, f64),
    /// V/m.
    pub crosstalk: f64,
    /// Amplitude, V, and wavelength, m.
    pub fringe: (f64, f64),
    /// Corner of a coupling capacitor, Hz; 0 for none.
    pub coupling_hz: f64,
    /// Largest absolute volt; 0 for no limit.
    pub limit: f64,
    pub snap_ins_given: bool,
}

impl Archive {
    pub const CLEAN: Self = Self {
        records: 10,
        samples: 40_960,
        line: (0.0, 0.0),
        crosstalk: 0.0,
        fringe: (0.0, 0.0),
        coupling_hz: 0.0,
        limit: 0.0,
        snap_ins_given: true,
    };

    /// 0.18 s as in the recordings of this field, at a rate that keeps tests cheap.
    pub fn interval_s(&self) -> f64 {
        0.18 / self.samples as f64
    }

    pub fn summaries(&self, seed: u64) -> Vec<RecordSummary> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // slow wander over the archive: a walk of 0.4 mV a record
        let (mut wander, phase) = (0.0, rng.random_range(0.0..std::f64::consts::TAU));
        (0..self.records)
            .map(|_| {
                let step = 4e-4 * normal(&mut rng);
                let (deflection, piezo, events) = self.record(wander, step, phase, &mut rng);
                wander += step;
                let events: Vec<RecordEvent> =
                    events.into_iter().filter(|e| self.snap_ins_given || e.kind == EventKind::SnapOff).collect();
                let input = RecordInput {
                    deflection: &deflection,
                    piezo: Some(&piezo),
                    events: &events,
                    interval_s: self.interval_s(),
                };
                summarise(&input).unwrap()
            })
            .collect()
    }

    fn record(
        &self,
        level: f64,
        drift: f64,
        fringe_phase: f64,
        rng: &mut ChaCha8Rng,
    ) -> (Vec<f64>, Vec<f64>, Vec<RecordEvent>) {
        let n = self.samples as f64;
        let (turn, back) = (0.43 * n, 0.93 * n);
        let (touch, load) = (rng.random_range(0.22..0.27) * n, 0.9 * (1.0 + 0.06 * normal(rng)));
        // 400 nm of travel in half a period; the contact takes it up with 10 V per micrometre less a fifteenth
        let per_sample = 400e-9 / (back - turn);
        let slope = 0.94e7 * per_sample;
        let peak = slope * (turn - touch) - 0.04;
        let rupture = (turn + (peak + load) / slope).min(0.91 * n);
        let line_phase = rng.random_range(0.0..std::f64::consts::TAU);
        let (turns, tau) = (
            std::f64::consts::TAU * 20e3 * self.interval_s(),
            60.0 / (std::f64::consts::PI * 20e3) / self.interval_s(),
        );
        // 1/f noise as a sum of random walks with a loss, one per octave of time constants
        let mut octaves: Vec<(f64, f64, f64)> = (3..18)
            .map(|k| 2f64.powi(k))
            .map(|t| ((-1.0 / t).exp(), (1.0 - (-2.0 / t).exp()).sqrt(), normal(rng)))
            .collect();
        // what the capacitor has taken up; it has forgotten all that was before the record but for the free level
        let mut taken = level;
        let keep = (-std::f64::consts::TAU * self.coupling_hz * self.interval_s()).exp();
        let (mut deflection, mut piezo) = (Vec::with_capacity(self.samples), Vec::with_capacity(self.samples));
        for k in 0..self.samples {
            let k = k as f64;
            let z = if k < turn { (turn - k) * per_sample } else { (k - turn).min(2.0 * back - turn - k) * per_sample };
            let z = z - 200e-9;
            let lever = match k {
                k if k < touch => 0.0,
                k if k < turn => slope * (k - touch) - 0.04 * (1.0 - ring(k - touch, turns, tau)),
                k if k < rupture => peak - slope * (k - turn),
                k => -load * ring(k - rupture, turns, tau),
            };
            let mut pink = 0.0;
            for (keep, add, state) in &mut octaves {
                *state = *keep * *state + *add * normal(rng);
                pink += *state;
            }
            let noise = 1.2e-3 * normal(rng) + 1.5e-4 * pink;
            let t = k * self.interval_s();
            let hidden = self.line.0 * (std::f64::consts::TAU * self.line.1 * t + line_phase).sin()
                + self.crosstalk * z
                + if self.fringe.0 > 0.0 {
                    self.fringe.0 * (4.0 * std::f64::consts::PI * z / self.fringe.1 + fringe_phase).cos()
                } else {
                    0.0
                };
            let volts = level + drift * k / n + lever + noise + hidden;
            let volts = if self.coupling_hz > 0.0 {
                taken = volts + keep * (taken - volts);
                volts - taken
            } else {
                volts
            };
            let volts = if self.limit > 0.0 { volts.clamp(-self.limit, self.limit) } else { volts };
            deflection.push((volts / CODE_V).round() * CODE_V);
            piezo.push(((z + 2.4e-10 * normal(rng)) / 2.4e-10).round() * 2.4e-10);
        }
        let event = |kind, sample: f64| RecordEvent { kind, sample: sample as usize };
        (deflection, piezo, vec![event(EventKind::SnapIn, touch), event(EventKind::SnapOff, rupture)])
    }
}

fn ring(samples: f64, turns: f64, tau: f64) -> f64 {
    (-samples / tau).exp() * (turns * samples).cos()
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
