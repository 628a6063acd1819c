//! Free stretches: where the lever is out of contact and at rest.

use super::blocks::Blocks;
use super::error::CalibrationError;
use crate::statistics::{half_sample_mode, median};
use std::ops::Range;

/// How free stretches are recognised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeRule {
    /// Left out after the lever has come to rest as far as its variance shows, samples: lets the ringing fall below the
    /// thermal motion.
    pub settle_samples: usize,
    /// Left out before the stretch ends, samples.
    pub guard_samples: usize,
    /// Shorter stretches are dropped, samples.
    pub shortest_samples: usize,
}

/// The free level of a record and its free stretches.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeStretches {
    /// Deflection out of contact, V.
    pub level_v: f64,
    /// Blocks within this distance of the level count as free, V.
    pub tolerance_v: f64,
    /// Sample ranges, ascending.
    pub stretches: Vec<Range<usize>>,
}

/// Level tolerance in units of the spread of the block means about the free level, and its floor in units of the noise
/// within a block (a clean, quantised baseline has no spread).
const LEVEL_SPREADS: f64 = 8.0;
const LEVEL_NOISES: f64 = 1.0;
/// A block that rings has more than this times the variance of the quiet ones.
const RINGING_RATIO: f64 = 1.5;

/// Finds the free stretches of a record.
///
/// # Method
/// In contact the deflection ramps, so its block means spread; out of contact they pile up: the half-sample mode of the
/// means is the free level. The variance of the quiet is the median variance of the blocks next to the level. A block
/// is free where mean and variance agree with these; a run of free blocks that is long enough, less settling and guard,
/// is a stretch. Where the contact's ramp crosses the level it makes a run too short to count.
///
/// # Accuracy
/// Ends are good to one block; the ringing left after `settle_samples` is `exp(-settle pi f1 / Q1)` of a thermal
/// amplitude or so.
///
/// # Errors
/// Fewer than 16 blocks.
pub fn free_stretches(blocks: &Blocks, rule: FreeRule) -> Result<FreeStretches, CalibrationError> {
    const FEWEST: usize = 16;
    let too_short = CalibrationError::Length {
        what: "record (in blocks)",
        got: blocks.len(),
        wanted: format!("at least {FEWEST}"),
    };
    if blocks.len() < FEWEST {
        return Err(too_short);
    }
    let level_v = half_sample_mode(&blocks.mean_v).ok_or(too_short)?;
    // the tenth of the blocks that lies closest to the level is free wherever anything is
    let mut near: Vec<(f64, f64)> =
        blocks.mean_v.iter().zip(&blocks.variance_v2).map(|(m, v)| ((m - level_v).abs(), *v)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate((blocks.len() / 10).max(FEWEST / 2));
    let middle = |value: fn(&(f64, f64)) -> f64| median(&mut near.iter().map(value).collect::<Vec<f64>>());
    let or_none = |value: f64| if value.is_nan() { 0.0 } else { value };
    let spread_v = 1.4826 * or_none(middle(|n| n.0));
    let quiet_v2 = or_none(middle(|n| n.1));
    let tolerance_v = (LEVEL_SPREADS * spread_v).max(LEVEL_NOISES * quiet_v2.sqrt());
    let free = blocks
        .mean_v
        .iter()
        .zip(&blocks.variance_v2)
        .map(|(mean, variance)| (mean - level_v).abs() <= tolerance_v && *variance <= RINGING_RATIO * quiet_v2);
    let mut stretches = runs(free, 2);
    for run in &mut stretches {
        // a record that begins free has nothing to settle from
        let settle = if run.start == 0 { 0 } else { rule.settle_samples };
        let guard = if run.end == blocks.len() { 0 } else { rule.guard_samples };
        *run = run.start * blocks.length + settle..(run.end * blocks.length).saturating_sub(guard);
    }
    stretches.retain(|run| run.end > run.start && run.len() >= rule.shortest_samples.max(4 * blocks.length));
    Ok(FreeStretches { level_v, tolerance_v, stretches })
}

/// Runs of `true`, bridging up to `gap` single misses in a row.
fn runs(flags: impl Iterator<Item = bool>, gap: usize) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (i, _) in flags.enumerate().filter(|(_, flag)| *flag) {
        match runs.last_mut() {
            Some(run) if i <= run.end + gap => run.end = i + 1,
            _ => runs.push(i..i + 1),
        }
    }
    runs
}
