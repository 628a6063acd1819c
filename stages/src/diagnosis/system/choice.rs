//! Which causes to add: greedily, then each again against its rivals.

use super::bench::Bench;
use super::blocks::Blocks;
use super::fit::Fit;
use super::linear_algebra::dot;
use super::misfit::Floor;
use super::model::Model;
use super::options::SystemOptions;
use super::screen::{Promise, Sample, screen, significance};
use crate::causes::{Cause, Part};

/// Candidates that are fitted at each step.
const REFITTED: usize = 5;
/// Samples times steps of a fit that only has to be compared: ten steps of the longest sample.
const WORK: usize = 160_000;
/// Times that a model may be changed after its causes were held against their rivals.
const ROUNDS: usize = 4;
/// Rivals that a named cause is held against.
const RIVALS: usize = 2;
/// Two models tie whose losses differ by less than this many variances of the floor: a likelihood ratio of 7.
const TIE: f64 = 4.0;

/// A model with what it loses on folds that it has not seen, block by block.
#[derive(Clone)]
pub(super) struct Judged {
    pub fit: Fit,
    pub held_out: Vec<f64>,
}

impl Judged {
    pub fn new(fit: Fit, blocks: &Blocks) -> Self {
        let held_out = fit.moments(blocks).held_out(0.0);
        Self { fit, held_out }
    }

    /// Loss on folds that were not seen.
    pub fn unseen(&self) -> f64 {
        self.held_out.iter().sum()
    }
}

/// A cause that was chosen, and what it was held against.
#[derive(Clone)]
pub(super) struct Chosen {
    /// Its id.
    pub id: &'static str,
    /// Its place among the model's causes.
    pub place: usize,
    /// Corrected for all candidates and their trials.
    pub p_value: f64,
    /// Ratio of the score's scatter between blocks to that of white residuals.
    pub inflation: f64,
    /// The best model with another cause in its place: id, share of the gain.
    pub runner_up: Option<(&'static str, f64)>,
    /// Whether the two can't be told apart.
    pub tied: bool,
}

/// What the search found.
pub(super) struct Choice {
    /// The baseline and each model with one more cause, in order: rung n has n causes.
    pub ladder: Vec<Judged>,
    /// The causes of the last.
    pub chosen: Vec<Chosen>,
    /// What came nearest where nothing was added: id, share of the squared residual that it would take.
    pub nearest: Vec<(&'static str, f64)>,
}

/// All that a step of the search looks at.
pub(super) struct Search<'a> {
    pub bench: &'a Bench,
    pub blocks: Blocks,
    /// The beginning of the training part, where candidates are compared; all of it where it is short.
    pub sample: Bench,
    pub sample_blocks: Blocks,
    pub options: &'a SystemOptions,
    pub candidates: Vec<&'static dyn Cause>,
    /// Trials of all candidates together.
    pub trials: usize,
}

impl Search<'_> {
    /// Adds causes until nothing is significant, drops what later ones make superfluous, exchanges what a rival does
    /// better.
    ///
    /// # Method
    /// Score screen, joint refits of the best five to a sample, the largest gain of the log likelihood less the
    /// Bayesian penalty; a cause stays while its F test by blocks, corrected for the number of trials, and its share of
    /// the held-out error both pass.
    /// # Source
    /// S. A. Billings, Nonlinear System Identification, 2013, chapter 3, on forward selection; G. Schwarz, Ann. Stat. 6
    /// (1978) 461.
    pub fn run(&self, baseline: Fit) -> Choice {
        let mut ladder = vec![Judged::new(baseline, &self.blocks)];
        let mut chosen = Vec::new();
        let mut nearest = Vec::new();
        // an exchange lowers the loss, so that this ends; the bound is for ties by rounding
        for round in 0..ROUNDS {
            nearest = self.climb(&mut ladder);
            match self.examined(&ladder, round + 1 < ROUNDS) {
                Examined::Stands(causes) => {
                    chosen = causes;
                    break;
                }
                Examined::Changes(model) => ladder = self.rebuilt(&ladder[0], &model),
            }
        }
        Choice { ladder, chosen, nearest }
    }

    /// Adds one cause after another; gives what came nearest at the last step.
    fn climb(&self, ladder: &mut Vec<Judged>) -> Vec<(&'static str, f64)> {
        loop {
            let Some(current) = ladder.last().cloned() else { return Vec::new() };
            let promises = screen(self.bench, &current.fit, &self.candidates);
            let nearest = promises.iter().take(3).map(|p| (p.cause.about().id, p.gain / current.fit.loss)).collect();
            if current.fit.model.causes.len() >= self.options.most_causes {
                return nearest;
            }
            match self.best(&current, &promises) {
                Some(next) => ladder.push(next),
                None => return nearest,
            }
        }
    }

