//! Candidate events of one record, from its block means.

use super::despike::despike;
use super::kind::EventKind;
use super::level_change::{LevelChange, jump_and_slope, level_change};
use crate::statistics::median_and_scale;

/// How sensitive the detection is. Lengths in blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectionSettings {
    /// Blocks on either side that the level is taken from.
    pub level_blocks: usize,
    /// How many robust standard deviations a step and a jump of level must exceed.
    pub significance: f64,
    /// Standard deviation of one sample's rounding, in the channel's unit: a floor under the noise.
    pub rounding_std: f64,
    /// Samples in a block.
    pub block_samples: usize,
}

/// An event as the block means show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Its block; the onset lies within two blocks of it.
    pub block: usize,
    /// What it is.
    pub kind: EventKind,
    /// Change of level, in the channel's unit.
    pub jump: f64,
}

/// Why a sudden step was not taken for an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dismissal {
    /// The level is the same before and after: a spike, a click, a ringing.
    NoLevelChange,
    /// A downward jump that no contact ramp follows.
    NoContact,
    /// Too near to an end of the record (or to another step) to see a level on both sides.
    Unjudged,
}

/// A sudden step that was not taken for an event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dismissed {
    /// Its block.
    pub block: usize,
    /// Why.
    pub reason: Dismissal,
    /// Change of level; the height of the step where the level could not be seen.
    pub jump: f64,
}

/// What a record holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Detection {
    /// Events in order of time.
    pub events: Vec<Candidate>,
    /// Sudden steps that are none.
    pub dismissed: Vec<Dismissed>,
    /// Robust standard deviation of steps between blocks, in the channel's unit.
    pub step_noise: f64,
    /// Robust standard deviation of jumps of level where nothing happens, in the channel's unit.
    pub jump_noise: f64,
}

/// How much a step must outgrow what came before, to be a new one and not a ringing.
const REGROWTH: f64 = 2.5;
/// Blocks over which a ringing's height is remembered.
const MEMORY_BLOCKS: usize = 64;
/// Blocks that belong to the rise of one edge.
const RISE_BLOCKS: usize = 8;

/// Finds snap-off and snap-to-contact events in the block means of one record.
///
/// # Model
/// The deflection is piecewise straight, with hum, 1/f drift and noise; an event is a sudden change of level (a kink of
/// the piezo triangle changes the slope alone, a spike neither, a ringing only follows).
/// # Method
/// Spikes of one or two blocks are bridged. Then:
/// 1. Steps `b[k+1] - b[k-1]`, less the local slope, that exceed `significance` times their median absolute deviation
///    in this record; of a ringing only the first.
/// 2. At each of them lines fitted before and after give the jump of level. It must exceed `significance` times its own
///    scale over the record (so hum and drift raise the bar by what they do), the jump that the change of slope could
///    feign, and 0.7 times the ringing (a released oscillator rings with at most 0.71 rms of its step).
/// 3. Up is a snap-off; down, and followed by a rising slope, a snap-to-contact.
///
/// All thresholds are relative to the record: nothing is tuned to volts.
/// # Units
/// `means` in the channel's unit, positions in blocks.
/// # Accuracy
/// Finds jumps of 10 robust standard deviations of a block mean's step; the onset within two blocks.
/// Cost: linear in the number of blocks.
pub fn detect(means: &[f32], settings: &DetectionSettings) -> Detection {
    if means.len() < 3 {
        return Detection::default();
    }
    let mut steps = compensated_steps(means);
    let step_noise = step_noise(&steps, settings);
    let threshold = settings.significance * step_noise;
    let mut bridged = means.to_vec();
    if !despike(&mut bridged, threshold).is_empty() {
        steps = compensated_steps(&bridged);
    }
    let means = &bridged[..];
    let nulls = null_scales(means, settings, step_noise);
    let edges = edges(&steps, threshold);
    let mut detection = Detection { step_noise, jump_noise: nulls.jump, ..Detection::default() };
    for (index, &block) in edges.iter().enumerate() {
        let low = if index == 0 { 0 } else { edges[index - 1] + 2 };
        let high = edges.get(index + 1).map_or(means.len(), |&next| next.saturating_sub(1));
        match level_change(means, block, settings.level_blocks, low, high) {
            None => detection.dismissed.push(Dismissed { block, reason: Dismissal::Unjudged, jump: steps[block] }),
            Some(change) => match judge(&change, &nulls, settings.significance) {
                Ok(kind) => detection.events.push(Candidate { block, kind, jump: change.jump }),
                Err(reason) => detection.dismissed.push(Dismissed { block, reason, jump: change.jump }),
            },
        }
    }
    detection
}

