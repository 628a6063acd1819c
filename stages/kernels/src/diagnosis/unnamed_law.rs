//! A law that no cause covers: each general term alone, held against what the causes leave.

use rayon::prelude::*;

use super::data::Bench;
use super::fit::{Blocks, Fit, Moments, Until, dot};
use super::lack_of_fit::clean;
use super::library::{Law, library};
use super::score_test::{Basis, Candidate, screen};
use super::selection::TIE;
use crate::causes::Part;
use crate::effects::{Effects, ModalForce};
use crate::statistics::f_tail;

/// A general term that a model lacks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct UnnamedLaw {
    /// What it is.
    pub words: String,
    /// What it would take of the squared residual of folds that are held out.
    pub gain: f64,
    /// Probability of so large a gain by chance, all terms considered.
    pub p_value: f64,
    /// What the linear model leaves with it alone; none where it is no force, or a named cause's own.
    pub alone: Option<f64>,
}

/// What was found of laws without a name.
#[derive(Debug, Default)]
pub(super) struct Laws {
    /// The one that a model lacks.
    pub lacking: Option<UnnamedLaw>,
    /// Whether the limit of work left some that are fitted alone unfitted.
    pub untried: bool,
}

/// Laws that are fitted in the place of all causes.
const FITTED: usize = 3;

/// The term of the library that would take most of a fit's residual, of those that are significant; or, where names are
/// many, one of the largest that alone does better than all of them.
///
/// # Method
/// Score test of each term, what the fit's own numbers can make taken out; the scatter of its score between blocks with
/// the term itself fitted, so that whatever else is left counts as noise; an F ratio of one and one fewer than the
/// blocks, by Bonferroni for all terms; and it has to gain on folds that did not fit it. Aimed at one term each it sees
/// what a prediction from all of them drowns in their number. Of the largest that are forces, before any cause came and
/// after the last, the linear model with that force alone is fitted too, beside those causes that imitate no law, the
/// course of the input and what is added to the record: where several causes stand in for a law that no one has named
/// they come close together, and the law comes closer.
/// # Source
/// C. R. Rao, Linear Statistical Inference and Its Applications, 2nd ed., 1973, section 6e.
pub(super) fn unnamed_law(
    bench: &Bench,
    [baseline, fit]: [&Fit; 2],
    blocks: &Blocks,
    candidates: &[Candidate],
    false_alarm_rate: f64,
    work: u64,
) -> Laws {
    let mut found = significant(bench, fit, blocks, false_alarm_rate);
    let beside = beside_laws(bench, baseline, fit);
    let laws = fit.model.causes.len() - beside.as_ref().unwrap_or(baseline).model.causes.len();
    let before = beside.as_ref().unwrap_or(baseline);
    let end = bench.work() + work;
    let mut ended =
        if laws > 0 { fit_alone(bench, [before, fit], &mut found, candidates, end) } else { Ended::NoneBeats };
    if laws > 1 && ended != Ended::Beaten {
        // what several names share is seen whole before any of them came
        let mut first = significant(bench, before, blocks, false_alarm_rate);
        ended = ended.or(fit_alone(bench, [before, fit], &mut first, candidates, end));
        first.retain(|(law, _)| law.beats(bench, fit));
        found.extend(first);
    }
    let place = found.iter().position(|(law, _)| law.beats(bench, fit)).unwrap_or(0);
    let lacking = (place < found.len()).then(|| found.swap_remove(place).0);
    Laws { lacking, untried: ended == Ended::Limit }
}

/// A law without a name that beside a simpler linear model leaves less than a richer one with all its causes, `fit`; none
/// where there is none.
pub(super) fn simpler_law(
    bench: &Bench,
    simpler: &Fit,
    fit: &Fit,
    blocks: &Blocks,
    candidates: &[Candidate],
    false_alarm_rate: f64,
    work: u64,
) -> Laws {
    let before = beside_laws(bench, simpler, fit);
    let before = before.as_ref().unwrap_or(simpler);
    let mut found = significant(bench, before, blocks, false_alarm_rate);
    let ended = fit_alone(bench, [before, fit], &mut found, candidates, bench.work() + work);
    let lacking = found.into_iter().map(|(law, _)| law).find(|law| law.beats(bench, fit));
    Laws { lacking, untried: ended == Ended::Limit }
}

/// How fits of laws alone ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ended {
    /// With one that beats all causes.
    Beaten,
    /// None does.
    NoneBeats,
    /// None of those that the limit of work left time for.
    Limit,
}

impl Ended {
    /// Of two in turn, the first of which has not beaten.
    fn or(self, next: Self) -> Self {
        if next == Self::Beaten || self == Self::NoneBeats { next } else { self }
    }
}

