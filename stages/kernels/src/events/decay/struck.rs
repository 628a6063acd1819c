//! Hits into ringing: where the prediction of a free decay fails at once.

use std::ops::Range;

use faer::Mat;

use super::backward::block_of;
use super::clipping;
use crate::linear_algebra::solve;
use crate::statistics::{chi_square_level, median};

/// Coefficients of the recurrence at most: ten modes.
const MOST_ORDER: usize = 20;
/// Equations per coefficient at least.
const EQUATIONS: usize = 6;
/// Blocks of a window at most, 32 periods. Why: modes that move with their amplitude hardly do within them.
const WINDOW_BLOCKS: usize = 512;
/// Blocks before and after an instant that tell the prediction's own error there. Why: a median of so many is known to
/// a tenth; the error falls with the ringing.
const BESIDE_BLOCKS: usize = 96;
/// Fits: what misses by more than a hit's is left out of the next one.
const ROUNDS: usize = 4;
/// Probability that noise alone fails the prediction anywhere in a record.
const FALSE_ALARM: f64 = 1e-4;
/// Least failure over the ringing's rms around it. Why: what changes the ringing by less than a twentieth is within the
/// error of a decay's amplitude and moves no pole by more than a twentieth of its decline.
const LEAST_CHANGE: f64 = 0.05;
/// Blocks that a glitch spoils at most: a wrong sample and its edges.
const GLITCH_BLOCKS: usize = 3;
/// Periods within which failures are those of one hit.
const ONE_HIT_PERIODS: usize = 2;
/// Standard deviation of a normal variable over the median of its modulus.
const STD_OF_MEDIAN: f64 = 1.482_602_218_505_602;

/// Where the prediction of a stretch that rings fails, ascending.
#[derive(Debug, Default)]
pub(super) struct Failures {
    /// First samples of hits.
    pub hits: Vec<usize>,
    /// Samples of glitches: what rings goes on after them as it was.
    pub glitches: Vec<usize>,
}

/// Hits, and glitches that are none, within a stretch that rings.
///
/// # Model
/// Free ringing obeys one linear recurrence, `y_k = sum_j a_j y_(k-j)` up to noise, whatever its amplitudes and phases
/// are; it fails where a force acts, and obeys again after it.
/// # Method
/// Means of blocks of a sixteenth of a period. Each channel's forward recurrence by least squares over windows of up to
/// 512 blocks, refitted without the blocks that miss. The squares of the channels' misses over their scale around that
/// instant, added, are chi-square; a hit exceeds what noise does in one record of ten thousand, and a twentieth of the
/// ringing. Misses that a few wrong blocks explain are a glitch's: the ringing goes on after them as it was.
/// # Cost
/// 500 operations per block and channel and fit.
pub(super) fn hits_into_ringing(
    channels: &[&[f64]],
    steps: &[f64],
    clipped: &[Vec<Range<usize>>],
    ringing: &Range<usize>,
    period: usize,
) -> Failures {
    let block = block_of(period);
    let count = ringing.len() / block;
    let mut found = Failures::default();
    let limit = chi_square_level(FALSE_ALARM / count.max(1) as f64, channels.len());
    let mut first = 0;
    loop {
        let blocks = first..(first + WINDOW_BLOCKS).min(count);
        // a quarter at either end belongs to the neighbours, but for the stretch's own ends
        let edge = WINDOW_BLOCKS / 4;
        let judged =
            if first == 0 { 0 } else { first + edge }..if blocks.end == count { count } else { blocks.end - edge };
        let window = ringing.start + blocks.start * block..ringing.start + blocks.end * block;
        let lane = |c: usize| Lane::of(channels[c], steps[c], &clipped[c], &window, block);
        let lanes: Vec<Lane> = (0..channels.len()).filter_map(lane).collect();
        for (b, hit) in failures(&lanes, limit) {
            let all = if hit { &mut found.hits } else { &mut found.glitches };
            let sample = window.start + b * block;
            let near = all.last().is_some_and(|last| sample - last.min(&sample) <= ONE_HIT_PERIODS * period);
            if judged.contains(&(blocks.start + b)) && !near {
                all.push(sample);
            }
        }
        if blocks.end == count {
            return found;
        }
        first += WINDOW_BLOCKS / 2;
    }
}