    /// The best of the first few promises that passes.
    fn best(&self, current: &Judged, promises: &[Promise]) -> Option<Judged> {
        let promising: Vec<&Promise> =
            promises.iter().take(REFITTED).filter(|promise| self.could_matter(current, promise)).collect();
        if promising.is_empty() {
            return None;
        }
        let here = self.on_sample(&current.fit.model)?;
        let mut tried: Vec<(f64, Model)> = Vec::new();
        for promise in promising {
            let Some(next) = self.extended(&here.fit.model, promise) else { continue };
            let parameters = next.fit.model.vector().len().saturating_sub(here.fit.model.vector().len()).max(1);
            let samples = self.sample.count as f64;
            let gain = 0.5 * samples * (here.fit.loss / next.fit.loss).ln();
            tried.push((gain - 0.5 * parameters as f64 * samples.ln(), next.fit.model));
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let sample = self.sampled(&here.fit);
        for (_, model) in tried.into_iter().filter(|(gain, _)| gain.is_finite()) {
            let next = Judged::new(Fit::new(self.bench, &model, None)?, &self.blocks);
            let which = next.fit.model.causes.len() - 1;
            if self.passes(&sample, &next, which, current) {
                return Some(next);
            }
        }
        None
    }

    /// Whether a promise, taken at its word, could be significant or large: a fit of what is neither is time lost.
    fn could_matter(&self, current: &Judged, promise: &Promise) -> bool {
        let mean_square = current.fit.loss / self.bench.count as f64;
        // a cause that only works beside refitted others holds far more than its secant promises: where fits are cheap
        // they decide
        let cheap = self.sample.count == self.bench.count;
        promise.gain > 2.0 * mean_square && (cheap || 5.0 * promise.gain / current.fit.loss > self.options.least_gain)
    }

    /// Training part over sample, in samples.
    fn scale(&self) -> f64 {
        self.bench.count as f64 / self.sample.count as f64
    }

    /// Steps of a fit that only has to be compared.
    fn few(&self) -> usize {
        (WORK / self.sample.count.max(1)).clamp(10, 40)
    }

    /// A model fitted to the sample.
    fn on_sample(&self, model: &Model) -> Option<Judged> {
        Some(Judged::new(Fit::new(&self.sample, model, Some(self.few()))?, &self.sample_blocks))
    }

    fn sampled<'b>(&'b self, fit: &'b Fit) -> Sample<'b> {
        let floor = Floor::new(&self.sample, fit, &self.sample_blocks);
        Sample { bench: &self.sample, blocks: self.sample_blocks, fit, floor }
    }

    /// A promise fitted jointly with a model to the sample.
    fn extended(&self, model: &Model, promise: &Promise) -> Option<Judged> {
        let start = |values: &Vec<f64>| model.with(promise.cause, values.clone());
        let loss = |values: &Vec<f64>| {
            let rest = self.sample.residual(&self.sample.simulate(&start(values)));
            let loss = dot(&rest, &rest);
            if loss.is_finite() { loss } else { f64::INFINITY }
        };
        // the strength that the score asks for may be far outside where it is linear
        let from = if loss(&promise.values) <= loss(&promise.trial) { &promise.values } else { &promise.trial };
        self.on_sample(&start(from))
    }

    /// Whether cause `which` of a model is significant and large enough against the model without it.
    fn passes(&self, sample: &Sample<'_>, with: &Judged, which: usize, without: &Judged) -> bool {
        let gain = without.fit.loss - with.fit.loss;
        let sign = significance(sample, &with.fit.model, which, gain, self.scale());
        let share = 1.0 - (with.fit.loss / without.fit.loss).sqrt();
        let p_value = self.corrected(sign.p_value, with.fit.model.causes[which].cause);
        p_value < self.options.false_alarm_rate && share > self.options.least_gain
    }

    /// Bonferroni over all candidates' trials; a frequency is searched among as many as the record resolves.
    fn corrected(&self, p_value: f64, cause: &dyn Cause) -> f64 {
        let searched = cause.about().parameters.iter().any(|parameter| parameter.unit == "Hz");
        let tries = self.trials * if searched { self.bench.count / 2 } else { 1 };
        (p_value * tries as f64).min(1.0)
    }

    /// Holds each cause of the last model against its absence and against its rivals.
    fn examined(&self, ladder: &[Judged], may_change: bool) -> Examined {
        let Some(here) = ladder.last().and_then(|last| self.on_sample(&last.fit.model)) else {
            return Examined::Stands(Vec::new());
        };
        let sample = self.sampled(&here.fit);
        let mut chosen = Vec::new();
        for which in 0..here.fit.model.causes.len() {
            let without = self
                .on_sample(&here.fit.model.without(which))
                .filter(|without| without.fit.loss > here.fit.loss)
                // the others' values may diverge without it: then the model before it came
                .or_else(|| self.on_sample(&ladder.get(which)?.fit.model));
            let Some(without) = without else { continue };
            let rival = self.rival(&here, which, &without);
            let found = self.audit(&sample, &here, which, &without, rival.as_ref());
            let share = 1.0 - (here.fit.loss / without.fit.loss).sqrt();
            let weak = found.p_value > self.options.false_alarm_rate || share < self.options.least_gain;
            // the last has just passed
            if may_change && weak && which + 1 < here.fit.model.causes.len() {
                return Examined::Changes(without.fit.model);
            }
            if let Some((rival, _)) = rival.filter(|_| may_change)
                && rival.fit.loss - here.fit.loss < -TIE * sample.floor.mean_square
            {
                return Examined::Changes(rival.fit.model);
            }
            chosen.push(found);
        }
        Examined::Stands(chosen)
    }

    /// The best model with another cause in the place of `which`, of another class; all on the sample.
    fn rival(&self, here: &Judged, which: usize, without: &Judged) -> Option<(Judged, &'static str)> {
        let about = here.fit.model.causes[which].cause.about();
        // over the beginning of a record an offset, a drift and a slow line are one
        let short = self.sample.count < self.bench.count && about.part == Part::Record;
        let others: Vec<&'static dyn Cause> = self
            .candidates
            .iter()
            .copied()
            .filter(|cause| !about.class.contains(&cause.about().id) && !here.fit.model.has(cause.about().id))
            .filter(|cause| !(short && cause.about().part == Part::Record))
            .collect();
        let promises = screen(&self.sample, &without.fit, &others);
        let sample = self.sampled(&without.fit);
        let extended = promises.iter().take(RIVALS).filter_map(|promise| {
            let rival = self.extended(&without.fit.model, promise)?;
            // what is not significant by itself is no rival
            self.passes(&sample, &rival, rival.fit.model.causes.len() - 1, without)
                .then_some((rival, promise.cause.about().id))
        });
        extended.min_by(|a, b| a.0.fit.loss.total_cmp(&b.0.fit.loss))
    }

    /// The ladder to a model's causes, in their order.
    fn rebuilt(&self, baseline: &Judged, model: &Model) -> Vec<Judged> {
        let mut ladder = vec![baseline.clone()];
        for added in &model.causes {
            let Some(current) = ladder.last() else { break };
            // from what this rung asks for, not from values that only hold beside the causes to come; where that
            // diverges, from what hardly acts
            let promise = screen(self.bench, &current.fit, &[added.cause]).into_iter().next();
            let asked = promise.into_iter().flat_map(|promise| [promise.values, promise.trial]);
            let next = asked
                .chain([added.values.clone()])
                .find_map(|values| Fit::new(self.bench, &current.fit.model.with(added.cause, values), None));
            let Some(next) = next else { break };
            ladder.push(Judged::new(next, &self.blocks));
        }
        // the last from where it was found, if that is the better
        let found = Fit::new(self.bench, model, None);
        if let (Some(last), Some(found)) = (ladder.last_mut(), found)
            && last.fit.model.causes.len() == model.causes.len()
            && found.loss < last.fit.loss
        {
            *last = Judged::new(found, &self.blocks);
        }
        ladder
    }

    /// A cause with its p-value and its runner-up.
    fn audit(
        &self,
        sample: &Sample<'_>,
        here: &Judged,
        which: usize,
        without: &Judged,
        rival: Option<&(Judged, &'static str)>,
    ) -> Chosen {
        let added = &here.fit.model.causes[which];
        let gain = without.fit.loss - here.fit.loss;
        let scale = self.scale();
        let sign = significance(sample, &here.fit.model, which, gain * scale, scale);
        let tie = TIE * sample.floor.mean_square * sign.inflation.max(1.0);
        Chosen {
            id: added.id(),
            place: which,
            p_value: self.corrected(sign.p_value, added.cause),
            inflation: sign.inflation,
            tied: rival.is_some_and(|(rival, _)| scale * (rival.fit.loss - here.fit.loss) < tie),
            runner_up: rival.map(|(rival, id)| (*id, (without.fit.loss - rival.fit.loss) / gain)),
        }
    }
}

/// Whether a model's causes stand.
enum Examined {
    /// Each, with what it was held against.
    Stands(Vec<Chosen>),
    /// The model without a superfluous cause, or with a better one in its place.
    Changes(Model),
}