/// Fits the linear model with each of the largest forces that no candidate is, until one beats all causes of a fit or so much
/// work is done.
fn fit_alone(
    bench: &Bench,
    [linear, fit]: [&Fit; 2],
    found: &mut [(UnnamedLaw, Option<Candidate>)],
    candidates: &[Candidate],
    end: u64,
) -> Ended {
    let unnamed = |force: &Candidate| !candidates.iter().any(|own| same(own, force));
    let forces = found.iter_mut().filter_map(|(law, force)| Some((law, force.as_ref()?)));
    for (law, force) in forces.filter(|(_, force)| unnamed(force)).take(FITTED) {
        if bench.work() > end {
            return Ended::Limit;
        }
        law.alone = alone(bench, linear, force);
        if law.beats(bench, fit) {
            return Ended::Beaten;
        }
    }
    Ended::NoneBeats
}

/// The linear model with those causes of a fit that imitate no law: the course of the input between samples and what is added
/// to the record. None where there are none.
fn beside_laws(bench: &Bench, linear: &Fit, fit: &Fit) -> Option<Fit> {
    let kept = fit.model.causes.iter().filter(|added| added.is_choice() || added.cause.about().part == Part::Record);
    let mut model = linear.model.clone();
    model.causes.extend(kept.cloned());
    (model.causes.len() > linear.model.causes.len()).then(|| Fit::new(bench, &model, Until::JUDGED)).flatten()
}

impl UnnamedLaw {
    /// The same on more samples, where all losses are larger by a factor.
    pub fn scaled(self, factor: f64) -> Self {
        Self { gain: self.gain * factor, alone: self.alone.map(|loss| loss * factor), ..self }
    }

    /// Whether it alone describes more than all causes of a fit together.
    pub fn beats(&self, bench: &Bench, fit: &Fit) -> bool {
        let variance = fit.loss / bench.count as f64;
        self.alone.is_some_and(|loss| loss < fit.loss - TIE * variance)
    }
}

/// Significant terms by falling gain, with the force that each is.
fn significant(
    bench: &Bench,
    fit: &Fit,
    blocks: &Blocks,
    false_alarm_rate: f64,
) -> Vec<(UnnamedLaw, Option<Candidate>)> {
    let rest = clean(bench, fit);
    let basis = Basis::new(fit);
    let laws = library(bench, fit);
    let terms: usize = laws.iter().map(|law| law.searched).sum();
    let white = dot(&rest, &rest) / bench.count as f64;
    let test = |law: Law| {
        let whole = dot(&law.column, &law.column);
        let direction = basis.beyond(bench, fit, law.column);
        let (length, along) = (dot(&direction, &direction), dot(&direction, &rest));
        // what is left of a direction that the model makes itself is rounding
        if !(length > 1e-10 * whole && length.is_finite()) {
            return None;
        }
        // by blocks, with the term fitted
        let moments = Moments::new(&[direction], &rest, blocks);
        let count = blocks.count() as f64;
        let scores = moments.score.iter().zip(&moments.curvature);
        let scatter: f64 = scores.map(|(score, square)| (score[0] - along / length * square[0][0]).powi(2)).sum();
        let variance = (scatter * count / (count - 1.0)).max(white * length);
        let p_value = (terms as f64 * f_tail(along * along / variance, 1.0, count - 1.0)).min(1.0);
        let gain = moments.loss.iter().sum::<f64>() - moments.held_out(0.0).iter().sum::<f64>();
        let found = UnnamedLaw { words: law.words, gain, p_value, alone: None };
        (p_value < false_alarm_rate && found.gain > 0.0).then_some((found, law.force))
    };
    let mut found: Vec<(UnnamedLaw, Option<Candidate>)> = laws.into_par_iter().filter_map(test).collect();
    found.sort_by(|a, b| b.0.gain.total_cmp(&a.0.gain));
    found
}

/// Whether a candidate is the same force as another.
fn same(own: &Candidate, other: &Candidate) -> bool {
    let forces = |candidate: &Candidate| {
        let mut effects = Effects::default();
        let unit = candidate.cause.about().parameters.iter().map(|_| 1.0).collect::<Vec<_>>();
        effects.add_at(&candidate.modes, |effects| candidate.cause.add(&unit, effects));
        let power = |force: ModalForce| if let ModalForce::Power(law) = force { Some(law) } else { None };
        effects.modal_force.into_iter().map(power).collect::<Option<Vec<_>>>()
    };
    forces(own).is_some_and(|own| !own.is_empty() && forces(other) == Some(own))
}

/// What the linear model leaves with a force added, from the strength that it asks for or from a trial's.
fn alone(bench: &Bench, baseline: &Fit, force: &Candidate) -> Option<f64> {
    let promise = screen(bench, baseline, std::slice::from_ref(force)).into_iter().next()?;
    let fitted = |values: Vec<f64>| {
        Fit::new(bench, &baseline.model.with(force.cause, &force.modes, values), Until::JUDGED).map(|fit| fit.loss)
    };
    [promise.values, promise.trial].into_iter().filter_map(fitted).min_by(f64::total_cmp)
}
