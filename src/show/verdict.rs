//! A diagnosis in a few lines.

use afmid_stages::causes;
use afmid_stages::diagnosis::{Diagnosis, Gain, NamedCause, RunnerUp, Value, Verdict};

use super::number::{number, with_std};

/// Sentences of evidence that are shown: the result has all.
const MOST_EVIDENCE: usize = 2;

/// Verdict, named causes, what is left, the next measurement; what is unknown is left out.
pub fn verdict_lines(answer: &Diagnosis) -> Vec<String> {
    let mut lines = vec![verdict(answer)];
    lines.extend(answer.causes.iter().map(cause));
    if !answer.nearest.is_empty() {
        lines.push(format!("nearest: {}", listed(answer.nearest.iter().map(runner_up))));
    }
    lines.extend(validation(answer));
    lines.extend(evidence(answer));
    lines.extend(next(answer));
    lines
}

fn verdict(answer: &Diagnosis) -> String {
    let rate = number(answer.false_alarm_rate);
    let chance = match answer.p_value {
        Some(p) => format!("p = {} where nothing is wrong, false-alarm rate {rate}", two_digits(p)),
        None => format!("false-alarm rate {rate}"),
    };
    let said = match answer.verdict {
        Verdict::Clean => "clean: the linear model holds as far as these data can tell".to_owned(),
        Verdict::Named => format!("named: {}", listed(answer.causes.iter().map(|cause| cause.id.clone()))),
        Verdict::Unexplained if answer.baseline.adequate => {
            "unexplained: the linear model is wrong, no cause of the catalogue accounts for it".to_owned()
        }
        Verdict::Unexplained => "unexplained: no linear model accounts for what is linear in these data".to_owned(),
    };
    format!("{said} ({chance})")
}

/// A cause with its strength, its gain and what it cannot be distinguished from.
fn cause(cause: &NamedCause) -> String {
    let strength: Vec<String> = cause.parameters.iter().map(|(name, value)| parameter(name, value)).collect();
    let others: Vec<String> = cause.class.iter().filter(|id| **id != cause.id).cloned().collect();
    let class = if others.is_empty() { String::new() } else { format!("; or {}", listed(others.into_iter())) };
    let rival = match (&cause.runner_up, class.is_empty()) {
        (Some(other), true) => format!("; next best {}", runner_up(other)),
        _ => String::new(),
    };
    format!("  {}: {}{}{class}{rival}", cause.id, strength.join(", "), gain(&cause.gain))
}

fn parameter(name: &str, value: &Value) -> String {
    let number = with_std(value.value.unwrap_or(f64::NAN), value.std.unwrap_or(f64::NAN));
    let unit = if value.unit == "1" { "" } else { &value.unit };
    format!("{name} {number} {unit}").trim_end().to_owned()
}

fn gain(gain: &Gain) -> String {
    let unit = if gain.unit == "1" { String::new() } else { format!(" {}", gain.unit) };
    let held_out = if gain.held_out.is_empty() { String::new() } else { format!(" held out ({})", gain.held_out) };
    match (gain.rms_before, gain.rms_after, gain.log_likelihood) {
        (Some(before), Some(after), _) => {
            format!("; error {} -> {}{unit}{held_out}", four_digits(before), four_digits(after))
        }
        (_, _, Some(gain)) => format!("; log likelihood +{}{held_out}", four_digits(gain)),
        _ => String::new(),
    }
}

/// Errors of the linear and of the extended model on parts that chose nothing.
fn validation(answer: &Diagnosis) -> Option<String> {
    let part = |part: &afmid_stages::diagnosis::Validation| {
        let unit = if part.unit == "1" { String::new() } else { format!(" {}", part.unit) };
        Some(format!(
            "{} {} -> {}{unit}",
            part.name,
            four_digits(part.rms_before?),
            four_digits(part.rms_after?)
        ))
    };
    let parts: Vec<String> = answer.validation.iter().filter_map(part).collect();
    (!parts.is_empty()).then(|| format!("error of linear and extended model: {}", parts.join(", ")))
}

fn evidence(answer: &Diagnosis) -> Vec<String> {
    let shown = answer.evidence.iter().take(MOST_EVIDENCE);
    let mut lines: Vec<String> = shown.map(|sentence| format!("evidence: {sentence}")).collect();
    if answer.evidence.len() > MOST_EVIDENCE {
        lines.push(format!("  and {} sentences more: on the page", answer.evidence.len() - MOST_EVIDENCE));
    }
    lines
}

/// What would settle the first cause, or tell the nearest from another.
fn next(answer: &Diagnosis) -> Option<String> {
    let of_nearest = || {
        let nearest = answer.nearest.first().filter(|_| answer.verdict == Verdict::Unexplained)?;
        Some(causes::find(&nearest.id)?.about().next_measurement.to_owned())
    };
    let named = answer.causes.iter().map(|cause| cause.next_measurement.clone()).find(|next| !next.is_empty());
    named.or_else(of_nearest).map(|next| format!("next measurement: {next}"))
}

fn runner_up(other: &RunnerUp) -> String {
    match other.share_of_gain {
        Some(share) => format!("{} ({:.0} % of the gain)", other.id, 100.0 * share),
        None => other.id.clone(),
    }
}

fn four_digits(value: f64) -> String {
    number(format!("{value:.3e}").parse().unwrap_or(value))
}

/// What a double rounds to zero is no zero.
fn two_digits(p: f64) -> String {
    if p <= 0.0 { "0 (below 1e-300)".to_owned() } else { number(format!("{p:.1e}").parse().unwrap_or(p)) }
}

fn listed(items: impl Iterator<Item = String>) -> String {
    let items: Vec<String> = items.collect();
    match items.split_last() {
        None => "nothing".to_owned(),
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
    }
}
