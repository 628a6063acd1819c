//! Which channels of a file are sensors of one motion, and why the others are none.

use super::channels::{driving, nothing, some_of, usable};
use super::choice::Question;
use super::first_file::FirstFile;
use super::recordings::Source;
use crate::inspect::{Channel, LEAST_CODES};
use crate::show::number;

/// Channels that are searched for decays, at most.
const MOST_SEARCHED: usize = 16;

/// The sensors, and what is said of the channels that are none.
#[derive(Debug)]
pub struct Sensors<'a> {
    pub channels: Vec<&'a Channel>,
    pub left_out: Option<String>,
}

/// Channels of one length, rate and unit; where they have no unit, of one name but for its number.
#[derive(Debug)]
struct Likes<'a> {
    channels: Vec<&'a Channel>,
    stem: Option<&'a str>,
}

/// The sensors of a file: the channels that are like the best one, or a larger set of like ones that rings, too. Errors:
/// there is none.
pub fn sensors<'a>(file: &FirstFile<'a>) -> Result<Sensors<'a>, Question> {
    let source = file.source;
    let best = source.best.and_then(|index| source.channels.get(index)).filter(usable);
    let longest = || source.channels.iter().filter(usable).max_by_key(|channel| channel.samples);
    let best = best.or_else(longest).ok_or_else(|| nothing(source))?;
    let driving = driving(source);
    let drives = |channel: &&Channel| driving.iter().any(|one| one.location == channel.location);
    let signals: Vec<&Channel> = source.channels.iter().filter(|c| usable(c) && !drives(c)).collect();
    let channels = like(&signals, best, file);
    let left_out = left_out(source, &channels);
    Ok(Sensors { channels, left_out })
}

/// Those of the signals that are like the best one, or a larger set of like ones that rings.
pub fn like<'a>(signals: &[&'a Channel], best: &'a Channel, file: &FirstFile<'a>) -> Vec<&'a Channel> {
    let found = chosen(sets(signals), best, file);
    if found.is_empty() { vec![best] } else { found }
}

/// Sets of like channels, in the order of their first ones.
fn sets<'a>(signals: &[&'a Channel]) -> Vec<Likes<'a>> {
    let stems: Vec<Option<&str>> = signals.iter().map(|channel| stem(&channel.location)).collect();
    let numbered = |at: usize| {
        let stem = stems.get(at).copied().flatten();
        let others = stems.iter().enumerate().any(|(other, found)| other != at && *found == stem);
        stem.filter(|_| others && signals.get(at).is_some_and(|channel| channel.unit.is_empty()))
    };
    let mut sets: Vec<Likes<'a>> = Vec::new();
    for (at, channel) in signals.iter().enumerate() {
        let stem = numbered(at);
        let like =
            |set: &&mut Likes| set.stem == stem && set.channels.first().is_some_and(|first| alike(first, channel));
        match sets.iter_mut().find(like) {
            Some(set) => set.channels.push(channel),
            None => sets.push(Likes { channels: vec![channel], stem }),
        }
    }
    sets
}

fn alike(a: &Channel, b: &Channel) -> bool {
    (a.samples, &a.unit, a.sample_rate_hz) == (b.samples, &b.unit, b.sample_rate_hz)
}

/// The name of a channel that ends with a number, without it: `acc` of `acc2`, `y` of `y[3]`.
fn stem(location: &str) -> Option<&str> {
    let bare = location.trim_end_matches(['}', ']', ')']);
    let stem = bare.trim_end_matches(|c: char| c.is_ascii_digit());
    (stem.len() < bare.len()).then_some(stem)
}

/// The set of the best channel, unless another has more that ring, and several channels. A deflection is chosen by its
/// name.
fn chosen<'a>(sets: Vec<Likes<'a>>, best: &Channel, file: &FirstFile<'a>) -> Vec<&'a Channel> {
    let holds_best = |set: &Likes| set.channels.iter().any(|channel| channel.location == best.location);
    let own = sets.iter().position(holds_best);
    let named = best.location.to_lowercase().contains("defl");
    let mut left = MOST_SEARCHED;
    let mut rank = |set: &Likes| {
        let searched = set.channels.len().min(left);
        left -= searched;
        let ringing = set.channels.iter().take(searched).filter(|channel| file.rings(channel)).count();
        (set.channels.len() > 1 && ringing > 0, ringing)
    };
    let number = match own {
        Some(own) if named || sets.len() == 1 => Some(own),
        _ => {
            let ranks: Vec<(bool, usize)> = sets.iter().map(&mut rank).collect();
            (0..sets.len()).rev().max_by_key(|&number| (ranks.get(number), Some(number) == own))
        }
    };
    number.and_then(|number| sets.into_iter().nth(number)).map(|set| set.channels).unwrap_or_default()
}

/// What is said of the channels that are not taken, by why; none where all are.
pub fn left_out(source: &Source, taken: &[&Channel]) -> Option<String> {
    let (first, driving) = (*taken.first()?, driving(source));
    let mut by_reason: Vec<(String, Vec<&str>)> = Vec::new();
    let others = source.channels.iter().filter(|channel| !channel.is_axis);
    for channel in others.filter(|channel| taken.iter().all(|one| one.location != channel.location)) {
        let drives = driving.iter().any(|one| one.location == channel.location);
        let why = why(channel, first, drives);
        match by_reason.iter_mut().find(|(known, _)| *known == why) {
            Some((_, names)) => names.push(&channel.location),
            None => by_reason.push((why, vec![&channel.location])),
        }
    }
    let line = |(why, names): &(String, Vec<&str>)| format!("{} ({why})", some_of(names));
    let lines: Vec<String> = by_reason.iter().map(line).collect();
    (!lines.is_empty())
        .then(|| format!("channels left out: {}; --channel NAME takes those that it names", lines.join("; ")))
}

/// Why a channel is not taken with the first of those that are.
fn why(channel: &Channel, first: &Channel, drives: bool) -> String {
    let Some(values) = &channel.values else { return "listed only".to_owned() };
    let unit = |channel: &Channel| match channel.unit.is_empty() {
        true => "without a unit".to_owned(),
        false => format!("in {}", channel.unit),
    };
    if let Some(why) = &channel.no_sensor {
        why.clone()
    } else if drives {
        format!("an excitation by its name or unit: --input {}", channel.location)
    } else if channel.samples != first.samples {
        format!("{} samples, not {}", channel.samples, first.samples)
    } else if channel.sample_rate_hz != first.sample_rate_hz {
        channel.sample_rate_hz.map_or_else(|| "without a rate".to_owned(), |rate| format!("at {} Hz", number(rate)))
    } else if values.least == values.largest {
        "constant".to_owned()
    } else if values.codes < LEAST_CODES {
        format!("only {} different values", values.codes)
    } else if values.missing > 0 {
        format!("{} samples missing", values.missing)
    } else if channel.unit != first.unit {
        unit(channel)
    } else {
        "of another name".to_owned()
    }
}
