//! Which channels of a file are the signals, which the inputs.

use super::choice::Question;
use super::pipeline::Wanted;
use super::recordings::Source;
use crate::inspect::{Channel, LEAST_CODES, Values};

/// Fewer changes of a switch are steps, each a test of its own.
const LEAST_CHANGES: usize = 20;
/// How names of inputs begin.
const INPUTS: [&str; 10] =
    ["input", "force", "hammer", "excit", "drive", "stimul", "torque", "actuat", "setpoint", "command"];

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

/// Inputs: as they were named, else those that drive, of these the forces if there are some. Errors: what is not known, and
/// how to say it.
pub fn inputs<'a>(source: &'a Source, wanted: &Wanted<'_>) -> Result<Vec<&'a Channel>, Question> {
    let found: Vec<&Channel> = match wanted.inputs {
        [] => {
            let all = driving(source);
            let forces: Vec<&Channel> = all.iter().copied().filter(|channel| is_force(channel)).collect();
            if forces.is_empty() { all } else { forces }
        }
        names => names.iter().map(|name| named(source, name)).collect::<Result<_, _>>()?,
    };
    match found.is_empty() {
        false => Ok(found),
        true => Err(no_input(source)),
    }
}

/// Why a file has no input: no signals, a single one, or none that is named so.
fn no_input(source: &Source) -> Question {
    let signals: Vec<&Channel> = source.channels.iter().filter(usable).collect();
    let file = source.file.display();
    match signals[..] {
        [] => nothing(source),
        [only] => {
            let problem = format!("{file}: {} is its only signal, wanted an input and an output", only.location);
            (problem, Some("--goal names what to find in one signal".to_owned()))
        }
        _ => {
            let help = format!("say with --input which of {} drives the others", listed(&signals));
            (format!("{file} does not say which channel is the input"), Some(help))
        }
    }
}

/// What may be an output: as they were named, else all signals of the inputs' length that drive nothing, or if there are
/// none, all that are no inputs. Errors: there is none; named ones of several units.
pub fn outputs<'a>(source: &'a Source, wanted: &Wanted<'_>, inputs: &[&Channel]) -> Result<Vec<&'a Channel>, Question> {
    let of = |channels: &[&Channel], channel: &Channel| channels.iter().any(|one| one.location == channel.location);
    let found = match wanted.channels {
        [] => {
            let signals = source.channels.iter().filter(usable);
            let others: Vec<&Channel> = signals
                .filter(|channel| !of(inputs, channel))
                .filter(|channel| inputs.first().is_none_or(|input| input.samples == channel.samples))
                .collect();
            let driving = driving(source);
            let moved: Vec<&Channel> = others.iter().copied().filter(|channel| !of(&driving, channel)).collect();
            if moved.is_empty() { others } else { moved }
        }
        names => names.iter().map(|name| named(source, name)).collect::<Result<Vec<&Channel>, _>>()?,
    };
    let unlike = found.iter().find(|channel| found.first().is_some_and(|first| first.unit != channel.unit));
    match (found.first(), unlike) {
        (None, _) => {
            let problem = format!("{} has no further channel of that length", source.file.display());
            Err((problem, Some("--channel names the output, --input the input".to_owned())))
        }
        (Some(first), Some(other)) if !wanted.channels.is_empty() => {
            let problem = format!("--channel {} and {} are of different units", first.location, other.location);
            Err((problem, Some("write a config for each unit".to_owned())))
        }
        _ => Ok(found),
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

/// The channels that drive others: named as an input, or in a unit of force beside what is in another. None where
/// nothing else is a signal. Two values are enough if they alternate: binary sequences drive, after a few steps a structure
/// rings freely.
pub fn driving(source: &Source) -> Vec<&Channel> {
    let alternates = |values: &Values| values.codes >= LEAST_CODES || values.changes >= LEAST_CHANGES;
    let varies = |values: &Values| alternates(values) && values.missing == 0;
    let drives = |channel: &&Channel| {
        let known = !channel.is_axis && channel.values.as_ref().is_some_and(varies);
        known && is_input(&channel.location, &channel.unit)
    };
    let found: Vec<&Channel> = source.channels.iter().filter(drives).collect();
    let moved = |channel: &Channel| {
        usable(&channel) && !drives(&channel) && found.iter().any(|input| input.samples == channel.samples)
    };
    if source.channels.iter().any(moved) { found } else { Vec::new() }
}

/// Units of force, in lower case.
const FORCES: [&str; 7] = ["n", "kn", "mn", "newton", "newtons", "lbf", "kgf"];

fn is_force(channel: &Channel) -> bool {
    let name = last_name(&channel.location).to_lowercase();
    FORCES.contains(&channel.unit.to_lowercase().as_str()) || ["force", "hammer"].iter().any(|f| name.starts_with(f))
}

/// Whether a channel is an input by its name (force, hammer, drive, `u`, `u2`, `uBenchMark`) or in a unit of force.
pub fn is_input(location: &str, unit: &str) -> bool {
    let name = last_name(location);
    let lower = name.to_lowercase();
    let after_u = name.strip_prefix('u').and_then(|rest| rest.chars().next());
    let u =
        name == "u" || after_u.is_some_and(|next| next.is_ascii_digit() || next.is_ascii_uppercase() || next == '_');
    u || INPUTS.iter().any(|begin| lower.starts_with(begin)) || FORCES.contains(&unit.to_lowercase().as_str())
}

fn last_name(location: &str) -> &str {
    location.rsplit(['/', '.']).next().unwrap_or_default()
}

/// Whether a channel holds a signal.
pub fn usable(channel: &&Channel) -> bool {
    let signal = |values: &Values| values.codes >= LEAST_CODES && values.missing == 0;
    !channel.is_axis && channel.no_sensor.is_none() && channel.values.as_ref().is_some_and(signal)
}

/// That a file has no signal.
pub fn nothing(source: &Source) -> Question {
    let file = source.file.display();
    let lacking = source.channels.iter().filter(|channel| !channel.is_axis);
    let lacking = lacking.filter_map(|channel| Some((channel, channel.values.as_ref()?.missing)));
    match lacking.max_by_key(|(_, missing)| *missing).filter(|(_, missing)| *missing > 0) {
        Some((channel, missing)) => {
            let problem = format!(
                "{file}: {missing} of {} samples of {} are missing, and no other channel is a signal",
                channel.samples, channel.location
            );
            let help = "fill them in, or cut the file to a stretch that has all".to_owned();
            (problem, Some(help))
        }
        None => {
            let help = "`afmid inspect` says what recordings hold".to_owned();
            (format!("{file}: {}", source.reason), Some(help))
        }
    }
}
