//! Where events begin: rises of the envelope, level crossings, given times.

use super::envelope::Envelope;
use super::options::{DecaySearchOptions, DecayTrigger};
use crate::statistics::median;

/// Share of the largest energy up to the next rise that a hit has within two periods: beats go on rising.
const SUDDEN: f64 = 0.5;

/// Periods before a rise that tell whether it comes out of quiet, and the energy, over the noise's, that quiet has at
/// most.
pub(super) const QUIET_PERIODS: usize = 4;
pub(super) const QUIET: f64 = 2.0;

/// Rises of the envelope, in order of time, and the record's first sample where it already rings there.
///
/// # Method
/// Energy of the period after a sample over that of the period before it, noise added to both: a local maximum above
/// the least rise, with an energy that the noise does not reach. A rise counts if its first two periods hold half of
/// the largest energy before the next one: a beat rises slower.
pub(super) fn rises(envelope: &Envelope, options: &DecaySearchOptions) -> Vec<usize> {
    let (samples, period) = (envelope.samples(), envelope.period);
    let loud = 1.0 + options.significance * envelope.scatter;
    let rise = |k: usize| {
        let after = envelope.mean(k, k + period);
        let before = envelope.mean(k.saturating_sub(period), k).max(1.0);
        if after > loud { after / before } else { 0.0 }
    };
    let mut found: Vec<(usize, f64)> = Vec::new();
    for k in period.min(samples)..samples.saturating_sub(period / 2) {
        let height = rise(k);
        if height <= options.least_rise {
            continue;
        }
        match found.last_mut() {
            Some(last) if k - last.0 <= 2 * period => {
                if height > last.1 {
                    *last = (k, height);
                }
            }
            _ => found.push((k, height)),
        }
    }
    let mut all: Vec<usize> = found.into_iter().map(|(k, _)| k).collect();
    let early = all.first().copied().unwrap_or(samples);
    if envelope.mean(0, period.min(early)) > loud && early >= period {
        all.insert(0, 0);
    }
    sudden(envelope, all)
}

/// Drops rises that go on rising for more than two periods, last ones first; not those out of quiet, which begin a decay
/// of modes that at first all but cancel.
///
/// Windows that reach into the next rise, which may be a quarter of a period early, do not count: it may be a hit with a
/// hundred times the energy.
fn sudden(envelope: &Envelope, mut all: Vec<usize>) -> Vec<usize> {
    let reach = envelope.period + envelope.period / 4;
    let mut next = envelope.samples();
    // a quarter of a period: a rise may be found so much early
    let quiet_to = |k: usize| k.saturating_sub(envelope.period / 4);
    let out_of_quiet =
        |k: usize| envelope.mean(quiet_to(k).saturating_sub(QUIET_PERIODS * envelope.period), quiet_to(k)) < QUIET;
    for place in (0..all.len()).rev() {
        let k = all[place];
        let at_once = envelope.largest(k, k + 2 * envelope.period);
        if !out_of_quiet(k) && at_once < SUDDEN * envelope.largest(k, next.saturating_sub(reach)) {
            all.remove(place);
        } else {
            next = k;
        }
    }
    all
}

/// Crossings of a level above a channel's median, again after a period below half of it.
pub(super) fn crossings(channel: &[f64], level: f64, period: usize) -> Vec<usize> {
    let centre = median(&mut channel.to_vec());
    let (mut all, mut below) = (Vec::new(), usize::MAX);
    let mut armed = true;
    for (k, y) in channel.iter().enumerate() {
        let height = (y - centre) / level;
        if height >= 1.0 && armed {
            all.push(k);
            armed = false;
        }
        below = if height.abs() >= 0.5 { 0 } else { below.saturating_add(1) };
        armed |= below > 2 * period;
    }
    all
}

/// Starts by the trigger; those of a drive's end are found elsewhere.
pub(super) fn onsets(
    channels: &[&[f64]],
    envelope: &Envelope,
    rate_hz: f64,
    options: &DecaySearchOptions,
) -> Vec<usize> {
    match &options.trigger {
        DecayTrigger::Level { channel, level } => crossings(channels[*channel], *level, envelope.period),
        DecayTrigger::Given { times_s } => {
            let mut all: Vec<usize> = times_s.iter().map(|t| (t * rate_hz).round() as usize).collect();
            all.sort_unstable();
            all.dedup();
            all
        }
        DecayTrigger::LargestRise | DecayTrigger::DriveEnd { .. } | DecayTrigger::Force { .. } => {
            rises(envelope, options)
        }
    }
}
