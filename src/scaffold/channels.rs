//! Which channels of a file are the signals, which the inputs.

use super::choice::Question;
use super::pipeline::Wanted;
use super::recordings::Source;
use crate::inspect::{Channel, LEAST_CODES, Values};

/// How names of inputs begin.
const INPUTS: [&str; 8] = ["input", "force", "hammer", "excit", "drive", "stimul", "torque", "actuat"];

/// A channel by its name. Errors: there is none.
pub fn named<'a>(source: &'a Source, name: &str) -> Result<&'a Channel, Question> {
    let found = source.channels.iter().find(|channel| is_named(channel, name));
    found.ok_or_else(|| {
        let names: Vec<&str> = source.channels.iter().map(|channel| channel.location.as_str()).collect();
        (format!("{} has no channel `{name}`", source.file.display()), Some(format!("it has {}", names.join(", "))))
    })
}

/// Whether a channel has that name.
pub fn is_named(channel: &Channel, name: &str) -> bool {
    same_name(&channel.location, name)
}

/// Whether a location is that name, with or without the stroke that it begins with.
pub fn same_name(location: &str, name: &str) -> bool {
    let bare = |location: &str| location.strip_prefix('/').unwrap_or(location).to_owned();
    bare(location) == bare(name)
}

/// Inputs: as they were named, else by their names. Errors: what is not known, and how to say it.
pub fn inputs<'a>(source: &'a Source, wanted: &Wanted<'_>) -> Result<Vec<&'a Channel>, Question> {
    let signals: Vec<&Channel> = source.channels.iter().filter(usable).collect();
    let found: Vec<&Channel> = match wanted.inputs {
        [] => signals.iter().copied().filter(|channel| drives(channel)).collect(),
        names => names.iter().map(|name| named(source, name)).collect::<Result<_, _>>()?,
    };
    match found.is_empty() {
        false => Ok(found),
        true => {
            let help = format!("say with --input which of {} drives the others", listed(&signals));
            Err((format!("{} does not say which channel is the input", source.file.display()), Some(help)))
        }
    }
}

/// Outputs: as they were named, else all further channels of that length; `several` of one unit if so. Errors: what is
/// not known, and how to say it.
pub fn outputs<'a>(
    source: &'a Source,
    wanted: &Wanted<'_>,
    inputs: &[&Channel],
    several: bool,
) -> Result<Vec<&'a Channel>, Question> {
    let signals = source.channels.iter().filter(usable);
    let others: Vec<&Channel> = signals
        .filter(|channel| inputs.iter().all(|input| input.location != channel.location))
        .filter(|channel| inputs.first().is_none_or(|input| input.samples == channel.samples))
        .collect();
    let found = match wanted.channels {
        [] => others.clone(),
        names => names.iter().map(|name| named(source, name)).collect::<Result<Vec<&Channel>, _>>()?,
    };
    let of_one_unit = found.iter().all(|channel| channel.unit == found[0].unit);
    match (&found[..], wanted.channels) {
        ([], _) => {
            let problem = format!("{} has no further channel of that length", source.file.display());
            Err((problem, Some("--channel names the output, --input the input".to_owned())))
        }
        ([_], _) => Ok(found),
        _ if several && of_one_unit => Ok(found),
        (_, []) => {
            let problem = format!("{} has several channels that could be the output", source.file.display());
            Err((problem, Some(format!("say with --channel which one of {}", listed(&others)))))
        }
        (_, names) => {
            let problem = format!("one output is fitted to a measured input, --channel {} is another", names[1]);
            Err((problem, Some("write a config for each output; several of one unit go with --goal frf".to_owned())))
        }
    }
}

/// The first names; more are counted.
pub fn some_of<T: AsRef<str>>(names: &[T]) -> String {
    const MOST: usize = 8;
    let shown: Vec<&str> = names.iter().take(MOST).map(AsRef::as_ref).collect();
    let more = if names.len() > MOST { format!(" and {} more", names.len() - MOST) } else { String::new() };
    shown.join(", ") + &more
}

fn listed(channels: &[&Channel]) -> String {
    channels.iter().map(|channel| channel.location.as_str()).collect::<Vec<_>>().join(", ")
}

/// Whether a channel is named as an input.
pub fn drives(channel: &Channel) -> bool {
    is_input(&channel.location)
}

/// Whether a location is that of an input by its name: force, hammer, drive, `u`, `u2`, `uBenchMark`.
pub fn is_input(location: &str) -> bool {
    let name = location.rsplit(['/', '.']).next().unwrap_or_default();
    let lower = name.to_lowercase();
    let after_u = name.strip_prefix('u').and_then(|rest| rest.chars().next());
    let u =
        name == "u" || after_u.is_some_and(|next| next.is_ascii_digit() || next.is_ascii_uppercase() || next == '_');
    u || INPUTS.iter().any(|begin| lower.starts_with(begin))
}

/// Whether a channel holds a signal.
pub fn usable(channel: &&Channel) -> bool {
    let signal = |values: &Values| values.codes >= LEAST_CODES && values.missing == 0;
    !channel.is_axis && channel.values.as_ref().is_some_and(signal)
}

/// That a file has no signal.
pub fn nothing(source: &Source) -> Question {
    let help = "`afmid inspect` says what recordings hold".to_owned();
    (format!("{}: {}", source.file.display(), source.reason), Some(help))
}
