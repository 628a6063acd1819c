//! What an averaged snap-off can say about the delay: the total lag, and a bound by causality.

use super::error::CalibrationError;
use super::sensitivity_model::Estimate;
use crate::linear_algebra::definite_inverse;
use crate::optimise::{Damping, Ending, Limits, Objective, Taken, Trial, damped_step, descend};
use crate::signal::{Detrend, Welch};
use faer::{Mat, c64};

/// What is known of the onset and the delay. All times on the average's own axis, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnsetDelay {
    /// First sustained departure from the line before the event: rupture plus delay cannot be later (causality).
    pub latest_s: f64,
    /// Rupture + delay + the detector poles' phase lag at mode 1: what the phase of mode 1 measures.
    pub total_lag_s: Estimate,
    /// The given poles' phase lag at mode 1, s; 0 without poles.
    pub pole_lag_s: f64,
    /// Rupture + delay: the total lag less the poles'. Without poles an upper bound like `latest_s`.
    pub onset_and_delay_s: Estimate,
    /// Mode 1 as fitted: frequency (undamped), Hz, and quality factor.
    pub mode_1: (f64, f64),
}

/// Settings.
#[derive(Debug, Clone, PartialEq)]
pub struct OnsetRule {
    /// Departure in standard errors that counts, sustained over `sustained_samples`.
    pub threshold: f64,
    /// See above.
    pub sustained_samples: usize,
    /// The ringing is fitted from this long after the departure, s.
    pub skip_s: f64,
    /// Detector poles, Hz, as far as they are known.
    pub detector_pole_hz: Vec<f64>,
}

/// What the average says.
///
/// # Model
/// A delay `exp(-s T)` and a later rupture are the same signal: only their sum shows. Two things are known of it.
/// Causality: it is not later than the first departure from the line before. Phase: mode 1 of a released lever rings as
/// `Re[(1 - i sigma/w) D(p) e^{p (t - t0 - T)}]` with `p = -sigma + i w`, so its phase gives `t0 + T - arg D(p) / w`,
/// where the detector's poles lag by about the sum of their time constants. Poles above the bandwidth are in turn a
/// delay: the sum is known only as well as they are. t0 and T apart are not knowable from the response.
///
/// # Method
/// Line through the first three quarters of the stretch before time 0; first sample from which `sustained_samples`
/// depart by `threshold` standard errors in one sense; Gauss-Newton on `f1, Q1`, offset and complex amplitude over the
/// ringing.
///
/// # Accuracy
/// Standard errors are those of white noise of the given size. Other modes leak by their share over their distance in
/// line widths: 3 ns for the paper's lever.
///
/// # Errors
/// Lengths differ; no departure; the fit of mode 1 does not settle.
pub fn onset_delay(
    time_s: &[f64],
    mean: &[f64],
    standard_error: &[f64],
    rule: &OnsetRule,
) -> Result<OnsetDelay, CalibrationError> {
    if mean.len() != time_s.len() || standard_error.len() != time_s.len() || time_s.len() < 64 {
        let wanted = format!("{} and at least 64, as the time axis", time_s.len());
        return Err(CalibrationError::Length {
            what: "averaged event",
            got: mean.len().min(standard_error.len()),
            wanted,
        });
    }
    let (first, load) = departure(time_s, mean, standard_error, rule)?;
    let latest_s = time_s.get(first).copied().unwrap_or(f64::NAN);
    let begin = time_s.iter().take_while(|t| **t < latest_s + rule.skip_s).count();
    let ringing = (time_s.get(begin..).unwrap_or_default(), mean.get(begin..).unwrap_or_default());
    let noise = standard_error.get(begin..).unwrap_or_default();
    let noise = (noise.iter().map(|s| s * s).sum::<f64>() / noise.len().max(1) as f64).sqrt();
    let mode = RingingMode::fit(ringing.0, ringing.1, noise)?;
    let (sigma, w) = (mode.decay_per_s, mode.angular_per_s);
    // the release rings up from a negative load: its amplitude carries the load's sign
    let amplitude = mode.amplitude * load.signum();
    let total = -(amplitude.arg() + (sigma / w).atan()) / w;
    let pole = c64::new(-sigma, w);
    let detector: c64 = rule.detector_pole_hz.iter().fold(c64::new(1.0, 0.0), |d, hz| {
        let p = std::f64::consts::TAU * hz;
        d * c64::new(p, 0.0) / (pole + p)
    });
    let pole_lag_s = -detector.arg() / w;
    let std = mode.phase_std / w;
    let undamped = w.hypot(sigma);
    Ok(OnsetDelay {
        latest_s,
        total_lag_s: Estimate { value: total, std },
        pole_lag_s,
        onset_and_delay_s: Estimate { value: total - pole_lag_s, std },
        mode_1: (undamped / std::f64::consts::TAU, undamped / (2.0 * sigma)),
    })
}

