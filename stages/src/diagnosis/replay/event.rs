//! One measured event, simulated again.

use afmid_pipeline::StageError;

use super::fit::least_squares;
use crate::simulate::{Afm, LeverModel, LinearPart};
use afmid_kernels::diagnosis::release::{Cut, EventWindow};
use afmid_kernels::effects::{Effects, Instant};
use afmid_kernels::simulate::{Cut as SimulatedCut, Microscope, Release};

/// A microscope that simulates measured events again, with causes or without.
pub struct Replayer {
    microscope: Microscope,
    effects: Effects,
    /// Frequencies of lines whose phase is each event's own, Hz.
    lines_hz: Vec<f64>,
    cut: Cut,
}

/// A measured event and what the simulation leaves of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayedEvent {
    /// Static deflection before the release, V.
    pub amplitude_v: f64,
    /// Where the release lies among the window's values, samples.
    pub onset: f64,
    /// Measured less simulated, V; sample `before` is the first one after the release.
    pub residual_v: Vec<f64>,
    /// Its root mean square, V.
    pub rms_v: f64,
    /// Whether the last step was small.
    pub converged: bool,
}

/// Steps of a fit, and how small the last one must be: of the amplitude, and in samples. Together they leave some 20 uV
/// of a signal of 1 V.
const STEPS: usize = 15;
const ARRIVED: [f64; 2] = [1e-5, 1e-3];
/// Shift for the derivative with respect to the instant, samples: the release begins with the fifth power of time.
const SHIFT: f64 = 0.05;
/// Cuts of the window where the onset leaves its interval.
const CUTS: usize = 4;

impl Replayer {
    /// The lever and detector alone.
    pub fn baseline(model: &LeverModel, cut: Cut) -> Self {
        Self { microscope: microscope(model, &model.baseline), effects: Effects::default(), lines_hz: Vec::new(), cut }
    }

    /// Lever, detector and causes. Lines take each event's own phase; those slower than the window are in its offset
    /// and slope.
    ///
    /// # Errors
    /// Causes that are unknown or out of their limits.
    pub fn extended(model: &LeverModel, cut: Cut) -> Result<Self, StageError> {
        let (mut effects, mut lines_hz) = (Effects::default(), Vec::new());
        for entry in model.hidden()? {
            let (cause, values) = entry.resolve()?;
            let mut own = Effects::default();
            cause.add(&values, &mut own);
            let frequency = cause.about().parameters.iter().position(|p| p.name == "frequency_hz");
            match frequency.filter(|_| !own.added.is_empty()) {
                Some(at) => lines_hz.push(values[at]),
                None => cause.add(&values, &mut effects),
            }
        }
        let window_s = cut.samples as f64 * cut.interval_s;
        lines_hz.retain(|frequency| frequency * window_s > 1.0);
        Ok(Self { microscope: microscope(model, &model.extended), effects, lines_hz, cut })
    }

    /// Simulates an event again with the amplitude, instant, offset and slope that suit it best; `piezo_m` beside the
    /// window's values, or empty.
    ///
    /// # Method
    /// Gauss-Newton on least squares; derivatives are those of the lever without causes, which differ by a few per
    /// cent: a step more or two.
    /// # Accuracy
    /// Steps end at a thousandth of a sample and a hundred-thousandth of the load.
    pub fn replay(&self, event: &EventWindow, piezo_m: &[f64]) -> Option<ReplayedEvent> {
        let mut onset = event.onset;
        let mut last = None;
        for _ in 0..CUTS {
            let start = event.start(onset, &self.cut)?;
            let found = self.fitted(event, piezo_m, start, onset)?;
            let stays = event.start(found.onset, &self.cut) == Some(start);
            onset = found.onset;
            last = Some(found);
            if stays {
                break;
            }
        }
        last
    }

