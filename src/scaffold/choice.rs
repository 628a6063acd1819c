//! What recordings look like: snap-offs of a lever, free decays, measured input and output, a steady oscillation.

use afmid_kernels::harmonics::is_tone;
use afmid_kernels::spectra::{
    energy_beside_hits, excited_share, is_impulsive, period_samples, resonance_segment, rings_on,
};
use afmid_stages::io::quantity_of_unit;

use super::channels::{driving, inputs, is_named, named, nothing, outputs};
use super::density::density;
use super::diagnosis::{Diagnosed, beside, diagnosis};
use super::first_file::FirstFile;
use super::hit_names::are_hits;
use super::lever::{force_curve, is_of_a_lever};
use super::pipeline::Wanted;
use super::recordings::Source;
use super::sensors::{Sensors, left_out, like, sensors};
use super::spring;
use super::stated::{does_without_unit, of_rate};
use super::steps;
use crate::cli::{Goal, RecordsAre};
use crate::inspect::{Channel, counted};
use crate::show::{about, number};

/// Why something cannot be chosen, and what to do.
pub type Question = (String, Option<String>);

/// What a config is written for.
#[derive(Debug)]
pub struct Choice<'a> {
    pub goal: Goal,
    /// The signals; of decays and of responses to a force several.
    pub channels: Vec<&'a Channel>,
    /// The measured inputs; of input and output alone.
    pub inputs: Vec<&'a Channel>,
    /// The measured force whose hits begin free decays.
    pub force: Option<&'a Channel>,
    /// The distance between lever and sample; of a spring constant alone.
    pub piezo: Option<&'a Channel>,
    /// The frequencies of a power density.
    pub frequencies: Option<&'a Channel>,
    /// Whether the input is a hammer's: short against the record.
    pub struck: bool,
    /// Samples with which the input repeats itself.
    pub period_samples: Option<usize>,
    /// Samples of the segments of an averaged spectrum that resolve its resonance.
    pub segment_samples: Option<usize>,
    /// Whether the noise is that of force curves' free stretches.
    pub free_stretches: bool,
    /// What files and channels are, where the stage's default is not meant.
    pub records_are: Option<RecordsAre>,
    /// Of a diagnosis of anything but releases, whose goal says it: what it needs beside the channels.
    pub diagnosis: Option<Diagnosed<'a>>,
    /// Why, for a comment in the config; empty where the user chose.
    pub why: String,
    /// What is left out, for comments and for the user.
    pub notes: Vec<String>,
}

impl<'a> Choice<'a> {
    /// Without a measured input.
    pub fn of(goal: Goal, channels: Vec<&'a Channel>, why: String) -> Self {
        Self {
            goal,
            channels,
            inputs: Vec::new(),
            force: None,
            piezo: None,
            frequencies: None,
            struck: false,
            period_samples: None,
            segment_samples: None,
            free_stretches: false,
            records_are: None,
            diagnosis: None,
            why,
            notes: Vec::new(),
        }
    }

    /// The goal's name, which is the pipeline's.
    pub const fn name(&self) -> &'static str {
        if self.diagnosis.is_some() { Goal::Diagnosis.name() } else { self.goal.name() }
    }
}

/// Chooses by what the first file holds, as far as the user has not. Errors: what is not known, and how to say it.
pub fn choose<'a>(source: &'a Source, wanted: &Wanted<'_>) -> Result<Choice<'a>, Question> {
    if let Some(reference) = wanted.reference.filter(|_| wanted.goal != Some(Goal::Diagnosis)) {
        let help = "wanted --goal diagnosis, or no --reference".to_owned();
        return Err((format!("--reference {reference}: only a diagnosis is of an axis in its loop"), Some(help)));
    }
    spring::is_wanted(wanted)?;
    let file = FirstFile::new(source);
    if let Some(choice) = density(&file, wanted)? {
        return Ok(choice);
    }
    let of_time = wanted.rate_hz.is_some() || wanted.goal == Some(Goal::Frf) || file.has_responses(false);
    if let Some(question) = file.spectrum().filter(|_| !of_time) {
        return Err(question);
    }
    let mut choice = by_goal(&file, wanted)?;
    choice.notes.extend(choice.channels.first().and_then(|channel| of_unit(&choice, channel, wanted)));
    choice.notes.extend(beside(source, &choice));
    choice.notes.extend(choice.channels.first().and_then(|channel| of_rate(channel, wanted)));
    let contradicted = choice.channels.first().and_then(|channel| file.contradicted_rate(channel, wanted));
    choice.notes.extend(contradicted.map(|problem| format!("{problem}: is --rate right?")));
    Ok(choice)
}

