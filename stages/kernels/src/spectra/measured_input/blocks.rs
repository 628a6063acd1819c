//! Blocks of measured input and output, and what is done to them before the transform.

use crate::signal::hann;
use crate::spectra::SpectrumError;
use crate::spectra::error::finite;
use crate::statistics::{median, median_and_scale, without_slow, without_steps};

/// Inputs and outputs over the same samples.
#[derive(Debug, Clone)]
pub struct Block<'a> {
    /// One or several.
    pub inputs: Vec<&'a [f64]>,
    /// One or several.
    pub outputs: Vec<&'a [f64]>,
}

/// What blocks are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BlockKind {
    /// Each holds a hit and what rings after it.
    Hits {
        /// Samples on either side of an input's largest one beyond which it is set to zero; none leaves it as it is.
        force_window: Option<usize>,
        /// Inputs and outputs are multiplied by `exp(-d t)` with this `d`, in 1/s; 0 for nothing.
        added_decay_per_s: f64,
    },
    /// Segments of a long record, each overlapping the next by half; a Hann window is put on them.
    Segments,
    /// Whole periods of an input that repeats itself, the response settled: no window.
    Periods,
}

/// The sample in which the first hit begins: the force comes to the share `level` of its largest value about its median.
pub fn hit_begins(force: &[f64], level: f64) -> usize {
    let offset = median(&mut force.to_vec());
    let size = |value: &f64| (value - offset).abs();
    let largest = force.iter().map(size).fold(0.0, f64::max);
    force.iter().position(|value| size(value) >= level * largest).unwrap_or_default()
}

/// Which of several records hold a hit: their first input comes to the share `level` of the largest of all, each about its
/// median.
pub fn with_hits(records: &[Block<'_>], level: f64) -> Vec<bool> {
    let largest = |record: &Block<'_>| {
        let force = record.inputs.first().copied().unwrap_or_default();
        let offset = median(&mut force.to_vec());
        force.iter().map(|value| (value - offset).abs()).fold(0.0, f64::max)
    };
    let each: Vec<f64> = records.iter().map(largest).collect();
    let all = each.iter().copied().fold(0.0, f64::max);
    each.iter().map(|one| *one > 0.0 && *one >= level * all).collect()
}

/// Samples of a block that every one of several records has: up to the end where half of the records or more hold one hit,
/// else up to the next hit.
pub fn common_hit_samples(records: &[Block<'_>], before: usize, level: f64) -> Option<usize> {
    let forces = || records.iter().map(|record| record.inputs.first().copied().unwrap_or_default());
    let spacings: Vec<Option<usize>> = forces().map(|force| hit_spacing(force, before)).collect();
    let single = 2 * spacings.iter().filter(|spacing| spacing.is_none()).count() >= records.len();
    let samples = forces().zip(spacings).map(|(force, spacing)| {
        let to_the_end = || force.len() - hit_begins(force, level) + before;
        spacing.filter(|_| !single).unwrap_or_else(to_the_end).min(force.len())
    });
    samples.min()
}

/// Share of samples that are the same number from which an input was under a force window when it was recorded: less
/// than half the samples of a sensor's noise are the same code. Zeros may have been moved by an offset since.
const WINDOWED: f64 = 0.5;

/// A block's series, ready for the transform.
pub(super) struct Prepared {
    pub inputs: Vec<Vec<f64>>,
    pub outputs: Vec<Vec<f64>>,
    /// Whether all inputs were under a force window already.
    pub windowed_before: bool,
}

/// Samples that a block has at least.
pub(super) const LEAST_SAMPLES: usize = 8;

/// The segments of a record: as many samples each, every one beginning in the middle of that before.
///
/// # Errors
/// A length of less than eight samples, a record that is shorter, unequal series.
pub fn segments<'a>(record: &Block<'a>, samples: usize) -> Result<Vec<Block<'a>>, SpectrumError> {
    let whole = check(record)?;
    if samples < LEAST_SAMPLES || whole < samples {
        return Err(SpectrumError::TooShort { got: whole.min(samples), wanted: samples.max(LEAST_SAMPLES) });
    }
    let cut = |series: &[&'a [f64]], from: usize| series.iter().map(|x| &x[from..from + samples]).collect();
    let block = |from| Block { inputs: cut(&record.inputs, from), outputs: cut(&record.outputs, from) };
    Ok((0..=whole - samples).step_by(samples / 2).map(block).collect())
}