/// Index of the first sustained departure, and the level before minus the level at the end (the load).
fn departure(time: &[f64], mean: &[f64], error: &[f64], rule: &OnsetRule) -> Result<(usize, f64), CalibrationError> {
    let before = time.iter().take_while(|t| **t < 0.0).count() * 3 / 4;
    let baseline = Baseline::fit(time, mean, before).ok_or(CalibrationError::TooLittle {
        what: "samples before the event",
        found: before,
        wanted: 32,
        hint: "the average must begin well before its onset (time 0)",
    })?;
    let scores: Vec<f64> = time
        .iter()
        .zip(mean)
        .zip(error)
        .map(|((t, y), s)| (y - baseline.at(*t)) / s.max(0.25 * baseline.noise).max(f64::MIN_POSITIVE))
        .collect();
    let departs = |run: &[f64]| run.iter().all(|z| *z > rule.threshold) || run.iter().all(|z| *z < -rule.threshold);
    let first = scores
        .windows(rule.sustained_samples.max(1))
        .enumerate()
        .skip(before)
        .find(|(_, run)| departs(run))
        .map(|(k, _)| k)
        .ok_or(CalibrationError::TooLittle {
            what: "sustained departures from the line before the event",
            found: 0,
            wanted: 1,
            hint: "lower threshold, or average more events",
        })?;
    let tail = mean.get(mean.len() * 3 / 4..).unwrap_or_default();
    let rest = tail.iter().sum::<f64>() / tail.len().max(1) as f64;
    Ok((first, baseline.at(time.get(first).copied().unwrap_or(0.0)) - rest))
}

struct Baseline {
    centre: f64,
    level: f64,
    slope: f64,
    noise: f64,
}

impl Baseline {
    fn fit(time: &[f64], values: &[f64], count: usize) -> Option<Self> {
        let (time, values) = (time.get(..count)?, values.get(..count)?);
        if count < 32 {
            return None;
        }
        let n = count as f64;
        let (centre, level) = (time.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
        let square: f64 = time.iter().map(|t| (t - centre).powi(2)).sum();
        let slope = time.iter().zip(values).map(|(t, y)| (t - centre) * (y - level)).sum::<f64>() / square;
        let rest: f64 = time.iter().zip(values).map(|(t, y)| (y - level - slope * (t - centre)).powi(2)).sum();
        Some(Self { centre, level, slope, noise: (rest / n).sqrt() })
    }

    fn at(&self, time: f64) -> f64 {
        self.level + self.slope * (time - self.centre)
    }
}

struct RingingMode {
    decay_per_s: f64,
    angular_per_s: f64,
    amplitude: c64,
    phase_std: f64,
}

impl RingingMode {
    /// `y = offset + Re[C e^{p t}]`: Gauss-Newton on Re C, Im C, offset, sigma, w, from the strongest line of the
    /// spectrum and the best of a ladder of quality factors.
    fn fit(time: &[f64], values: &[f64], noise: f64) -> Result<Self, CalibrationError> {
        let guess_hz = strongest_line(time, values)?;
        let mut best: Option<(f64, Self)> = None;
        for quality in [5.0, 15.0, 40.0, 120.0, 400.0] {
            if let Ok((misfit, mode)) = Self::from_guess(time, values, noise, guess_hz, quality)
                && best.as_ref().is_none_or(|(least, _)| misfit < *least)
            {
                best = Some((misfit, mode));
            }
        }
        let reason = "no decaying oscillation fits the ringing";
        best.map(|(_, mode)| mode).ok_or(CalibrationError::Fit { near_hz: guess_hz, reason })
    }

    /// The fit from one guess, with its residual sum of squares.
    fn from_guess(
        time: &[f64],
        values: &[f64],
        noise: f64,
        guess_hz: f64,
        quality: f64,
    ) -> Result<(f64, Self), CalibrationError> {
        let failed = |reason| CalibrationError::Fit { near_hz: guess_hz, reason };
        let undamped = std::f64::consts::TAU * guess_hz;
        let mut fit = Ringing { time, values };
        let (start, limits) = (fit.start(undamped / (2.0 * quality), undamped), Limits { steps: 50, ..Limits::NONE });
        let found = descend(&mut fit, start, &mut { FIRST_DAMPING }, Damping::STANDARD, limits).map_err(failed)?;
        if found.ending == Ending::IterationLimit {
            return Err(failed("50 iterations were not enough"));
        }
        let At { p, cost } = found.point;
        let (information, _) = fit.normal(&p);
        let inverse = definite_inverse(&information).ok_or_else(|| failed(SINGULAR))?;
        let square = p[0].hypot(p[1]).powi(2);
        // d arg C = (Re C dIm - Im C dRe) / |C|^2
        let (a, b) = (-p[1] / square, p[0] / square);
        let variance = a * a * inverse[(0, 0)] + 2.0 * a * b * inverse[(0, 1)] + b * b * inverse[(1, 1)];
        let mode = Self {
            decay_per_s: p[3],
            angular_per_s: p[4],
            amplitude: c64::new(p[0], p[1]),
            phase_std: noise * variance.sqrt(),
        };
        Ok((cost, mode))
    }
}

/// Damping of the first step.
const FIRST_DAMPING: f64 = 1e-6;
const SINGULAR: &str = "the ringing's equations are singular";

/// `Re C exp(-d t) exp(i w t) + c` against the samples, as an objective.
struct Ringing<'a> {
    time: &'a [f64],
    values: &'a [f64],
}

