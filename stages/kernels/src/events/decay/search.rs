//! The search, from channels to decays.

use std::ops::Range;

use super::change::ringing_changes;
use super::clipping::{clipped, touches};
use super::drive::{bend, ends_of_drive, ends_of_response, hits_of_force};
use super::envelope::{Envelope, Pitch, without_drift};
use super::error::DecaySearchError;
use super::extent::{Begin, begin, beyond, departure, end, quiet_before};
use super::found::{ChannelDecay, DecayEnd, DecaySearch, Decline, DismissedDecay, DismissedReason, FreeDecay, Steady};
use super::noise_floor::noise_std;
use super::onsets::{QUIET, QUIET_PERIODS, onsets, rises};
use super::options::{DecaySearchOptions, DecayTrigger};
use super::steadiness::{SEGMENT_PERIODS, oscillation};
use super::struck::{Failures, hits_into_ringing};
use crate::events::baseline;
use crate::signal::code_step;

/// Share of a period before the next event that is left out. Why: a hit is seen a sample or two after its contact begins,
/// and a converter's filter of linear phase answers some samples before it.
const BEFORE_EVENT: f64 = 0.5;
/// Least samples of a record.
const LEAST_SAMPLES: usize = 64;
/// Periods of a decay at least.
const LEAST_PERIODS: usize = 2;
/// Fall of the amplitude, nepers, that is a decay whatever its slope's error: two periods of a low Q have none.
const CERTAIN_FALL: f64 = 1.5;
/// A sixteenth of a driven stretch is left out at its end: to so much a bend is known.
const END: usize = 16;
/// Change of the amplitude, nepers, below which a stretch may be a drive's. Why: of few segments a slope's error would
/// also let the first beat of a decay pass.
const DRIVEN_FALL: f64 = 0.05;
/// Fall of the amplitude, nepers, below which an instrument's own gain may have drifted.
const LEAST_FALL: f64 = 1e-3;

/// Finds the free decays of one record.
///
/// # Model
/// Quiet, an event (hit, release, pulse, end of a drive), free ringing of any number of modes that dies away in white
/// or slowly wandering noise; the same again. Offset and drift slower than the ringing.
/// # Method
/// 1. The strongest oscillation sets the period. Each channel less its running mean over two periods, over its noise
///    (quietest stretches), squared and added: the envelope.
/// 2. Starts by [`DecayTrigger`]; of rises refined to the first sustained departure from the quiet line before. Hits into
///    ringing: where its prediction fails and what rings afterwards is not what rang before.
/// 3. End: where the ringing of two periods is smaller than the noise, or the next start.
/// 4. First free sample: the later samples foretell it backwards by a linear recurrence; contact and saturation do not
///    obey it.
/// 5. The decline of the strongest oscillation against its own error: what does not decline is [`Steady`].
/// 6. Its size against the excursions of stationary noise with the same mean energy in its band: what is no larger is
///    none.
/// # Shapes
/// `channels`: C slices of N samples of the same instants.
/// # Units
/// The channels' own; samples; Hz.
/// # Accuracy
/// In all but one of a hundred decays: first free sample no more than a sixteenth of a period early and half a period
/// late; end: where amplitude and noise are equal, to three quarters of the decay time (docs/results/decay.md). Cost:
/// some `100 N C` operations.
/// # Errors
/// No channel, unequal lengths, fewer than 64 samples, values that are not finite, options out of range.
/// # Source
/// R. V. Allen, Bull. Seismol. Soc. Am. 68 (1978) 1521 (energy before and after a pick); G. R. B. de Prony, J. Ec.
/// Polytech. 1 (1795) 24 (linear recurrence of exponentials).
pub fn find_decays(
    channels: &[&[f64]],
    sample_rate_hz: f64,
    options: &DecaySearchOptions,
) -> Result<DecaySearch, DecaySearchError> {
    check(channels, sample_rate_hz, options)?;
    let record = Record::of(channels, sample_rate_hz, options);
    let starts = record.starts(options);
    // a channel that never changes has no noise
    let noise_std = record.noise_std.iter().map(|&s| if s.is_finite() { s } else { 0.0 }).collect();
    let mut found = DecaySearch {
        decays: Vec::new(),
        steady: Vec::new(),
        dismissed: Vec::new(),
        largest_energy: record.envelope.largest(0, record.envelope.samples()),
        noise_std,
        channels: record.numbers.clone(),
        random: false,
    };
    let mut since = 0;
    for (place, &onset) in starts.iter().enumerate() {
        let next = starts.get(place + 1).copied().unwrap_or(record.envelope.samples());
        since = record.judge(onset, since, next, options, &mut found);
    }
    if matches!(options.trigger, DecayTrigger::LargestRise) {
        record.dismiss_handling(&mut found);
        record.dismiss_walks(&mut found);
        record.dismiss_excursions(&mut found);
    }
    record.keep_largest(&mut found.decays, options.most);
    Ok(found)
}

