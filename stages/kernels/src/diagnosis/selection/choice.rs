//! What a search found: models, and the causes that were chosen.

use crate::causes::About;
use crate::diagnosis::data::Bench;
use crate::diagnosis::fit::{Blocks, Fit};
use crate::diagnosis::lack_of_fit::Misfit;

/// A model with what it loses on folds that it has not seen, block by block.
#[derive(Clone)]
pub(crate) struct Judged {
    pub fit: Fit,
    pub held_out: Vec<f64>,
}

impl Judged {
    pub fn new(fit: Fit, bench: &Bench, blocks: &Blocks) -> Self {
        let held_out = fit.moments(bench, blocks).held_out(0.0);
        Self { fit, held_out }
    }

    /// Loss on folds that were not seen.
    pub fn unseen(&self) -> f64 {
        self.held_out.iter().sum()
    }
}

/// A cause that was chosen, and what it was held against.
#[derive(Clone)]
pub(crate) struct Chosen {
    /// What it is.
    pub about: &'static About,
    /// Its place among the model's causes.
    pub place: usize,
    /// Corrected for all candidates and their trials.
    pub p_value: f64,
    /// Ratio of the score's scatter between blocks to that of white residuals.
    pub inflation: f64,
    /// The best model with another cause in its place: which, share of the gain.
    pub runner_up: Option<(&'static About, f64)>,
    /// Whether the two can't be distinguished.
    pub tied: bool,
    /// Error without it on what did not choose it, all others refitted; none where it is far from the error with it.
    pub left_out: Option<f64>,
}

impl Chosen {
    /// Whether the data distinguish it from its rival, or both act in the same place and make its class.
    pub fn has_a_name(&self) -> bool {
        !self.tied || self.runner_up.is_some_and(|(rival, _)| rival.part == self.about.part)
    }

    /// What these data can't distinguish from it, itself included.
    pub fn class(&self) -> Vec<String> {
        let own = self.about.class;
        let rival = self.runner_up.map(|(rival, _)| rival.id).filter(|id| self.tied && !own.contains(id));
        own.iter().copied().chain(rival).map(str::to_owned).collect()
    }
}

/// What the search found.
pub(crate) struct Choice {
    /// The baseline and each model with one more cause, in order: rung n has n causes.
    pub ladder: Vec<Judged>,
    /// The causes of the last.
    pub chosen: Vec<Chosen>,
    /// What came nearest where nothing was added: id, share of the squared residual that it would take.
    pub nearest: Vec<(&'static str, f64)>,
    /// What was not tried at the limit of work.
    pub untried: Untried,
}

/// What a search leaves that comes to its limit of work.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Untried {
    /// Further causes whose signs are large enough.
    pub causes: bool,
    /// Rivals of the causes that were found.
    pub rivals: bool,
    /// Laws without a name.
    pub laws: bool,
}

impl Choice {
    /// What the causes take of the squared residual, together.
    pub(crate) fn explained(&self) -> f64 {
        let ends = self.ladder.first().zip(self.ladder.last());
        ends.map_or(0.0, |(first, last)| (first.fit.loss - last.fit.loss).max(0.0))
    }

    /// Whether what its last model leaves is not the whole story: `misfit` of that model.
    pub(crate) fn lacks(&self, misfit: &Misfit, tolerated: f64) -> bool {
        let left = self.ladder.last().map_or(0.0, |last| last.fit.loss);
        misfit.counts(tolerated, left, self.explained())
    }

    /// Loss of its last model on folds that it has not seen.
    pub(super) fn unseen(&self) -> f64 {
        self.ladder.last().map_or(f64::INFINITY, Judged::unseen)
    }
}
