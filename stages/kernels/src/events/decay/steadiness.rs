//! Whether an oscillation decays: the slope of its amplitude against its own error.

use std::ops::Range;

use faer::Mat;

use super::beat::beating;
use super::found::Decline;
use crate::linear_algebra::solve;
use crate::signal::{RealTransform, hann};

/// Segments of a stretch at most.
const SEGMENTS: usize = 32;
/// Least periods of a segment: its taper keeps other modes off.
pub(super) const SEGMENT_PERIODS: f64 = 4.0;
/// Least segments for a slope with an error.
const LEAST_SEGMENTS: usize = 6;

/// The strongest oscillation of a stretch.
pub(super) struct Oscillation {
    /// Cycles per sample.
    pub frequency: f64,
    pub decline: Decline,
    /// Energies of the segments over the noise's, and the seconds between them.
    energies: Vec<f64>,
    interval_s: f64,
    /// Amplitude per channel: root mean square of the segments'.
    pub amplitude: Vec<f64>,
}

impl Oscillation {
    /// Decline of two tones that beat; none where they do not.
    pub fn beat(&self) -> Option<Decline> {
        beating(&self.energies, self.interval_s)
    }
}

/// Amplitude and decline of the oscillation at about `frequency` (cycles per sample), by segments of `periods` at least.
///
/// # Method
/// The stretch in up to 32 segments; in each the Hann-weighted amplitude at the frequency, all channels weighted by
/// their noise and added in power. Frequency: refined by the strongest channel's phase from segment to segment, and a
/// segment's taper. Slope: line through the logarithms; its error from their scatter round it, so that beats and
/// noise count.
pub(super) fn oscillation(
    channels: &[&[f64]],
    noise_std: &[f64],
    range: &Range<usize>,
    frequency: f64,
    periods: f64,
    rate_hz: f64,
) -> Oscillation {
    let length = ((range.len() / SEGMENTS).max((periods / frequency.max(1e-12)).ceil() as usize)).clamp(1, range.len());
    let count = range.len() / length;
    let taper = hann(length, 0.5);
    let strongest = strongest(channels, noise_std, range);
    let refined = refined(&channels[strongest][range.clone()], frequency, length, &taper);
    let basis = Tone::new(refined, &taper);
    let amplitude = |channel: &[f64], segment: usize| {
        basis.amplitude(&channel[range.start + segment * length..range.start + (segment + 1) * length])
    };
    let all: Vec<Vec<f64>> =
        channels.iter().map(|channel| (0..count).map(|segment| amplitude(channel, segment)).collect()).collect();
    let energy = |segment: usize| all.iter().zip(noise_std).map(|(a, s)| (a[segment] / s).powi(2)).sum();
    let energies: Vec<f64> = (0..count).map(energy).collect();
    let rms = |a: &Vec<f64>| (a.iter().map(|v| v * v).sum::<f64>() / count.max(1) as f64).sqrt();
    Oscillation {
        frequency: refined,
        decline: slope(&energies, length as f64 / rate_hz),
        energies,
        interval_s: length as f64 / rate_hz,
        amplitude: all.iter().map(rms).collect(),
    }
}

/// Weighted least squares of a cosine, a sine and a level: exact for a single tone, whatever part of a period is left.
struct Tone {
    columns: [Vec<f64>; 3],
    /// Weighted Gram matrix.
    gram: Mat<f64>,
    taper: Vec<f64>,
}

impl Tone {
    /// Cosine and sine differ where the frequency is a quarter of a turn in the segment off zero and off half the sample
    /// rate; closer ones are taken for such.
    fn new(frequency: f64, taper: &[f64]) -> Self {
        let margin = (0.25 / taper.len() as f64).min(0.25);
        let frequency = frequency.clamp(margin, 0.5 - margin);
        let angle = |k: usize| std::f64::consts::TAU * frequency * k as f64;
        let of = |f: &dyn Fn(usize) -> f64| (0..taper.len()).map(f).collect::<Vec<f64>>();
        let columns = [of(&|k| angle(k).cos()), of(&|k| angle(k).sin()), of(&|_| 1.0)];
        let weighted = |i: usize, j: usize| {
            columns[i].iter().zip(&columns[j]).zip(taper).map(|((a, b), w)| w * a * b).sum::<f64>()
        };
        let gram = Mat::from_fn(3, 3, weighted);
        Self { columns, gram, taper: taper.to_vec() }
    }