/// Blocks at which a hit or a glitch begins, ascending, and whether it is a hit.
fn failures(lanes: &[Lane], limit: f64) -> Vec<(usize, bool)> {
    let Some(first) = lanes.first() else { return Vec::new() };
    let squares = |b: usize| lanes.iter().filter_map(|lane| lane.over_scale(b)).map(|miss| miss * miss).sum::<f64>();
    let (mut all, mut b) = (Vec::new(), first.order);
    while b < first.means.len() {
        if squares(b) > limit {
            let reach = b..(b + first.order + GLITCH_BLOCKS).min(first.means.len());
            let least = |lane: &Lane| (LEAST_CHANGE * lane.rms_around(b)).max(lane.rounding);
            let large = lanes.iter().any(|lane| lane.largest(reach.clone()) > least(lane));
            if large {
                all.push((b, !is_glitch(lanes, reach.clone(), limit)));
            }
            // the misses of one event reach as far as the recurrence
            b = reach.end;
        } else {
            b += 1;
        }
    }
    all
}

/// Whether other values of the first blocks of `reach` explain what misses there.
fn is_glitch(lanes: &[Lane], reach: Range<usize>, limit: f64) -> bool {
    let freedom = reach.len().saturating_sub(GLITCH_BLOCKS).max(1) * lanes.len();
    let left: f64 = lanes.iter().map(|lane| lane.without_glitch(reach.clone())).sum();
    left < chi_square_level(FALSE_ALARM, freedom).max(limit)
}

/// A channel in a window.
struct Lane {
    means: Vec<f64>,
    order: usize,
    /// Of the blocks before, the nearest first, and of a constant.
    weights: Vec<f64>,
    /// What is not foretold; NaN where it cannot be.
    misses: Vec<f64>,
    /// Standard deviation of the misses around each block.
    scales: Vec<f64>,
    /// What rounding to codes misses at most.
    rounding: f64,
}

impl Lane {
    /// None where there is too little to fit.
    fn of(y: &[f64], step: f64, gaps: &[Range<usize>], window: &Range<usize>, block: usize) -> Option<Self> {
        let count = window.len() / block;
        let sample = |b: usize| window.start + b * block..window.start + (b + 1) * block;
        let level = y[window.clone()].iter().sum::<f64>() / window.len().max(1) as f64;
        let means: Vec<f64> =
            (0..count).map(|b| y[sample(b)].iter().map(|v| v - level).sum::<f64>() / block as f64).collect();
        let order = (count / EQUATIONS).min(MOST_ORDER);
        if order < 3 {
            return None;
        }
        let whole: Vec<bool> = (0..count).map(|b| !clipping::touches(gaps, sample(b))).collect();
        let usable = |b: usize| b >= order && whole[b - order..=b].iter().all(|whole| *whole);
        let mut rows: Vec<usize> = (0..count).filter(|&b| usable(b)).collect();
        let size = means.iter().fold(0.0_f64, |m, v| m.max(v.abs())).max(f64::MIN_POSITIVE);
        let mut lane =
            Self { means, order, weights: Vec::new(), misses: Vec::new(), scales: Vec::new(), rounding: 0.0 };
        for _ in 0..ROUNDS {
            if rows.len() < 3 * order {
                return None;
            }
            lane.fit(&rows, size)?;
            let miss = |b: usize| if usable(b) { lane.miss(b, size) } else { f64::NAN };
            lane.misses = (0..count).map(miss).collect();
            // a block's mean is rounded by a twelfth of a code squared, over its samples
            let gain = 1.0 + lane.weights[..order].iter().map(|w| w * w).sum::<f64>();
            let rounding_std = step * (gain / (12.0 * block as f64)).sqrt();
            lane.scales = scales(&lane.misses, order, rounding_std.max(1e-9 * size));
            lane.rounding = 0.5 * step * (1.0 + lane.weights[..order].iter().map(|w| w.abs()).sum::<f64>());
            // five standard deviations: noise loses none of a window
            rows = (0..count).filter(|&b| usable(b) && lane.misses[b].abs() < 5.0 * lane.scales[b]).collect();
        }
        Some(lane)
    }

    fn regressor(&self, b: usize, j: usize, size: f64) -> f64 {
        if j == self.order { size } else { self.means[b - 1 - j] }
    }

