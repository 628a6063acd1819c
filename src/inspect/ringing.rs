//! What rings in a channel.

use std::ops::Range;

use afmid_kernels::events::decay::{DecaySearch, DecaySearchOptions, find_decays};
use afmid_pipeline::StageError;
use afmid_pipeline::recording::FoundChannel;

use super::verdict::Answer;
use crate::show::{about, number};

/// Samples that are searched: a long record's first ones.
const MOST_SEARCHED: usize = 1 << 22;

/// What decays of a random vibration are.
const RANDOM: &str = "rises and falls of a random vibration, no free decays: `afmid new pipeline` takes its spectrum";

/// The longest stretch without an interruption before samples `gaps`; of equals the first.
pub fn longest_stretch(samples: usize, gaps: &[usize]) -> Range<usize> {
    let ends = gaps.iter().copied().chain([samples]);
    let starts = std::iter::once(0).chain(gaps.iter().copied());
    let longer = |best: Range<usize>, next: Range<usize>| if next.len() > best.len() { next } else { best };
    starts.zip(ends).map(|(start, end)| start..end.max(start)).reduce(longer).unwrap_or(0..0)
}

/// The first samples of the longest stretch, in the channel's unit, NaN where missing. Errors: they cannot be read.
pub fn first_samples(found: &FoundChannel) -> Result<Vec<f64>, StageError> {
    let stretch = longest_stretch(found.samples, &found.gaps);
    let stored = found.source.read(stretch.start, stretch.len().min(MOST_SEARCHED))?;
    let value = |code: f64| match found.fill_code {
        Some(fill) if fill == code => f64::NAN,
        _ => code * found.scale_factor + found.add_offset,
    };
    Ok(stored.widened().into_iter().map(value).collect())
}

/// Whether a channel holds a ringdown, by the samples of its longest stretch without a missing one.
pub fn ringdown(found: &FoundChannel) -> (Answer, String) {
    let samples = match first_samples(found) {
        Ok(samples) => samples,
        Err(error) => return (Answer::Unknown, error.problem),
    };
    // a missing sample is a stretch of its own
    let missing = (0..samples.len()).filter(|&k| !samples[k].is_finite());
    let edges: Vec<usize> = missing.flat_map(|k| [k, k + 1]).collect();
    let present = longest_stretch(samples.len(), &edges);
    let first = longest_stretch(found.samples, &found.gaps).start + present.start;
    // without a rate the search is in samples
    let rate = found.sample_rate_hz;
    let search = find_decays(&[&samples[present.clone()]], rate.unwrap_or(1.0), &DecaySearchOptions::default());
    let (answer, reason) = match (search, rate) {
        (Ok(search), Some(rate)) => of_search(&search, rate, first),
        (Ok(search), None) => without_rate(&search, first),
        (Err(problem), _) => (Answer::No, problem.to_string()),
    };
    if present.len() == found.samples || reason == RANDOM {
        return (answer, reason);
    }
    // of what was not searched nothing is known
    let answer = if answer == Answer::No { Answer::Unknown } else { answer };
    let (last, all) = ((first + present.len()).saturating_sub(1), found.samples);
    (answer, format!("{reason}; of {all} samples those from {first} to {last} were searched"))
}

fn of_search(search: &DecaySearch, rate: f64, since: usize) -> (Answer, String) {
    match (search.decays.first(), search.reason()) {
        (None, _) if search.random => (Answer::No, RANDOM.to_owned()),
        (Some(first), _) => {
            let start_s = (since + first.range.start) as f64 / rate;
            let (frequency, samples) = (first.frequency_hz, rate / first.frequency_hz);
            let at = format!("at {} Hz: {samples:.1} samples a period", about(frequency));
            let where_from = format!("from {} s on, {at}", number(start_s));
            (Answer::Yes, format!("{} {where_from}", counted(search.decays.len())))
        }
        (None, reason) => (Answer::No, reason.unwrap_or_default()),
    }
}

/// In the reasons of channels without a rate.
pub const NO_RATE: &str = "the file states no sample rate";

fn without_rate(search: &DecaySearch, since: usize) -> (Answer, String) {
    let unknown = format!("{NO_RATE}: give `sample_rate_hz`");
    match (search.decays.first(), search.steady.first()) {
        (None, _) if search.random => (Answer::No, RANDOM.to_owned()),
        (Some(first), _) => {
            let (start, samples) = (since + first.range.start, 1.0 / first.frequency_hz);
            let from = format!("from sample {start} on, {samples:.1} samples a period");
            (Answer::Unknown, format!("{} {from}; {unknown}", counted(search.decays.len())))
        }
        (None, Some(steady)) => {
            let samples = 1.0 / steady.frequency_hz;
            (Answer::No, format!("steady oscillation of {samples:.1} samples a period: Q cannot be had from it"))
        }
        (None, None) => (Answer::No, search.reason().unwrap_or_default()),
    }
}

/// How many decays there are, before where the first begins.
pub fn counted(decays: usize) -> String {
    if decays == 1 { "a free decay".to_owned() } else { format!("{decays} free decays, the first") }
}
