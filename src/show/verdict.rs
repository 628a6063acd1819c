//! A diagnosis in a few lines.

use afmid_stages::causes;
use afmid_stages::diagnosis::{Diagnosis, Gain, NamedCause, RunnerUp, Value, Verdict};

use super::number::{number, with_std};

/// Sentences of evidence, and candidates that are near, which are shown: the page has all.
const MOST: usize = 3;

/// Verdict, named causes, what is left, the next measurement; what is unknown is left out.
pub fn verdict_lines(answer: &Diagnosis) -> Vec<String> {
    let mut lines = vec![verdict(answer)];
    lines.extend(answer.causes.iter().map(cause));
    if !answer.nearest.is_empty() {
        let others = answer.nearest.len().saturating_sub(MOST);
        let others = (others > 0).then(|| format!("{others} more"));
        lines.push(format!("nearest: {}", listed(answer.nearest.iter().take(MOST).map(runner_up).chain(others))));
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
        Some(format!("{} {} -> {}{unit}", part.name, four_digits(part.rms_before?), four_digits(part.rms_after?)))
    };
    let parts: Vec<String> = answer.validation.iter().filter_map(part).collect();
    (!parts.is_empty()).then(|| format!("error of linear and extended model: {}", parts.join(", ")))
}

/// What gave the causes away or remains, without the steps that the lines of causes and candidates have.
fn evidence(answer: &Diagnosis) -> Vec<String> {
    let is_step = |sentence: &&String| sentence.contains(" lowers the free-run error ");
    let sentences: Vec<&String> = answer.evidence.iter().filter(|sentence| !is_step(sentence)).collect();
    let mut lines: Vec<String> = sentences.iter().take(MOST).map(|sentence| format!("evidence: {sentence}")).collect();
    match sentences.len().saturating_sub(MOST) {
        0 => {}
        1 => lines.push("  1 more sentence is on the page".to_owned()),
        more => lines.push(format!("  {more} more sentences are on the page")),
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

#[cfg(test)]
mod tests {
    use serde_json::{Value as Json, json};

    use super::*;

    fn lines(changes: Json) -> Vec<String> {
        let mut answer = json!({
            "verdict": "clean", "p_value": null, "baseline": { "adequate": true, "order": 2, "parameters": {}, "noise_rms": null,
            "distortion_rms": null }, "causes": [], "evidence": [], "nearest": [], "modes_before": [], "modes_after": [],
            "validation": [], "ladder": [], "false_alarm_rate": 0.01
        });
        let of = |value: Json| value.as_object().cloned().unwrap_or_default();
        answer.as_object_mut().expect("an object").extend(of(changes));
        verdict_lines(&serde_json::from_value(answer).expect("a diagnosis"))
    }

    #[test]
    fn every_number_has_its_error_and_what_is_unknown_is_left_out() {
        assert_eq!(
            lines(json!({})),
            ["clean: the linear model holds as far as these data can tell (false-alarm rate 0.01)"]
        );
        let named = json!({
            "verdict": "named", "p_value": 1.234e-9,
            "causes": [{ "id": "duffing", "class": ["duffing", "quintic-stiffness"], "p_value": 1e-9,
                "parameters": { "k3": { "value": 0.6, "std": 0.004, "unit": "1/V^2" } },
                "gain": { "rms_before": 0.041_234, "rms_after": 0.001, "unit": "V", "log_likelihood": 812.4, "held_out": "8 folds" },
                "runner_up": { "id": "quintic-stiffness", "share_of_gain": 0.99 }, "next_measurement": "drive it twice as far" }],
            "evidence": ["duffing lowers the free-run error of the training part from 4.0e-2 to 1.0e-3 V", "a", "b", "c", "d"],
            "validation": [{ "name": "test", "rms_before": 0.2, "rms_after": null, "unit": "V" }]
        });
        assert_eq!(
            lines(named),
            [
                "named: duffing (p = 1.2e-9 where nothing is wrong, false-alarm rate 0.01)",
                "  duffing: k3 0.6000(40) 1/V^2; error 0.04123 -> 0.001 V held out (8 folds); or quintic-stiffness",
                "evidence: a",
                "evidence: b",
                "evidence: c",
                "  1 more sentence is on the page",
                "next measurement: drive it twice as far",
            ]
        );
    }

    #[test]
    fn where_nothing_is_named_the_nearest_say_what_to_measure() {
        let nearest: Vec<Json> = ["coulomb-friction", "offset", "duffing", "creep", "backlash"]
            .iter()
            .map(|id| json!({ "id": id, "share_of_gain": 0.5 }))
            .collect();
        let lines = lines(json!({ "verdict": "unexplained", "p_value": 0.0, "nearest": nearest }));
        assert!(lines[0].contains("p = 0 (below 1e-300)"), "{lines:?}");
        let shares = "coulomb-friction (50 % of the gain), offset (50 % of the gain), duffing (50 % of the gain)";
        assert_eq!(lines[1], format!("nearest: {shares} and 2 more"));
        assert!(lines[2].starts_with("next measurement: let it ring until it stops"), "{lines:?}");
    }
}
