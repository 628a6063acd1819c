//! Whether a decay is no larger than the excursions of a stationary vibration that noise drives.

use std::ops::Range;

use faer::Mat;
use num_complex::Complex64;

use crate::linear_algebra::solve;
use crate::signal::hann;

/// Probability that stationary noise exceeds the limit anywhere in a record.
const FALSE_ALARM: f64 = 1e-3;
/// Segments of a decay time, and of a stretch, from which on they are longer than `LEAST_PERIODS`.
const SEGMENTS_OF_DECAY_TIME: f64 = 8.0;
const SEGMENTS_OF_STRETCH: usize = 48;
/// Periods of a segment at least: its taper keeps other modes off.
const LEAST_PERIODS: f64 = 4.0;
/// Exponentials in the band of a segment at most: modes that are closer than a quarter of their frequency.
const MOST_ORDER: usize = 8;
/// Segments per exponential: its coefficient is two numbers.
const SEGMENTS_PER_ORDER: usize = 4;
/// Exponentials that are allowed for at least, two that beat and a third.
const LEAST_ORDER: usize = 3;
/// Squared amplitude over that of the segment before, at most: forty segments to a decay time. Why: of what falls slower
/// a stretch of 48 segments does not know how slowly.
const LEAST_FALL: f64 = 0.95;
/// Share of the record outside of all decays and steady stretches, at least, whose mean energy is that of the record.
const LEAST_REST: f64 = 0.25;

/// How large a decay is against a stationary vibration of its band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Size {
    /// Noise reaches it.
    OfNoise {
        /// Its largest energy over the mean one, the larger of those that are known.
        ratio: f64,
        /// What noise exceeds in one record of a thousand.
        limit: f64,
    },
    /// Noise does not.
    Larger,
    /// Too short, in a record that leaves nothing to compare it with.
    Unknown,
}

/// A decay whose size is judged.
pub(super) struct Judged<'a> {
    /// The channel with the largest peak over its noise.
    pub values: &'a [f64],
    pub range: Range<usize>,
    /// Cycles per sample.
    pub frequency: f64,
    /// Decline, nepers per sample.
    pub rate: f64,
}

impl Judged<'_> {
    /// The decay's size against that of stationary noise.
    ///
    /// # Model
    /// Under the hypothesis the complex amplitude `z` at the frequency is a stationary normal process: its energy is
    /// exponentially distributed about the mean `m`, and in N segments exceeds `x m` some `2 N x exp(-x)` times. After a
    /// hit `z` is a sum of exponentials, and the energy exceeds what is not such a sum by the signal-to-noise ratio.
    /// # Method
    /// Amplitudes of Hann-weighted segments. `m` is estimated twice: the mean energy outside of decays and steady
    /// stretches, where they leave a quarter of the record, and the variance that the one-step errors of a linear
    /// recurrence within the decay sustain, `q / (1 - exp(-2 r h))`. Both ratios are below the limit in noise.
    /// # Source
    /// S. O. Rice, Bell Syst. Tech. J. 24 (1945) 46 (envelope of a narrow band).
    pub fn size(&self, taken: &[Range<usize>]) -> Size {
        let segment = self.segment();
        let inside = self.amplitudes(self.range.clone(), segment);
        let peak = inside.iter().map(Complex64::norm_sqr).fold(0.0, f64::max);
        let rest = self.mean_outside(taken, segment);
        let sustained = sustained(&inside, (-2.0 * self.rate * segment as f64).exp());
        let limit = limit(self.values.len() as f64 / segment as f64);
        let ratios = [rest, sustained].map(|mean| mean.map(|mean| peak / mean.max(f64::MIN_POSITIVE)));
        match ratios.into_iter().flatten().reduce(f64::max) {
            Some(ratio) if ratio <= limit => Size::OfNoise { ratio, limit },
            Some(_) => Size::Larger,
            None => Size::Unknown,
        }
    }

    /// Whether an oscillation that does not decay is noise's: its own errors sustain it.
    pub fn is_sustained(&self) -> bool {
        let all = 0..self.values.len();
        matches!(self.size(std::slice::from_ref(&all)), Size::OfNoise { .. })
    }

    /// Samples of a segment.
    fn segment(&self) -> usize {
        let of_time = (1.0 / (self.rate.max(0.0) * SEGMENTS_OF_DECAY_TIME)).min(self.values.len() as f64) as usize;
        let least = (LEAST_PERIODS / self.frequency.max(1e-9)).ceil() as usize;
        of_time.min(self.range.len() / SEGMENTS_OF_STRETCH).max(least).max(2)
    }

    /// Complex amplitudes of segments at the frequency.
    fn amplitudes(&self, range: Range<usize>, segment: usize) -> Vec<Complex64> {
        let taper = hann(segment, 0.5);
        let turn = |k: usize| Complex64::from_polar(1.0, -std::f64::consts::TAU * (self.frequency * k as f64).fract());
        let of = |values: (usize, &[f64])| -> Complex64 {
            let (number, values) = values;
            let first = range.start + number * segment;
            let mean = values.iter().sum::<f64>() / segment as f64;
            values.iter().zip(&taper).enumerate().map(|(i, (y, w))| turn(first + i) * (w * (y - mean))).sum()
        };
        self.values[range.clone()].chunks_exact(segment).enumerate().map(of).collect()
    }

    /// Mean energy outside of the ascending ranges; none where they leave too little.
    fn mean_outside(&self, taken: &[Range<usize>], segment: usize) -> Option<f64> {
        let (mut energies, mut since) = (Vec::new(), 0);
        for range in taken.iter().cloned().chain(std::iter::once(self.values.len()..self.values.len())) {
            if range.start > since {
                energies.extend(self.amplitudes(since..range.start, segment).iter().map(Complex64::norm_sqr));
            }
            since = since.max(range.end);
        }
        let enough = (energies.len() * segment) as f64 >= LEAST_REST * self.values.len() as f64;
        enough.then(|| energies.iter().sum::<f64>() / energies.len() as f64)
    }
}

