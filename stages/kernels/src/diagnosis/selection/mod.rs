//! Which causes to add: greedily, then each again against its rivals.

mod choice;

pub(crate) use choice::{Choice, Chosen, Judged, Untried};

use super::data::Bench;
use super::dynamics::Model;
use super::fit::{Blocks, Chords, Fit, Until, dot};
use super::instants::{instant, nearest_instant};
use super::lack_of_fit::{Floor, misfit};
use super::options::DiagnosisOptions;
use super::score_test::{Candidate, Promise, Sample, other_choices, screen, significance};
use crate::causes::{About, Cause};
use crate::statistics::f_tail;

/// Candidates that are fitted at each step.
const REFITTED: usize = 5;
/// Samples times steps of a fit that only has to be compared: ten steps of many samples.
const WORK: usize = 160_000;
/// Times that a model may be changed after its causes were held against their rivals.
const ROUNDS: usize = 4;
/// Causes that are held against their rivals, all times together, after which no exchange follows.
const EXAMINED: usize = 12;
/// Share of the largest gain from which on a candidate may be the best.
const NEAR: f64 = 0.8;
/// Share of the loss below which a step of a fit that only has to be compared is its last.
const SLOW: f64 = 1e-3;
/// Share of the loss that is left below which chords are not trusted.
const FAR: f64 = 0.5;
/// Share of a cause's gain from which on a rival explains the same.
const ALIKE: f64 = 0.99;
/// Rivals that a named cause is held against.
const RIVALS: usize = 2;
/// Predictable over unpredictable part of what a model leaves, both rms, from which on another model is looked for: half
/// of the squared residual.
const MUCH: f64 = 1.0;
/// Last causes that another search goes on without.
const AGAIN: usize = 1;
/// Two models tie whose losses differ by less than this many variances of the floor: a likelihood ratio of 7.
pub(super) const TIE: f64 = 4.0;

/// All that a step of the search looks at.
pub(crate) struct Search<'a> {
    pub bench: &'a Bench,
    pub blocks: Blocks,
    pub options: &'a DiagnosisOptions,
    pub candidates: Vec<Candidate>,
    /// Trials of all candidates together.
    pub trials: usize,
    /// The bench's work at which the search ends, with what it has then.
    pub end: u64,
    /// Work beyond that for holding what it has then against rivals.
    pub for_rivals: u64,
}