/// `Re C`, `Im C`, `c`, `d`, `w`, with the sum of squares.
struct At {
    p: [f64; 5],
    cost: f64,
}

impl Ringing<'_> {
    fn at(&self, p: [f64; 5]) -> At {
        let cost = self.rows(&p).map(|(_, rest)| rest * rest).sum();
        At { p, cost }
    }

    /// Amplitude and offset by linear least squares at a guessed pole.
    fn start(&self, decay: f64, angular: f64) -> At {
        let (information, gradient) = self.normal(&[0.0, 0.0, 0.0, decay, angular]);
        let (linear, _) = damped_step(&information.as_ref().get(..3, ..3).to_owned(), &gradient[..3], 0.0);
        self.at([linear[0], linear[1], linear[2], decay, angular])
    }

    /// Slopes and residual of each sample.
    fn rows(&self, p: &[f64; 5]) -> impl Iterator<Item = ([f64; 5], f64)> {
        let p = *p;
        self.time.iter().zip(self.values).map(move |(t, y)| {
            let decay = (-p[3] * t).exp();
            let (sin, cos) = (p[4] * t).sin_cos();
            let (c, s) = (decay * cos, decay * sin);
            let row = [c, -s, 1.0, -t * (p[0] * c - p[1] * s), -t * (p[0] * s + p[1] * c)];
            (row, y - (p[2] + p[0] * c - p[1] * s))
        })
    }

    fn normal(&self, p: &[f64; 5]) -> (Mat<f64>, Vec<f64>) {
        let (mut information, mut gradient) = (Mat::zeros(5, 5), vec![0.0; 5]);
        for (row, rest) in self.rows(p) {
            for i in 0..5 {
                gradient[i] += row[i] * rest;
                (0..5).for_each(|j| information[(i, j)] += row[i] * row[j]);
            }
        }
        (information, gradient)
    }
}

impl Objective for Ringing<'_> {
    type Point = At;
    type Local = (Mat<f64>, Vec<f64>);
    type Step = ();
    type Error = &'static str;

    fn cost(&self, at: &At) -> f64 {
        at.cost
    }

    fn local(&mut self, at: &mut At) -> Result<Option<Self::Local>, &'static str> {
        let normal = self.normal(&at.p);
        definite_inverse(&normal.0).map(|_| Some(normal)).ok_or(SINGULAR)
    }

    fn trial(&mut self, at: &At, local: &Self::Local, damping: f64) -> Result<Trial<At, ()>, &'static str> {
        let (step, _) = damped_step(&local.0, &local.1, damping);
        let p: [f64; 5] = std::array::from_fn(|i| at.p[i] + step[i]);
        let possible = p[3] > 0.0 && p[4] > 0.0 && p.iter().all(|v| v.is_finite());
        Ok(possible.then(|| (self.at(p), ())))
    }

    /// The last steps change the sum of squares by less than its rounding.
    fn accepts(&self, cost: f64, next: f64) -> bool {
        next <= cost * (1.0 + 1e-13)
    }

    fn taken(&mut self, from: &At, _: &Self::Local, (): (), to: &mut At) -> Taken {
        let moved = |i: usize| (to.p[i] - from.p[i]).abs();
        let arrived = moved(4) < 1e-10 * to.p[4] && moved(3) < 1e-8 * to.p[3];
        Taken { kept: None, ending: arrived.then_some(Ending::Minimum) }
    }
}

/// The frequency of the largest bin of the Hann periodogram, Hz.
fn strongest_line(time: &[f64], values: &[f64]) -> Result<f64, CalibrationError> {
    let even = values.len() & !1;
    let (first, last) = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
    let rate = (time.len().max(2) - 1) as f64 / (last - first);
    let mut welch = Welch::new(even, rate, Detrend::Mean)?;
    welch.push(values.get(..even).unwrap_or_default());
    let average = welch.average()?;
    let bins = average.density.iter().enumerate().skip(2);
    Ok(bins.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0.0, |(k, _)| k as f64 * average.bin_hz))
}
