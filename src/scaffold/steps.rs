//! Channels of few levels that others follow: what drives in steps is no signal, but it may be the input.

use std::collections::BTreeMap;

use super::channels::is_input;
use super::first_file::FirstFile;
use super::pipeline::Wanted;
use super::recordings::Source;
use crate::batch::shell::quoted;
use crate::inspect::Channel;

/// Levels of what drives in steps.
const MOST_LEVELS: usize = 20;
/// Share of a signal's variance that lies between the levels of another channel, at least, where it follows that.
const FOLLOWS: f64 = 0.1;

/// That a channel of few levels may drive those that are taken, and the command that takes it for the input. None where
/// there is no such channel.
pub fn hint(file: &FirstFile<'_>, taken: &[&Channel], wanted: &Wanted<'_>) -> Option<String> {
    let values = file.samples(taken.first()?).ok()?;
    let follows =
        |channel: &&Channel| file.samples(channel).is_ok_and(|levels| share_between(&levels, &values) > FOLLOWS);
    let driver = named(file, taken).or_else(|| beside(file, taken).find(follows))?;
    let levels = driver.values.as_ref().map_or(0, |values| values.codes);
    let name = &driver.location;
    let command = command(file.source, name, wanted);
    Some(format!("{name} has {levels} levels: --input {name} if it drives the others ({command})"))
}

/// The channel of few levels that is named as an input, beside those that are taken.
pub fn named<'a>(file: &FirstFile<'a>, taken: &[&Channel]) -> Option<&'a Channel> {
    beside(file, taken).find(|channel| is_input(&channel.location, &channel.unit))
}

/// Channels of few levels beside those that are taken.
fn beside<'a>(file: &FirstFile<'a>, taken: &[&Channel]) -> impl Iterator<Item = &'a Channel> {
    let others = file.source.channels.iter().filter(|one| taken.iter().all(|own| own.location != one.location));
    others.filter(|channel| taken.first().is_some_and(|first| has_steps(channel, first)))
}

fn has_steps(channel: &Channel, signal: &Channel) -> bool {
    let few = channel.values.as_ref().is_some_and(|v| (2..=MOST_LEVELS).contains(&v.codes) && v.missing == 0);
    few && !channel.is_axis && channel.samples == signal.samples && channel.sample_rate_hz == signal.sample_rate_hz
}

/// Share of the variance of `values` that lies between the levels beside them.
fn share_between(levels: &[f64], values: &[f64]) -> f64 {
    let mut sums: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for (level, value) in levels.iter().zip(values).filter(|(_, value)| value.is_finite()) {
        let (n, s) = sums.entry(level.to_bits()).or_default();
        (*n, *s) = (*n + 1.0, *s + value);
        (count, sum, squares) = (count + 1.0, sum + value, squares + value * value);
    }
    let total = squares - sum * sum / count;
    let between = sums.values().map(|(n, s)| s * s / n).sum::<f64>() - sum * sum / count;
    if total > 0.0 { between / total } else { 0.0 }
}

fn command(source: &Source, input: &str, wanted: &Wanted<'_>) -> String {
    let files = source.patterns.iter().map(quoted).collect::<Vec<_>>().join(" ");
    let rate = wanted.rate_hz.map(|rate| format!(" --rate {rate}")).unwrap_or_default();
    format!("afmid new pipeline {files}{rate} --input {}", quoted(input))
}

#[cfg(test)]
#[test]
fn a_signal_that_follows_has_its_variance_between_the_levels() {
    let levels: Vec<f64> = (0..400).map(|k| f64::from(k / 100 % 2)).collect();
    let noise = |k: usize| ((k * k) as f64).sin();
    let follows: Vec<f64> = levels.iter().enumerate().map(|(k, level)| 3.0 * level + noise(k)).collect();
    assert!(share_between(&levels, &follows) > 0.5);
    assert!(share_between(&levels, &(0..400).map(noise).collect::<Vec<f64>>()) < FOLLOWS);
    assert_eq!(share_between(&levels, &[1.0; 400]), 0.0);
}