    fn fitted(&self, event: &EventWindow, piezo_m: &[f64], start: usize, onset: f64) -> Option<ReplayedEvent> {
        let cut = self.cut;
        let measured = event.values.get(start..start + cut.samples)?;
        let release_at = (start + cut.before) as f64;
        let mut amplitude = level(&measured[cut.samples - cut.samples / 4..]) - level(&measured[..cut.before]);
        let mut lead = (release_at - onset) * cut.interval_s;
        let added = self.added(event, piezo_m, start);
        let still = self.steady(&added);
        let columns = self.columns(event, amplitude, lead);
        let (mut line, mut residual) = (vec![0.0; still.len()], Vec::new());
        let mut converged = false;
        for step in 0..=STEPS {
            let signal = self.simulated(event, amplitude, lead, &self.effects);
            let rest = |k: usize| still.iter().zip(&line).map(|(column, weight)| column[k] * weight).sum::<f64>();
            let modelled: Vec<f64> = (0..cut.samples).map(|k| signal[k] + added[k] + rest(k)).collect();
            let limited = self.limited(&modelled);
            residual = measured.iter().zip(&limited).map(|(y, m)| y - m).collect();
            if converged || step == STEPS {
                break;
            }
            let seen: Vec<bool> = modelled.iter().zip(&limited).map(|(m, l)| m == l).collect();
            let all: Vec<&[f64]> = columns.iter().chain(&still).map(Vec::as_slice).collect();
            let weights = least_squares(&all, &residual, &seen)?;
            amplitude += weights[0];
            lead += weights[1];
            line.iter_mut().zip(&weights[2..]).for_each(|(w, step)| *w += step);
            let own = (cut.before as f64 - 1.0) * cut.interval_s;
            if !(amplitude.is_finite() && lead.abs() < own) {
                return None;
            }
            converged =
                weights[0].abs() < ARRIVED[0] * amplitude.abs() && weights[1].abs() < ARRIVED[1] * cut.interval_s;
        }
        let rms_v = (residual.iter().map(|r| r * r).sum::<f64>() / residual.len() as f64).sqrt();
        let onset = release_at - lead / cut.interval_s;
        Some(ReplayedEvent { amplitude_v: amplitude, onset, residual_v: residual, rms_v, converged })
    }

    fn simulated(&self, event: &EventWindow, amplitude_v: f64, lead_s: f64, effects: &Effects) -> Vec<f64> {
        let cut = SimulatedCut { before: self.cut.before, samples: self.cut.samples };
        self.microscope.released(&Release { amplitude_v, lead_s, at: event.first }, effects, cut)
    }

    /// Derivatives with respect to amplitude and lead.
    fn columns(&self, event: &EventWindow, amplitude: f64, lead: f64) -> [Vec<f64>; 2] {
        let shift = SHIFT * self.cut.interval_s;
        let linear = Effects { frequency: self.effects.frequency.clone(), ..Effects::default() };
        let unit = self.simulated(event, 1.0, lead, &linear);
        let later = self.simulated(event, 1.0, lead + shift, &linear);
        let moved = later.iter().zip(&unit).map(|(b, a)| amplitude * (b - a) / shift).collect();
        [unit, moved]
    }

    /// Offset, slope, and both phases of every line.
    fn steady(&self, like: &[f64]) -> Vec<Vec<f64>> {
        let samples = like.len();
        let centre = 0.5 * (samples.max(2) - 1) as f64;
        let mut out = vec![vec![1.0; samples], (0..samples).map(|k| (k as f64 - centre) / centre).collect()];
        for frequency in &self.lines_hz {
            let phase = |k: usize| std::f64::consts::TAU * frequency * k as f64 * self.cut.interval_s;
            out.push((0..samples).map(|k| phase(k).cos()).collect());
            out.push((0..samples).map(|k| phase(k).sin()).collect());
        }
        out
    }

    /// What causes add to the record there, V.
    fn added(&self, event: &EventWindow, piezo_m: &[f64], start: usize) -> Vec<f64> {
        let value = |k: usize| {
            let time_s = event.first.time_s + (start + k) as f64 * self.cut.interval_s;
            let piezo_m = piezo_m.get(start + k).copied().unwrap_or(event.first.piezo_m);
            let at = Instant { time_s, piezo_m, ..event.first };
            self.effects.added.iter().map(|added| added(&at)).sum()
        };
        (0..self.cut.samples).map(value).collect()
    }

    fn limited(&self, volts: &[f64]) -> Vec<f64> {
        match self.effects.limits {
            Some((low, high)) => volts.iter().map(|v| v.max(low).min(high)).collect(),
            None => volts.to_vec(),
        }
    }
}

/// Newtons and metres of the simulation are any: stiffness and sensitivity cancel in volts.
fn microscope(model: &LeverModel, part: &LinearPart) -> Microscope {
    Afm::default().with_lever(model, part).microscope()
}

fn level(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
