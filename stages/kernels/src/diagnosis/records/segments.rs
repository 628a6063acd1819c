//! Free and loaded stretches of a record, from its events.

use super::basis::{polynomials, span};
use super::points::Points;
use super::summary::RecordEvent;
use crate::events::EventKind;
use crate::statistics::median;

/// What a stretch is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SegmentKind {
    /// Free, and not after a rupture: nothing rings.
    Approach,
    /// In contact.
    Contact,
    /// Free, after a rupture whose ringing has gone.
    Retract,
}

/// A stretch over which the piezo moves one way, as block means.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// What it is.
    pub kind: SegmentKind,
    /// Number of its first block in the record.
    pub first: usize,
    /// Deflection, V.
    pub values: Vec<f64>,
    /// Deflection summed up from the record's beginning to the middle of the block, V times blocks: what a coupling
    /// capacitor has taken up.
    pub sums: Vec<f64>,
    /// Piezo position, m, smoothed by a polynomial in time: its noise would enter through the contact's steep slope.
    pub piezo: Option<Vec<f64>>,
}

/// Shorter stretches are dropped, blocks.
const SHORTEST: usize = 12;
/// Blocks left out next to an event: its place is known to the block, and its edge may lie in the next.
const GUARD: usize = 2;
/// Degree of the polynomial that smooths a piezo's monotone travel: a half period of a sine to 1e-4 of its height.
const PIEZO_DEGREE: usize = 5;

/// A stretch of blocks, `[start, end)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    pub kind: SegmentKind,
    pub start: usize,
    pub end: usize,
}

/// The stretches of a record. Between two ruptures (or the record's start and one) without a snap-in in between, the
/// contact is taken to begin where two straight lines fit best.
pub(super) fn stretches(points: &Points, events: &[RecordEvent]) -> Vec<Stretch> {
    let mut marks: Vec<(usize, EventKind)> =
        events.iter().map(|event| (event.sample / points.step, event.kind)).collect();
    marks.sort_by_key(|&(block, _)| block);
    let total = points.values.len();
    let mut found = Vec::new();
    let mut left = None;
    for right in marks.iter().copied().map(Some).chain([None]) {
        let start = left.map_or(0, |(block, kind)| settled(points, block, kind, right.map_or(total, |(b, _)| b)));
        let end = right.map_or(total, |(block, _)| block.saturating_sub(GUARD)).min(total);
        between(points, left, right, start..end, &mut found);
        left = right;
    }
    let turned = found.into_iter().flat_map(|stretch| split(points, stretch));
    turned.filter(|stretch| stretch.end >= stretch.start + SHORTEST).collect()
}

fn between(
    points: &Points,
    left: Option<(usize, EventKind)>,
    right: Option<(usize, EventKind)>,
    range: std::ops::Range<usize>,
    found: &mut Vec<Stretch>,
) {
    use EventKind::{SnapIn, SnapOff};
    let free = if left.is_some() { SegmentKind::Retract } else { SegmentKind::Approach };
    let mut add = |kind, start: usize, end: usize| found.push(Stretch { kind, start, end });
    match (left.map(|l| l.1), right.map(|r| r.1)) {
        (Some(SnapIn), Some(SnapOff)) => add(SegmentKind::Contact, range.start, range.end),
        (None | Some(SnapOff), Some(SnapIn)) => add(free, range.start, range.end),
        (None | Some(SnapOff), Some(SnapOff)) => {
            if let Some(onset) = contact_onset(&points.values, range.clone()) {
                let before = range.start..onset.saturating_sub(GUARD);
                // a record that begins in contact bends where the piezo turns
                if left.is_some() || is_level(&points.values, &before, &(onset..range.end)) {
                    add(free, before.start, before.end);
                }
                let start = settled(points, onset + 1, SnapIn, range.end);
                add(SegmentKind::Contact, start, range.end);
            }
        }
        (Some(SnapOff), None) => {
            let loaded = left.map_or(0.0, |(block, _)| steepness(&points.values, block));
            // a further contact, without rupture, climbs as steeply as the last one fell, however late it begins
            match contact_onset(&points.values, range.clone()) {
                Some(onset) if climb(&points.values, onset, range.end) > LEVEL * loaded => {
                    add(free, range.start, onset.saturating_sub(GUARD));
                }
                _ => add(free, range.start, range.end),
            }
        }
        // without events nothing tells free from loaded; a contact that never ruptures, or two snap-ins in a row, is
        // not judged
        _ => {}
    }
}

