//! From models to the answer that is stored and shown.

use std::collections::BTreeMap;

use super::data::{Bench, Part, PartStart, Record};
use super::dynamics::Kind;
use super::fit::{Blocks, FOLDS, Fit};
use super::instants::instant_std;
use super::lack_of_fit::Misfit;
use super::options::DiagnosisOptions;
use super::ruling::Ruling;
use super::selection::{Choice, Chosen, Judged};
use super::unnamed_law::UnnamedLaw;
use super::validation::{free_run_rms, held_out, pooled_rms};
use super::verdict::{
    BaselineSummary, DiagnosedMode, Diagnosis, Gain, NamedCause, Rung, RunnerUp, Validation, Value, Verdict,
};

/// What an answer is made from.
pub(super) struct Findings<'a> {
    pub bench: &'a Bench,
    pub records: &'a [Record<'a>],
    pub options: &'a DiagnosisOptions,
    pub blocks: Blocks,
    pub choice: Choice,
    pub misfit: Misfit,
    /// What the extended model lacks and no cause is.
    pub unnamed: Option<UnnamedLaw>,
    /// Whether the extended model describes as much as any linear model does.
    pub adequate: bool,
}

impl Findings<'_> {
    pub fn answer(&self) -> Diagnosis {
        let ladder = &self.choice.ladder;
        let validation = self.validation();
        let errors = self.held_out();
        let all = self.named(&errors);
        let Ruling { verdict, stand, because } = self.grounds(&all, &errors).ruling(&|stand| self.alone(stand));
        let causes = stand.into_iter().filter_map(|number| all.get(number).cloned()).collect();
        Diagnosis {
            p_value: None,
            verdict,
            baseline: self.baseline(),
            causes,
            evidence: self.evidence(verdict).into_iter().chain(because).collect(),
            nearest: if verdict == Verdict::Unexplained { self.nearest() } else { Vec::new() },
            modes_before: ladder.first().map_or(Vec::new(), |judged| self.modes(judged)),
            modes_after: ladder.last().map_or(Vec::new(), |judged| self.modes(judged)),
            validation,
            ladder: self.rungs(&errors),
            false_alarm_rate: self.options.false_alarm_rate,
        }
    }

    /// The linear model. Noise is what neither the extended model nor any general term predicts.
    fn baseline(&self) -> BaselineSummary {
        let Some(first) = self.choice.ladder.first() else { return BaselineSummary::default() };
        let left = self.choice.ladder.last().map_or(first.fit.loss, |last| last.fit.loss);
        let noise = left / (1.0 + self.misfit.ratio.powi(2));
        BaselineSummary {
            adequate: self.adequate,
            order: Some(first.fit.model.dynamics.order()),
            parameters: BTreeMap::new(),
            noise_rms: self.rms(noise),
            distortion_rms: self.rms((first.fit.loss - noise).max(0.0)),
        }
    }

    /// Unit of the first channel's scaled output.
    fn scale(&self) -> f64 {
        self.bench.output_scale.first().copied().unwrap_or(1.0)
    }

    pub(super) fn systematic(&self) -> bool {
        self.choice.lacks(&self.misfit, self.options.tolerated_misfit) || self.lacking().is_some()
    }

    /// A law that is lacking to a degree that no name stands beside it.
    fn lacking(&self) -> Option<&UnnamedLaw> {
        let last = &self.choice.ladder.last()?.fit;
        let least = (self.options.tolerated_law.powi(2) * self.choice.explained())
            .max(2.0 * self.options.least_gain * last.loss);
        self.unnamed.as_ref().filter(|law| law.gain > least || law.beats(self.bench, last))
    }

    pub(super) fn rms(&self, loss: f64) -> Option<f64> {
        finite((loss / self.bench.count as f64).sqrt() * self.scale())
    }

    /// Errors on what names have to gain on, model by model: the first part to be judged on, all that are whole
    /// experiments, the held-out folds where there are no parts.
    fn held_out(&self) -> Vec<Option<f64>> {
        let judge = |judged: &Judged| match held_out(&self.options.parts) {
            [] => self.rms(judged.unseen()),
            parts => pooled_rms(self.bench, self.records, &judged.fit.model, parts),
        };
        self.choice.ladder.iter().map(judge).collect()
    }

    /// The error on what names have to gain on of a model, in the output's unit: a loss where folds are held out.
    fn in_units(&self, error: f64) -> Option<f64> {
        if self.options.parts.is_empty() { self.rms(error) } else { Some(error) }
    }

    /// Samples that count as independent for the score of a cause.
    fn effective(&self, count: usize) -> f64 {
        let worst = self.choice.chosen.iter().map(|chosen| chosen.inflation).fold(1.0, f64::max);
        (count as f64 / worst).max(1.0)
    }

    fn named(&self, errors: &[Option<f64>]) -> Vec<NamedCause> {
        let (count, place) = match held_out(&self.options.parts) {
            [] => (self.bench.count, format!("{FOLDS} folds of the training part in turn")),
            [part] => (scored(part), format!("part {}", part.name)),
            parts => {
                let names: Vec<&str> = parts.iter().map(|part| &part.name[..]).collect();
                (parts.iter().map(scored).sum(), format!("parts {}", names.join(", ")))
            }
        };
        let one = |chosen: &Chosen| {
            let which = chosen.place;
            let at = |rung: usize| errors.get(rung).copied().flatten();
            // beside all others where they were refitted without it, else as it was added
            let last = errors.len().saturating_sub(1);
            let (before, after) = match chosen.left_out.and_then(|error| self.in_units(error)) {
                Some(without) => (Some(without), at(last)),
                None => (at(which), at(which + 1)),
            };
            let gain = before.zip(after).and_then(|(b, a)| finite(self.effective(count) * (b / a).ln()));
            NamedCause {
                id: chosen.about.id.to_owned(),
                class: chosen.class(),
                p_value: finite(chosen.p_value),
                parameters: self.parameters(which),
                gain: Gain {
                    rms_before: before,
                    rms_after: after,
                    unit: self.options.output_unit.clone(),
                    log_likelihood: gain,
                    held_out: place.clone(),
                },
                runner_up: chosen
                    .runner_up
                    .map(|(rival, share)| RunnerUp { id: rival.id.to_owned(), share_of_gain: finite(share) }),
                next_measurement: chosen.about.next_measurement.to_owned(),
            }
        };
        self.choice.chosen.iter().filter(|chosen| chosen.has_a_name()).map(one).collect()
    }

    fn parameters(&self, which: usize) -> BTreeMap<String, Value> {
        let Some(last) = self.choice.ladder.last() else { return BTreeMap::new() };
        let covariance = last.fit.moments(self.bench, &self.blocks).sandwich();
        let Some(added) = last.fit.model.causes.get(which) else { return BTreeMap::new() };
        let places = last.fit.model.places(which);
        let one = |(i, parameter): (usize, &crate::causes::Parameter)| {
            let factor = self.factor(parameter.unit, &added.modes);
            let free = places.clone().zip(added.free()).find(|(_, own)| *own == i).map(|(place, _)| place);
            let std = match free {
                Some(place) => Some(covariance[place][place].sqrt() * factor),
                None => instant_std(self.bench, &last.fit, which, i),
            };
            let value = Value {
                value: added.values.get(i).and_then(|value| finite(value * factor)),
                std: std.and_then(finite),
                unit: self.unit(parameter.unit),
            };
            (parameter.name.to_owned(), value)
        };
        added.cause.about().parameters.iter().enumerate().map(one).collect()
    }

    /// A parameter's unit in the scaled problem, in the record's units: those of the channel that its mode is counted
    /// in.
    fn factor(&self, unit: &str, modes: &[usize]) -> f64 {
        let own = self.choice.ladder.last().map_or(&[][..], |last| &last.fit.model.dynamics.own);
        let channel = own.get(modes.first().copied().unwrap_or(0)).copied().unwrap_or(0);
        let y = self.bench.output_scale.get(channel).copied().unwrap_or_else(|| self.scale());
        match unit {
            "input" => self.bench.input_scale,
            unit => y.powi(power_of_output(unit)),
        }
    }

    fn unit(&self, unit: &str) -> String {
        match unit {
            "input" => self.options.input_unit.clone(),
            _ => unit.replace('V', &self.options.output_unit),
        }
    }

    fn modes(&self, judged: &Judged) -> Vec<DiagnosedMode> {
        let covariance = judged.fit.moments(self.bench, &self.blocks).sandwich();
        let dynamics = &judged.fit.model.dynamics;
        let std = |place: usize| covariance.get(place).and_then(|row| finite(row.get(place)?.sqrt()));
        let one = |(s, section): (usize, &super::dynamics::Section)| {
            let place = dynamics.place(s);
            (section.kind == Kind::Oscillator).then(|| DiagnosedMode {
                frequency_hz: section.frequency_hz,
                frequency_std_hz: std(place),
                quality_factor: 1.0 / section.loss,
                quality_factor_std: std(place + 1).map(|std| std / section.loss.powi(2)),
            })
        };
        dynamics.sections.iter().enumerate().filter_map(one).collect()
    }

    fn validation(&self) -> Vec<Validation> {
        let ladder = &self.choice.ladder;
        let rms = |judged: Option<&Judged>, part: &Part| {
            judged.and_then(|judged| free_run_rms(self.bench, self.records, &judged.fit.model, part))
        };
        let one = |part: &Part| Validation {
            name: part.name.clone(),
            rms_before: rms(ladder.first(), part),
            rms_after: rms(ladder.last(), part),
            unit: self.options.output_unit.clone(),
        };
        self.options.parts.iter().map(one).collect()
    }

    fn rungs(&self, errors: &[Option<f64>]) -> Vec<Rung> {
        let effective = self.effective(self.bench.count);
        let ladder = &self.choice.ladder;
        let one = |(i, judged): (usize, &Judged)| {
            let parameters = judged.fit.model.system_parameters();
            let mean_square = judged.fit.loss / self.bench.count as f64 * self.scale().powi(2);
            let before = i.checked_sub(1).and_then(|i| ladder.get(i));
            Rung {
                added: judged.fit.model.causes.last().map_or("linear model", |added| added.id()).to_owned(),
                parameters,
                rms: self.rms(judged.fit.loss),
                held_out_rms: errors.get(i).copied().flatten(),
                unit: self.options.output_unit.clone(),
                log_likelihood_gain: before
                    .and_then(|before| finite(0.5 * effective * (before.fit.loss / judged.fit.loss).ln())),
                bic: finite(effective * mean_square.ln() + parameters as f64 * effective.ln()),
            }
        };
        ladder.iter().enumerate().map(one).collect()
    }

    fn nearest(&self) -> Vec<RunnerUp> {
        let chosen = self.choice.chosen.iter().map(|chosen| (chosen.about.id, None));
        let rivals = self
            .choice
            .chosen
            .iter()
            .filter_map(|chosen| chosen.runner_up)
            .map(|(rival, share)| (rival.id, Some(share)));
        let left = self.choice.nearest.iter().map(|(id, share)| (*id, Some(*share)));
        let all: Vec<(&str, Option<f64>)> = chosen.chain(rivals).chain(left).collect();
        let mut nearest: Vec<RunnerUp> = Vec::new();
        for (id, share) in all {
            if !nearest.iter().any(|other| other.id == id) {
                nearest.push(RunnerUp { id: id.to_owned(), share_of_gain: share.and_then(finite) });
            }
        }
        nearest
    }

    /// What is seen of a law that no cause is.
    fn said_of(&self, law: &UnnamedLaw, last: &Fit) -> String {
        let (words, share) = (&law.words, 100.0 * law.gain / last.loss);
        if let Some(alone) = law.alone.filter(|_| law.beats(self.bench, last)) {
            let [alone, all] = [alone, last.loss].map(|loss| self.rms(loss).unwrap_or(0.0));
            let unit = &self.options.output_unit;
            return format!(
                "{words} alone leaves {alone:.4e} {unit}, all causes together {all:.4e}, and no cause that was tried is \
                 such a law"
            );
        }
        let explained = match self.choice.explained() {
            0.0 => String::new(),
            explained => format!(", {:.1} % of what all causes take together", 100.0 * law.gain / explained),
        };
        format!(
            "{words} would take another {share:.1} % of the squared residual{explained} (p = {:.1e}), and no cause that \
             was tried is such a law",
            law.p_value
        )
    }

    fn evidence(&self, verdict: Verdict) -> Vec<String> {
        let unit = &self.options.output_unit;
        let mut lines: Vec<String> = self
            .choice
            .ladder
            .windows(2)
            .map(|pair| {
                let rms = |judged: &Judged| (judged.fit.loss / self.bench.count as f64).sqrt() * self.scale();
                let added = pair[1].fit.model.causes.last().map_or("", |added| added.id());
                let [before, after] = [rms(&pair[0]), rms(&pair[1])];
                format!(
                    "{added} lowers the free-run error of the training part from {before:.4e} to {after:.4e} {unit}"
                )
            })
            .collect();
        for chosen in self.choice.chosen.iter().filter(|chosen| chosen.tied) {
            let rival = chosen.runner_up.map_or("nothing", |(rival, _)| rival.id);
            lines.push(format!(
                "{} can't be distinguished from {rival}: their losses differ by less than 4 variances of the noise",
                chosen.about.id
            ));
        }
        let share = 100.0 * self.misfit.share();
        if self.misfit.is_significant() {
            lines.push(format!(
                "motion and input predict another {share:.1} % of the squared residual ({:.1} standard errors), {}",
                self.misfit.significance,
                if self.choice.lacks(&self.misfit, self.options.tolerated_misfit) {
                    format!(
                        "{:.2} of the root mean square of what they do not predict: more than `tolerated_misfit` = {} allows",
                        self.misfit.ratio, self.options.tolerated_misfit
                    )
                } else if self.misfit.is_systematic(self.options.tolerated_misfit) {
                    "little beside what the causes explain".to_owned()
                } else {
                    "which is tolerated".to_owned()
                }
            ));
        }
        if let Some((law, last)) = self.lacking().zip(self.choice.ladder.last())
            && verdict == Verdict::Unexplained
        {
            lines.push(self.said_of(law, &last.fit));
        }
        if let Some((id, share)) = self.choice.nearest.first().filter(|_| verdict == Verdict::Named) {
            lines.push(format!("not named: {id} would take {:.2} % of the squared residual", 100.0 * share));
        }
        lines
    }
}

/// Samples of a part that are scored.
fn scored(part: &Part) -> usize {
    let state = if let PartStart::FirstSamples(count) = part.start { count } else { 0 };
    part.stretch.samples().saturating_sub(state)
}

/// Power of the output's unit in a parameter's: `V`, `V^2`, `1/V`, `s/V`, `1/V^4`.
fn power_of_output(unit: &str) -> i32 {
    let of = |text: &str| match text.strip_prefix('V')? {
        "" => Some(1),
        power => power.strip_prefix('^')?.parse::<i32>().ok(),
    };
    match unit.split_once('/') {
        Some((above, below)) => of(above).unwrap_or(0) - of(below).unwrap_or(0),
        None => of(unit).unwrap_or(0),
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::power_of_output;

    #[test]
    fn a_parameter_has_the_outputs_unit_to_a_power() {
        let units = ["V", "1/V", "1/V^2", "1/V^4", "s/V", "V^3", "1", "Hz", "V/s", "1/Hz", "input"];
        assert_eq!(units.map(power_of_output), [1, -1, -2, -4, -1, 3, 0, 0, 1, 0, 0]);
    }
}
