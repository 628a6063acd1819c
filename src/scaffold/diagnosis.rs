//! What a diagnosis is of, by what the recordings look like: releases of a lever, free decays, input and output, an axis
//! in its loop, a steady oscillation. Where the channels do not say what they are, they are asked for.

use std::ops::Range;

use super::channels::{driving, inputs, is_named, named, outputs, some_of, usable};
use super::choice::{Choice, Question, by_looks, one_channel};
use super::first_file::FirstFile;
use super::lever::is_of_a_lever;
use super::pipeline::Wanted;
use super::recordings::Source;
use crate::cli::Goal;
use crate::inspect::Channel;

/// What a diagnosis needs beside the signals.
#[derive(Debug, Default)]
pub struct Diagnosed<'a> {
    /// The input that the output is to follow, of an axis in its loop.
    pub reference: Option<&'a Channel>,
    /// Samples that are learnt from, and those that follow; none where the stage's halves are meant.
    pub stretches: Option<[Range<usize>; 2]>,
}

/// What is diagnosed. Errors: what is not known, and how to say it; nothing that can be diagnosed.
pub fn diagnosis<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>) -> Result<Choice<'a>, Question> {
    let source = file.source;
    if let Some(reference) = wanted.reference {
        return axis(file, wanted, reference);
    }
    let several = source.files.len() > 1;
    let looks = match by_looks(file, &Wanted { goal: None, ..*wanted }) {
        Err(_) if is_of_a_lever(source) && wanted.inputs.is_empty() => return releases(source, wanted, String::new()),
        // one that only shakes, or rings in several records
        Ok(looks)
            if is_of_a_lever(source) && (looks.goal == Goal::Thermal || looks.goal == Goal::Steady && several) =>
        {
            return releases(source, wanted, String::new());
        }
        looks => looks,
    };
    if wanted.inputs.is_empty() && wanted.channels.is_empty() && !is_clear(file, looks.as_ref().ok()) {
        return Err(unclear(file, wanted));
    }
    let looks = looks?;
    match looks.goal {
        Goal::SnapOff => releases(source, wanted, looks.why),
        Goal::Decay => Ok(Choice { diagnosis: Some(Diagnosed::default()), ..looks }),
        Goal::Steady => steady(source, looks),
        Goal::InputOutput | Goal::Frf if !looks.inputs.is_empty() => forced(file, wanted, looks),
        _ => Err(nothing_to_diagnose(source, &looks)),
    }
}

fn releases<'a>(source: &'a Source, wanted: &Wanted<'_>, why: String) -> Result<Choice<'a>, Question> {
    one_channel(source, wanted, Goal::Diagnosis, why)
}

/// Whether a file's channels say what they are: those that are taken are all its signals, and several are sensors of one
/// motion by a stated unit, by cells or by the names that their author numbered.
fn is_clear(file: &FirstFile<'_>, looks: Option<&Choice<'_>>) -> bool {
    let signals: Vec<&Channel> = file.source.channels.iter().filter(usable).collect();
    let Some(looks) = looks else { return signals.len() < 2 };
    // input and output ask for themselves
    if looks.goal == Goal::SnapOff || !looks.inputs.is_empty() {
        return true;
    }
    let taken = |channel: &&&Channel| {
        let mut all = looks.channels.iter().copied().chain(looks.force);
        all.any(|own| own.location == channel.location)
    };
    let all_taken = signals.iter().filter(taken).count() == signals.len();
    let has_hammer = || looks.force.is_none() && file.hammer().is_some();
    all_taken && (looks.channels.len() < 2 || are_sensors(&looks.channels) && !has_hammer())
}

/// Whether channels are sensors of one motion by what their author wrote. Numbers of columns are the reader's.
fn are_sensors(channels: &[&Channel]) -> bool {
    let stated = channels.iter().all(|channel| !channel.unit.is_empty());
    let of_author = |channel: &&Channel| {
        let name = channel.location.trim_end_matches(|c: char| c.is_ascii_digit());
        channel.location.ends_with('}') || name.len() < channel.location.len() && !name.ends_with("column_")
    };
    stated || channels.iter().all(of_author)
}

/// That a file does not say what its channels are.
fn unclear(file: &FirstFile<'_>, wanted: &Wanted<'_>) -> Question {
    let source = file.source;
    let signals: Vec<&Channel> = source.channels.iter().filter(usable).collect();
    let problem = format!("{} does not say what its channels {} are", source.file.display(), listed(&signals));
    let mut help = vec![
        "--channel NAME is the signal (once per sensor of one motion)".to_owned(),
        "--input NAME what drives it, if that was measured".to_owned(),
        "--reference NAME what it is to follow, if a controller makes the input from both".to_owned(),
    ];
    help.extend(file.hammer());
    let rate = |channel: &&Channel| channel.sample_rate_hz.is_some();
    if wanted.rate_hz.is_none() && !signals.iter().any(rate) {
        help.push("no sample rate is stated: --rate HZ".to_owned());
    }
    (problem, Some(help.join("; ")))
}

