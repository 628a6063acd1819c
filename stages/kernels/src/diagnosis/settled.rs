//! What was chosen on a sample, fitted to all samples, and what does not hold there taken out.

use rayon::prelude::*;

use super::baseline::blocks;
use super::data::{Bench, Record};
use super::diagnose::Extended;
use super::dynamics::Model;
use super::fit::{Chords, Fit, Moments, Until, with_own};
use super::options::DiagnosisOptions;
use super::selection::{Choice, Judged};
use super::validation::{held_out, pooled_rms};

/// The fit to all samples of a model between the baseline and the last: its error is shown, not used.
const PASSED: Until = Until::steps(3);
/// The fit without a cause, for comparison.
const COMPARED: Until = Until { gain: 1e-3, ..Until::steps(6) };
/// Ratio of losses without and with a cause from which on it needs no further test.
const PLAIN: f64 = 1.5;
/// Standard errors that a strength must reach.
const STRENGTH: f64 = 3.0;

/// A cause of the last model, seen on all samples.
struct Standing {
    /// Its largest strength over its error; a choice has none.
    strength: Option<f64>,
    /// Without it: the error on what did not choose it, and the model; none where that is far off.
    without: Option<(f64, Model)>,
}

impl Extended {
    /// Every model fitted to all samples, from where it was found, without causes whose strength is below three of its
    /// errors or that gain nothing on what did not choose them. None where the baseline diverges.
    ///
    /// # Method
    /// Backward elimination, the cause first that loses most by being there.
    pub fn on_all(&self, records: &[Record<'_>], interval_s: f64, options: &DiagnosisOptions) -> Option<Self> {
        let first = self.choice.ladder.first()?;
        let (here, bench) = self.bench_of_all(records, interval_s, options)?;
        let blocks = blocks(&bench, &first.fit);
        let fitted = |model: &Model, until: Until| {
            let mut start = if here { model.clone() } else { with_own(&bench, model) };
            start.dynamics.interval_s = interval_s;
            Some(Judged::new(Fit::new(&bench, &start, until)?, &bench, &blocks))
        };
        let mut models: Vec<Model> = self.choice.ladder.iter().map(|judged| judged.fit.model.clone()).collect();
        let mut chosen = self.choice.chosen.clone();
        // a model that diverges on all samples ends the ladder before it
        let mut last = loop {
            if let Some(last) = fitted(models.last()?, Until::MINIMUM) {
                break last;
            }
            models.pop();
        };
        chosen.retain(|chosen| chosen.place + 1 < models.len());
        let baseline = if models.len() > 1 { fitted(&models[0], Until::MINIMUM)? } else { last.clone() };
        let mut unchanged = if here { models.len() } else { 0 };
        while models.len() > 1 {
            let error = |model: &Model| pooled_rms(&bench, records, model, held_out(&options.parts));
            let folds = options.parts.is_empty();
            let with = if folds { Some(last.unseen()) } else { error(&last.fit.model) };
            let covariance = last.fit.moments(&bench, &blocks).sandwich();
            let judge = |reached: &Chords| match folds {
                true => Some(Moments::new(&reached.columns, &reached.residual, &blocks).held_out(0.0).iter().sum()),
                false => error(&reached.model),
            };
            let standings: Vec<Standing> = last
                .fit
                .without_chords(&bench, COMPARED)
                .into_par_iter()
                .enumerate()
                .map(|(which, reached)| standing(&last.fit, &covariance, which, reached, judge))
                .collect();
            let loses = |s: &Standing| Some(with? / s.without.as_ref()?.0);
            let worst = (0..standings.len())
                .filter_map(|which| Some((loses(&standings[which])?, which)))
                .filter(|(ratio, _)| *ratio >= 1.0)
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let faint = (0..standings.len())
                .filter_map(|which| Some((standings[which].strength?, which)))
                .filter(|(strength, _)| *strength < STRENGTH)
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, which)) = worst.or(faint) else {
                // what is far from it is fitted, to say how far
                let fitted = |which: usize| {
                    let judged =
                        Judged::new(Fit::new(&bench, &last.fit.model.without(which), PASSED)?, &bench, &blocks);
                    if folds { Some(judged.unseen()) } else { error(&judged.fit.model) }
                };
                for own in &mut chosen {
                    let near = standings.get(own.place).and_then(|s| Some(s.without.as_ref()?.0));
                    own.left_out = near.or_else(|| fitted(own.place));
                }
                break;
            };
            let without = standings.into_iter().nth(which).and_then(|s| s.without).map(|(_, model)| model);
            let next = without.unwrap_or_else(|| last.fit.model.without(which));
            // one whose absence diverges stays
            let Some(fit) = Fit::new(&bench, &next, Until::MINIMUM) else { break };
            last = Judged::new(fit, &bench, &blocks);
            models.remove(which + 1);
            models.iter_mut().skip(which + 1).for_each(|model| *model = model.without(which));
            unchanged = unchanged.min(which + 1);
            chosen.retain(|own| own.place != which);
            chosen.iter_mut().filter(|own| own.place > which).for_each(|own| own.place -= 1);
        }
        let mut ladder = vec![baseline];
        let between = 1..models.len().saturating_sub(1);
        for (rung, model) in models.iter().enumerate().take(between.end).skip(between.start) {
            let known = (rung < unchanged).then(|| self.choice.ladder[rung].clone());
            let until = if here { Until::MINIMUM } else { PASSED };
            // where its own values diverge, from those of the last model
            let from_last = || {
                let more = (rung..last.fit.model.causes.len()).rev();
                fitted(&more.fold(last.fit.model.clone(), |model, which| model.without(which)), until)
            };
            ladder.push(known.or_else(|| fitted(model, until)).or_else(from_last)?);
        }
        if models.len() > 1 {
            ladder.push(last);
        }
        let (nearest, untried) = (self.choice.nearest.clone(), self.choice.untried);
        Some(Self {
            choice: Choice { ladder, chosen, nearest, untried },
            bench,
            blocks,
            adequate: self.adequate,
            far_better: self.far_better,
        })
    }

    /// The linear model alone on all samples: no account of them, where what extends it diverges there. None: it diverges,
    /// too.
    pub fn linear_on_all(&self, records: &[Record<'_>], interval_s: f64, options: &DiagnosisOptions) -> Option<Self> {
        let (here, bench) = self.bench_of_all(records, interval_s, options)?;
        let first = self.choice.ladder.first()?;
        let blocks = blocks(&bench, &first.fit);
        let mut start = if here { first.fit.model.clone() } else { with_own(&bench, &first.fit.model) };
        start.dynamics.interval_s = interval_s;
        let ladder = vec![Judged::new(Fit::new(&bench, &start, Until::MINIMUM)?, &bench, &blocks)];
        let (nearest, untried) = (self.choice.nearest.clone(), self.choice.untried);
        let choice = Choice { ladder, chosen: Vec::new(), nearest, untried };
        Some(Self { choice, bench, blocks, adequate: false, far_better: false })
    }

    /// Whether the search had all samples.
    pub fn is_whole(&self, interval_s: f64, options: &DiagnosisOptions) -> bool {
        self.bench.stretches == options.training && self.bench.interval_s == interval_s
    }

    /// All samples, and whether they are those that the search had.
    fn bench_of_all(
        &self,
        records: &[Record<'_>],
        interval_s: f64,
        options: &DiagnosisOptions,
    ) -> Option<(bool, Bench)> {
        if self.is_whole(interval_s, options) {
            return Some((true, self.bench.clone()));
        }
        let highest_hz = self.choice.ladder.first()?.fit.model.dynamics.highest_hz();
        Some((false, self.bench.at_interval(records, &options.training, interval_s, highest_hz)?))
    }
}

fn standing(
    last: &Fit,
    covariance: &[Vec<f64>],
    which: usize,
    reached: Option<Chords>,
    error: impl Fn(&Chords) -> Option<f64>,
) -> Standing {
    let added = &last.model.causes[which];
    let ratio = |(place, value): (usize, f64)| value.abs() / covariance[place][place].sqrt();
    let strength = last.model.places(which).zip(added.free_values()).map(ratio).fold(0.0, f64::max);
    let reached = reached.filter(|reached| reached.loss < PLAIN * last.loss);
    let without = reached.and_then(|reached| Some((error(&reached)?, reached.model)));
    Standing { strength: (!added.is_choice()).then_some(strength), without }
}
