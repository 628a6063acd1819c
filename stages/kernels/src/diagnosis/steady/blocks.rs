//! Harmonics block by block.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::c64;
use crate::linear_algebra::symmetric_inverse;
use crate::{Mat, statistics::median};

use super::phase::{Track, alias};

/// Harmonics that are looked at: a static curve's die out long before.
pub(super) const HARMONICS: usize = 12;
/// Blocks at most: enough for errors, few enough that each has all harmonics apart.
const BLOCKS: usize = 50;
/// Blocks that make a batch, whose scatter shows what wanders more slowly than from block to block.
const BATCH: usize = 5;

/// One block: `y = level + Re sum_k h_k exp(i k phase)`, turned so that `h_1` is real.
pub(super) struct Block {
    /// Samples, counted from the track's first.
    pub range: Range<usize>,
    /// Level at its middle.
    pub level: f64,
    /// Phase of `h_1` about the track's.
    pub turn: f64,
    /// `h_0` is unused; harmonics that can't be had are zero.
    pub harmonics: Vec<c64>,
    /// Mean frequency, cycles per sample.
    pub frequency: f64,
    /// Sum of squares of what is left.
    pub loss: f64,
}

/// All blocks, and what their harmonics leave.
pub(super) struct Blocks {
    pub blocks: Vec<Block>,
    /// Numbers of the harmonics that stand apart from all others, ascending, 1 first.
    pub kept: Vec<usize>,
    /// The record less harmonics, level and drift left in.
    pub rest: Vec<f64>,
    /// Samples of a block.
    pub length: usize,
}

/// A mean over blocks with its standard error, and the variance of one block about its neighbours.
#[derive(Clone, Copy, Default)]
pub(super) struct Mean {
    pub value: f64,
    pub std: f64,
    pub scatter: f64,
}

impl Blocks {
    /// Least squares on level, slope and harmonics in each block.
    pub fn of(y: &[f64], track: &Track) -> Self {
        let samples = track.phase.len().min(y.len().saturating_sub(track.first));
        let periods = track.frequency * samples as f64;
        // twenty periods a block where there are enough, eight or fewer in short records
        let count = if periods >= 400.0 { (periods / 20.0) as usize } else { ((periods / 8.0) as usize).min(20) };
        let count = count.clamp(4, BLOCKS);
        let length = (samples / count).max(1);
        let kept = apart(track.frequency, length);
        let mut rest = Vec::with_capacity(samples);
        let mut blocks = Vec::with_capacity(count);
        for b in 0..count {
            let end = if b + 1 == count { samples } else { (b + 1) * length };
            let range = b * length..end;
            let motion = track.stretch(&range);
            let y = y.get(track.first + range.start..track.first + range.end).unwrap_or(&[]);
            blocks.push(block(range, y, &motion, &kept, &mut rest));
        }
        Self { blocks, kept, rest, length }
    }

    /// Mean of a number of each block.
    pub fn mean(&self, of: impl Fn(&Block) -> f64) -> Mean {
        mean(&self.blocks.iter().map(of).collect::<Vec<f64>>())
    }

    /// Root mean square of what is left.
    pub fn noise(&self) -> f64 {
        let samples: usize = self.blocks.iter().map(|block| block.range.len()).sum();
        (self.blocks.iter().map(|block| block.loss).sum::<f64>() / samples.max(1) as f64).sqrt()
    }
}

/// Mean with an error by the differences of neighbours, so that a slow drift counts as none; of neighbouring batches
/// where their scatter is larger.
pub(super) fn mean(values: &[f64]) -> Mean {
    let count = values.len().max(1) as f64;
    let value = values.iter().sum::<f64>() / count;
    let scatter = neighbours(values);
    let batches: Vec<f64> = values.chunks_exact(BATCH).map(|part| part.iter().sum::<f64>() / BATCH as f64).collect();
    // of fewer than eight batches the scatter is a guess
    let slow = if batches.len() >= 8 { neighbours(&batches) / batches.len() as f64 } else { 0.0 };
    Mean { value, std: (scatter / count).max(slow).sqrt(), scatter }
}

/// Variance by the differences of neighbours.
fn neighbours(values: &[f64]) -> f64 {
    let squares: f64 = values.windows(2).map(|pair| pair.iter().fold(0.0, |d, v| v - d).powi(2)).sum();
    0.5 * squares / values.len().saturating_sub(1).max(1) as f64
}

