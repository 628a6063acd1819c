//! What a file states of its samples, and what the user has to: sample rate and unit.

use afmid_pipeline::recording::{WANTED_RATE, brief_number, is_rate, rates_agree};

use super::choice::Question;
use super::pipeline::Wanted;
use super::recordings::Source;
use crate::cli::Goal;
use crate::inspect::Channel;

/// The sample rate to be written: the user's, which overrules the file's; none where the file's is taken. Errors:
/// neither states one.
pub fn rate(source: &Source, channel: &Channel, wanted: &Wanted<'_>, unit: bool) -> Result<Option<f64>, Question> {
    if let Some(odd) = wanted.rate_hz.filter(|rate| !is_rate(*rate)) {
        return Err((format!("--rate is {}, wanted {WANTED_RATE}", brief_number(odd)), None));
    }
    match (channel.sample_rate_hz, wanted.rate_hz) {
        (Some(_), None) => Ok(None),
        (None, Some(rate)) => Ok(Some(rate)),
        (Some(rate), Some(other)) if rates_agree(rate, other, 0.0) => Ok(None),
        (Some(_), Some(given)) => Ok(Some(given)),
        (None, None) => Err(question(source, channel, wanted, unit)),
    }
}

/// What is to be said of a channel's rate: that the user's takes the place of the file's, or that it is a guess.
pub fn of_rate(channel: &Channel, wanted: &Wanted<'_>) -> Option<String> {
    let stated = channel.sample_rate_hz?;
    match (wanted.rate_hz, channel.rate_is_guess) {
        (None, false) => None,
        (None, true) => Some(format!(
            "the file states no unit of time, seconds or hertz are taken: {stated} samples a second; --rate HZ says \
             another rate"
        )),
        (Some(given), _) if rates_agree(given, stated, channel.rate_std) => None,
        (Some(given), true) => Some(format!("--rate {given} takes the place of {stated}, taken in seconds or hertz")),
        (Some(given), false) => Some(format!("warning: --rate {given} holds, though the file states {stated}")),
    }
}

/// Whether a config does without a unit that nobody states: of decays and noise it scales the amplitudes alone.
pub fn does_without_unit(goal: Goal, channel: &Channel, wanted: &Wanted<'_>) -> bool {
    let scales_alone = matches!(goal, Goal::Decay | Goal::Thermal | Goal::SpringConstant | Goal::Steady);
    scales_alone && channel.unit.is_empty() && wanted.unit.is_none()
}

/// The unit to be written; none where the file states it. Errors: as [`rate`].
pub fn unit<'a>(
    source: &Source,
    goal: Goal,
    channel: &Channel,
    wanted: &Wanted<'a>,
) -> Result<Option<&'a str>, Question> {
    match (channel.unit.as_str(), wanted.unit) {
        ("", Some(unit)) => Ok(Some(unit)),
        ("", None) if does_without_unit(goal, channel, wanted) => Ok(Some("1")),
        ("", None) => Err(question(source, channel, wanted, true)),
        (stated, Some(unit)) if stated != unit => {
            let problem = format!("{} states the unit {stated}", source.file.display());
            Err((problem, Some("leave --unit out".to_owned())))
        }
        _ => Ok(None),
    }
}

fn question(source: &Source, channel: &Channel, wanted: &Wanted<'_>, unit: bool) -> Question {
    let (problem, help) = missing(source, channel, wanted, unit);
    (problem, Some(help.join("; ")))
}

/// What neither the file states nor the user, and how to say it; of the unit if `unit`.
pub fn missing(source: &Source, channel: &Channel, wanted: &Wanted<'_>, unit: bool) -> (String, Vec<String>) {
    let rate = channel.sample_rate_hz.or(wanted.rate_hz).is_none();
    let unit = unit && channel.unit.is_empty() && wanted.unit.is_none();
    let (what, how) = match (rate, unit) {
        (true, true) => {
            ("sample rate and no unit", "say them with --rate HZ --unit UNIT, such as --rate 5000 --unit V")
        }
        (true, false) => ("sample rate", "say how many samples a second with --rate HZ"),
        (false, _) => ("unit", "say the signal's unit with --unit, such as --unit V"),
    };
    let axis = source.channels.iter().find(|channel| channel.is_axis).filter(|_| rate);
    let says = |axis: &Channel| source.remarks.iter().find(|remark| remark.starts_with(&axis.location)).cloned();
    let mut help = vec![how.to_owned()];
    if let Some((axis, remark)) = axis.and_then(|axis| Some((axis, says(axis)?))) {
        let of_time = axis.location.to_lowercase().contains("time") || ["s", "ms", "us"].contains(&axis.unit.as_str());
        if of_time {
            help.push(remark);
            return (format!("{} states no {what}", source.file.display()), help);
        }
        help.push(format!(
            "{remark}; --goal frf if {} is a frequency and the others are responses, --goal thermal if a power density",
            axis.location
        ));
    }
    (format!("{} states no {what}", source.file.display()), help)
}