fn listed(channels: &[&Channel]) -> String {
    some_of(&channels.iter().map(|channel| channel.location.as_str()).collect::<Vec<_>>())
}

/// Measured input and output: free decays after the hits of a hammer, else both over the whole record. Errors: several
/// outputs or files.
fn forced<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>, looks: Choice<'a>) -> Result<Choice<'a>, Question> {
    let source = file.source;
    let all = outputs(source, wanted, &looks.inputs)?;
    if looks.struck
        && looks.channels.len() == all.len()
        && let [force] = looks.inputs[..]
        && let (_, found) = file.search(&looks.channels, Some(force), wanted)?
        && !found.decays.is_empty()
    {
        let why = format!("free decays of {} after the hits of {}", listed(&looks.channels), force.location);
        let diagnosis = Some(Diagnosed::default());
        let choice = Choice::of(Goal::Decay, looks.channels, why);
        return Ok(Choice { force: Some(force), notes: looks.notes, diagnosis, ..choice });
    }
    let output = one_output(file, wanted, &looks.inputs)?;
    one_file(source, "input and output")?;
    let (longest, note) = longest(file, &looks.inputs, output, wanted)?;
    let (middle, waits) = middle(file, &looks.inputs, &longest)?;
    let is_whole = note.is_none() && waits.is_none();
    let stretches = (!is_whole).then_some([longest.start..middle, middle..longest.end]);
    let measured = if looks.inputs.len() > 1 { "inputs" } else { "input" };
    let (names, record) = (listed(&looks.inputs), source.name());
    let why = format!("measured {measured} {names} and output {} in {record}", output.location);
    let notes = looks.notes.into_iter().chain(note).chain(waits).collect();
    let diagnosis = Some(Diagnosed { reference: None, stretches });
    Ok(Choice { inputs: looks.inputs, notes, diagnosis, ..Choice::of(Goal::InputOutput, vec![output], why) })
}

/// Where learning from a stretch of inputs and output ends and judging begins: in the middle, or in that of what comes after the
/// first change where no input moves before; and what to say then. Errors: the inputs cannot be read.
fn middle(
    file: &FirstFile<'_>,
    inputs: &[&Channel],
    stretch: &Range<usize>,
) -> Result<(usize, Option<String>), Question> {
    let middle = stretch.start.midpoint(stretch.end);
    let mut first: Option<usize> = None;
    for input in inputs {
        let values = file.samples(input)?;
        let own = values.get(stretch.clone()).unwrap_or_default();
        let change = own.iter().position(|value| Some(value) != own.first()).map(|place| stretch.start + place);
        first = first.into_iter().chain(change).min();
    }
    let Some(late) = first.filter(|change| *change >= middle) else { return Ok((middle, None)) };
    let end = late.midpoint(stretch.end);
    let said = format!("no input moves before sample {late}: what is learnt from reaches to sample {end}");
    Ok((end, Some(said)))
}

/// An axis in its control loop: what it is to follow, the drive, and at most one more input.
fn axis<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>, reference: &str) -> Result<Choice<'a>, Question> {
    let source = file.source;
    let reference = named(source, reference)?;
    let other = |channel: &&Channel| channel.location != reference.location;
    let drives: Vec<&Channel> = match wanted.inputs {
        [] => driving(source).into_iter().filter(other).collect(),
        _ => inputs(source, wanted)?.into_iter().filter(other).collect(),
    };
    let is_drive = match drives.len() {
        1 => true,
        2 => !wanted.inputs.is_empty(),
        _ => false,
    };
    if !is_drive {
        let signals: Vec<&Channel> = source.channels.iter().filter(usable).filter(other).collect();
        let problem = match drives[..] {
            [] => format!("{} does not say which channel is the drive", source.file.display()),
            _ => format!("{}: the drive may be {}", source.file.display(), listed(&drives)),
        };
        let help = format!(
            "say with --input which of {} the controller sets, and with a second --input what else pushes the axis",
            listed(&signals)
        );
        return Err((problem, Some(help)));
    }
    let all: Vec<&Channel> = std::iter::once(reference).chain(drives).collect();
    let output = one_output(file, wanted, &all)?;
    one_file(source, "an axis in its loop")?;
    let (longest, note) = longest(file, &all, output, wanted)?;
    // a loop is learnt from as a whole: its motions back and forth differ
    let last = longest.end.saturating_sub(1).max(longest.start);
    let stretches = Some([longest.start..last, last..longest.end]);
    let why = format!(
        "{} follows {}, driven by {}, in {}",
        output.location,
        reference.location,
        listed(&all[1..]),
        source.name()
    );
    let scale =
        "forces are in the unit of the drive: `drive_scale` and `force_unit` say how much force that is".to_owned();
    let notes = note.into_iter().chain([scale]).collect();
    let diagnosis = Some(Diagnosed { reference: Some(reference), stretches });
    Ok(Choice { inputs: all, notes, diagnosis, ..Choice::of(Goal::InputOutput, vec![output], why) })
}

