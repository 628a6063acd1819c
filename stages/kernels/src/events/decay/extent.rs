//! How far a decay reaches: its first free sample, and where it drowns.

use std::ops::Range;

use super::backward::{block_of, obeys};
use super::envelope::Envelope;
use super::found::DecayEnd;
use crate::events::first_sustained_departure;

/// Standard deviations of the noise that a departure has.
const DEPARTURE: f64 = 6.0;
/// Samples in a row beyond it.
const SUSTAINED: usize = 3;
/// Samples of noise from which a line is taken.
const LEAST_QUIET: usize = 24;
/// Periods after the peak within which a hit is over.
const CONTACT_PERIODS: f64 = 1.5;
/// Periods of the free decay that foretell its beginning.
const FORETOLD_PERIODS: usize = 40;
/// Samples of a channel that the noise's energy is averaged over where a decay drowns.
const DROWN_SAMPLES: usize = 64;

/// Quiet samples before a start, from `since` on; none where there are too few.
pub(super) fn quiet_before(envelope: &Envelope, since: usize, onset: usize) -> Option<Range<usize>> {
    let period = envelope.period;
    let end = onset.saturating_sub(period / 4 + 1);
    let first = (since + if since > 0 { period } else { 0 }).min(end);
    let limit = 1.0 + 6.0 * (2.0 / (end - first).max(1) as f64).sqrt().max(envelope.scatter);
    (end - first >= LEAST_QUIET.max(period / 2) && envelope.mean(first, end) < 3.0 * limit).then_some(first..end)
}

/// The first sample off the line before, in any channel; `near` where nothing quiet precedes it.
pub(super) fn departure(
    channels: &[&[f64]],
    noise_std: &[f64],
    near: usize,
    quiet_from: usize,
    period: usize,
) -> usize {
    let begin = near.saturating_sub(period + period / 4);
    let room = begin.saturating_sub(quiet_from);
    if room < LEAST_QUIET {
        return near;
    }
    let found = channels.iter().zip(noise_std).filter_map(|(y, noise)| {
        let search = begin..(near + 5 * period / 2).min(y.len());
        let found =
            first_sustained_departure(y, search, room.min(8 * period.max(LEAST_QUIET)), DEPARTURE, SUSTAINED, *noise);
        found.map(|onset| onset.index)
    });
    found.min().unwrap_or(near)
}

/// Where the free decay of a start begins, and whether anything happens there.
pub(super) struct Begin {
    /// Its first free sample.
    pub free: usize,
    /// Whether what precedes the start is foretold by what follows it: no event at all, a beat.
    pub foretold: bool,
}

/// What the end of a decay, over at `end`, says of its beginning near `onset`.
pub(super) fn begin(
    channels: &[&[f64]],
    swings: &[Vec<f64>],
    noise_std: &[f64],
    clipped: &[Vec<Range<usize>>],
    onset: usize,
    end: usize,
    period: usize,
) -> Begin {
    let reach = (onset + 2 * period).min(end).max(onset + 1);
    let size = |k: usize| swings.iter().zip(noise_std).map(|(y, s)| (y[k] / s).abs()).fold(0.0, f64::max);
    let peak = (onset..reach).max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(onset);
    let latest = (peak + (CONTACT_PERIODS * period as f64).ceil() as usize).min(end);
    let block = block_of(period);
    let obeys = |first: usize| {
        let stretch = first..end.min(first + FORETOLD_PERIODS * period);
        obeys(channels, clipped, &stretch, latest + period / 2, block)
    };
    // a period earlier: what was before does not go on, unless nothing happened
    let foretold = onset >= period && end >= onset + 2 * period && obeys(onset - period);
    let free = (onset..latest).step_by(block).find(|&first| obeys(first)).unwrap_or(peak);
    // the edge of a contact is smooth: a block more
    Begin { free: if free > onset { (free + block).min(end) } else { free }, foretold }
}

/// The sample after a decay's last, and why it ends there.
///
/// # Method
/// Energy of ringing and noise over 64 samples of a channel or two periods: the decay drowns where it falls below
/// twice the noise's, which is where the rms of the ringing is the noise's. Gaps of half of what came before are
/// beats.
pub(super) fn end(envelope: &Envelope, onset: usize, next: usize) -> (usize, DecayEnd) {
    let (samples, period) = (envelope.samples(), envelope.period);
    let span = (2 * period).max(DROWN_SAMPLES.div_ceil(envelope.channels));
    let alive = |k: usize| envelope.mean(k, (k + span).min(next.max(k + 1))) > 2.0;
    let step = (period / 8).max(1);
    // end of the last run of live windows; a later run goes on with it if it is near, or as long as beats are
    let (mut last, mut first) = (onset, None);
    for k in (onset..next).step_by(step) {
        if alive(k) {
            let begin = *first.get_or_insert(k);
            let gap = begin - last;
            if gap <= 4 * span || (gap <= (last - onset) / 2 && k - begin >= gap / 4) {
                last = k;
                first = Some(k);
            }
        } else {
            first = None;
            if k - last > (4 * span).max((last - onset) / 2) {
                break;
            }
        }
    }
    // the window whose energy is twice the noise's has its crossing about its middle
    let end = last + if last > onset { span / 2 } else { 0 };
    if end + span / 2 + step >= next {
        return (next, if next == samples { DecayEnd::RecordEnd } else { DecayEnd::NextEvent });
    }
    (end, DecayEnd::Noise)
}

/// The sample after the last that a fit takes of a decay that drowns at `end`, at most `limit`.
///
/// # Method
/// Half as long again. Cut where it drowns a fit loses up to 3 % of its errors at a peak of 20 times the noise, and
/// more of modes that last longer than the strongest; half as long again leaves under 0.5 %.
pub(super) fn beyond(onset: usize, end: usize, limit: usize) -> usize {
    (end + end.saturating_sub(onset) / 2).min(limit).max(end)
}