/// What is to be said of a unit that nobody states.
fn of_unit(choice: &Choice<'_>, channel: &Channel, wanted: &Wanted<'_>) -> Option<String> {
    let senses = choice.diagnosis.is_some() && choice.goal != Goal::Steady;
    if senses && channel.unit.is_empty() && wanted.unit.is_none() {
        let said = "no unit is stated: a deflection is taken; --unit m/s^2 or g says an acceleration, m/s a rate";
        return Some(said.to_owned());
    }
    let said = "no unit is stated: amplitudes are as in the file; --unit UNIT says theirs";
    does_without_unit(choice.goal, channel, wanted).then(|| said.to_owned())
}

fn by_goal<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>) -> Result<Choice<'a>, Question> {
    let source = file.source;
    match wanted.goal {
        None => by_looks(file, wanted),
        // of a lever modes are those of its snap-offs where nothing else is seen
        Some(Goal::Modes) => by_looks(file, wanted).or_else(|question| match is_of_a_lever(source) {
            true => one_channel(source, wanted, Goal::SnapOff, String::new()),
            false => Err(question),
        }),
        Some(Goal::Diagnosis) => diagnosis(file, wanted),
        Some(Goal::Decay) => decay(file, wanted, false),
        Some(goal @ Goal::InputOutput) => input_output(file, wanted, Some(goal)),
        Some(Goal::Frf) if wanted.inputs.is_empty() && file.has_responses(true) => Ok(responses(source)),
        Some(goal @ Goal::Frf) => match file.no_responses().filter(|_| wanted.inputs.is_empty()) {
            Some(question) => Err(question),
            None => input_output(file, wanted, Some(goal)),
        },
        Some(Goal::SpringConstant) => spring::choice(file, wanted),
        Some(goal) => Ok(thermal(file, wanted, one_channel(source, wanted, goal, String::new())?)),
    }
}

/// Without a goal.
pub fn by_looks<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>) -> Result<Choice<'a>, Question> {
    let source = file.source;
    if !wanted.inputs.is_empty() {
        return input_output(file, wanted, None);
    }
    // a unit over that of a force is a response's, whatever the columns are called
    let said = wanted.rate_hz.is_none() && wanted.unit.is_some_and(|unit| quantity_of_unit(unit).is_some());
    if file.has_responses(said) {
        return Ok(responses(source));
    }
    if let Some(why) = force_curve(file, wanted) {
        return one_channel(source, wanted, Goal::SnapOff, why);
    }
    match wanted.channels.len() < 2 && has_input(source, wanted) {
        true => input_output(file, wanted, None),
        false => decay(file, wanted, true),
    }
}

/// Whether a channel is named as an input and not wanted as the signal.
fn has_input(source: &Source, wanted: &Wanted<'_>) -> bool {
    let signal = |channel: &Channel| wanted.channels.iter().any(|name| is_named(channel, name));
    driving(source).into_iter().any(|channel| !signal(channel))
}

fn responses(source: &Source) -> Choice<'_> {
    let channels = source.channels.iter().take(1).collect();
    Choice::of(Goal::Frf, channels, format!("frequency responses in {}", source.name()))
}