/// Harmonics whose frequencies after sampling are three resolutions of a block apart from level, half the sample rate
/// and lower harmonics.
fn apart(frequency: f64, length: usize) -> Vec<usize> {
    let resolution = 3.0 / length as f64;
    let most = HARMONICS.min((length / 8).saturating_sub(1)).max(1);
    let mut kept: Vec<usize> = vec![1];
    for k in 2..=most {
        let place = alias(k as f64 * frequency);
        let clear = |other: f64| (place - other).abs() > resolution;
        if clear(0.0) && clear(0.5) && kept.iter().all(|&other| clear(alias(other as f64 * frequency))) {
            kept.push(k);
        }
    }
    kept
}

fn block(range: Range<usize>, y: &[f64], motion: &[(f64, f64)], kept: &[usize], rest: &mut Vec<f64>) -> Block {
    let width = 2 + 2 * kept.len();
    let samples = y.len().max(1) as f64;
    let mut row = vec![0.0; width];
    let mut gram = vec![0.0; width * width];
    let mut along = vec![0.0; width];
    for (t, (y, motion)) in y.iter().zip(motion).enumerate() {
        fill(&mut row, t as f64 / samples - 0.5, *motion, kept);
        for (i, (a, along)) in row.iter().zip(&mut along).enumerate() {
            *along += a * y;
            gram.iter_mut().skip(i * width).zip(&row).take(i + 1).for_each(|(sum, b)| *sum += a * b);
        }
    }
    let entry = |i: usize, j: usize| gram.get(i.max(j) * width + i.min(j)).copied().unwrap_or(0.0);
    let inverse = symmetric_inverse(&Mat::from_fn(width, width, entry));
    let solution: Vec<f64> =
        (0..width).map(|i| along.iter().enumerate().map(|(j, v)| inverse[(i, j)] * v).sum()).collect();
    let mut loss = 0.0;
    for (t, (y, motion)) in y.iter().zip(motion).enumerate() {
        fill(&mut row, t as f64 / samples - 0.5, *motion, kept);
        let products = row.iter().zip(&solution).map(|(a, b)| a * b);
        let level: f64 = products.clone().take(2).sum();
        let periodic: f64 = products.skip(2).sum();
        loss += (y - level - periodic).powi(2);
        rest.push(y - periodic);
    }
    let mut harmonics = vec![c64::new(0.0, 0.0); HARMONICS + 1];
    for (pair, &k) in solution.get(2..).unwrap_or(&[]).chunks_exact(2).zip(kept) {
        if let ([cosine, sine], Some(h)) = (pair, harmonics.get_mut(k)) {
            *h = c64::new(*cosine, -sine);
        }
    }
    let turn = harmonics.get(1).map_or(0.0, |first| first.arg());
    harmonics.iter_mut().enumerate().for_each(|(k, h)| *h *= c64::from_polar(1.0, -(k as f64) * turn));
    let frequency = match motion {
        [(first, _), .., (last, _)] => (last - first) / (TAU * (motion.len() - 1) as f64),
        _ => 0.0,
    };
    let level = solution.first().copied().unwrap_or(0.0);
    Block { range, level, turn, harmonics, frequency, loss }
}

/// Level, slope, cosines and sines at one sample. Within a block harmonic k follows the k-th power of the amplitude, as
/// those of a slightly bent curve do: modulation within the block leaves no sidebands.
fn fill(row: &mut [f64], time: f64, (phase, amplitude): (f64, f64), kept: &[usize]) {
    let (sine, cosine) = phase.sin_cos();
    let (step, mut turn, mut at) = (c64::new(cosine, sine) * amplitude, c64::new(1.0, 0.0), 0);
    if let [level, slope, rest @ ..] = row {
        (*level, *slope) = (1.0, time);
        for (pair, &k) in rest.chunks_exact_mut(2).zip(kept) {
            while at < k {
                turn *= step;
                at += 1;
            }
            if let [c, s] = pair {
                (*c, *s) = (turn.re, turn.im);
            }
        }
    }
}

/// Least over largest of the blocks' amplitudes, single blocks of noise smoothed by the median of three.
pub(super) fn evenness(blocks: &[Block]) -> f64 {
    let amplitudes: Vec<f64> = blocks.iter().map(|block| block.harmonics.get(1).map_or(0.0, |h| h.norm())).collect();
    let smooth: Vec<f64> = if amplitudes.len() < 12 {
        amplitudes
    } else {
        amplitudes.windows(3).map(|three| median(&mut three.to_vec())).collect()
    };
    let largest = smooth.iter().copied().fold(0.0, f64::max);
    smooth.iter().copied().fold(f64::INFINITY, f64::min) / largest
}