/// Rise of a free stretch, of the mean rise in contact: a hundred times what a free lever does, a third of what one in
/// contact does near a turn.
const LEVEL: f64 = 0.1;

/// Whether a stretch is level beside a contact.
fn is_level(values: &[f64], stretch: &std::ops::Range<usize>, contact: &std::ops::Range<usize>) -> bool {
    let part = |range: &std::ops::Range<usize>| values.get(range.clone()).unwrap_or(&[]);
    let (free, loaded) = (part(stretch), span(part(contact)));
    let third = free.len() / 3;
    if third == 0 {
        return false;
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let rise = (mean(&free[free.len() - third..]) - mean(&free[..third])).abs() / (free.len() - third) as f64;
    rise < LEVEL * (loaded.1 - loaded.0) / contact.len().max(1) as f64
}

/// Blocks before a rupture that show how steeply a lever in contact moves.
const LOADED: usize = 8;

/// Change from block to block before a rupture, V; infinite where the record begins with it.
fn steepness(values: &[f64], rupture: usize) -> f64 {
    let last = rupture.saturating_sub(GUARD);
    let first = last.saturating_sub(LOADED);
    match (values.get(first), values.get(last)) {
        (Some(begin), Some(end)) if last > first => (end - begin).abs() / (last - first) as f64,
        _ => f64::INFINITY,
    }
}

/// Rise from block to block from the onset of a contact to its highest block, V.
fn climb(values: &[f64], onset: usize, end: usize) -> f64 {
    let stretch = values.get(onset..end).unwrap_or(&[]);
    let peak = (0..stretch.len()).max_by(|&a, &b| stretch[a].total_cmp(&stretch[b])).unwrap_or(0);
    if peak == 0 { 0.0 } else { (stretch[peak] - stretch[0]) / peak as f64 }
}

/// First block after an event at `block` where its ringing has gone.
///
/// The variance within the blocks, less that of the slope which the blocks' means show (a coupling capacitor's droop is
/// steep), shows the ringing until it falls to 1.5 times that of the quiet; as much time again takes it as far below
/// the noise as it stood above.
fn settled(points: &Points, block: usize, kind: EventKind, end: usize) -> usize {
    let first = block + if kind == EventKind::SnapOff { 1 } else { GUARD };
    if end <= first + 8 {
        return end;
    }
    let slope = |k: usize| {
        let (before, after) = (k.max(first + 1) - 1, (k + 1).min(end - 1));
        (points.values[after] - points.values[before]) / (after - before) as f64
    };
    let ringing: Vec<f64> = (first..end).map(|k| points.variances[k] - slope(k).powi(2) / 12.0).collect();
    let mut quiet = ringing[(end - first) / 2..].to_vec();
    let bar = 1.5 * median(&mut quiet);
    let still = ringing.windows(4).position(|window| window.iter().all(|v| *v <= bar));
    let ringing = still.unwrap_or(end - first);
    first + (2 * ringing + 1).min((end - first) / 2)
}

/// Part of the highest block up to which a contact is straight enough to be looked at: behind a coupling capacitor it
/// bends.
const STRAIGHT: f64 = 0.3;

/// Where two straight lines fit the blocks up to [`STRAIGHT`] of their highest best: the lever touches. None where too
/// few lie before that.
fn contact_onset(values: &[f64], range: std::ops::Range<usize>) -> Option<usize> {
    let stretch = values.get(range.clone())?;
    let peak = (0..stretch.len()).max_by(|&a, &b| stretch[a].total_cmp(&stretch[b]))?;
    let level = median(&mut stretch[..=peak].to_vec());
    let high = level + STRAIGHT * (stretch[peak] - level);
    let straight = (0..peak).rev().find(|&k| stretch[k] < high).map_or(peak, |k| (k + 4).min(peak));
    let climb = &stretch[..=straight];
    if climb.len() < 2 * SHORTEST {
        return None;
    }
    let (before, after) = (line_misfits(climb.iter().copied()), line_misfits(climb.iter().rev().copied()));
    let cost = |k: usize| before[k] + after[climb.len() - k];
    let best = (4..climb.len() - 4).min_by(|&a, &b| cost(a).total_cmp(&cost(b)))?;
    Some(range.start + best)
}

/// Sum of squares that a straight line leaves of the first `k` values, for every `k` up to all.
fn line_misfits(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut misfits = vec![0.0];
    // Welford's updates: sums about the running means
    let (mut n, mut mx, mut my, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for y in values {
        let x = n;
        n += 1.0;
        let (dx, dy) = (x - mx, y - my);
        mx += dx / n;
        my += dy / n;
        xx += dx * (x - mx);
        xy += dx * (y - my);
        yy += dy * (y - my);
        misfits.push(if xx > 0.0 { (yy - xy * xy / xx).max(0.0) } else { 0.0 });
    }
    misfits
}

/// Splits a stretch where the piezo (in contact, without a piezo: the deflection) turns.
fn split(points: &Points, stretch: Stretch) -> Vec<Stretch> {
    let travel = match (&points.piezo, stretch.kind) {
        (Some(piezo), _) => piezo,
        (None, SegmentKind::Contact) => &points.values,
        (None, _) => return vec![stretch],
    };
    let Some(track) = travel.get(stretch.start..stretch.end) else { return Vec::new() };
    let Some(turn) = turn(track) else { return vec![stretch] };
    let at = stretch.start + turn;
    let halves = [Stretch { end: at.saturating_sub(1), ..stretch }, Stretch { start: at + 2, ..stretch }];
    halves.into_iter().filter(|half| half.end > half.start).flat_map(|half| split(points, half)).collect()
}

/// Where a track turns back by more than a twentieth of its span.
fn turn(track: &[f64]) -> Option<usize> {
    let (low, high) = span(track);
    let (first, last) = (*track.first()?, *track.last()?);
    let margin = 0.05 * (high - low);
    let top = (0..track.len()).max_by(|&a, &b| track[a].total_cmp(&track[b]))?;
    let bottom = (0..track.len()).min_by(|&a, &b| track[a].total_cmp(&track[b]))?;
    let rounded = [(top, high - first.max(last)), (bottom, first.min(last) - low)];
    rounded.into_iter().find(|&(_, over)| margin > 0.0 && over > margin).map(|(at, _)| at)
}

/// What is kept of a stretch.
pub(super) fn segment(points: &Points, stretch: &Stretch) -> Segment {
    let range = stretch.start..stretch.end;
    let piezo = points.piezo.as_ref().map(|piezo| smooth(&piezo[range.clone()]));
    let before: f64 = points.values[..stretch.start].iter().sum();
    let values = points.values[range].to_vec();
    let sums = values.iter().scan(before, |sum, value| {
        *sum += value;
        Some(*sum - 0.5 * value)
    });
    Segment { kind: stretch.kind, first: stretch.start, sums: sums.collect(), values, piezo }
}

fn smooth(track: &[f64]) -> Vec<f64> {
    let time: Vec<f64> = (0..track.len()).map(|k| k as f64).collect();
    let rough = polynomials(&time, PIEZO_DEGREE.min(track.len() / 4)).residual(track);
    track.iter().zip(rough).map(|(z, r)| z - r).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    /// Free, snap-in, contact up and down, rupture with ringing, free, turn of the piezo.
    fn record() -> (Vec<f64>, Vec<f64>) {
        let noise = white_noise(65_536, 1e-3, 3);
        let value = |k: f64| match k {
            k if k < 16_000.0 => 0.0,
            k if k < 28_000.0 => -0.05 + (k - 16_000.0) * 6e-5,
            k if k < 52_000.0 => 0.67 - (k - 28_000.0) * 6e-5,
            k => (-(k - 52_000.0) / 600.0).exp() * (0.3 * (k - 52_000.0)).cos() * 0.8,
        };
        let piezo = |k: f64| if k < 28_000.0 { -k } else { (k - 56_000.0).min(68_000.0 - k).min(4_000.0) };
        let z = (0..65_536).map(|k| 1e-11 * piezo(f64::from(k)) + 1e-12 * noise[65_535 - k as usize]).collect();
        ((0..65_536).map(|k| value(f64::from(k)) + noise[k as usize]).collect(), z)
    }

    #[test]
    fn stretches_lie_between_the_events_with_and_without_the_snap_in_given() {
        let (y, z) = record();
        let points = super::super::points::points(&y, Some(&z));
        let off = RecordEvent { kind: EventKind::SnapOff, sample: 52_000 };
        let on = RecordEvent { kind: EventKind::SnapIn, sample: 16_000 };
        for events in [vec![off], vec![off, on]] {
            let found = stretches(&points, &events);
            assert_eq!(found[0].kind, SegmentKind::Approach);
            assert!(found[0].start == 0 && (246..=250).contains(&found[0].end), "{found:?}");
            assert!(found[1..].iter().filter(|s| s.kind == SegmentKind::Contact).count() == 2, "{found:?}");
            let retract = found.iter().find(|s| s.kind == SegmentKind::Retract).unwrap();
            // 0.8 V fall to a millivolt in 6.7 times 600 samples: 63 blocks; up to as much again is left out
            assert!((52_000 / 64 + 60..52_000 / 64 + 135).contains(&retract.start), "{found:?}");
        }
        assert_eq!(stretches(&points, &[]), Vec::new());
    }

    #[test]
    fn a_record_that_begins_in_contact_has_no_free_stretch_before_its_rupture() {
        let (y, z) = record();
        for first in [18_000, 24_000] {
            let points = super::super::points::points(&y[first..], Some(&z[first..]));
            let off = RecordEvent { kind: EventKind::SnapOff, sample: 52_000 - first };
            let found = stretches(&points, &[off]);
            assert!(found.iter().all(|s| s.kind != SegmentKind::Approach), "{found:?}");
            assert!(found.iter().any(|s| s.kind == SegmentKind::Retract), "{found:?}");
        }
    }

    #[test]
    fn a_contact_at_the_end_of_a_record_is_not_free_however_short() {
        let (y, z) = record();
        // contact that goes on to 12,000 samples after its beginning rises 0.72 V; here the record ends long before
        for lasting in [400, 2_000, 6_000] {
            let (mut long_y, mut long_z) = (y.clone(), z.clone());
            let noise = white_noise(4_000 + lasting, 1e-3, 4);
            for (k, noise) in noise.iter().enumerate() {
                let climbed = (k as f64 - 4_000.0).max(0.0) * 6e-5;
                long_y.push(climbed + noise);
                long_z.push(z[65_535] - 1e-11 * k as f64);
            }
            let points = super::super::points::points(&long_y, Some(&long_z));
            let found = stretches(&points, &[RecordEvent { kind: EventKind::SnapOff, sample: 52_000 }]);
            let last = found.last().unwrap();
            let contact = (65_536 + 4_000) / points.step;
            assert!(last.kind == SegmentKind::Retract && last.end <= contact, "{lasting}: {found:?}");
            assert!(last.end + 2 * GUARD + 4 > contact, "{lasting}: {found:?}, contact from {contact}");
        }
    }

    #[test]
    fn a_turn_is_where_the_track_goes_back_and_noise_is_none() {
        let track: Vec<f64> = (0..100).map(|k| f64::from(60 - (k - 60i32).abs())).collect();
        assert_eq!(turn(&track), Some(60));
        assert_eq!(turn(&track[..60]), None);
        assert_eq!(turn(&[1.0; 50]), None);
    }

    #[test]
    fn misfits_are_those_of_the_line() {
        let misfits = line_misfits([0.0, 1.0, 2.0, 3.0, 9.0].into_iter());
        assert!(misfits[4].abs() < 1e-12);
        // residuals of the line through five points: 0.2 * (6, -1, -8... ) by hand: sum of squares 10
        assert!((misfits[5] - 10.0).abs() < 1e-12, "{}", misfits[5]);
    }
}