    fn amplitude(&self, values: &[f64]) -> f64 {
        let first = values[0];
        let right = Mat::from_fn(3, 1, |i, _| {
            self.columns[i].iter().zip(values).zip(&self.taper).map(|((c, y), w)| w * c * (y - first)).sum()
        });
        let found = solve(self.gram.clone(), &right);
        found[(0, 0)].hypot(found[(1, 0)])
    }
}

/// The channel with the largest energy over its noise's.
fn strongest(channels: &[&[f64]], noise_std: &[f64], range: &Range<usize>) -> usize {
    let energy = |c: usize| {
        let values = super::envelope::without_line(&channels[c][range.clone()]);
        values.iter().map(|y| y * y).sum::<f64>() / noise_std[c].powi(2)
    };
    let all: Vec<f64> = (0..channels.len()).map(energy).collect();
    (0..all.len()).max_by(|&a, &b| all[a].total_cmp(&all[b])).unwrap_or(0)
}

/// The peak of the periodogram near `frequency`, between its bins by the phase of two overlapping segments.
fn refined(values: &[f64], frequency: f64, length: usize, taper: &[f64]) -> f64 {
    let plan = RealTransform::new(length);
    let line = super::envelope::without_line(values);
    let spectrum = |first: usize| plan.forward(line[first..first + length].iter().zip(taper).map(|(y, w)| y * w));
    let begin = spectrum(0);
    let near = (frequency * length as f64).round().max(1.0) as usize;
    let bins = near.saturating_sub(2).max(1)..(near + 3).min(begin.len());
    let Some(peak) = bins.max_by(|&a, &b| begin[a].norm().total_cmp(&begin[b].norm())) else { return frequency };
    let mut found = peak as f64 / length as f64;
    // ever longer distances: each one's phase is unambiguous to the precision of the one before
    let mut distance = 1usize;
    while distance + length <= line.len() {
        let turned = (spectrum(distance)[peak] * begin[peak].conj()).arg() / std::f64::consts::TAU;
        let whole = (found * distance as f64 - turned).round();
        found = (whole + turned) / distance as f64;
        distance *= 2;
    }
    // the line of its mirror image at half the sample rate may draw it beyond
    (found - found.round()).abs()
}

/// Least-squares slope of half the logarithms of energies `interval_s` apart, falling counted positive. Each counts by its
/// energy: the little that is left between two beats says little of the slope.
fn slope(energies: &[f64], interval_s: f64) -> Decline {
    let log = |energy: &f64| 0.5 * energy.max(f64::MIN_POSITIVE).ln();
    let n = energies.len() as f64;
    if energies.len() < LEAST_SEGMENTS {
        let rate_per_s = match (energies.first(), energies.last()) {
            (Some(first), Some(last)) if energies.len() > 1 => (log(first) - log(last)) / ((n - 1.0) * interval_s),
            _ => 0.0,
        };
        return Decline { rate_per_s, std_per_s: f64::INFINITY, freedom: 0 };
    }
    let total = energies.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let all = || energies.iter().enumerate().map(|(k, energy)| (energy / total, k as f64, log(energy)));
    let [centre, mean] = [all().map(|(w, t, _)| w * t).sum::<f64>(), all().map(|(w, _, y)| w * y).sum::<f64>()];
    let spread: f64 = all().map(|(w, t, _)| w * (t - centre).powi(2)).sum();
    let by: f64 = all().map(|(w, t, y)| w * (t - centre) * (y - mean)).sum::<f64>() / spread;
    // each segment's own residual: energies do not say how well they are known
    let rest = |t: f64, y: f64| (y - mean - by * (t - centre)).powi(2);
    let meat: f64 = all().map(|(w, t, y)| (w * (t - centre)).powi(2) * rest(t, y)).sum();
    let std = (meat * n / (n - 2.0)).sqrt() / spread;
    let std_per_s = std.max(f64::EPSILON) / interval_s;
    Decline { rate_per_s: -by / interval_s, std_per_s, freedom: energies.len() - 2 }
}
