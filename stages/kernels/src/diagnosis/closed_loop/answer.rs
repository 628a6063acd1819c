//! From findings to the answer that is stored and shown.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::diagnosis::ruling::{Claim, Grounds, Ruling};
use crate::diagnosis::verdict::{
    BaselineSummary, Diagnosis, Gain, NamedCause, Rung, RunnerUp, Validation, Value, Verdict,
};

use super::adequacy::{Adequacy, adequacy};
use super::balance::{ASYMMETRY, EXTRA, MASS, OFFSET, STIFFNESS, VISCOUS};
use super::data::{ClosedLoopDiagnosis, ClosedLoopOptions};
use super::diagnose::Bench;
use super::estimate::{BLOCKS, Estimate};
use super::selection::{CANDIDATES, Choice, Step, fall, indistinct};
use super::wording::{feedback, mass_unit, next_measurement, parameter};

/// Part of the squares beside noise that an effect may take without a name.
const TOLERATED: f64 = 0.25;
/// Standard errors of an effect that is mentioned.
const MENTIONED: f64 = 3.0;

struct Findings<'a> {
    bench: &'a Bench<'a>,
    options: &'a ClosedLoopOptions<'a>,
    choice: &'a Choice,
}

pub(super) fn answer(bench: Bench<'_>, options: &ClosedLoopOptions<'_>, choice: Choice) -> ClosedLoopDiagnosis {
    // what is not allowed still belongs to the plant: judged without it, its effect would pass for other dynamics
    let full = choice.left.first().map_or(&choice.last, |(trial, _)| &trial.estimate);
    let plant = choice.last.plant(bench.drive_scale);
    let before = bench.simulated(&choice.linear.plant(bench.drive_scale));
    let after = bench.simulated(&plant);
    let adequacy = adequacy(&bench, full, &bench.simulated(&full.plant(bench.drive_scale)));
    let findings = Findings { bench: &bench, options, choice: &choice };
    let diagnosis = findings.diagnosis(&adequacy, &before.output, &after.output);
    let (controller, drive_after) = (bench.controller.clone(), after.drive);
    ClosedLoopDiagnosis { diagnosis, before: before.output, after: after.output, drive_after, controller, plant }
}

