//! What is no mode of its own: lines that do not die away, and companions of modes that move with their amplitude.

use faer::Mat;

use super::result::{ChannelRingdown, RecordFit};
use super::shape::ModeShape;
use crate::ringdown::ModeEstimate;

/// Why a fitted exponential is no mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dropped {
    /// Its damping is not above zero at the 0.1 % level: a line of a drive or of the mains.
    Steady,
    /// Its quality factor is not above `1/sqrt(2)` at the 0.1 % level: its response has no maximum. A drift, a coupling
    /// capacitor or what the model lacks, fitted along with the modes.
    Broad,
    /// It dies away within three samples: a filter of the recorder or the end of a hit looks the same.
    Brief,
    /// The fit leaves more than noise round it, and with errors that count that its damping is not above zero at the
    /// 0.1 % level: what another mode lacks, or a mode of which nothing is known. Or it turns less than once in the decays
    /// that it is seen in.
    Undetermined,
    /// It lies within the line of another mode, has its shape and dies away twice as fast or faster: what that mode's
    /// motion leaves.
    Companion {
        /// Number of that mode, from 0, among the modes that are left.
        of: usize,
        /// Modal assurance criterion between the shapes.
        mac: f64,
    },
    /// It is a multiple of the phase of a mode that moves with its amplitude.
    Harmonic {
        /// Number of that mode, from 0, among the modes that are left.
        of: usize,
        /// 2 or 3.
        multiple: usize,
    },
    /// One of several weak lines at equal distances on both sides of a mode, of its shape: a gain or a clock is disturbed
    /// again and again.
    Sideband {
        /// Number of that mode, from 0, among the modes that are left.
        of: usize,
        /// Multiple of the distance.
        order: i32,
    },
}

/// A fitted exponential that is no mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DroppedMode {
    /// As fitted.
    pub mode: ModeEstimate,
    /// Why.
    pub reason: Dropped,
}

/// Standard errors exceeded by noise alone once in a thousand (one-sided).
pub(super) const DETERMINED: f64 = 3.09;
/// Share of a shape's energy that may be orthogonal to a stronger mode's: what lies there is known no better than the
/// lack of fit. Noise adds three times its own share.
const ORTHOGONAL: (f64, f64) = (0.05, 3.0);

/// Energy of each mode over all hits and channels, each channel in units of its noise: channels may be of unlike units.
pub(super) fn energies(fit: &ChannelRingdown) -> Vec<f64> {
    let energy = |(j, pole): (usize, &faer::c64)| {
        let of = |record: &RecordFit| record.residues[j].norm_sqr() / fit.noise[record.channel].white;
        fit.records.iter().map(of).sum::<f64>() / -pole.re
    };
    fit.poles.iter().enumerate().map(energy).collect()
}

/// Modes that do not die away, by number: by less than 1/e within the longest record, and no more than noise allows.
pub(super) fn steady(fit: &ChannelRingdown, duration_s: f64) -> Vec<usize> {
    let rate = |j: usize| -fit.poles[j].re;
    // by the error of noise alone: what the model lacks makes no line of a decay
    let error = |j: usize| (fit.covariance[(2 * j, 2 * j)].max(0.0) / fit.lack_of_fit[j]).sqrt();
    let dies = |j: usize| rate(j) > DETERMINED * error(j);
    (0..fit.poles.len()).filter(|&j| rate(j) * duration_s < 1.0 && !dies(j)).collect()
}

/// Modes of whose damping nothing is known, for what the fit leaves round them, or that turn less than once in the decays
/// that have their energy, by number. `duration_s`: of each decay.
pub(super) fn undetermined(fit: &ChannelRingdown, duration_s: &[f64]) -> Vec<usize> {
    let error = |j: usize| fit.covariance[(2 * j, 2 * j)].max(0.0).sqrt();
    let known = |j: usize| fit.lack_of_fit[j] <= 1.0 || -fit.poles[j].re > DETERMINED * error(j);
    let turns = |j: usize| {
        let duration = |record: &RecordFit| duration_s.get(record.event).copied().unwrap_or(0.0);
        let energy = |record: &RecordFit| {
            let gone = 1.0 - (2.0 * fit.poles[j].re * duration(record)).exp();
            record.residues[j].norm_sqr() / fit.noise[record.channel].white * gone
        };
        let all: f64 = fit.records.iter().map(energy).sum();
        let seen: f64 = fit.records.iter().map(|record| energy(record) * duration(record)).sum();
        fit.poles[j].im / std::f64::consts::TAU * seen / all.max(f64::MIN_POSITIVE)
    };
    (0..fit.poles.len()).filter(|&j| !known(j) || turns(j) < 1.0).collect()
}