/// The output of the inputs: as it was named, or the only channel that may be it. Errors: several.
fn one_output<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>, inputs: &[&Channel]) -> Result<&'a Channel, Question> {
    let source = file.source;
    let found = outputs(source, wanted, inputs)?;
    let is_input = |channel: &&&Channel| inputs.iter().any(|input| input.location == channel.location);
    match (found.iter().find(is_input), &found[..]) {
        (Some(both), _) => {
            let help = "name another channel with --channel".to_owned();
            Err((format!("{} is input and output at once", both.location), Some(help)))
        }
        (None, [only]) => Ok(*only),
        _ => {
            let problem = format!("{} has several channels that may be the output", source.file.display());
            let help = format!("say with --channel which one of {}: a diagnosis is of one", listed(&found));
            Err((problem, Some(help)))
        }
    }
}

/// Errors: several files.
fn one_file(source: &Source, what: &str) -> Result<(), Question> {
    if source.files.len() < 2 {
        return Ok(());
    }
    let problem = format!("{} files, wanted one record of {what}", source.files.len());
    let help = "give one file: each record has a diagnosis of its own; --input names the file of the input if the files are \
                one measurement";
    Err((problem, Some(help.to_owned())))
}

fn steady<'a>(source: &Source, looks: Choice<'a>) -> Result<Choice<'a>, Question> {
    one_file(source, "a steady oscillation")?;
    Ok(Choice { diagnosis: Some(Diagnosed::default()), ..looks })
}

/// The longest stretch of inputs and output without an interruption, and what to say if that is not all.
fn longest(
    file: &FirstFile<'_>,
    inputs: &[&Channel],
    output: &Channel,
    wanted: &Wanted<'_>,
) -> Result<(Range<usize>, Option<String>), Question> {
    let all: Vec<&Channel> = inputs.iter().copied().chain([output]).collect();
    let (samples, mut ends) = file.together(&all, wanted)?;
    ends.push(samples);
    ends.sort_unstable();
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let longest = starts.zip(&ends).map(|(first, end)| first..(*end).min(samples)).max_by_key(Range::len);
    let longest = longest.unwrap_or(0..samples);
    let note = (longest.len() < samples).then(|| {
        format!("the recording was interrupted: samples {} to {} of {samples} are taken", longest.start, longest.end)
    });
    Ok((longest, note))
}

/// Why recordings are nothing that causes could be found in.
fn nothing_to_diagnose(source: &Source, looks: &Choice<'_>) -> Question {
    let file = source.file.display();
    match looks.goal {
        Goal::Thermal => {
            let help = "--input NAME names a measured force; --goal thermal of `new pipeline` fits the resonance";
            (format!("{file}: noise and no measured input: nothing to hold a model against"), Some(help.to_owned()))
        }
        _ => {
            let help = "give records over time; --goal frf of `new pipeline` fits their modes";
            (format!("{file}: {}: a diagnosis is of records over time", looks.why), Some(help.to_owned()))
        }
    }
}

/// Signals beside those that are diagnosed, where none is named as an input: one of them may drive.
pub fn beside(source: &Source, choice: &Choice<'_>) -> Option<String> {
    let of_decays = matches!(choice.goal, Goal::Decay | Goal::Steady) && choice.force.is_none();
    let first = choice.channels.first().filter(|_| choice.diagnosis.is_some() && of_decays)?;
    let taken = |channel: &Channel| choice.channels.iter().any(|own| is_named(channel, &own.location));
    let others = source.channels.iter().filter(usable).filter(|channel| channel.samples == first.samples);
    let others: Vec<&Channel> = others.filter(|channel| !taken(channel)).collect();
    let names = listed(&others);
    (!others.is_empty()).then(|| format!("not used: {names}; --input NAME if one of them drives what is diagnosed"))
}