impl Findings<'_> {
    fn diagnosis(&self, adequacy: &Adequacy, before: &[f64], after: &[f64]) -> Diagnosis {
        let left = self.choice.left.iter().any(|(_, share)| *share > TOLERATED);
        let all = self.named();
        let claim = |cause: &NamedCause| Claim { id: cause.id.clone(), held_out: None };
        let claims = all.iter().map(claim).collect();
        let grounds = Grounds { adequate: adequacy.adequate, systematic: left, claims, ..Grounds::default() };
        let Ruling { verdict, stand, .. } = grounds.ruling(&|_| None);
        let named = stand.into_iter().filter_map(|number| all.get(number).cloned()).collect();
        let p_values = self.choice.steps.iter().map(|step| step.trial.p_value);
        let training = self.rms(before, &self.bench.training);
        Diagnosis {
            verdict,
            p_value: p_values.fold(None, |least: Option<f64>, p| Some(least.map_or(p, |least| least.min(p)))),
            baseline: BaselineSummary {
                adequate: adequacy.adequate,
                order: Some(2),
                parameters: self.parameters(),
                noise_rms: finite(self.bench.noise),
                distortion_rms: training.map(|rms| (rms * rms - self.bench.noise.powi(2)).max(0.0).sqrt()),
            },
            causes: named,
            evidence: self.evidence(adequacy, after),
            nearest: if verdict == Verdict::Unexplained { self.nearest() } else { Vec::new() },
            modes_before: Vec::new(),
            modes_after: Vec::new(),
            validation: self.validation(before, after),
            ladder: self.ladder(),
            false_alarm_rate: self.options.false_alarm_rate,
        }
    }

    fn rms(&self, simulated: &[f64], part: &Range<usize>) -> Option<f64> {
        let pair = simulated.get(part.clone())?.iter().zip(self.bench.measured.output.get(part.clone())?);
        let squares: f64 = pair.map(|(a, b)| (a - b).powi(2)).sum();
        finite((squares / part.len() as f64).sqrt())
    }

    fn parameters(&self) -> BTreeMap<String, Value> {
        let units = &self.options.units;
        let extra = self.bench.measured.extra.map_or("extra", |(name, _)| name);
        [
            (MASS, "mass".to_owned(), mass_unit(units), 1.0),
            (VISCOUS, "viscous_friction".to_owned(), format!("{} s/{}", units.force, units.output), 1.0),
            (STIFFNESS, "stiffness".to_owned(), format!("{}/{}", units.force, units.output), 1.0),
            (EXTRA, format!("force_per_{extra}"), units.force.clone(), -1.0),
        ]
        .into_iter()
        .filter_map(|(column, name, unit, sign)| {
            let (value, std) = self.choice.last.of(column)?;
            Some((name, Value { value: finite(sign * value), std: finite(std), unit }))
        })
        .collect()
    }

    fn effective(&self) -> f64 {
        self.bench.training.len() as f64 / self.bench.window.samples().max(1) as f64
    }

    fn named(&self) -> Vec<NamedCause> {
        let one = |step: &Step| {
            let column = step.trial.column;
            let (name, unit) = parameter(column, &self.options.units);
            let (value, std) = self.choice.last.of(column).unwrap_or((f64::NAN, f64::NAN));
            let number = Value { value: finite(value), std: finite(std), unit };
            let like = indistinct(self.bench, &self.choice.last, column).map(|column| id(column).to_owned());
            NamedCause {
                id: id(column).to_owned(),
                class: [id(column).to_owned()].into_iter().chain(like).collect(),
                p_value: finite(step.trial.p_value),
                parameters: BTreeMap::from([(name.to_owned(), number)]),
                gain: Gain {
                    rms_before: finite(step.rms[0]),
                    rms_after: finite(step.rms[1]),
                    unit: self.options.units.output.clone(),
                    log_likelihood: finite(0.5 * self.effective() * (step.squares[0] / step.squares[1]).ln()),
                    held_out: format!(
                        "{BLOCKS} blocks in turn: force balance (log likelihood), position simulated in the loop (rms)"
                    ),
                },
                runner_up: step
                    .runner_up
                    .map(|(column, share)| RunnerUp { id: id(column).to_owned(), share_of_gain: finite(share) }),
                next_measurement: next_measurement(column).to_owned(),
            }
        };
        self.choice.steps.iter().map(one).collect()
    }

    fn nearest(&self) -> Vec<RunnerUp> {
        let chosen = self.choice.steps.iter().map(|step| (step.trial.column, None));
        let rivals = self.choice.steps.iter().filter_map(|step| step.runner_up.map(|(c, share)| (c, Some(share))));
        let mut nearest: Vec<RunnerUp> = Vec::new();
        for (column, share) in chosen.chain(rivals) {
            if !nearest.iter().any(|other| other.id == id(column)) {
                nearest.push(RunnerUp { id: id(column).to_owned(), share_of_gain: share.and_then(finite) });
            }
        }
        nearest
    }

    fn validation(&self, before: &[f64], after: &[f64]) -> Vec<Validation> {
        let one = |part: &super::data::JudgedPart| {
            let range = part.first..part.end.max(part.first);
            Validation {
                name: part.name.clone(),
                rms_before: self.rms(before, &range),
                rms_after: self.rms(after, &range),
                unit: self.options.units.output.clone(),
            }
        };
        self.options.parts.iter().map(one).collect()
    }

    /// Rungs in force: residuals of the balance.
    fn ladder(&self) -> Vec<Rung> {
        let rows = self.bench.moments.rows().max(1) as f64;
        let effective = self.effective();
        let rung = |added: &str, estimate: &Estimate, before: Option<f64>| {
            let square = estimate.squares / rows;
            let parameters = estimate.set.len();
            Rung {
                added: added.to_owned(),
                parameters,
                rms: finite(square.sqrt()),
                held_out_rms: finite((estimate.held_out.iter().sum::<f64>() / rows).sqrt()),
                unit: self.options.units.force.clone(),
                log_likelihood_gain: before.and_then(|b| finite(0.5 * effective * (b / estimate.squares).ln())),
                bic: finite(effective * square.ln() + parameters as f64 * effective.ln()),
            }
        };
        let mut ladder = vec![rung("mass and viscous friction", &self.choice.linear, None)];
        let mut last = self.choice.linear.squares;
        for step in &self.choice.steps {
            ladder.push(rung(id(step.trial.column), &step.trial.estimate, Some(last)));
            last = step.trial.estimate.squares;
        }
        ladder
    }

    fn evidence(&self, adequacy: &Adequacy, after: &[f64]) -> Vec<String> {
        let extra = self.bench.measured.extra.map(|(name, _)| name);
        let mut lines = feedback(&self.bench.controller, extra);
        if adequacy.adequate {
            lines.push(format!(
                "the plant integrates: a mass with friction leaves {:.1} % of the force (rms) beside noise, and \
                 neither a spring nor a resonance takes most of that",
                100.0 * adequacy.missed_force
            ));
        }
        if self.bench.drive_scale != self.bench.measured.drive_scale {
            lines.push("a positive drive pushes the output down: the sign of the drive's scale is wrong".to_owned());
        }
        lines.extend(adequacy.evidence.iter().cloned());
        let unit = &self.options.units.output;
        for step in &self.choice.steps {
            lines.push(format!(
                "held-out error of the simulated position: {:.3e} {unit} without {}, {:.3e} {unit} with it",
                step.rms[0],
                id(step.trial.column),
                step.rms[1]
            ));
        }
        for (trial, share) in &self.choice.left {
            lines.push(format!(
                "a force as of {} would take {:.0} % of the squares that noise does not explain; it may not be \
                 named, or the simulated loop does not gain by it",
                id(trial.column),
                100.0 * share
            ));
        }
        if let Some(rms) = self.rms(after, &self.bench.training) {
            lines.push(format!("simulated from the reference, the position is off by {rms:.3e} {unit} rms"));
        }
        lines.extend(self.direction());
        lines
    }

    /// A resistance that depends on the direction, where the data tell it from a constant force.
    fn direction(&self) -> Option<String> {
        let base: Vec<usize> =
            self.choice.last.set.iter().copied().filter(|c| ![OFFSET, ASYMMETRY].contains(c)).collect();
        let with = |more: &[usize]| {
            let set: Vec<usize> = base.iter().chain(more).copied().collect();
            self.bench.estimate(&set)
        };
        let (constant, viscous, both) = (with(&[OFFSET])?, with(&[ASYMMETRY])?, with(&[OFFSET, ASYMMETRY])?);
        let (half, std) = both.of(ASYMMETRY)?;
        let (_, better) = fall(&constant.held_out, &viscous.held_out);
        let needed = half.abs() > MENTIONED * std && fall(&constant.held_out, &both.held_out).1 > 2.0;
        if !needed && better <= MENTIONED {
            return None;
        }
        let (mean, _) = viscous.of(VISCOUS)?;
        let (alone, alone_std) = viscous.of(ASYMMETRY)?;
        let unit = format!("{} s/{}", self.options.units.force, self.options.units.output);
        Some(format!(
            "the constant force is rather a viscous friction that depends on the direction: {:.1} {unit} forwards, \
             {:.1} backwards (half the difference {alone:.1} +- {alone_std:.1}); it leaves {:.2} times the squares of \
             a constant force",
            mean + alone,
            mean - alone,
            viscous.squares / constant.squares
        ))
    }
}

fn id(column: usize) -> &'static str {
    CANDIDATES.iter().find(|candidate| candidate.column == column).map_or("", |candidate| candidate.id)
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
