//! A verdict in words.

use afmid_pipeline::RunResult;
use afmid_stages::causes;
use afmid_stages::diagnosis::{Diagnosis, NamedCause, RunnerUp, Verdict};

use super::diagnosed::diagnoses;
use crate::report::number::{UNKNOWN, number, quantity, rounded};
use crate::report::view::{CauseView, Fact, Head, StoryView, TableView, Tile};

/// Headline, causes and evidence.
pub(super) fn words(answer: &Diagnosis) -> StoryView {
    StoryView {
        headline: headline(answer),
        sentences: sentences(answer),
        causes: answer.causes.iter().map(cause_view).collect(),
        evidence: answer.evidence.clone(),
    }
}

/// The verdict as one of the numbers that matter, one for each diagnosis.
pub(crate) fn verdict_tiles(run: &RunResult) -> Vec<Tile> {
    let tile = |answer: &Diagnosis| {
        let (value, note) = match answer.verdict {
            Verdict::Clean => ("clean".to_owned(), p_value(answer.p_value)),
            Verdict::Named => (counted(answer.causes.len()), list(answer.causes.iter().map(|cause| cause.id.as_str()))),
            Verdict::Unexplained => ("unexplained".to_owned(), p_value(answer.p_value)),
        };
        Tile { label: "diagnosis".to_owned(), value, note }
    };
    diagnoses(run).iter().map(|diagnosed| tile(&diagnosed.answer)).collect()
}

fn counted(causes: usize) -> String {
    if causes == 1 { "1 cause".to_owned() } else { format!("{causes} causes") }
}

fn headline(answer: &Diagnosis) -> String {
    match answer.verdict {
        Verdict::Clean => "Clean: the linear model holds as far as these data can tell.".to_owned(),
        Verdict::Named => {
            format!("The linear model is wrong: {}.", list(answer.causes.iter().map(|cause| cause.id.as_str())))
        }
        Verdict::Unexplained => {
            "Unexplained: the linear model is wrong, and no cause of the catalogue accounts for it.".to_owned()
        }
    }
}

fn sentences(answer: &Diagnosis) -> Vec<String> {
    let rate = number(answer.false_alarm_rate);
    let mut out = Vec::new();
    match (answer.verdict, answer.p_value) {
        (Verdict::Clean, Some(_)) => out.push(format!(
            "The strongest sign of any candidate has {}, held against a false-alarm rate of {rate}: noise alone does that. No name is given.",
            p_value(answer.p_value)
        )),
        // where no model was extended, no candidate was tried
        (Verdict::Clean, None) if answer.ladder.is_empty() => {}
        (Verdict::Clean, None) => out.push(format!("No candidate is significant at a false-alarm rate of {rate}.")),
        (_, Some(_)) => out.push(format!(
            "Where nothing is wrong, so strong a sign has {}; the false-alarm rate was set to {rate}.",
            p_value(answer.p_value)
        )),
        (_, None) => out.push(format!("The false-alarm rate was set to {rate}.")),
    }
    if !answer.nearest.is_empty() {
        out.push(format!("Nearest to an explanation, but not one: {}.", list(answer.nearest.iter().map(runner_up))));
    }
    out
}

fn cause_view(cause: &NamedCause) -> CauseView {
    let about = causes::find(&cause.id).map(|known| known.about());
    let heads = vec![Head::text("parameter"), Head::number("value", ""), Head::text("meaning")];
    let mut parameters = TableView::new("", heads);
    for (name, value) in &cause.parameters {
        let meaning = about.and_then(|about| about.parameters.iter().find(|parameter| parameter.name == name));
        parameters.rows.push(vec![
            name.clone(),
            quantity(or_nan(value.value), or_nan(value.std), &value.unit),
            meaning.map_or_else(String::new, |parameter| parameter.meaning.to_owned()),
        ]);
    }
    CauseView {
        id: cause.id.clone(),
        physics: about.map_or_else(String::new, |about| about.physics.to_owned()),
        parameters,
        facts: facts(cause),
        resembles: about.map_or_else(String::new, |about| about.resembles.to_owned()),
        next: cause.next_measurement.clone(),
    }
}

fn facts(cause: &NamedCause) -> Vec<Fact> {
    let gain = &cause.gain;
    let rms = |value: Option<f64>| rounded(or_nan(value), 4, &gain.unit);
    let others = || cause.class.iter().map(String::as_str).filter(|id| *id != cause.id);
    let class = if others().next().is_none() { "nothing of the catalogue".to_owned() } else { list(others()) };
    let mut facts = vec![
        Fact::new("by chance", p_value(cause.p_value)),
        Fact::new("held out", gain.held_out.clone()),
        Fact::new("residual there, without → with", format!("{} → {}", rms(gain.rms_before), rms(gain.rms_after))),
        Fact::new("gain of the log likelihood there", signed(gain.log_likelihood)),
        Fact::new("runner-up", cause.runner_up.as_ref().map_or_else(|| "none tried".to_owned(), runner_up)),
        Fact::new("can't be distinguished from", class),
    ];
    // whole records have channels without a held-out part
    facts.retain(|fact| {
        !fact.value.is_empty() && fact.value != UNKNOWN && fact.value != format!("{UNKNOWN} → {UNKNOWN}")
    });
    facts
}

fn runner_up(other: &RunnerUp) -> String {
    match other.share_of_gain {
        Some(share) => format!("{} ({} of the gain)", other.id, percent(share)),
        None => other.id.clone(),
    }
}

/// `86 %`; shares below a hundredth keep two digits.
fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if value.abs() >= 1.0 { format!("{value:.0} %") } else { format!("{} %", number((value * 100.0).round() / 100.0)) }
}

/// `p = 0.046`; what a double rounds to zero is no zero.
fn p_value(p: Option<f64>) -> String {
    match p {
        Some(p) if p <= 0.0 => "p < 10⁻³⁰⁰".to_owned(),
        Some(p) => format!("p = {}", two_digits(p)),
        None => "p unknown".to_owned(),
    }
}

fn two_digits(value: f64) -> String {
    number(format!("{value:.1e}").parse().unwrap_or(value))
}

pub(super) fn signed(value: Option<f64>) -> String {
    match value.filter(|value| value.is_finite()) {
        None => UNKNOWN.to_owned(),
        Some(value) => {
            let digits = if value.abs() < 10.0 { 1 } else { 0 };
            format!("{}{:.digits$}", if value < 0.0 { "−" } else { "+" }, value.abs())
        }
    }
}

pub(super) fn or_nan(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

/// `a, b and c`.
fn list<T: AsRef<str>>(items: impl Iterator<Item = T>) -> String {
    let items: Vec<String> = items.map(|item| item.as_ref().to_owned()).collect();
    match items.split_last() {
        None => "nothing".to_owned(),
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
    }
}
