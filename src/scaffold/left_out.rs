//! Recordings that a config leaves out, with the commands that make theirs.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::rates_agree;
use clap::ValueEnum;

use super::channels::some_of;
use super::groups::Group;
use super::recordings::Source;
use crate::batch::shell::quoted;
use crate::cli::{Goal, RecordingsArgs};
use crate::show::number as shown;

/// Groups that are named; more are counted.
const MOST: usize = 8;

/// What of the recordings is not in the config, a line each.
pub fn left_out(source: &Source, args: &RecordingsArgs, goal: Option<Goal>, config: &Path) -> Vec<String> {
    let others = &source.others;
    let mut lines: Vec<String> = others
        .iter()
        .take(MOST)
        .enumerate()
        .map(|(number, group)| match group.lacks.is_empty() {
            true => {
                let command = command(source, number, args, goal, config);
                format!("left out: {}; for a config of them: {command}", group.said())
            }
            false => format!("left out: {}, without {}", group.said(), group.lacks.join(", ")),
        })
        .collect();
    if others.len() > MOST {
        let files: usize = others.iter().skip(MOST).map(|group| group.files.len()).sum();
        lines.push(format!("left out: {files} files of {} more kinds", others.len() - MOST));
    }
    lines.extend(skipped(&source.skipped));
    lines
}

/// Files that are no recordings, by why.
fn skipped(files: &[(PathBuf, String)]) -> Vec<String> {
    let mut by_reason: Vec<(&str, Vec<String>)> = Vec::new();
    for (path, why) in files {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match by_reason.iter_mut().find(|(known, _)| known == why) {
            Some((_, names)) => names.push(name),
            None => by_reason.push((why, vec![name])),
        }
    }
    let line = |(why, names): &(&str, Vec<String>)| format!("skipped: {}: {why}", some_of(names));
    by_reason.iter().map(line).collect()
}

/// The command that makes a config of one of the other groups.
fn command(source: &Source, number: usize, args: &RecordingsArgs, goal: Option<Goal>, config: &Path) -> String {
    let Some(group) = source.others.get(number) else { return String::new() };
    let mut words = vec!["afmid new pipeline".to_owned()];
    let rate = rate_that_chooses(source, number).filter(|_| args.paths.iter().all(|path| path.is_dir()));
    let files = if rate.is_some() { &args.paths } else { &group.files };
    words.extend(files.iter().map(quoted));
    let name = |value: Option<clap::builder::PossibleValue>| value.map(|value| value.get_name().to_owned());
    if args.resample {
        words.push("--resample".to_owned());
    }
    let mut say = |flag: &str, value: String| words.push(format!("{flag} {}", quoted(value)));
    // a rate that files state themselves, or their times or frequencies, is not that of the files that were taken
    let own = group.axes.mean_rate_hz.filter(|_| group.rate_hz().is_none()).map(shown);
    let carried = args.rate.filter(|_| source.rate_hz.or(group.rate_hz()).is_none() && !group.axes.any);
    if let Some(rate) = rate.or(carried).map(|rate| rate.to_string()).or(own) {
        say("--rate", rate);
    }
    name(goal.and_then(|goal| goal.to_possible_value())).into_iter().for_each(|goal| say("--goal", goal));
    name(args.records_are.and_then(|what| what.to_possible_value())).into_iter().for_each(|what| say("--as", what));
    args.channel.iter().for_each(|channel| say("--channel", channel.clone()));
    args.input.iter().for_each(|input| say("--input", input.clone()));
    args.reference.iter().for_each(|reference| say("--reference", reference.clone()));
    args.unit.iter().for_each(|unit| say("--unit", unit.clone()));
    let stem = config.file_stem().unwrap_or_default().to_string_lossy();
    let file = config.with_file_name(format!("{stem}-{}.toml", number + 2));
    say("-o", file.to_string_lossy().into_owned());
    words.join(" ")
}

/// The rate by which `--rate` takes this group out of its folder: no other of as many files or more has it.
fn rate_that_chooses(source: &Source, number: usize) -> Option<f64> {
    let group = source.others.get(number)?;
    let rate = group.rate_hz()?;
    let at = |other: Option<f64>| other.is_some_and(|other| rates_agree(other, rate, 0.0));
    let larger = |other: &Group| at(other.rate_hz()) && other.files.len() >= group.files.len();
    let rival = source.others.iter().enumerate().any(|(at, other)| at != number && larger(other));
    (!rival && !at(source.rate_hz)).then_some(rate)
}
