//! Lines beside the oscillation: which are its own, which belong together, which are spurious.

use std::f64::consts::{LN_2, PI, TAU};

use crate::c64;
use crate::signal::{RealTransform, hann};
use crate::statistics::median;

use super::blocks::{Blocks, HARMONICS};
use super::phase::{Track, alias};

/// Bins that the level around a line is the median of.
const AROUND: usize = 401;
/// Bins at the low end that drift has.
const DRIFT: usize = 10;
/// Bins within which two peaks are one line.
const ONE: usize = 6;
/// Multiples of the oscillation's frequency, before and after sampling, that no line may be near.
const MULTIPLES: usize = 100;
/// Lines that are looked at: the strongest.
const MOST: usize = 300;
/// Share of a sideband's amplitude that its mirror image has at least.
const MIRROR: f64 = 0.3;

/// One line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Cycles per sample.
    pub frequency: f64,
    pub amplitude: f64,
    /// Median amplitude of the bins around.
    pub level: f64,
}

/// What the oscillation makes itself, and the rest.
#[derive(Debug, Default)]
pub(super) struct Lines {
    /// Of no known origin, the strongest first.
    pub foreign: Vec<Line>,
    /// At multiples of a half or a third of its frequency.
    pub subharmonic: Vec<Line>,
    /// Pairs about its harmonics: slow modulation of amplitude or phase.
    pub sidebands: usize,
    /// Sums and differences with foreign lines.
    pub products: usize,
    /// Crowds of peaks that are a narrow band of noise, by their strongest.
    pub crowds: Vec<Line>,
}

/// Finds the lines of what the harmonics leave.
///
/// # Method
/// Amplitudes under a Hann window; a line exceeds the median around by `sqrt(ln(N / rate) / ln 2)`, what the largest of
/// N bins of noise does with that false-alarm rate, and the ripple of rounding.
pub(super) fn lines(blocks: &Blocks, track: &Track, wander: f64, ripple: f64, false_alarm_rate: f64) -> Lines {
    let spectrum = Spectrum::of(&blocks.rest);
    let own = Own { blocks, track, wander, bin: 1.0 / blocks.rest.len().max(1) as f64 };
    let all: Vec<Line> = spectrum.peaks(ripple, false_alarm_rate).into_iter().filter(|l| !own.multiple(l)).collect();
    let mut found = Lines::default();
    let mut rest = Vec::new();
    for line in &all {
        if own.fraction(line) {
            found.subharmonic.push(*line);
        } else if own.sideband(line, &all, &spectrum) {
            found.sidebands += 1;
        } else {
            rest.push(*line);
        }
    }
    for line in rest {
        // sums and differences with stronger foreign lines: the curve of the detector mixes them
        if found.foreign.iter().take(10).any(|foreign| own.product(&line, foreign)) {
            found.products += 1;
        } else {
            found.foreign.push(line);
        }
    }
    found
}

/// Takes crowds of peaks out of what families left: five and more, each within half a median window of the next.
pub(super) fn crowds(lines: &mut Lines, samples: usize) {
    let near = 0.5 * AROUND as f64 / samples.max(1) as f64;
    let mut sorted = std::mem::take(&mut lines.foreign);
    sorted.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    let apart = |pair: &Line, next: &Line| next.frequency - pair.frequency < near;
    for crowd in sorted.chunk_by(apart) {
        match crowd.iter().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude)) {
            Some(strongest) if crowd.len() >= 5 => lines.crowds.push(*strongest),
            _ => lines.foreign.extend_from_slice(crowd),
        }
    }
    lines.foreign.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
}

/// Distance of a line from its largest bin, in bins: with the ratio r of the larger neighbour `(2 r - 1) / (r + 1)`.
fn hann_distance(amplitude: &[f64], k: usize) -> f64 {
    let at = |j: usize| amplitude.get(j).copied().unwrap_or(0.0);
    let (below, here, above) = (at(k.saturating_sub(1)), at(k).max(f64::MIN_POSITIVE), at(k + 1));
    let distance = |side: f64| ((2.0 * side / here - 1.0) / (side / here + 1.0)).clamp(0.0, 0.5);
    if above >= below { distance(above) } else { -distance(below) }
}

