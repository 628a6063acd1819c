//! Power densities that others have averaged: columns beside frequencies.

use afmid_pipeline::toml::{Table, Value};

use super::channels::{is_named, named, some_of};
use super::choice::{Choice, Question};
use super::first_file::FirstFile;
use super::pipeline::{Wanted, path};
use super::recordings::Source;
use crate::cli::Goal;
use crate::inspect::Channel;

/// What names of densities contain, in lower case.
const NAMES: [&str; 3] = ["psd", "density", "densities"];

/// The config of a file's power density; none where the file holds a record, responses, or nothing that says it is a
/// density. Errors: several files.
pub fn density<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>) -> Result<Option<Choice<'a>>, Question> {
    let source = file.source;
    let asked = wanted.goal == Some(Goal::Thermal);
    if wanted.rate_hz.is_some() || !(asked || matches!(wanted.goal, None | Some(Goal::Modes))) {
        return Ok(None);
    }
    let Some((axis, spectra)) = file.spectra(asked) else { return Ok(None) };
    let of = |location: &str| source.channels.iter().find(|channel| channel.location == location);
    let spectra: Vec<&Channel> = spectra.iter().filter_map(|location| of(location)).collect();
    let densities: Vec<&Channel> = spectra.iter().copied().filter(|channel| says_density(channel)).collect();
    let chosen = match (wanted.channels, &densities[..], &spectra[..]) {
        ([name, ..], _, _) if asked || densities.iter().any(|channel| is_named(channel, name)) => named(source, name)?,
        ([], [first, ..], _) => *first,
        ([], [], [only]) if asked && is_positive(only) => *only,
        _ => return Ok(None),
    };
    if source.files.len() > 1 {
        let problem = format!("{} files of power densities, wanted one", source.files.len());
        return Err((problem, Some("give one file, for a config of its own".to_owned())));
    }
    let why = format!("{}: {}, a power density over the frequencies {axis}", source.name(), chosen.location);
    let others: Vec<&str> =
        spectra.iter().filter(|one| one.location != chosen.location).map(|one| one.location.as_str()).collect();
    let left_out = format!("channels left out: {}; --channel NAME takes the one that it names", some_of(&others));
    let notes = if others.is_empty() { Vec::new() } else { vec![left_out] };
    Ok(Some(Choice { frequencies: of(&axis), notes, ..Choice::of(Goal::Thermal, vec![chosen], why) }))
}

/// Whether no value is negative: one of a signal's often is, none of a density.
fn is_positive(channel: &Channel) -> bool {
    channel.values.as_ref().is_some_and(|values| values.least >= 0.0)
}

/// The `params` of the stage that reads it.
pub fn params(source: &Source, choice: &Choice<'_>, wanted: Wanted<'_>, folder: &std::path::Path) -> String {
    let text = |text: &str| Value::String(text.to_owned());
    let mut params = Table::new();
    params.insert("file".to_owned(), path(&source.file, folder));
    params.insert("frequency".to_owned(), text(choice.frequencies.map_or("", |axis| &axis.location)));
    let channel = choice.channels[0];
    params.insert("density".to_owned(), text(&channel.location));
    params.insert("unit".to_owned(), text(wanted.unit.or(signal_unit(&channel.unit)).unwrap_or("1")));
    format!("params = {}\n", Value::Table(params))
}

fn says_density(channel: &Channel) -> bool {
    let name = channel.location.rsplit(['/', '.']).next().unwrap_or_default().to_lowercase();
    signal_unit(&channel.unit).is_some() || NAMES.iter().any(|said| name.contains(said))
}

/// The unit of the signal whose density is in that unit: `V` of `V^2/Hz`.
fn signal_unit(unit: &str) -> Option<&str> {
    let squared = unit.trim().strip_suffix("/Hz").or_else(|| unit.trim().strip_suffix("/hz"))?;
    let signal = ["^2", "**2", "²", "2"].iter().find_map(|square| squared.strip_suffix(square))?;
    let bare = signal.trim_matches(['(', ')', ' ']);
    (!bare.is_empty()).then_some(bare)
}

#[cfg(test)]
#[test]
fn a_density_has_the_unit_of_its_signal() {
    for (unit, signal) in
        [("V^2/Hz", Some("V")), ("nm²/Hz", Some("nm")), ("(m/s^2)^2/Hz", Some("m/s^2")), ("V2/Hz", Some("V"))]
    {
        assert_eq!(signal_unit(unit), signal, "{unit}");
    }
    for unit in ["V/Hz", "V/sqrt(Hz)", "dB/Hz", "V", "", "2/Hz"] {
        assert_eq!(signal_unit(unit), None, "{unit}");
    }
}