/// A record as the search sees it.
pub(super) struct Record<'a> {
    /// Without the drive's.
    pub(super) channels: Vec<&'a [f64]>,
    numbers: Vec<usize>,
    drive: Option<&'a [f64]>,
    /// Channels without their drift.
    pub(super) swings: Vec<Vec<f64>>,
    /// Infinite for a channel that never changes: it takes no part.
    pub(super) noise_std: Vec<f64>,
    /// Steps of the codes; 0 where there are none.
    steps: Vec<f64>,
    clipped: Vec<Vec<Range<usize>>>,
    pub(super) envelope: Envelope,
    /// Where a steady response begins to die.
    response_ends: Vec<usize>,
    /// Hits of the force, ascending, of the trigger [`DecayTrigger::Force`] alone.
    hits: Vec<Range<usize>>,
    /// Strongest oscillation, cycles per sample.
    frequency: f64,
    pub(super) rate_hz: f64,
    all: Vec<&'a [f64]>,
}

impl<'a> Record<'a> {
    pub(super) fn of(all: &[&'a [f64]], rate_hz: f64, options: &DecaySearchOptions) -> Self {
        let drive = options.trigger.left_out();
        let numbers: Vec<usize> = (0..all.len()).filter(|&c| Some(c) != drive).collect();
        let channels: Vec<&[f64]> = numbers.iter().map(|&c| all[c]).collect();
        let changes = |y: &&[f64]| y.iter().any(|value| *value != y[0]);
        let live: Vec<&[f64]> = channels.iter().copied().filter(changes).collect();
        let pitch = Pitch::of(if live.is_empty() { &channels } else { &live });
        let period = ((1.0 / pitch.slowest).round() as usize).max(2);
        let swings: Vec<Vec<f64>> = channels.iter().map(|y| without_drift(y, (2 * period) | 1)).collect();
        let steps: Vec<f64> = channels.iter().map(|y| code_step(y)).collect();
        let noise = |c: usize| match changes(&channels[c]) {
            true => noise_std(&swings[c], period, steps[c]),
            false => f64::INFINITY,
        };
        let noise_std: Vec<f64> = (0..channels.len()).map(noise).collect();
        let envelope = Envelope::new(&swings, &noise_std, period);
        let clipped = channels.iter().zip(&steps).map(|(y, &step)| clipped(y, step)).collect();
        let drive = drive.map(|c| all[c]);
        let hits = match options.trigger {
            DecayTrigger::Force { .. } => {
                drive.map_or_else(Vec::new, |force| hits_of_force(force, &rises(&envelope, options), period))
            }
            _ => Vec::new(),
        };
        Self {
            channels,
            numbers,
            drive,
            swings,
            noise_std,
            steps,
            clipped,
            response_ends: ends_of_response(&envelope),
            hits,
            envelope,
            frequency: pitch.strongest,
            rate_hz,
            all: all.to_vec(),
        }
    }

    fn starts(&self, options: &DecaySearchOptions) -> Vec<usize> {
        match (&options.trigger, self.drive) {
            (DecayTrigger::DriveEnd { .. }, Some(drive)) => {
                let ends = ends_of_drive(drive, self.envelope.period);
                // a response that outlasts its drive's command: the later of the two
                let later = |end: usize| self.response_ends.iter().copied().find(|&k| k > end);
                let next = |place: usize| ends.get(place + 1).copied().unwrap_or(usize::MAX);
                ends.iter().enumerate().map(|(i, &end)| later(end).filter(|&k| k < next(i)).unwrap_or(end)).collect()
            }
            (DecayTrigger::DriveEnd { .. }, None) => self.response_ends.clone(),
            (DecayTrigger::Force { .. }, Some(_)) => self.hits.iter().map(|hit| hit.start).collect(),
            (DecayTrigger::LargestRise, _) => {
                self.with_hits(self.without_beats(onsets(&self.all, &self.envelope, self.rate_hz, options)))
            }
            _ => onsets(&self.all, &self.envelope, self.rate_hz, options),
        }
    }

    /// Leaves out rises that are no events: what follows them foretells what precedes them. From the last one back, so
    /// that each is judged by all that rings after it.
    fn without_beats(&self, mut starts: Vec<usize>) -> Vec<usize> {
        let period = self.envelope.period;
        let mut next = self.envelope.samples();
        for place in (0..starts.len()).rev() {
            let start = starts[place];
            let before = start.saturating_sub(period / 4);
            let quiet = start < QUIET_PERIODS * period
                || self.envelope.mean(before - before.min(QUIET_PERIODS * period), before) < QUIET;
            let (end, _) = end(&self.envelope, start, next);
            // a beat may dip below the noise: it rises no higher than its decay began
            let lower = place > 0 && self.height(start) < self.height(starts[place - 1]);
            let foretold = (!quiet || lower) && self.begin(start, end).foretold;
            if foretold || (!quiet && self.is_late_beat(&starts[..=place])) {
                starts.remove(place);
            } else {
                next = start;
            }
        }
        starts
    }

    /// Adds hits into the ringing of earlier ones, places those among the rises that are such, and leaves out glitches.
    fn with_hits(&self, starts: Vec<usize>) -> Vec<usize> {
        let apart = LEAST_PERIODS * self.envelope.period;
        let mut all = Vec::with_capacity(starts.len());
        let mut since = 0;
        while let Some(&start) = starts.get(since) {
            // through all rises that come before it has died
            let mut last = since;
            let until = loop {
                let next = starts.get(last + 1).copied();
                match end(&self.envelope, starts[last], next.unwrap_or(self.envelope.samples())) {
                    (_, DecayEnd::NextEvent) if next.is_some() => last += 1,
                    (end, _) => break end,
                }
            };
            let ringing = (start + apart).min(until)..until;
            let Failures { mut hits, glitches } =
                hits_into_ringing(&self.channels, &self.steps, &self.clipped, &ringing, self.envelope.period);
            hits.retain(|&hit| hit + apart < until && ringing_changes(&self.channels, start, hit, self.frequency));
            let rises = &starts[since + 1..=last];
            let far = |from: &[usize], rise: usize| from.iter().all(|one| one.abs_diff(rise) > apart);
            let placed = |rise: &&usize| far(&hits, **rise) && far(&glitches, **rise);
            all.push(start);
            all.extend(rises.iter().filter(placed));
            all.extend(hits);
            since = last + 1;
        }
        all.sort_unstable();
        all
    }

    /// Whether the last of the starts is too late in the record for what follows to foretell anything, and no higher
    /// than the one before it: a beat rises no higher than its decay began.
    fn is_late_beat(&self, starts: &[usize]) -> bool {
        let [.., before, last] = *starts else { return false };
        last + LEAST_PERIODS * self.envelope.period > self.envelope.samples() && self.height(last) < self.height(before)
    }

    /// Largest energy within the first periods.
    fn height(&self, start: usize) -> f64 {
        self.envelope.largest(start, start + LEAST_PERIODS * self.envelope.period)
    }

    fn begin(&self, onset: usize, end: usize) -> Begin {
        begin(&self.channels, &self.swings, &self.noise_std, &self.clipped, onset, end, self.envelope.period)
    }

    /// Takes the start for a decay, a steady oscillation or neither; where the next quiet stretch may begin.
    fn judge(
        &self,
        start: usize,
        since: usize,
        next: usize,
        options: &DecaySearchOptions,
        found: &mut DecaySearch,
    ) -> usize {
        let period = self.envelope.period;
        let given = !matches!(options.trigger, DecayTrigger::LargestRise);
        let quiet = quiet_before(&self.envelope, since, start);
        let onset = match &quiet {
            Some(quiet) if !given => departure(&self.channels, &self.noise_std, start, quiet.start, period),
            _ => start,
        };
        let (end, why) = end(&self.envelope, onset, next);
        let hit = self.hits.iter().find(|hit| hit.contains(&onset));
        let before = (BEFORE_EVENT * period as f64).ceil() as usize;
        let left_out = why == DecayEnd::NextEvent && (hit.is_some() || !given);
        let end = if left_out { end.saturating_sub(before).max(onset) } else { end };
        let driven = if given { None } else { self.driven_until(onset, end, options, found) };
        let onset = driven.unwrap_or(onset);
        let first = match options.trigger {
            // the drive's end is the last forced sample
            DecayTrigger::DriveEnd { .. } => onset,
            _ if driven.is_some() => onset,
            _ => self.begin(onset, end).free.max(hit.map_or(0, |hit| hit.end)),
        } + (options.skip_s * self.rate_hz).round() as usize;
        if first + LEAST_PERIODS * period > end {
            let reason = if end <= onset + period { DismissedReason::NoRinging } else { DismissedReason::TooShort };
            found.dismissed.push(DismissedDecay { onset, reason });
            return end;
        }
        let range = first..end;
        let seen =
            |periods: f64| oscillation(&self.channels, &self.noise_std, &range, self.frequency, periods, self.rate_hz);
        let mut tone = seen(SEGMENT_PERIODS);
        if !tone.decline.std_per_s.is_finite() && why != DecayEnd::Noise {
            // up to the next hit few periods are all there is
            tone.decline = seen(LEAST_PERIODS as f64).decline;
        }
        // what does not turn twice is a relaxation
        if tone.frequency * (range.len() as f64) < LEAST_PERIODS as f64 {
            found.dismissed.push(DismissedDecay { onset, reason: DismissedReason::TooShort });
            return end;
        }
        let frequency_hz = tone.frequency * self.rate_hz;
        let mut steady = self.is_steady(&tone.decline, &range, why, options);
        if let Some(beat) = if steady { tone.beat() } else { None } {
            // a slope through the lobes of a beat says little
            steady = self.is_steady(&beat, &range, why, options);
            tone.decline = if steady { tone.decline } else { beat };
        }
        if steady {
            let growing = tone.decline.rate_per_s < -tone.decline.limit_per_s(options.decline_significance);
            let (decline, amplitude) = (tone.decline, tone.amplitude);
            found.steady.push(Steady { range, frequency_hz, amplitude, decline, growing });
            return end;
        }
        let range = first..if why == DecayEnd::Noise { beyond(onset, end, next - period.min(next - end)) } else { end };
        let channels = self.channels_of(&range, quiet.as_ref(), next);
        found.decays.push(FreeDecay { onset, range, end: why, quiet, frequency_hz, decline: tone.decline, channels });
        end
    }

    /// Where a drive ends that kept the response steady from `onset` on; that stretch goes to the steady ones.
    fn driven_until(
        &self,
        onset: usize,
        end: usize,
        options: &DecaySearchOptions,
        found: &mut DecaySearch,
    ) -> Option<usize> {
        let period = self.envelope.period;
        let inside = |k: &usize| *k > onset + 8 * period && k + LEAST_PERIODS * period < end;
        let seen = self.response_ends.iter().copied().find(inside);
        let bends = bend(&self.envelope, onset..end).filter(inside);
        let steady = |last: usize| {
            // the drive's first half may build up, and the last periods are none of it where the end is late
            let range = onset + period.max((last - onset) / 2)..last - period.max((last - onset) / END);
            let tone =
                oscillation(&self.channels, &self.noise_std, &range, self.frequency, SEGMENT_PERIODS, self.rate_hz);
            let duration_s = range.len() as f64 / self.rate_hz;
            let falls = tone.decline.rate_per_s.abs() * duration_s;
            let known = tone.decline.std_per_s * duration_s < DRIVEN_FALL;
            let steady = known
                && falls < DRIVEN_FALL
                && self.is_steady(&tone.decline, &range, DecayEnd::NextEvent, options)
                // a lobe of a beat is level on the whole, too
                && tone.beat().is_none();
            let (frequency_hz, amplitude, decline) = (tone.frequency * self.rate_hz, tone.amplitude, tone.decline);
            steady.then_some((last, Steady { range, frequency_hz, amplitude, decline, growing: false }))
        };
        let (last, stretch) = bends.and_then(steady).or_else(|| seen.and_then(steady))?;
        found.steady.push(stretch);
        Some(last)
    }

    /// Whether the decline is within its error, or an instrument's drift.
    fn is_steady(&self, decline: &Decline, range: &Range<usize>, why: DecayEnd, options: &DecaySearchOptions) -> bool {
        let energy = |first: usize| self.envelope.mean(first, first + LEAST_PERIODS * self.envelope.period) - 1.0;
        let last = range.end.saturating_sub(LEAST_PERIODS * self.envelope.period).max(range.start);
        let fall = 0.5 * (energy(range.start) / energy(last).max(1e-3)).max(f64::MIN_POSITIVE).ln();
        if fall > CERTAIN_FALL {
            return false;
        }
        let total = decline.rate_per_s * range.len() as f64 / self.rate_hz;
        let short = !decline.std_per_s.is_finite();
        // few periods that end in the noise have died; few that fill the record cannot be judged by a slope
        if short {
            return why != DecayEnd::Noise && fall < 0.5;
        }
        decline.rate_per_s < decline.limit_per_s(options.decline_significance) || total < LEAST_FALL
    }

    /// Leaves the `most` decays with the largest peaks over their noise, in order of time.
    fn keep_largest(&self, decays: &mut Vec<FreeDecay>, most: usize) {
        let size = |d: &FreeDecay| d.channels.iter().zip(&self.noise_std).map(|(c, s)| (c.peak / s).powi(2)).sum();
        let sizes: Vec<f64> = decays.iter().map(size).collect();
        let mut ascending: Vec<usize> = (0..sizes.len()).collect();
        ascending.sort_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
        let mut kept = vec![true; sizes.len()];
        ascending.iter().take(sizes.len().saturating_sub(most)).for_each(|&k| kept[k] = false);
        let mut kept = kept.into_iter();
        decays.retain(|_| kept.next().unwrap_or(true));
    }

    fn channels_of(&self, range: &Range<usize>, quiet: Option<&Range<usize>>, next: usize) -> Vec<ChannelDecay> {
        let after = range.end + self.envelope.period..next.saturating_sub(self.envelope.period);
        (0..self.channels.len())
            .map(|c| {
                let (y, swing) = (self.channels[c], &self.swings[c]);
                let before = quiet.and_then(|quiet| baseline(y, quiet.clone()));
                let behind = if after.len() >= 32 { baseline(y, after.clone()) } else { None };
                let largest = |&a: &usize, &b: &usize| swing[a].abs().total_cmp(&swing[b].abs());
                let peak_sample = range.clone().max_by(largest).unwrap_or(range.start);
                let level = match (&before, &behind) {
                    (_, Some(line)) => line.at(peak_sample as f64),
                    (Some(line), None) => line.at(peak_sample as f64),
                    (None, None) => y[peak_sample] - swing[peak_sample],
                };
                let gaps = self.clipped[c].iter().filter(|gap| touches(std::slice::from_ref(gap), range.clone()));
                let cut = |gap: &Range<usize>| gap.start.max(range.start)..gap.end.min(range.end);
                ChannelDecay {
                    peak: y[peak_sample] - level,
                    peak_sample,
                    clipped: gaps.map(cut).collect(),
                    level_before: before.map(|line| line.at(range.start as f64)),
                    noise_before: before.map(|line| line.noise_std),
                    noise_after: behind.map(|line| line.noise_std),
                }
            })
            .collect()
    }
}

fn check(channels: &[&[f64]], rate_hz: f64, options: &DecaySearchOptions) -> Result<(), DecaySearchError> {
    let wanted = channels.first().ok_or(DecaySearchError::NoChannel)?.len();
    for (channel, values) in channels.iter().enumerate() {
        if values.len() != wanted {
            return Err(DecaySearchError::Length { channel, found: values.len(), wanted });
        }
        if let Some(index) = values.iter().position(|y| !y.is_finite()) {
            return Err(DecaySearchError::NotFinite { channel, index });
        }
    }
    if wanted < LEAST_SAMPLES {
        return Err(DecaySearchError::TooShort { found: wanted, wanted: LEAST_SAMPLES });
    }
    if !(rate_hz > 0.0 && rate_hz.is_finite()) {
        let wanted = "above 0";
        return Err(DecaySearchError::Parameter { name: "sample_rate_hz", found: rate_hz, wanted });
    }
    options.check(channels.len())?;
    let DecayTrigger::Given { times_s } = &options.trigger else { return Ok(()) };
    match times_s.iter().find(|t| (**t * rate_hz).round() >= wanted as f64) {
        Some(&found) => Err(DecaySearchError::Parameter { name: "times_s", found, wanted: "times within the record" }),
        None => Ok(()),
    }
}