/// Amplitude of a bin at this distance from a line of amplitude one, less than a bin.
fn hann_response(distance: f64) -> f64 {
    let angle = PI * distance;
    let sinc = if angle.abs() < 1e-6 { 1.0 } else { angle.sin() / angle };
    sinc / (1.0 - distance * distance)
}

struct Spectrum {
    amplitude: Vec<f64>,
    samples: usize,
}

impl Spectrum {
    fn of(rest: &[f64]) -> Self {
        let mean = rest.iter().sum::<f64>() / rest.len().max(1) as f64;
        let window = hann(rest.len(), 0.5);
        let gain = window.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let bins = RealTransform::new(rest.len()).forward(rest.iter().zip(&window).map(|(y, w)| w * (y - mean)));
        Self { amplitude: bins.iter().map(|bin| 2.0 * bin.norm() / gain).collect(), samples: rest.len() }
    }

    /// Median around a bin, of every hundredth only: it changes slowly.
    fn levels(&self) -> Vec<f64> {
        let half = AROUND / 2;
        let at = |k: usize| {
            let range = k.saturating_sub(half).max(DRIFT.min(k))..(k + half + 1).min(self.amplitude.len());
            median(&mut self.amplitude.get(range).unwrap_or(&[]).to_vec())
        };
        (0..=self.amplitude.len() / 100).map(|i| at(100 * i)).collect()
    }

    fn peaks(&self, ripple: f64, false_alarm_rate: f64) -> Vec<Line> {
        let levels = self.levels();
        let count = self.amplitude.len().max(2) as f64;
        let factor = ((count / false_alarm_rate.clamp(1e-12, 0.5)).ln() / LN_2).sqrt();
        let mut found: Vec<Line> = Vec::new();
        for (k, &amplitude) in self.amplitude.iter().enumerate().skip(DRIFT) {
            let nearest = |i: usize| levels.get(i).copied();
            let level = nearest((k + 50) / 100).or_else(|| nearest(k / 100)).unwrap_or(0.0);
            if !(amplitude > factor * level && amplitude > ripple) {
                continue;
            }
            let around = self.amplitude.get(k.saturating_sub(ONE / 2)..(k + ONE / 2 + 1).min(self.amplitude.len()));
            if around.is_some_and(|around| around.iter().all(|other| *other <= amplitude)) {
                let distance = hann_distance(&self.amplitude, k);
                let frequency = (k as f64 + distance) / self.samples as f64;
                found.push(Line { frequency, amplitude: amplitude / hann_response(distance), level });
            }
        }
        found.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        found.truncate(MOST);
        found
    }

    /// Largest amplitude within two bins.
    fn near(&self, frequency: f64) -> f64 {
        let k = (frequency * self.samples as f64).round().max(0.0) as usize;
        let range = k.saturating_sub(2)..(k + 3).min(self.amplitude.len());
        self.amplitude.get(range).unwrap_or(&[]).iter().copied().fold(0.0, f64::max)
    }
}

/// What is the oscillation's own.
struct Own<'a> {
    blocks: &'a Blocks,
    track: &'a Track,
    /// Standard deviation of the frequency, cycles per sample.
    wander: f64,
    bin: f64,
}

