//! Ends of a drive: in its own channel, or where a steady response begins to die.

use std::ops::Range;

use super::envelope::Envelope;
use crate::statistics::{median, median_and_scale, without_slow};

/// Share of the largest energy from which on a stretch is driven.
const DRIVEN: f64 = 0.5;
/// Least periods of a driven stretch.
const LEAST_PERIODS: usize = 8;
/// Share of the plateau's energy down to which its last samples still belong to it.
const PLATEAU: f64 = 0.8;

/// Share of the largest swing beyond which a drive acts.
const ACTS: f64 = 0.1;
/// The same of a weak hit, and standard deviations of the force's noise.
const WEAK: (f64, f64) = (0.01, 8.0);

/// Stretches of a drive: from the first to the last sample beyond a tenth of its largest swing before it rests for two
/// periods.
fn driven_stretches(drive: &[f64], period: usize) -> Vec<Range<usize>> {
    let rest = median(&mut drive[drive.len() - drive.len() / 16 - 1..].to_vec());
    let swings: Vec<f64> = drive.iter().map(|y| y - rest).collect();
    let largest = swings.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    beyond(&swings, ACTS * largest, period)
}

/// Hits of a force, ascending: pulses beyond a tenth of the largest one; weaker ones, beyond its noise, that the response
/// rises at.
///
/// `rises`: samples at which the response rises. What wanders slower than a pulse is no force.
pub(super) fn hits_of_force(force: &[f64], rises: &[usize], period: usize) -> Vec<Range<usize>> {
    let swings = without_slow(force);
    let largest = swings.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    let (_, noise) = median_and_scale(&mut swings.clone());
    let certain = WEAK.1 * noise;
    let mut hits = beyond(&swings, (ACTS * largest).max(certain), period);
    let far = |hit: &Range<usize>, strong: &Range<usize>| {
        hit.start > strong.end + 2 * period || strong.start > hit.end + 2 * period
    };
    let answered = |hit: &Range<usize>| rises.iter().any(|rise| rise.abs_diff(hit.start) <= period);
    let mut weak = beyond(&swings, (WEAK.0 * largest).max(certain), period);
    weak.retain(|hit| answered(hit) && hits.iter().all(|strong| far(hit, strong)));
    hits.extend(weak);
    hits.sort_by_key(|hit| hit.start);
    hits
}

/// From the first to the last sample beyond a level before two periods of rest.
fn beyond(swings: &[f64], level: f64, period: usize) -> Vec<Range<usize>> {
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for k in (0..swings.len()).filter(|&k| swings[k].abs() > level) {
        match stretches.last_mut() {
            Some(last) if k < last.end + 2 * period => last.end = k + 1,
            _ => stretches.push(k..k + 1),
        }
    }
    stretches
}

/// The sample after each stretch of a drive that is followed by two periods of rest.
pub(super) fn ends_of_drive(drive: &[f64], period: usize) -> Vec<usize> {
    let rests = |end: &usize| end + 2 * period < drive.len();
    driven_stretches(drive, period).into_iter().map(|stretch| stretch.end).filter(rests).collect()
}

/// Samples where a steady response begins to die.
///
/// # Method
/// Stretches of eight periods and more with half of the record's largest energy; of each the last sample with 80 % of
/// its median energy over a period. Late by up to a period, never early: the decay is free there.
pub(super) fn ends_of_response(envelope: &Envelope) -> Vec<usize> {
    let (samples, period) = (envelope.samples(), envelope.period);
    let energy: Vec<f64> =
        (0..samples).map(|k| envelope.mean(k.saturating_sub(period / 2), k + period / 2 + 1)).collect();
    let level = DRIVEN * plateau(&energy);
    let mut ends = Vec::new();
    let mut first = None;
    for k in 0..=samples {
        let driven = energy.get(k).is_some_and(|e| *e >= level);
        match first {
            None if driven => first = Some(k),
            Some(begin) if !driven => {
                first = None;
                if k - begin >= LEAST_PERIODS * period && k < samples {
                    let own = median(&mut energy[begin..k].to_vec());
                    let last = (begin..k).rev().find(|&k| energy[k] >= PLATEAU * own).unwrap_or(k);
                    ends.push((last + period / 2 + 1).min(samples));
                }
            }
            _ => {}
        }
    }
    ends
}

/// Median energy of the samples above half the largest: a single spike is no plateau.
fn plateau(energy: &[f64]) -> f64 {
    let most = energy.iter().copied().fold(0.0, f64::max);
    let mut upper: Vec<f64> = energy.iter().copied().filter(|e| *e > DRIVEN * most).collect();
    median(&mut upper)
}

/// Segments of the record at most in which a bend is sought.
const SEGMENTS: usize = 256;
/// Squares that a straight line leaves over those that a bend leaves, at least. Why: what bends by chance gains a few per
/// cent; a beat's top gains more and is no steady stretch.
const BENDS: f64 = 4.0;
/// Fall of the logarithm of the energy in which a decline is straight: a neper of the amplitude.
const FIRST_FALL: f64 = 2.0;

/// Where a level amplitude bends into a decline: a drive that ended, though the response is still strong at the end of the
/// record.
///
/// # Method
/// Of the logarithm of the energy in segments of whole periods, least squares of a level up to a segment and a straight
/// decline from there on, for each segment; none where a straight line leaves less than four times as much. A decline is
/// straight at first alone: the bend is sought once more in what precedes a fall by a neper. Late by a segment: what is
/// forced is no decay.
pub(super) fn bend(envelope: &Envelope, range: Range<usize>) -> Option<usize> {
    // whole periods: a part of one has another energy
    let length = envelope.period * (range.len() / SEGMENTS / envelope.period + 1);
    let count = range.len() / length;
    let energy = |i: usize| envelope.mean(range.start + i * length, range.start + (i + 1) * length) - 1.0;
    let logs: Vec<f64> = (0..count).map(|i| energy(i).max(f64::MIN_POSITIVE).ln()).collect();
    let (line, _) = left(&logs, |i| i as f64);
    let (from, squares, slope) = corner(&logs)?;
    if slope >= 0.0 || BENDS * squares >= line {
        return None;
    }
    let level = median(&mut logs[..from].to_vec());
    let first = (from..count).find(|&i| logs[i] < level - FIRST_FALL).unwrap_or(count);
    let from = corner(&logs[..first]).map_or(from, |(from, ..)| from);
    Some(range.start + (from + 1) * length)
}

/// The value from which on a level declines in a straight line, the squares that are left and the slope.
fn corner(logs: &[f64]) -> Option<(usize, f64, f64)> {
    let from = |from: usize| (from, left(logs, |i| i.saturating_sub(from) as f64));
    let all = (LEAST_PERIODS..logs.len().saturating_sub(2)).map(from);
    all.min_by(|a, b| a.1.0.total_cmp(&b.1.0)).map(|(from, (squares, slope))| (from, squares, slope))
}

/// Squares that a level and a multiple of `column` leave, and the multiple.
fn left(values: &[f64], column: impl Fn(usize) -> f64) -> (f64, f64) {
    let n = values.len() as f64;
    let [mean, centre] = [values.iter().sum::<f64>() / n, (0..values.len()).map(&column).sum::<f64>() / n];
    let (mut own, mut cross, mut all) = (0.0, 0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let (x, y) = (column(i) - centre, value - mean);
        own += x * x;
        cross += x * y;
        all += y * y;
    }
    let slope = if own > 0.0 { cross / own } else { 0.0 };
    (all - slope * cross, slope)
}