    fn fit(&mut self, rows: &[usize], size: f64) -> Option<()> {
        let width = self.order + 1;
        let mut gram = Mat::<f64>::zeros(width, width);
        let mut right = Mat::<f64>::zeros(width, 1);
        for &b in rows {
            for i in 0..width {
                let own = self.regressor(b, i, size);
                (0..=i).for_each(|j| gram[(i, j)] += own * self.regressor(b, j, size));
                right[(i, 0)] += own * self.means[b];
            }
        }
        let largest = (0..width).map(|i| gram[(i, i)]).fold(0.0, f64::max);
        for i in 0..width {
            // exponentials fewer than coefficients leave them undetermined
            gram[(i, i)] += 1e-12 * largest;
            (0..i).for_each(|j| gram[(j, i)] = gram[(i, j)]);
        }
        let solved = solve(gram, &right);
        self.weights = (0..width).map(|i| solved[(i, 0)]).collect();
        self.weights.iter().all(|w| w.is_finite()).then_some(())
    }

    fn miss(&self, b: usize, size: f64) -> f64 {
        self.means[b] - (0..=self.order).map(|j| self.regressor(b, j, size) * self.weights[j]).sum::<f64>()
    }

    fn over_scale(&self, b: usize) -> Option<f64> {
        self.misses.get(b).map(|miss| miss / self.scales[b]).filter(|miss| miss.is_finite())
    }

    fn largest(&self, blocks: Range<usize>) -> f64 {
        self.misses[blocks].iter().filter(|miss| miss.is_finite()).fold(0.0, |m, miss| m.max(miss.abs()))
    }

    fn rms_around(&self, b: usize) -> f64 {
        let around = &self.means[b.saturating_sub(BESIDE_BLOCKS)..(b + BESIDE_BLOCKS).min(self.means.len())];
        let mean = around.iter().sum::<f64>() / around.len() as f64;
        (around.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / around.len() as f64).sqrt()
    }

    /// Squares over their scale that the misses of `reach` have left where its first blocks may have any values.
    fn without_glitch(&self, reach: Range<usize>) -> f64 {
        let rows: Vec<usize> = reach.clone().filter(|&b| self.misses[b].is_finite()).collect();
        let wrong = GLITCH_BLOCKS.min(rows.len());
        // a block enters its own row with one, those that it foretells with minus its weight
        let effect = |b: usize, wrong: usize| match b.checked_sub(reach.start + wrong) {
            None => 0.0,
            Some(0) => 1.0,
            Some(since) => self.weights.get(since - 1).filter(|_| since <= self.order).map_or(0.0, |w| -w),
        };
        let scale = |b: usize| self.scales[b];
        let gram = Mat::from_fn(wrong, wrong, |i, j| {
            rows.iter().map(|&b| effect(b, i) * effect(b, j) / scale(b).powi(2)).sum::<f64>() + f64::MIN_POSITIVE
        });
        let right = Mat::from_fn(wrong, 1, |i, _| {
            rows.iter().map(|&b| effect(b, i) * self.misses[b] / scale(b).powi(2)).sum::<f64>()
        });
        let values = solve(gram, &right);
        let left = |b: usize| self.misses[b] - (0..wrong).map(|i| effect(b, i) * values[(i, 0)]).sum::<f64>();
        rows.iter().map(|&b| (left(b) / scale(b)).powi(2)).sum()
    }
}

/// Standard deviation of the misses around each block: the larger of the medians before it and behind the reach of what
/// happens at it; infinite where one of them is not known: what has hardly begun has not settled.
fn scales(misses: &[f64], order: usize, floor: f64) -> Vec<f64> {
    let n = misses.len();
    let of = |range: Range<usize>| {
        let mut sizes: Vec<f64> = misses[range].iter().map(|miss| miss.abs()).filter(|miss| miss.is_finite()).collect();
        (sizes.len() >= BESIDE_BLOCKS / 4).then(|| STD_OF_MEDIAN * median(&mut sizes))
    };
    // medians of windows every few blocks: they change slowly
    let stride = 8;
    let before: Vec<Option<f64>> = (0..n).step_by(stride).map(|b| of(b.saturating_sub(BESIDE_BLOCKS)..b)).collect();
    let after = |b: usize| of((b + 2 * order).min(n)..(b + 2 * order + BESIDE_BLOCKS).min(n));
    let after: Vec<Option<f64>> = (0..n).step_by(stride).map(after).collect();
    (0..n)
        .map(|b| match (before[b / stride], after[b / stride]) {
            (Some(before), Some(after)) => before.max(after).max(floor).max(f64::MIN_POSITIVE),
            _ => f64::INFINITY,
        })
        .collect()
}