impl Own<'_> {
    /// Distance from the nearest of `k f1` after sampling within which a line counts as its own.
    fn multiple(&self, line: &Line) -> bool {
        (1..=MULTIPLES).any(|k| {
            // amplitudes that change from block to block spread what was fitted over a block's resolution
            let fitted = if k <= HARMONICS { 4.0 / self.blocks.length as f64 } else { 0.0 };
            let near = 4.0 * self.bin
                + 3.0 * k as f64 * self.wander
                + fitted.max(if k == 1 { 3.0 * self.track.bandwidth } else { 0.0 });
            (line.frequency - alias(k as f64 * self.track.frequency)).abs() < near
        })
    }

    fn fraction(&self, line: &Line) -> bool {
        [2, 3].into_iter().any(|divisor| {
            (1..=divisor * HARMONICS).filter(|k| k % divisor != 0).any(|k| {
                let share = k as f64 / divisor as f64;
                let near = 2.0 * self.bin + 3.0 * share * self.wander;
                (line.frequency - alias(share * self.track.frequency)).abs() < near
            })
        })
    }

    /// Within a fifth of the frequency of a harmonic, with a mirror image or with a line at the distance itself.
    fn sideband(&self, line: &Line, all: &[Line], spectrum: &Spectrum) -> bool {
        let f1 = self.track.frequency;
        (1..=HARMONICS).any(|k| {
            let harmonic = alias(k as f64 * f1);
            let distance = line.frequency - harmonic;
            if distance.abs() > 0.2 * f1 {
                return false;
            }
            let mirror = spectrum.near(alias(harmonic - distance));
            let mirrored = mirror > MIRROR * line.amplitude && mirror > 3.0 * line.level;
            // a strong line at a low frequency modulates; of many weak ones some lie anywhere
            let slow = |other: &Line| {
                (other.frequency - distance.abs()).abs() < 2.0 * self.bin + self.wander
                    && other.amplitude > line.amplitude
            };
            mirrored || all.iter().any(slow)
        })
    }

    /// Whether it is `|k f1 +- f|` of a stronger line.
    fn product(&self, line: &Line, foreign: &Line) -> bool {
        foreign.amplitude > line.amplitude
            && (1..=3).any(|k| {
                let f = k as f64 * self.track.frequency;
                let near = 2.0 * self.bin + 2.0 * k as f64 * self.wander;
                [f + foreign.frequency, f - foreign.frequency]
                    .into_iter()
                    .any(|product| (line.frequency - alias(product)).abs() < near)
            })
    }
}

/// Cosine and sine parts of a line, least squares over some samples of the record; time runs from its first.
pub(super) fn project(rest: &[f64], frequency: f64, use_block: impl Fn(usize) -> bool, length: usize) -> [f64; 2] {
    let (mut cc, mut cs, mut ss, mut yc, mut ys) = (0.0, 0.0, 0.0, 0.0, 0.0);
    each(rest, frequency, length, |b, _, y, c, s| {
        if use_block(b) {
            cc += c * c;
            cs += c * s;
            ss += s * s;
            yc += y * c;
            ys += y * s;
        }
    });
    let determinant = (cc * ss - cs * cs).max(f64::MIN_POSITIVE);
    [(ss * yc - cs * ys) / determinant, (cc * ys - cs * yc) / determinant]
}

/// Takes a line off.
pub(super) fn take_off(rest: &mut [f64], frequency: f64, parts: [f64; 2]) {
    let [a, b] = parts;
    let taken: Vec<f64> = {
        let mut taken = Vec::with_capacity(rest.len());
        each(rest, frequency, rest.len().max(1), |_, _, y, c, s| taken.push(y - a * c - b * s));
        taken
    };
    rest.iter_mut().zip(taken).for_each(|(y, t)| *y = t);
}

/// Calls with block, sample, value, cosine and sine of each sample.
fn each(rest: &[f64], frequency: f64, length: usize, mut call: impl FnMut(usize, usize, f64, f64, f64)) {
    let step = c64::from_polar(1.0, TAU * frequency);
    for (b, part) in rest.chunks(length.max(1)).enumerate() {
        // turned on from an exact phase every thousand samples: rounding stays below 1e-13
        for (i, short) in part.chunks(1000).enumerate() {
            let first = b * length + 1000 * i;
            let mut turn = c64::from_polar(1.0, TAU * (frequency * first as f64).fract());
            for (t, y) in (first..).zip(short) {
                call(b, t, *y, turn.re, turn.im);
                turn *= step;
            }
        }
    }
}