/// Modes whose response has no maximum, by number.
pub(super) fn broad(fit: &ChannelRingdown) -> Vec<usize> {
    // Q above 1/sqrt(2): the pole turns faster than it decays
    let faster = |j: usize| {
        let (rate, turn, both) = (2 * j, 2 * j + 1, (2 * j, 2 * j + 1));
        // the covariance is of the real part, which is minus the rate
        let variance = fit.covariance[(rate, rate)] + fit.covariance[(turn, turn)] + 2.0 * fit.covariance[both];
        (fit.poles[j].im + fit.poles[j].re) / variance.max(0.0).sqrt()
    };
    (0..fit.poles.len()).filter(|&j| faster(j).is_nan() || faster(j) < DETERMINED).collect()
}

/// Samples in which a mode dies away by 1/e, at least. Why: a converter's filter answers over as many.
const LEAST_TIME_CONSTANT_SAMPLES: f64 = 3.0;

/// Modes that die away within few samples, by number.
pub(super) fn brief(fit: &ChannelRingdown, interval_s: f64) -> Vec<usize> {
    let samples = |j: usize| 1.0 / (-fit.poles[j].re * interval_s);
    (0..fit.poles.len()).filter(|&j| fit.poles[j].re < 0.0 && samples(j) < LEAST_TIME_CONSTANT_SAMPLES).collect()
}

/// Companions with the mode of each, and the modal assurance criterion between them.
///
/// # Model
/// Frequency and damping that change with a power p >= 1 of the amplitude: `exp(s t) (1 + c_1 exp(-p a t) + ..)` with
/// the decay rate a, so all but the first term die away `1 + p >= 2` times as fast, within the line of the first.
/// # Method
/// Slowest first: a pole whose frequency is nearer to that of a slower mode than its own half width, of that mode's
/// shape and with at least twice its decay rate (less two standard errors). Of several such modes that with the most
/// energy.
pub(super) fn companions(fit: &ChannelRingdown) -> Vec<(usize, usize, f64)> {
    let energy = energies(fit);
    let mut order: Vec<usize> = (0..energy.len()).collect();
    order.sort_by(|&a, &b| fit.poles[b].re.total_cmp(&fit.poles[a].re));
    let mut kept: Vec<usize> = Vec::new();
    let mut found = Vec::new();
    for &i in &order {
        let belongs = |j: &&usize| {
            let (a, b) = (fit.poles[i], fit.poles[**j]);
            let error = |k: usize| fit.covariance[(2 * k, 2 * k)].max(0.0).sqrt();
            let faster = -a.re + 2.0 * error(i).hypot(2.0 * error(**j)) >= -2.0 * b.re;
            (a.im - b.im).abs() < a.re.abs() && faster && alike(fit, i, **j, ORTHOGONAL.0)
        };
        match kept.iter().filter(belongs).max_by(|a, b| energy[**a].total_cmp(&energy[**b])) {
            Some(&j) => found.push((i, j, fit.shapes[i].mac(&fit.shapes[j]))),
            None => kept.push(i),
        }
    }
    found
}

/// Whether two shapes are one but for a share of `orthogonal` of their energy, each channel in units of its noise: the units
/// of the channels then do not matter.
pub(super) fn alike(fit: &ChannelRingdown, i: usize, j: usize, orthogonal: f64) -> bool {
    let weighted = |k: usize| {
        let mut shape = fit.shapes[k].clone();
        for (point, noise) in shape.points.iter_mut().zip(&fit.noise) {
            point.value /= noise.white.sqrt();
            point.covariance.iter_mut().for_each(|entry| *entry /= noise.white);
        }
        shape
    };
    let noise = |shape: &ModeShape, k: usize| {
        let size: f64 = shape.points.iter().map(|p| p.value.norm_sqr()).sum();
        // of noise alone: with all that the model lacks any two shapes would be one
        shape.points.iter().map(|p| p.covariance[0] + p.covariance[2]).sum::<f64>() / size / fit.lack_of_fit[k]
    };
    let (one, other) = (weighted(i), weighted(j));
    let apart = 1.0 - one.mac(&other);
    apart < orthogonal + ORTHOGONAL.1 * (noise(&one, i) + noise(&other, j))
}

