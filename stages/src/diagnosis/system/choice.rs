//! Which causes to add: greedily, then each again against its rivals.

use super::bench::Bench;
use super::blocks::Blocks;
use super::fit::Fit;
use super::linear_algebra::dot;
use super::misfit::Floor;
use super::options::SystemOptions;
use super::screen::{Promise, screen, significance};
use crate::causes::Cause;

/// Candidates that are fitted at each step.
const REFITTED: usize = 5;
/// Steps of a fit that only has to be compared.
const FEW: usize = 8;
/// Rivals that a named cause is held against.
const RIVALS: usize = 2;
/// Two models tie whose held-out losses differ by less than this many variances of the floor: a likelihood ratio of 7.
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
    /// The baseline and each model with one more cause, in order.
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
    pub options: &'a SystemOptions,
    pub candidates: Vec<&'static dyn Cause>,
}

impl Search<'_> {
    /// Adds causes until nothing is significant, drops what later ones make superfluous, exchanges what a rival does better.
    ///
    /// # Method
    /// Score screen, joint refits of the best five, the largest gain of the held-out log likelihood less half the Bayesian penalty; a cause stays while its
    /// F test by blocks, corrected for the number of trials, and its share of the held-out error both pass.
    /// # Source
    /// S. A. Billings, Nonlinear System Identification, 2013, chapter 3, on forward selection; G. Schwarz, Ann. Stat. 6 (1978) 461.
    pub fn run(&self, baseline: Fit) -> Choice {
        let mut ladder = vec![Judged::new(baseline, &self.blocks)];
        let mut nearest = Vec::new();
        // each exchange lowers the held-out loss, so that this ends; the bound is for ties by rounding
        for _ in 0..3 {
            nearest = self.climb(&mut ladder);
            let (fit, changed) = self.reconsider(&ladder);
            if !changed {
                break;
            }
            ladder = self.rebuilt(&ladder[0], &fit);
        }
        let chosen = self.audited(&ladder);
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
        let mut tried: Vec<(f64, Judged)> = Vec::new();
        for promise in promises.iter().take(REFITTED) {
            if !self.could_matter(current, promise) {
                continue;
            }
            let Some(next) = self.extended(current, promise) else { continue };
            let parameters = next.fit.model.vector().len().saturating_sub(current.fit.model.vector().len()).max(1);
            let effective = self.bench.count as f64;
            let gain = 0.5 * effective * (current.unseen() / next.unseen()).ln();
            tried.push((gain - 0.5 * parameters as f64 * effective.ln(), next));
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let floor = Floor::new(self.bench, &current.fit, &self.blocks);
        for (gain, next) in tried {
            let fit = Fit::new(self.bench, &next.fit.model, None)?;
            let next = Judged::new(fit, &self.blocks);
            let which = next.fit.model.causes.len() - 1;
            if gain.is_finite() && self.passes(&next, which, current, &floor) {
                return Some(next);
            }
        }
        None
    }

    /// Whether a promise, taken at its word, could be significant or large: a fit of what is neither is time lost.
    fn could_matter(&self, current: &Judged, promise: &Promise) -> bool {
        let mean_square = current.fit.loss / self.bench.count as f64;
        // a kinked or nonlinear cause may hold more than its secant promises: a factor of 3
        promise.gain > 2.0 * mean_square && 3.0 * promise.gain / current.fit.loss > self.options.least_gain
    }

    fn extended(&self, current: &Judged, promise: &Promise) -> Option<Judged> {
        let start = |values: &Vec<f64>| current.fit.model.with(promise.cause, values.clone());
        let loss = |values: &Vec<f64>| {
            let rest = self.bench.residual(&self.bench.simulate(&start(values)));
            let loss = dot(&rest, &rest);
            if loss.is_finite() { loss } else { f64::INFINITY }
        };
        // the strength that the score asks for may be far outside where it is linear
        let from = if loss(&promise.values) <= loss(&promise.trial) { &promise.values } else { &promise.trial };
        Some(Judged::new(Fit::new(self.bench, &start(from), Some(FEW))?, &self.blocks))
    }

    /// Whether cause `which` of a model is significant and large enough against the model without it.
    fn passes(&self, with: &Judged, which: usize, without: &Judged, floor: &Floor) -> bool {
        let significance = significance(self.bench, &with.fit, which, without.fit.loss, floor, &self.blocks);
        let share = 1.0 - (with.unseen() / without.unseen()).sqrt();
        let p_value = self.corrected(significance.p_value, with.fit.model.causes[which].cause);
        p_value < self.options.false_alarm_rate && share > self.options.least_gain
    }

    /// Bonferroni over all candidates' trials.
    fn corrected(&self, p_value: f64, cause: &dyn Cause) -> f64 {
        let searched = cause.about().parameters.iter().any(|parameter| parameter.unit == "Hz");
        let tries = self.candidates.len() * if searched { self.bench.count / 2 } else { 1 };
        (p_value * tries as f64).min(1.0)
    }

    /// Drops the weakest cause that no longer passes, or exchanges one for a rival that does better.
    fn reconsider(&self, ladder: &[Judged]) -> (Fit, bool) {
        let last = &ladder[ladder.len() - 1];
        let causes = last.fit.model.causes.len();
        let floor = Floor::new(self.bench, &last.fit, &self.blocks);
        for which in 0..causes.saturating_sub(1) {
            let Some(without) = self.refitted(&last.fit, which) else { continue };
            if !self.passes(last, which, &without, &floor) {
                return (without.fit, true);
            }
            if let Some((rival, _)) = self.rival(last, which, &without)
                && rival.unseen() - last.unseen() < -TIE * floor.mean_square
            {
                return (rival.fit, true);
            }
        }
        (last.fit.clone(), false)
    }

    fn refitted(&self, fit: &Fit, which: usize) -> Option<Judged> {
        Some(Judged::new(Fit::new(self.bench, &fit.model.without(which), Some(FEW))?, &self.blocks))
    }

    /// The best model with another cause in the place of `which`, of another class.
    fn rival(&self, last: &Judged, which: usize, without: &Judged) -> Option<(Judged, &'static str)> {
        let class = last.fit.model.causes[which].cause.about().class;
        let others: Vec<&'static dyn Cause> = self
            .candidates
            .iter()
            .copied()
            .filter(|cause| !class.contains(&cause.about().id) && !last.fit.model.has(cause.about().id))
            .collect();
        let promises = screen(self.bench, &without.fit, &others);
        let extended = promises.iter().take(RIVALS).filter_map(|promise| {
            let rival = self.extended(without, promise)?;
            Some((rival, promise.cause.about().id))
        });
        extended.min_by(|a, b| a.0.unseen().total_cmp(&b.0.unseen()))
    }

    /// The ladder to a model's causes, in their order.
    fn rebuilt(&self, baseline: &Judged, fit: &Fit) -> Vec<Judged> {
        let mut ladder = vec![baseline.clone()];
        for added in &fit.model.causes {
            let Some(current) = ladder.last() else { break };
            let start = current.fit.model.with(added.cause, added.values.clone());
            let Some(next) = Fit::new(self.bench, &start, None) else { break };
            ladder.push(Judged::new(next, &self.blocks));
        }
        ladder
    }

    /// Each cause of the last model with its p-value and its runner-up.
    fn audited(&self, ladder: &[Judged]) -> Vec<Chosen> {
        let last = &ladder[ladder.len() - 1];
        let floor = Floor::new(self.bench, &last.fit, &self.blocks);
        (0..last.fit.model.causes.len())
            .map(|which| {
                let added = &last.fit.model.causes[which];
                let Some(without) = self.refitted(&last.fit, which) else {
                    return Chosen { id: added.id(), p_value: 1.0, inflation: 1.0, runner_up: None, tied: true };
                };
                let sign = significance(self.bench, &last.fit, which, without.fit.loss, &floor, &self.blocks);
                let rival = self.rival(last, which, &without);
                let gain = without.fit.loss - last.fit.loss;
                let tied = rival.as_ref().is_some_and(|(rival, _)| {
                    rival.unseen() - last.unseen() < TIE * floor.mean_square * sign.inflation.max(1.0)
                });
                Chosen {
                    id: added.id(),
                    p_value: self.corrected(sign.p_value, added.cause),
                    inflation: sign.inflation,
                    runner_up: rival.map(|(rival, id)| (id, (without.fit.loss - rival.fit.loss) / gain)),
                    tied,
                }
            })
            .collect()
    }
}