/// The hits in a record: of `samples` each, the first `before` of them before the first input comes to the share
/// `level` of its largest value; a hit within the samples of another is part of that. Those that the record cuts off
/// are left out.
///
/// # Errors
/// Fewer than eight samples, more than the record has, not more than `before`; unequal series.
pub fn hits<'a>(
    record: &Block<'a>,
    samples: usize,
    before: usize,
    level: f64,
) -> Result<Vec<Block<'a>>, SpectrumError> {
    let whole = check(record)?;
    if samples < LEAST_SAMPLES || samples <= before || whole < samples {
        return Err(SpectrumError::TooShort {
            got: whole.min(samples),
            wanted: samples.max(before + 1).max(LEAST_SAMPLES),
        });
    }
    let force = record.inputs.first().copied().unwrap_or_default();
    let offset = median(&mut force.to_vec());
    let largest = force.iter().map(|value| (value - offset).abs()).fold(0.0, f64::max);
    let (mut found, mut from) = (Vec::new(), 0);
    while let Some(rise) = (from..whole).find(|&k| largest > 0.0 && (force[k] - offset).abs() >= level * largest) {
        let end = rise + samples - before;
        if let Some(first) = rise.checked_sub(before).filter(|_| end <= whole) {
            let cut = |series: &[&'a [f64]]| series.iter().map(|x| &x[first..end]).collect();
            found.push(Block { inputs: cut(&record.inputs), outputs: cut(&record.outputs) });
        }
        from = end;
    }
    Ok(found)
}

/// Share of the largest force from which a pulse counts as a hit of its own: a hammer's bounce has less.
const OWN_HIT: f64 = 0.3;
/// Pulses that follow within this share of the usual distance are one hit.
const ONE_HIT: f64 = 0.05;

/// Samples between the hits of a force, the least; none where there is one hit. Pulses within `before` samples are one
/// hit. The record's end counts as a further hit, unless it comes sooner than half of that after the last one.
///
/// A bounce of more than 0.3 of the largest force, later than a twentieth of the upper quartile of the distances, is taken
/// for a hit.
pub fn hit_spacing(force: &[f64], before: usize) -> Option<usize> {
    let offset = median(&mut force.to_vec());
    let largest = force.iter().map(|value| (value - offset).abs()).fold(0.0, f64::max);
    let high: Vec<usize> =
        (0..force.len()).filter(|&k| largest > 0.0 && (force[k] - offset).abs() >= OWN_HIT * largest).collect();
    let within = before.max(LEAST_SAMPLES);
    let mut gaps: Vec<usize> = high.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > within).collect();
    gaps.sort_unstable();
    let usual = gaps.get(gaps.len() * 3 / 4)?;
    let apart = (ONE_HIT * *usual as f64).max(within as f64);
    let mut starts: Vec<usize> = high.first().copied().into_iter().collect();
    starts.extend(high.windows(2).filter(|pair| (pair[1] - pair[0]) as f64 > apart).map(|pair| pair[1]));
    let least = starts.windows(2).map(|pair| pair[1] - pair[0]).min()?;
    let rest = force.len() - starts.last()?;
    Some(if 2 * rest > least { least.min(rest) } else { least })
}

/// Share of the samples in which a hammer's force has half of its energy, at most.
const SHORT: f64 = 0.01;

/// Largest value over its noise that is a hammer's, whatever energy the noise has: no noise reaches it.
const OUT_OF_NOISE: f64 = 12.0;

/// Whether an input is a hammer's: half of its energy, less that of its noise, lies within a hundredth of its samples. What
/// wanders slower is left out, and a step to another level, which is no hit.
pub fn is_impulsive(input: &[f64]) -> bool {
    let few = |samples: usize| samples as f64 <= (SHORT * input.len() as f64).ceil();
    if few(half_energy_samples(input)) {
        return true;
    }
    is_short(without_slow(input), few) && is_short(without_steps(input), few)
}

/// Whether half of the energy of swings, less that of their noise, lies within few samples.
fn is_short(mut swings: Vec<f64>, few: impl Fn(usize) -> bool) -> bool {
    let (_, noise) = median_and_scale(&mut swings.clone());
    let largest = swings.iter().map(|y| y.abs()).fold(0.0, f64::max);
    if largest <= OUT_OF_NOISE * noise {
        return false;
    }
    swings.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
    let energies = || swings.iter().map(|y| y * y - noise * noise);
    let half = 0.5 * energies().sum::<f64>();
    let mut sum = 0.0;
    let enough = |energy: f64| {
        sum += energy;
        sum > half
    };
    energies().position(enough).is_some_and(|last| few(last + 1))
}

/// Share of the largest value, and standard deviations of the noise, beyond both of which a force is a hit's.
const OF_A_HIT: (f64, f64) = (0.1, 8.0);
/// Samples to either side that are a hit's own: a filter's answer.
const BESIDE_SAMPLES: usize = 8;