impl Search<'_> {
    /// Adds causes until nothing is significant, drops what later ones make superfluous, exchanges what a rival does
    /// better, and tries what would have come in the place of each.
    ///
    /// # Method
    /// Score screen, joint refits of the best five, the largest gain of the log likelihood less the
    /// Bayesian penalty; a cause stays while its F test by blocks, corrected for the number of trials, and its share of
    /// the held-out error both pass.
    /// # Source
    /// S. A. Billings, Nonlinear System Identification, 2013, chapter 3, on forward selection; G. Schwarz, Ann. Stat. 6
    /// (1978) 461.
    pub fn run(&self, baseline: Fit) -> Choice {
        let mut best = self.from(vec![Judged::new(baseline, self.bench, &self.blocks)], None);
        let rest = |choice: &Choice| choice.ladder.last().map(|last| misfit(self.bench, &last.fit, &self.blocks));
        let good = rest(&best).is_none_or(|misfit| misfit.ratio < MUCH.min(self.options.tolerated_misfit));
        if good || self.is_full(&best.ladder) {
            return best;
        }
        // the first step is seldom wrong; the cause that helps most alone may be in the way of two that help together
        for place in (1..best.ladder.len().saturating_sub(1)).rev().take(AGAIN) {
            let Some(causes) = best.ladder.last().map(|last| &last.fit.model.causes) else { break };
            let Some(added) = causes.get(place) else { continue };
            let other = Candidate { cause: added.cause, modes: added.modes.clone() };
            let next = self.from(best.ladder[..=place].to_vec(), Some(&other));
            if next.unseen() < best.unseen() {
                best = next;
            }
        }
        best
    }

    /// Whether a ladder has as many causes as it may, or the search has taken as long as it may: what needs so many, or
    /// so long, is not in the catalogue.
    fn is_full(&self, ladder: &[Judged]) -> bool {
        ladder.len() > self.options.most_causes || self.is_spent()
    }

    /// Whether the search has taken as long as it may.
    fn is_spent(&self) -> bool {
        self.bench.work() > self.end
    }

    /// The search from a ladder on, without a candidate.
    fn from(&self, mut ladder: Vec<Judged>, banned: Option<&Candidate>) -> Choice {
        let mut chosen = Vec::new();
        let mut nearest = Vec::new();
        let mut untried = Untried::default();
        let mut examined = 0;
        // an exchange lowers the loss, so that this ends; the bounds are for ties by rounding and for many causes that
        // stand in for one that is not in the catalogue
        for round in 0..ROUNDS {
            (nearest, untried.causes) = self.climb(&mut ladder, banned);
            examined += ladder.len() - 1;
            let may_change = round + 1 < ROUNDS && examined < EXAMINED && !self.is_full(&ladder);
            match self.examined(&ladder, may_change) {
                Examined::Stands(causes, all_opposed) => {
                    chosen = causes;
                    untried.rivals = !all_opposed;
                    break;
                }
                Examined::Changes(model) => ladder = self.rebuilt(&ladder[0], &model),
            }
        }
        Choice { ladder, chosen, nearest, untried }
    }

    /// Adds one cause after another; gives what came nearest at the last step, and whether the limit of work left some of it
    /// untried.
    fn climb(&self, ladder: &mut Vec<Judged>, banned: Option<&Candidate>) -> (Vec<(&'static str, f64)>, bool) {
        loop {
            let Some(current) = ladder.last().cloned() else { return (Vec::new(), false) };
            let mut promises = screen(self.bench, &current.fit, &self.candidates);
            promises.retain(|promise| !banned.is_some_and(|banned| banned.is(&promise.candidate)));
            let nearest = promises.iter().take(3).map(|p| (p.candidate.id(), p.gain / current.fit.loss)).collect();
            if self.is_full(ladder) {
                let may_be_more = ladder.len() <= self.options.most_causes;
                return (nearest, may_be_more && promises.iter().any(|promise| self.is_sign(&current, promise)));
            }
            match self.best(&current, &promises) {
                Some(next) => ladder.push(self.best_instants(self.best_choice(next))),
                None => return (nearest, false),
            }
        }
    }

    /// The same with the best choice in the place of each of its choices: what the score has chosen while other causes
    /// were missing has no slope that would lead to another.
    fn best_choice(&self, judged: Judged) -> Judged {
        let mut best = judged;
        for which in 0..best.fit.model.causes.len() {
            let others = other_choices(self.bench, &best.fit, which);
            let others = others.iter().filter_map(|model| Fit::new(self.bench, model, Until::JUDGED));
            if let Some(better) = others.filter(|fit| fit.loss < best.fit.loss).min_by(|a, b| a.loss.total_cmp(&b.loss))
            {
                best = Judged::new(better, self.bench, &self.blocks);
            }
        }
        best
    }

    /// The same with each cause that sets in at an instant moved to the best one near by: it was found while other causes were
    /// missing, and has no slope.
    fn best_instants(&self, judged: Judged) -> Judged {
        let mut best = judged;
        for which in 0..best.fit.model.causes.len() {
            if let Some(model) = nearest_instant(self.bench, &best.fit, which)
                && let Some(fit) = Fit::new(self.bench, &model, Until::JUDGED).filter(|fit| fit.loss < best.fit.loss)
            {
                best = Judged::new(fit, self.bench, &self.blocks);
            }
        }
        best
    }

    /// The best of the first few promises that passes.
    fn best(&self, current: &Judged, promises: &[Promise]) -> Option<Judged> {
        let promising: Vec<&Promise> =
            promises.iter().take(REFITTED).filter(|promise| self.could_matter(current, promise)).collect();
        if promising.is_empty() {
            return None;
        }
        let gain = |model: Model, loss: f64| {
            let parameters = model.system_parameters() - current.fit.model.system_parameters();
            let samples = self.bench.count as f64;
            let gain = 0.5 * samples * (current.fit.loss / loss).ln();
            (gain - 0.5 * parameters as f64 * samples.ln(), model)
        };
        let falling = |a: &(f64, Model), b: &(f64, Model)| b.0.total_cmp(&a.0);
        let starts = self.starts(&current.fit.model, &promising);
        let reached = current.fit.with_chords(self.bench, &starts, self.compared_until());
        let reached: Vec<Chords> = reached.into_iter().flatten().collect();
        let least = reached.iter().map(|reached| reached.loss).fold(f64::INFINITY, f64::min);
        let fitted = |models: Vec<Model>| -> Vec<(f64, Model)> {
            let fits = models.iter().filter_map(|model| self.compared(model));
            fits.map(|judged| gain(judged.fit.model, judged.fit.loss)).collect()
        };
        // a cause that moves the others' numbers much misleads chords: then all are fitted, else those near the first
        let mut tried = if least < FAR * current.fit.loss {
            fitted(starts)
        } else {
            let mut tried: Vec<(f64, Model)> =
                reached.into_iter().map(|reached| gain(reached.model, reached.loss)).collect();
            tried.sort_by(falling);
            let near = tried.iter().filter(|(gain, _)| *gain > NEAR * tried[0].0).count();
            if near > 1 {
                let models = tried.drain(..near).map(|(_, model)| model).collect();
                tried.extend(fitted(models));
            }
            tried
        };
        tried.sort_by(falling);
        let sample = self.sample(&current.fit);
        for (_, model) in tried.into_iter().filter(|(gain, _)| gain.is_finite()) {
            // one that diverges leaves the others
            let Some(fit) = Fit::new(self.bench, &model, Until::JUDGED) else { continue };
            let next = Judged::new(fit, self.bench, &self.blocks);
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
        // a cause that only works beside refitted others holds far more than its secant promises: fits decide
        promise.gain > 2.0 * mean_square
    }

    /// Whether a promise is a sign that no search may leave untried: no chance in white residuals, and large enough.
    fn is_sign(&self, current: &Judged, promise: &Promise) -> bool {
        let (count, parameters) = (self.bench.count as f64, promise.values.len().max(1) as f64);
        let ratio = promise.gain / (current.fit.loss / count) / parameters;
        let p_value = self.corrected(f_tail(ratio, parameters, count), promise.candidate.cause);
        let share = 1.0 - (1.0 - promise.gain / current.fit.loss).max(0.0).sqrt();
        p_value < self.options.false_alarm_rate && share > self.options.least_gain
    }

    /// Steps of a fit that only has to be compared.
    fn few(&self) -> usize {
        (WORK / self.bench.count.max(1)).clamp(10, 40)
    }

    /// A model in a few steps of its fit.
    fn compared(&self, model: &Model) -> Option<Judged> {
        Some(Judged::new(Fit::new(self.bench, model, self.compared_until())?, self.bench, &self.blocks))
    }

    fn compared_until(&self) -> Until {
        Until { steps: self.few(), gain: SLOW.min(0.25 * self.options.least_gain), ..Until::JUDGED }
    }

    fn sample<'b>(&'b self, fit: &'b Fit) -> Sample<'b> {
        let floor = Floor::new(self.bench, fit, &self.blocks);
        Sample { bench: self.bench, blocks: &self.blocks, fit, floor }
    }

    /// Where the joint fits of promises begin.
    fn starts(&self, model: &Model, promises: &[&Promise]) -> Vec<Model> {
        // the strength that the score asks for may be far outside where it is linear
        let both = |promise: &&Promise| {
            let candidate = &promise.candidate;
            [&promise.values, &promise.trial]
                .map(|values| model.with(candidate.cause, &candidate.modes, values.clone()))
        };
        let models: Vec<Model> = promises.iter().flat_map(both).collect();
        let outputs = self.bench.simulate_all(&models);
        let loss = |output: &Vec<f64>| {
            let rest = self.bench.residual(output);
            let loss = dot(&rest, &rest);
            if loss.is_finite() { loss } else { f64::INFINITY }
        };
        let better = |(models, outputs): (&[Model], &[Vec<f64>])| {
            models[usize::from(loss(&outputs[0]) > loss(&outputs[1]))].clone()
        };
        models.chunks_exact(2).zip(outputs.chunks_exact(2)).map(better).collect()
    }

    /// Whether cause `which` of a model is significant and large enough against the model without it.
    fn passes(&self, sample: &Sample<'_>, with: &Judged, which: usize, without: &Judged) -> bool {
        let gain = without.fit.loss - with.fit.loss;
        let sign = significance(sample, &with.fit.model, which, gain);
        let share = 1.0 - (with.fit.loss / without.fit.loss).sqrt();
        let p_value = self.corrected(sign.p_value, with.fit.model.causes[which].cause);
        p_value < self.options.false_alarm_rate && share > self.options.least_gain && with.unseen() < without.unseen()
    }

    /// Bonferroni over all candidates' trials; a frequency is searched among as many as the record resolves, the time of
    /// a change among all samples.
    fn corrected(&self, p_value: f64, cause: &dyn Cause) -> f64 {
        let frequency = cause.about().parameters.iter().any(|parameter| parameter.unit == "Hz");
        let samples = self.bench.layout.samples(0);
        let searched = match (frequency, instant(cause)) {
            (true, _) => samples / 2,
            (false, Some(_)) => samples,
            (false, None) => 1,
        };
        let tries = self.trials * searched;
        (p_value * tries as f64).min(1.0)
    }

    /// Holds each cause of the last model against its absence and against its rivals.
    fn examined(&self, ladder: &[Judged], may_change: bool) -> Examined {
        let Some(here) = ladder.last() else { return Examined::Stands(Vec::new(), true) };
        let sample = self.sample(&here.fit);
        let mut chosen = Vec::new();
        let mut all_opposed = true;
        let end = self.bench.work().max(self.end) + self.for_rivals;
        for which in 0..here.fit.model.causes.len() {
            // without rivals where time is up, too
            if self.bench.work() > end {
                all_opposed = false;
                chosen.push(self.unopposed(&sample, ladder, which));
                continue;
            }
            let without = self
                .compared(&here.fit.model.without(which))
                .filter(|without| without.fit.loss > here.fit.loss)
                // the others' values may diverge without it: then the model before it came
                .or_else(|| self.compared(&ladder.get(which)?.fit.model));
            let Some(without) = without else { continue };
            let rival = self.rival(here, which, &without);
            let found = self.audit(&sample, here, which, &without, rival.as_ref());
            let share = 1.0 - (here.fit.loss / without.fit.loss).sqrt();
            let weak = found.p_value > self.options.false_alarm_rate || share < self.options.least_gain;
            // the last has just passed
            if may_change && weak && which + 1 < here.fit.model.causes.len() {
                return Examined::Changes(without.fit.model);
            }
            if let Some((rival, _)) = rival.as_ref().filter(|_| may_change)
                && rival.fit.loss - here.fit.loss < -TIE * sample.floor.mean_square
            {
                return Examined::Changes(rival.fit.model.clone());
            }
            // of two laws that explain the same the one that another mode follows as well
            let follows = |id: &str| {
                let mut others = here.fit.model.causes.iter().enumerate().filter(|(other, _)| *other != which);
                others.any(|(_, other)| other.id() == id)
            };
            if let Some((rival, about)) =
                rival.filter(|_| may_change && found.runner_up.is_some_and(|(_, share)| share > ALIKE))
                && follows(about.id)
                && !follows(found.about.id)
            {
                return Examined::Changes(rival.fit.model);
            }
            chosen.push(found);
        }
        Examined::Stands(chosen, all_opposed)
    }

    /// A cause as it was added, held against nothing.
    fn unopposed(&self, sample: &Sample<'_>, ladder: &[Judged], which: usize) -> Chosen {
        let with = &ladder[which + 1];
        self.audit(sample, with, which, &ladder[which], None)
    }

    /// The best model with another cause in the place of `which`, of another class.
    fn rival(&self, here: &Judged, which: usize, without: &Judged) -> Option<(Judged, &'static About)> {
        let about = here.fit.model.causes[which].cause.about();
        let others: Vec<Candidate> = self
            .candidates
            .iter()
            .filter(|other| !about.class.contains(&other.id()) && !here.fit.model.has(other.cause, &other.modes))
            .cloned()
            .collect();
        let promises = screen(self.bench, &without.fit, &others);
        let sample = self.sample(&without.fit);
        let starts = self.starts(&without.fit.model, &promises.iter().take(RIVALS).collect::<Vec<_>>());
        let reached = without.fit.with_chords(self.bench, &starts, self.compared_until());
        let mut rivals: Vec<Chords> = reached.into_iter().flatten().collect();
        rivals.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        rivals.into_iter().find_map(|reached| {
            let rival = self.compared(&reached.model)?;
            let place = rival.fit.model.causes.len() - 1;
            let about = rival.fit.model.causes[place].cause.about();
            // what is not significant by itself is no rival
            self.passes(&sample, &rival, place, without).then_some((rival, about))
        })
    }

    /// The ladder to a model's causes, in their order.
    fn rebuilt(&self, baseline: &Judged, model: &Model) -> Vec<Judged> {
        let mut ladder = vec![baseline.clone()];
        for added in &model.causes {
            let Some(current) = ladder.last() else { break };
            // from what this rung asks for, not from values that only hold beside the causes to come; where that
            // diverges, from what hardly acts
            let again = Candidate { cause: added.cause, modes: added.modes.clone() };
            let promise = screen(self.bench, &current.fit, &[again]).into_iter().next();
            let asked = promise.into_iter().flat_map(|promise| [promise.values, promise.trial]);
            let next = asked.chain([added.values.clone()]).find_map(|values| {
                Fit::new(self.bench, &current.fit.model.with(added.cause, &added.modes, values), Until::JUDGED)
            });
            let Some(next) = next else { break };
            ladder.push(Judged::new(next, self.bench, &self.blocks));
        }
        // the last from where it was found, if that is the better
        let found = Fit::new(self.bench, model, Until::JUDGED);
        if let (Some(last), Some(found)) = (ladder.last_mut(), found)
            && last.fit.model.causes.len() == model.causes.len()
            && found.loss < last.fit.loss
        {
            *last = Judged::new(found, self.bench, &self.blocks);
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
        rival: Option<&(Judged, &'static About)>,
    ) -> Chosen {
        let added = &here.fit.model.causes[which];
        let gain = without.fit.loss - here.fit.loss;
        let sign = significance(sample, &here.fit.model, which, gain);
        let tie = TIE * sample.floor.mean_square * sign.inflation.max(1.0);
        Chosen {
            about: added.cause.about(),
            place: which,
            p_value: self.corrected(sign.p_value, added.cause),
            inflation: sign.inflation,
            tied: rival.is_some_and(|(rival, _)| rival.fit.loss - here.fit.loss < tie),
            left_out: None,
            runner_up: rival.map(|(rival, about)| (*about, (without.fit.loss - rival.fit.loss) / gain)),
        }
    }
}

/// Whether a model's causes stand.
enum Examined {
    /// Each, with what it was held against; whether every one was held against rivals.
    Stands(Vec<Chosen>, bool),
    /// The model without a superfluous cause, or with a better one in its place.
    Changes(Model),
}