/// Measured input and output: of a hammer's hits, of points and of several sensors frequency responses, else a transfer
/// function.
fn input_output<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>, goal: Option<Goal>) -> Result<Choice<'a>, Question> {
    let source = file.source;
    let inputs = inputs(source, wanted)?;
    let struck = file.samples(inputs[0]).is_ok_and(|force| is_impulsive(&force));
    let named_hits = source.files.len() > 1 && wanted.records_are.is_none() && are_hits(&source.files);
    let records_are = match wanted.records_are {
        Some(RecordsAre::Points) => Some(RecordsAre::Points),
        Some(RecordsAre::Hits) if source.files.len() > 1 => Some(RecordsAre::Hits),
        _ => named_hits.then_some(RecordsAre::Hits),
    };
    let found = outputs(source, wanted, &inputs)?;
    let best = source.best.and_then(|index| source.channels.get(index));
    let best = best.filter(|best| found.iter().any(|channel| channel.location == best.location));
    let outputs = if wanted.channels.is_empty() { like(&found, best.unwrap_or(found[0]), file) } else { found };
    if goal.is_none()
        && struck
        && wanted.records_are.is_none()
        && let Some(choice) = decays_instead(file, wanted, inputs[0], &outputs)?
    {
        return Ok(choice);
    }
    let period_samples = if struck { None } else { repeats(file, &inputs) };
    // a model of all frequencies would be one of what a part of the band says nothing of
    let in_part = period_samples.is_some_and(|period| excites_a_part(file, inputs[0], period));
    let several = struck || in_part || records_are.is_some() || outputs.len() > 1;
    let goal = goal.unwrap_or(if several { Goal::Frf } else { Goal::InputOutput });
    let names = |all: &[&Channel]| all.iter().map(|one| one.location.as_str()).collect::<Vec<&str>>().join(", ");
    if goal == Goal::InputOutput && outputs.len() > 1 {
        let problem = format!("{} has several channels that could be the output", source.file.display());
        let help = format!("say with --channel which one of {}; --goal frf takes all", names(&outputs));
        return Err((problem, Some(help)));
    }
    let short = match (struck, period_samples) {
        (true, _) => ", which is short as a hammer's,".to_owned(),
        (_, Some(period)) => format!(", which repeats itself every {period} samples,"),
        _ => String::new(),
    };
    let (input, output) = (names(&inputs), names(&outputs));
    let hits = match (records_are, named_hits) {
        (Some(RecordsAre::Hits), true) => format!("; hits by the names of the {} files, averaged", source.files.len()),
        (Some(RecordsAre::Hits), false) => format!("; --as hits: the {} files are averaged", source.files.len()),
        _ => String::new(),
    };
    let why = format!("measured input {input}{short} and output {output} in {}{hits}", source.name());
    let taken: Vec<&Channel> = outputs.iter().chain(&inputs).copied().collect();
    let notes = left_out(source, &taken).filter(|_| wanted.channels.is_empty()).into_iter().collect();
    Ok(Choice { inputs, struck, period_samples, records_are, notes, ..Choice::of(goal, outputs, why) })
}

/// Periods of an input at least: one settles, the others tell the noise.
const LEAST_PERIODS: usize = 3;

/// Samples with which a single input repeats itself often enough.
fn repeats(file: &FirstFile<'_>, inputs: &[&Channel]) -> Option<usize> {
    let [input] = inputs else { return None };
    let values = file.samples(input).ok()?;
    period_samples(&[&values]).filter(|period| LEAST_PERIODS * period <= values.len())
}

/// Share of the bins up to half the sample rate that a periodic input excites, below which its lines are looked at alone.
const PART_OF_BAND: f64 = 0.5;

fn excites_a_part(file: &FirstFile<'_>, input: &Channel, period: usize) -> bool {
    file.samples(input).is_ok_and(|values| excited_share(&values[..period.min(values.len())]) < PART_OF_BAND)
}

/// Energy of a force beside its hits, over that of its hits, from which on responses have dampings that are wrong by more
/// than their errors.
const MOST_BESIDE_HITS: f64 = 0.05;