/// Variance that the one-step errors of a linear recurrence sustain where the squared amplitude falls by the factor
/// `fall` from segment to segment; none of too few segments.
fn sustained(amplitudes: &[Complex64], fall: f64) -> Option<f64> {
    let order = (amplitudes.len() / SEGMENTS_PER_ORDER).min(MOST_ORDER);
    if order < LEAST_ORDER {
        return None;
    }
    let rows = amplitudes.len() - order;
    // z_j = sum_i a_i z_(j-1-i); the real and the imaginary part of each a are unknowns
    let column = |row: usize, c: usize| {
        let z = amplitudes[row + order - 1 - c / 2];
        if c.is_multiple_of(2) { z } else { z * Complex64::i() }
    };
    let inner = |a: Complex64, b: Complex64| a.re * b.re + a.im * b.im;
    let width = 2 * order;
    let product = |a: usize, b: usize| (0..rows).map(|row| inner(column(row, a), column(row, b))).sum::<f64>();
    let mut gram = Mat::from_fn(width, width, product);
    let largest = (0..width).map(|a| gram[(a, a)]).fold(0.0, f64::max);
    // exponentials fewer than coefficients leave them undetermined
    (0..width).for_each(|a| gram[(a, a)] += 1e-12 * largest);
    let of_next = |a: usize, _| (0..rows).map(|row| inner(column(row, a), amplitudes[row + order])).sum::<f64>();
    let right = Mat::from_fn(width, 1, of_next);
    let weights = solve(gram, &right);
    let foretold = |row: usize| (0..width).map(|c| column(row, c) * weights[(c, 0)]).sum::<Complex64>();
    let squares: f64 = (0..rows).map(|row| (amplitudes[row + order] - foretold(row)).norm_sqr()).sum();
    let variance = squares / (rows - order) as f64 / (1.0 - fall.min(LEAST_FALL));
    variance.is_finite().then_some(variance)
}

/// Energy over the mean that noise of `count` independent segments exceeds at the false-alarm rate.
fn limit(count: f64) -> f64 {
    // 2 N x exp(-x) excursions beyond x; the iteration contracts by 1/x
    let plain = (2.0 * count.max(1.0) / FALSE_ALARM).ln();
    (0..20).fold(plain, |x, _| plain + x.ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_limit_is_exceeded_as_rarely_as_stated() {
        let x = limit(1e4);
        assert!((2e4 * x * (-x).exp() / FALSE_ALARM - 1.0).abs() < 1e-9, "{x}");
    }

    #[test]
    fn the_variance_that_errors_sustain_is_that_of_the_process() {
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for seed in 0..50 {
            let [re, im] = [0, 1].map(|part| white_noise(400, 1.0, 2 * seed + part));
            let mut z = Complex64::new(re[0], im[0]);
            let step = Complex64::from_polar(0.9, 0.3);
            let next = |(re, im): (&f64, &f64)| {
                z = z * step + (1.0_f64 - 0.81).sqrt() * Complex64::new(*re, *im);
                z
            };
            let process: Vec<Complex64> = re.iter().zip(&im).map(next).collect();
            let ratio = sustained(&process, 0.81).unwrap() / 2.0;
            (least, most) = (least.min(ratio), most.max(ratio));
        }
        // 384 complex errors: their variance is known to 5 %, five of that in fifty records
        assert!(least > 0.75 && most < 1.25, "{least} {most}");
    }

    #[test]
    fn exponentials_sustain_nothing() {
        let z = |k: usize| {
            let of = |fall: f64, turn: f64| Complex64::from_polar((-fall * k as f64).exp(), turn * k as f64);
            of(0.02, 0.3) + of(0.03, 0.45) + of(0.1, -0.8)
        };
        let amplitudes: Vec<Complex64> = (0..60).map(z).collect();
        assert!(sustained(&amplitudes, 0.96).unwrap() < 1e-6);
    }
}