/// Energy of a force beside its hits, about its median, over that of its hits: noise and drift, which blocks divide by.
pub fn energy_beside_hits(force: &[f64]) -> f64 {
    let rest = median(&mut force.to_vec());
    let size = |k: &usize| (force[*k] - rest).abs();
    let swings = without_slow(force);
    let (_, noise) = median_and_scale(&mut swings.clone());
    let largest = swings.iter().map(|y| y.abs()).fold(0.0, f64::max);
    let level = (OF_A_HIT.0 * largest).max(OF_A_HIT.1 * noise);
    let mut hit = vec![false; force.len()];
    for k in (0..force.len()).filter(|&k| swings[k].abs() > level) {
        hit[k.saturating_sub(BESIDE_SAMPLES)..(k + BESIDE_SAMPLES + 1).min(force.len())].fill(true);
    }
    let energy = |inside: bool| (0..force.len()).filter(|k| hit[*k] == inside).map(|k| size(&k).powi(2)).sum::<f64>();
    energy(false) / energy(true).max(f64::MIN_POSITIVE)
}

/// How many of a signal's samples, the largest about its median, have half of its energy; all of a constant one.
pub fn half_energy_samples(signal: &[f64]) -> usize {
    let rest = median(&mut signal.to_vec());
    let mut squares: Vec<f64> = signal.iter().map(|value| (value - rest).powi(2)).collect();
    squares.sort_by(|a, b| b.total_cmp(a));
    let half = 0.5 * squares.iter().sum::<f64>();
    let mut sum = 0.0;
    let enough = |square: &f64| {
        sum += square;
        sum > half
    };
    squares.iter().position(enough).map_or(signal.len(), |last| last + 1)
}

/// The length of all series. Errors: unequal, none, not finite.
pub(super) fn check(block: &Block<'_>) -> Result<usize, SpectrumError> {
    let samples = block.inputs.first().map_or(0, |input| input.len());
    let wanted = samples.max(LEAST_SAMPLES);
    if samples < LEAST_SAMPLES || block.outputs.is_empty() {
        return Err(SpectrumError::TooShort { got: samples, wanted });
    }
    for (name, series) in [("an input", &block.inputs), ("an output", &block.outputs)] {
        for values in series {
            if values.len() != samples {
                return Err(SpectrumError::Lengths { name, got: values.len(), wanted: samples });
            }
            finite(name, values)?;
        }
    }
    Ok(samples)
}

impl Prepared {
    /// Offsets removed, windows put on.
    pub fn of(block: &Block<'_>, kind: BlockKind, sample_rate_hz: f64) -> Self {
        let windowed_before = block.inputs.iter().all(|input| is_windowed(input));
        let prepare = |values: &[f64], is_input: bool| match kind {
            BlockKind::Segments => without_mean(values),
            BlockKind::Periods => {
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                values.iter().map(|value| value - mean).collect()
            }
            BlockKind::Hits { force_window, added_decay_per_s } => {
                let offset = median(&mut values.to_vec());
                let mut values: Vec<f64> = values.iter().map(|value| value - offset).collect();
                if let Some(reach) = force_window.filter(|_| is_input) {
                    clear_beyond(&mut values, reach);
                }
                let decay = |k: usize| (-added_decay_per_s * k as f64 / sample_rate_hz).exp();
                values.iter().enumerate().map(|(k, value)| value * decay(k)).collect()
            }
        };
        let all = |series: &[&[f64]], is_input| series.iter().map(|values| prepare(values, is_input)).collect();
        Self { inputs: all(&block.inputs, true), outputs: all(&block.outputs, false), windowed_before }
    }
}

fn is_windowed(input: &[f64]) -> bool {
    let rest = median(&mut input.to_vec());
    let resting = input.iter().filter(|value| **value == rest).count();
    resting as f64 >= WINDOWED * input.len() as f64 && resting < input.len()
}

/// A segment without its mean, under a Hann window.
fn without_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().zip(hann(values.len(), 0.0)).map(|(value, window)| (value - mean) * window).collect()
}

/// Zero but for `reach` samples on either side of the largest one.
fn clear_beyond(values: &mut [f64], reach: usize) {
    let peak = (0..values.len()).max_by(|&a, &b| values[a].abs().total_cmp(&values[b].abs())).unwrap_or(0);
    let (first, end) = (peak.saturating_sub(reach), (peak + reach + 1).min(values.len()));
    values[..first].fill(0.0);
    values[end..].fill(0.0);
}