fn judge(change: &LevelChange, nulls: &NullScales, significance: f64) -> Result<EventKind, Dismissal> {
    // the edge is known to two blocks: a kink there feigns a jump of twice the change of slope
    let kink = 4.0 * change.slope_change.abs();
    if change.jump.abs() < (significance * nulls.jump).max(kink).max(0.7 * change.ringing_rms) {
        return Err(Dismissal::NoLevelChange);
    }
    if change.jump > 0.0 {
        return Ok(EventKind::SnapOff);
    }
    // a probable sign is enough here: the jump itself is already beyond doubt
    if change.late_slope_change > 3.0 * nulls.slope { Ok(EventKind::SnapIn) } else { Err(Dismissal::NoContact) }
}

/// Step round each block, `b[k+1] - b[k-1]`, less twice the mean slope of the `MEMORY_BLOCKS` before.
fn compensated_steps(means: &[f32]) -> Vec<f64> {
    const BEFORE: usize = MEMORY_BLOCKS + 4;
    let mut steps = Vec::with_capacity(means.len());
    steps.push(0.0);
    let uncompensated = means.windows(3).take(BEFORE - 1);
    steps.extend(uncompensated.map(|around| f64::from(around[2]) - f64::from(around[0])));
    // the sum of the steps before telescopes
    steps.extend(means.windows(BEFORE + 2).map(|around| {
        let at = |k: usize| f64::from(around[k]);
        let slope = (at(BEFORE - 3) + at(BEFORE - 4) - at(1) - at(0)) / (MEMORY_BLOCKS as f64);
        at(BEFORE + 1) - at(BEFORE - 1) - slope
    }));
    steps.resize(means.len(), 0.0);
    steps
}

/// Robust standard deviation of the steps, at least that of rounding (the codes', and the single precision of the
/// means).
fn step_noise(steps: &[f64], settings: &DetectionSettings) -> f64 {
    let stride = (steps.len() / (1 << 14)).max(1);
    let mut some: Vec<f64> = steps.iter().copied().step_by(stride).collect();
    let floor = settings.rounding_std * (2.0 / settings.block_samples as f64).sqrt();
    let largest = steps.iter().fold(0.0f64, |largest, step| largest.max(step.abs()));
    let (_, scale) = median_and_scale(&mut some);
    scale.max(floor).max(1e-6 * largest)
}

/// How jumps and changes of slope scatter where nothing happens.
struct NullScales {
    jump: f64,
    slope: f64,
}

fn null_scales(means: &[f32], settings: &DetectionSettings, step_noise: f64) -> NullScales {
    let span = settings.level_blocks.max(2);
    let (mut jumps, mut slopes) = (Vec::new(), Vec::new());
    // some 500 positions give the scale to 4 %
    for block in (span..means.len()).step_by((means.len() / 512).max(span / 2).max(1)) {
        if let Some((jump, slope)) = jump_and_slope(means, block, span) {
            jumps.push(jump);
            slopes.push(slope);
        }
    }
    let n = span as f64;
    // white noise: variance 4 / n of a line's end, 12 / n^3 of its slope, twice for two lines; a step has twice a
    // block's variance
    let (white_jump, white_slope) = (step_noise * (4.0 / n).sqrt(), step_noise * (12.0 / n.powi(3)).sqrt());
    let scale = |values: &mut [f64]| if values.len() < 8 { 0.0 } else { median_and_scale(values).1 };
    NullScales { jump: scale(&mut jumps).max(white_jump), slope: scale(&mut slopes).max(white_slope) }
}

/// Blocks where a step begins: beyond the threshold, and well beyond every other such step in the memory.
fn edges(steps: &[f64], threshold: f64) -> Vec<usize> {
    let mut edges = Vec::new();
    // steps beyond the threshold, as (block, height); older than the memory dropped from the front
    let mut recent: std::collections::VecDeque<(usize, f64)> = std::collections::VecDeque::new();
    let mut last_edge: Option<usize> = None;
    for (block, step) in steps.iter().enumerate() {
        let height = step.abs();
        // NaN-safe: a NaN is no step
        if height <= threshold || height.is_nan() {
            continue;
        }
        while recent.front().is_some_and(|&(old, _)| old + MEMORY_BLOCKS < block) {
            recent.pop_front();
        }
        let rising = last_edge.is_some_and(|edge| block < edge + RISE_BLOCKS);
        let outgrows = recent.back().is_none_or(|_| recent.iter().all(|&(_, old)| height > REGROWTH * old));
        if outgrows && !rising {
            edges.push(block);
            last_edge = Some(block);
        }
        recent.push_back((block, height));
    }
    edges
}

#[cfg(test)]
#[path = "detection_tests.rs"]
mod tests;
