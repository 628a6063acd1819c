//! The contact slope: deflection against piezo while the tip is held.

use super::blocks::Blocks;
use super::error::CalibrationError;
use super::free_stretches::FreeStretches;
use crate::statistics::half_sample_mode;

/// One straight stretch in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopeStretch {
    /// First and last sample.
    pub start_sample: usize,
    /// One past the last sample.
    pub end_sample: usize,
    /// Towards the sample (piezo falling) or away.
    pub approach: bool,
    /// Slope of deflection against piezo, V/V; negative in the usual polarity.
    pub slope_v_per_v: f64,
    /// Piezo travel of the stretch, V.
    pub travel_v: f64,
    /// Root mean square distance of the block means from the line, V.
    pub residual_v: f64,
}

/// The slope over an archive.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSlope {
    /// Weighted mean over all stretches, V/V.
    pub slope_v_per_v: f64,
    /// Its standard error, from the scatter of the stretches.
    pub slope_std_v_per_v: f64,
    /// Mean over approach stretches, V/V; `None` without any.
    pub approach_v_per_v: Option<f64>,
    /// Mean over retract stretches, V/V; `None` without any.
    pub retract_v_per_v: Option<f64>,
    /// (approach - retract) / mean, and its standard error; `None` where either is missing or single.
    pub hysteresis: Option<(f64, f64)>,
}

/// Blocks over which a local slope is taken.
const WINDOW: usize = 16;
/// Local slopes within this share of the contact's are contact.
const SAME_SLOPE: f64 = 0.15;
/// Share of a stretch that is left out at either end: creep and rounding at the turning point, ringing at the events.
const TRIM: f64 = 0.06;

/// The straight contact stretches of one record.
///
/// # Method
/// A local slope of deflection against piezo in a sliding window of 16 blocks; among blocks that are not free the
/// half-sample mode of the slopes is the contact's. Runs of blocks whose local slope lies within 15 % of it are cut at
/// the piezo's turning point and trimmed by 6 % (at least a window) at either end; each is fitted by a line.
///
/// # Errors
/// No piezo channel. A record without contact gives an empty list.
pub fn contact_stretches(blocks: &Blocks, free: &FreeStretches) -> Result<Vec<SlopeStretch>, CalibrationError> {
    if blocks.piezo_v.len() != blocks.len() {
        return Err(CalibrationError::Length {
            what: "piezo channel (in blocks)",
            got: blocks.piezo_v.len(),
            wanted: format!("{}, as the deflection", blocks.len()),
        });
    }
    let slopes = local_slopes(blocks);
    let mut is_free = vec![false; blocks.len()];
    for run in &free.stretches {
        for flag in is_free.iter_mut().take(run.end / blocks.length).skip(run.start / blocks.length) {
            *flag = true;
        }
    }
    let held: Vec<f64> = slopes.iter().zip(&is_free).filter(|(_, free)| !**free).map(|(s, _)| *s).collect();
    let Some(contact) = half_sample_mode(&held) else { return Ok(Vec::new()) };
    let same = |i: usize| slopes.get(i).is_some_and(|s| (s / contact - 1.0).abs() < SAME_SLOPE);
    let rising = |i: usize| blocks.piezo_v.get(i + 1).unwrap_or(&f64::NAN) > blocks.piezo_v.get(i).unwrap_or(&f64::NAN);
    let mut stretches = Vec::new();
    let mut start = 0;
    for i in 0..=blocks.len() {
        let goes_on =
            i < blocks.len() && same(i) && (i == start || i + 1 == blocks.len() || rising(i) == rising(start));
        if goes_on {
            continue;
        }
        let trim = ((TRIM * (i - start) as f64).ceil() as usize).max(WINDOW / 2);
        if i > start + 2 * trim + WINDOW {
            stretches.extend(fit(blocks, start + trim, i - trim));
        }
        start = if i < blocks.len() && same(i) { i } else { i + 1 };
    }
    Ok(stretches)
}

fn local_slopes(blocks: &Blocks) -> Vec<f64> {
    let half = WINDOW / 2;
    (0..blocks.len())
        .map(|i| {
            if i < half || i + half > blocks.len() {
                return f64::NAN;
            }
            let window = i - half..i + half;
            line(&blocks.piezo_v[window.clone()], &blocks.mean_v[window]).map_or(f64::NAN, |line| line.slope)
        })
        .collect()
}

fn fit(blocks: &Blocks, start: usize, end: usize) -> Option<SlopeStretch> {
    let (piezo, mean) = (blocks.piezo_v.get(start..end)?, blocks.mean_v.get(start..end)?);
    let line = line(piezo, mean)?;
    let travel = piezo.last()? - piezo.first()?;
    Some(SlopeStretch {
        start_sample: start * blocks.length,
        end_sample: end * blocks.length,
        approach: travel < 0.0,
        slope_v_per_v: line.slope,
        travel_v: travel.abs(),
        residual_v: line.residual,
    })
}

struct Line {
    slope: f64,
    residual: f64,
}

/// Least-squares line; `None` where `x` does not move.
fn line(x: &[f64], y: &[f64]) -> Option<Line> {
    let n = x.len() as f64;
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sxx: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
    let sxy: f64 = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let slope = sxy / sxx;
    let square: f64 = x.iter().zip(y).map(|(x, y)| (y - mean_y - slope * (x - mean_x)).powi(2)).sum();
    slope.is_finite().then(|| Line { slope, residual: (square / n).sqrt() })
}

/// The slope of all stretches of an archive.
///
/// # Method
/// Mean weighted by travel squared (the wander of the baseline, not white noise, limits a slope); its error from
/// the weighted scatter, which needs no noise model.
///
/// # Errors
/// Fewer than two stretches.
pub fn contact_slope(stretches: &[SlopeStretch]) -> Result<ContactSlope, CalibrationError> {
    const HINT: &str =
        "the contact part must be longer than 32 blocks: lower block_samples, or check the piezo channel";
    let (slope, std) = weighted_mean(stretches.iter()).ok_or(CalibrationError::TooLittle {
        what: "straight contact stretches",
        found: stretches.len(),
        wanted: 2,
        hint: HINT,
    })?;
    let approach = weighted_mean(stretches.iter().filter(|s| s.approach));
    let retract = weighted_mean(stretches.iter().filter(|s| !s.approach));
    let hysteresis = approach.zip(retract).map(|(a, r)| ((a.0 - r.0) / slope, a.1.hypot(r.1) / slope.abs()));
    Ok(ContactSlope {
        slope_v_per_v: slope,
        slope_std_v_per_v: std,
        approach_v_per_v: approach.map(|a| a.0),
        retract_v_per_v: retract.map(|r| r.0),
        hysteresis,
    })
}

fn weighted_mean<'a>(stretches: impl Iterator<Item = &'a SlopeStretch> + Clone) -> Option<(f64, f64)> {
    let weight = |s: &SlopeStretch| s.travel_v * s.travel_v;
    let count = stretches.clone().count();
    if count < 2 {
        return None;
    }
    let total: f64 = stretches.clone().map(weight).sum();
    let mean = stretches.clone().map(|s| weight(s) * s.slope_v_per_v).sum::<f64>() / total;
    let square: f64 = stretches.map(|s| (weight(s) / total * (s.slope_v_per_v - mean)).powi(2)).sum();
    Some((mean, (square * count as f64 / (count - 1) as f64).sqrt()))
}