/// Largest multiple that is looked for: cubes and squares of the response make the first few.
const MULTIPLES: usize = 5;
/// How far a pole may be off the multiple of another, in its half width: the law is no pure power, and the mode may move.
const OFF_MULTIPLE: f64 = 0.5;
/// Energy of a harmonic over that of its mode, at most: a tenth of the amplitude.
const WEAK: f64 = 0.01;

/// A mode that looks like a harmonic of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HarmonicOf {
    /// Number of the mode, from 0.
    pub mode: usize,
    /// Number of the other.
    pub of: usize,
    /// Multiple of its frequency.
    pub multiple: usize,
}

impl ChannelRingdown {
    /// Weak modes whose pole is a multiple of a stronger one's: what a static curve or a stiffness that is not linear makes
    /// of it. A mode of a rod or a string may be there as well.
    ///
    /// # Model
    /// The n-th power of `Re(rho exp(s t))` has a part `exp(n s t)`.
    pub fn harmonics(&self) -> Vec<HarmonicOf> {
        let energy = energies(self);
        let is_one = |mode: usize, of: usize, multiple: usize| {
            let wanted = self.poles[of] * multiple as f64;
            energy[mode] < WEAK * energy[of] && (self.poles[mode] - wanted).norm() < OFF_MULTIPLE * wanted.re.abs()
        };
        let of = |mode: usize| {
            let pairs = (0..self.poles.len()).flat_map(|of| (2..=MULTIPLES).map(move |multiple| (of, multiple)));
            let found = pairs.filter(|&(of, multiple)| of != mode && is_one(mode, of, multiple));
            let (of, multiple) = found.max_by(|a, b| energy[a.0].total_cmp(&energy[b.0]))?;
            Some(HarmonicOf { mode, of, multiple })
        };
        (0..self.poles.len()).filter_map(of).collect()
    }

    /// The same without these modes, which stay in what was fitted: nuisances.
    pub(super) fn without(&self, modes: &[usize]) -> Self {
        self.chosen(&(0..self.poles.len()).filter(|j| !modes.contains(j)).collect::<Vec<usize>>())
    }

    /// These modes, in this order.
    pub(super) fn chosen(&self, keep: &[usize]) -> Self {
        let place = |i: usize| 2 * keep[i / 2] + i % 2;
        let mut out = self.clone();
        out.poles = keep.iter().map(|&j| self.poles[j]).collect();
        out.shapes = keep.iter().map(|&j| self.shapes[j].clone()).collect();
        out.lack_of_fit = keep.iter().map(|&j| self.lack_of_fit[j]).collect();
        out.covariance = Mat::from_fn(2 * keep.len(), 2 * keep.len(), |i, j| self.covariance[(place(i), place(j))]);
        for (record, full) in out.records.iter_mut().zip(&self.records) {
            record.residues = keep.iter().map(|&j| full.residues[j]).collect();
            record.residue_covariance = keep.iter().map(|&j| full.residue_covariance[j]).collect();
        }
        out
    }

    /// The same with these modes alone.
    pub(super) fn only(&self, modes: &[usize]) -> Self {
        self.without(&(0..self.poles.len()).filter(|j| !modes.contains(j)).collect::<Vec<usize>>())
    }

    /// Takes over a mode of another fit of the same records.
    pub(super) fn take_over(&mut self, mode: usize, other: &Self, from: usize) {
        self.take_pole(mode, other, from);
        for (own, record) in self.records.iter_mut().zip(&other.records) {
            own.residues[mode] = record.residues[from];
            own.residue_covariance[mode] = record.residue_covariance[from];
        }
    }

    /// Takes over pole and shape of a mode of another fit.
    pub(super) fn take_pole(&mut self, mode: usize, other: &Self, from: usize) {
        self.poles[mode] = other.poles[from];
        self.shapes[mode] = other.shapes[from].clone();
        self.lack_of_fit[mode] = other.lack_of_fit[from];
        for a in 0..2 {
            for i in 0..self.covariance.nrows() {
                self.covariance[(2 * mode + a, i)] = 0.0;
                self.covariance[(i, 2 * mode + a)] = 0.0;
            }
        }
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            self.covariance[(2 * mode + a, 2 * mode + b)] = other.covariance[(2 * from + a, 2 * from + b)];
        }
    }
}