/// Free decays where responses by blocks would be wrong: a structure still rings when a hit's block ends, or the force has
/// much noise or drift beside its hits.
fn decays_instead<'a>(
    file: &FirstFile<'a>,
    wanted: &Wanted<'_>,
    force: &'a Channel,
    outputs: &[&'a Channel],
) -> Result<Option<Choice<'a>>, Question> {
    let values = outputs.iter().map(|channel| file.samples(channel)).collect::<Result<Vec<_>, _>>()?;
    let rows: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
    if file.hitting(outputs, wanted).is_none() {
        return Ok(None);
    }
    let measured = file.samples(force)?;
    let beside = energy_beside_hits(&measured);
    let reason = match rings_on(&measured, &rows) {
        Some(share) => format!("{:.0} % of the amplitude is left where the next hit or the end comes", 100.0 * share),
        None if beside > MOST_BESIDE_HITS => {
            format!("noise and drift of {} have {} times the energy of its hits", force.location, number(beside))
        }
        None => return Ok(None),
    };
    let (_, found) = file.search(outputs, Some(force), wanted)?;
    if found.decays.is_empty() {
        return Ok(None);
    }
    let decays = match found.decays.len() {
        1 => "a free decay".to_owned(),
        count => format!("{count} free decays"),
    };
    let names: Vec<&str> = outputs.iter().map(|channel| channel.location.as_str()).collect();
    let why = format!(
        "{decays} of {} in {}: {reason}, which frequency responses by blocks do not bear; --goal frf makes them all the \
         same, --goal input-output fits {} to one of them",
        names.join(", "),
        file.source.name(),
        force.location
    );
    Ok(Some(Choice { force: Some(force), ..Choice::of(Goal::Decay, outputs.to_vec(), why) }))
}

/// One signal. Errors: several were named; none is there.
pub fn one_channel<'a>(
    source: &'a Source,
    wanted: &Wanted<'_>,
    goal: Goal,
    why: String,
) -> Result<Choice<'a>, Question> {
    let channel = match wanted.channels {
        [] => source.best.and_then(|index| source.channels.get(index)).ok_or_else(|| nothing(source))?,
        [one] => named(source, one)?,
        [_, second, ..] => {
            let help = "several sensors go with --goal decay".to_owned();
            return Err((format!("one channel was wanted, --channel {second} is another"), Some(help)));
        }
    };
    Ok(Choice::of(goal, vec![channel], why))
}

/// Channels that are the same number throughout, as words behind a sentence; nothing where there are none.
fn idle(source: &Source) -> String {
    let is_idle = |channel: &&Channel| channel.values.as_ref().is_some_and(|values| values.least == values.largest);
    let idle: Vec<&str> = source.channels.iter().filter(is_idle).map(|channel| channel.location.as_str()).collect();
    match idle[..] {
        [] => String::new(),
        [one] => format!("; {one} is the same number throughout"),
        _ => format!("; {} are the same number throughout", idle.join(", ")),
    }
}

/// Whether noise in any of the signals has a resonance in it.
fn resonates(signals: &[Vec<f64>]) -> bool {
    signals.iter().any(|values| resonance_segment(values).is_some())
}

/// The resonance in a channel's noise; of force curves in that of their free stretches.
fn thermal<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>, choice: Choice<'a>) -> Choice<'a> {
    let channel = choice.channels.first().filter(|_| choice.goal == Goal::Thermal);
    if channel.is_some()
        && let Some(curves) = force_curve(file, wanted)
    {
        let why = format!("the lever's noise in the free stretches of force curves ({curves})");
        return Choice { free_stretches: true, why, ..choice };
    }
    let segment_samples = channel.and_then(|channel| resonance_segment(&file.samples(channel).ok()?));
    Choice { segment_samples, ..choice }
}

/// That several sensors move at random with no measured force.
fn several_in_noise(source: &Source, channels: &[&Channel]) -> Question {
    let (file, count) = (source.file.display(), channels.len());
    let problem = format!(
        "{file}: {count} sensors of a stationary random vibration and no measured force: no free decays, and the stage for \
         modes under unmeasured forces is yet to come"
    );
    let help = format!(
        "--goal thermal --channel {} fits the resonance in one sensor's spectrum; --input NAME names a measured force",
        channels[0].location
    );
    (problem, Some(help))
}

fn decay<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>, guessed: bool) -> Result<Choice<'a>, Question> {
    if wanted.records_are == Some(RecordsAre::Points) {
        let help =
            "--input names the force of each file; files of frequency responses go with --goal frf; free decays are \
                    of hits or sensors"
                .to_owned();
        return Err(("--as points: decays without a measured force have no common scale".to_owned(), Some(help)));
    }
    let source = file.source;
    let Sensors { channels, left_out: said } = match wanted.channels {
        [] => sensors(file)?,
        names => {
            let channels = names.iter().map(|name| named(source, name)).collect::<Result<Vec<_>, _>>()?;
            Sensors { channels, left_out: None }
        }
    };
    let steps = steps::hint(file, &channels, wanted);
    let cells = channels.len() > 1 && channels.iter().all(|channel| channel.location.ends_with('}'));
    let records_are = wanted.records_are.or(cells.then_some(RecordsAre::Hits));
    // cells are hits of their own: one is enough to see what they are
    let seen = if records_are == Some(RecordsAre::Hits) { &channels[..1] } else { &channels[..] };
    let force = file.hitting(seen, wanted).filter(|_| !guessed && records_are.is_none());
    let said = match force {
        Some(force) if said.is_some() => {
            left_out(source, &channels.iter().copied().chain([force]).collect::<Vec<&Channel>>())
        }
        _ => said,
    };
    let notes: Vec<String> = said.into_iter().chain(steps.clone()).collect();
    let (values, found) = file.search(seen, force, wanted)?;
    let record = source.name();
    let other = |goal, why| Ok(Choice { notes: notes.clone(), ..Choice::of(goal, vec![channels[0]], why) });
    let why = match (found.decays.first(), found.reason()) {
        (Some(first), _) => {
            let time_s = first.range.start as f64 / file.rate(seen[0], wanted)?;
            let from = format!("from {} s on, at {} Hz", number(time_s), about(first.frequency_hz));
            let beside =
                found.steady.first().map(|line| format!(", beside a line at {} Hz", number(line.frequency_hz)));
            format!("{record}: {} {from}{}", counted(found.decays.len()), beside.unwrap_or_default())
        }
        (None, Some(reason)) if guessed && !found.steady.is_empty() && is_tone(&values[0]) => {
            let said = found.steady.first().map_or(reason, |steady| steady.statement());
            return other(Goal::Steady, format!("{record}: {said}"));
        }
        // what drives in steps and rings no longer than they last
        (None, Some(_)) if guessed && steps::named(file, &channels).is_some() => {
            let driver = steps::named(file, &channels).into_iter().map(|driver| driver.location.clone());
            let (inputs, channels) = (driver.collect::<Vec<String>>(), vec![channels[0].location.clone()]);
            return input_output(file, &Wanted { inputs: &inputs, channels: &channels, ..*wanted }, None);
        }
        (None, Some(reason)) if guessed && (found.random || resonates(&values)) => {
            if channels.len() > 1 {
                return Err(several_in_noise(source, &channels));
            }
            let reason = if found.random { reason } else { "noise with a resonance in it".to_owned() };
            return Ok(thermal(file, wanted, other(Goal::Thermal, format!("{record}: {reason}"))?));
        }
        (None, Some(reason)) if guessed => {
            let idle = idle(source);
            let none = format!("{reason}; no steady oscillation and no resonance in noise either{idle}");
            let help = "look at it with `afmid inspect`; --channel names the signal, --goal says what to find";
            let help = steps.into_iter().chain([help.to_owned()]).collect::<Vec<_>>().join("; ");
            return Err((format!("{}: no free decay, {none}", source.file.display()), Some(help)));
        }
        (None, reason) => format!("--goal decay; in {record}: {}", reason.unwrap_or_default()),
    };
    let hammer = file.hammer().filter(|_| guessed).map(|hammer| format!("; {hammer}")).unwrap_or_default();
    Ok(Choice { records_are, force, notes, ..Choice::of(Goal::Decay, channels, why + &hammer) })
}
