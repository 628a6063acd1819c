//! Score tests: which candidate's effect the residuals point at.

use crate::linear_algebra::{cholesky, product};
use faer::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::basis::Basis;
use super::change::changed;
use super::detuning::Detuning;
use super::exponent::Exponent;
use super::joint::{JointFit, Linear};
use super::normal::{AllCrossed, Crossed, Event};
use super::problem::Problem;
use super::signals::Signals;
use super::state::Hold;
use super::stepper::Pace;
use crate::causes::{Cause, Scene};
use crate::effects::Effects;
use crate::linear_algebra::symmetric_inverse;
use crate::model::ModelError;
use crate::statistics::normal_two_sided;

/// A candidate at one of its trial values.
#[derive(Clone)]
pub struct Sign {
    /// The candidate.
    pub cause: &'static dyn Cause,
    /// Values with the strength that fits best.
    pub values: Vec<f64>,
    /// Whether several strengths were tried: its effect is not in proportion to it.
    pub graded: bool,
    /// Score over its standard deviation.
    pub z: f64,
    /// Fall of the sum of squares that its strength promises.
    pub gain: f64,
    /// The same in variances of its score, which beside a cause whose model is not exact is that from event to event.
    pub squared: f64,
}

/// What a screen finds.
pub struct Screen {
    /// Best trial of each candidate, strongest first.
    pub signs: Vec<Sign>,
    /// Probability of the strongest, all trials considered.
    pub p_value: f64,
    /// Its probability, alone.
    pub alone: f64,
    /// What the events' own frequencies would gain.
    pub detuning: Detuning,
    /// How the strengths of what is named already change with the amplitude.
    pub exponents: Vec<Option<Exponent>>,
}

/// Events from which their scatter may widen the scores' standard deviation.
const SCATTER_EVENTS: usize = 8;
/// Draws of the scores' joint distribution without any cause.
const DRAWS: usize = 20_000;
/// Part of the strongest squared score that a candidate must have beside a cause whose model is not exact: what that
/// model leaves would otherwise be fitted first.
const PART: f64 = 0.5;
/// Projected share of a trial below which nothing of it is left to be seen.
const VISIBLE: f64 = 1e-4;

/// Screens candidates at a finished fit.
///
/// # Model
/// Scores are linear in the residuals: normal without any cause, their covariance known. Each is taken at a secant of
/// its candidate, the lever's parameters, those of causes already found and each event's own projected out; where most
/// trials' scores scatter from event to event by more than the noise model says, all standard deviations are widened by
/// as much. Beside a cause whose model is not exact each score is judged by its own scatter: what such a model leaves
/// differs from event to event, by hundreds of times the noise along some effects and not at all along others.
/// # Method
/// The probability of the strongest of all comes from draws of that joint distribution, beyond them from its effective
/// number of independent scores.
/// # Errors
/// An event that leaves its samples.
/// # Source
/// C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50.
pub fn screen(
    problem: &Problem<'_>,
    fitted: &JointFit,
    candidates: &[&'static dyn Cause],
    scene: &Scene,
    seed: u64,
) -> Result<Screen, ModelError> {
    let linear = Linear::at(problem, fitted)?;
    let state = linear.state();
    let trials: Vec<(&'static dyn Cause, Vec<f64>)> =
        candidates.iter().flat_map(|cause| cause.trials(scene).into_iter().map(|values| (*cause, values))).collect();
    let Sensitivities { events, raw, projection } = Sensitivities::of(problem, &linear, &trials);
    let scores: Vec<Vec<f64>> = events.iter().map(|event| projection.score(&event.gradient)).collect();
    let inexact = state.hypotheses.iter().any(|hypothesis| hypothesis.cause.inexact() > 0.0) && events.len() > 1;
    let mut signs: Vec<Sign> = Vec::new();
    // trials at frequencies that were picked where the residual is strongest are the best of many
    let blind = Scene { residual_peaks_hz: Vec::new(), ..scene.clone() };
    let picked: Vec<bool> =
        trials.iter().map(|(cause, values)| !cause.trials(&blind).iter().any(|known| known == values)).collect();
    let (mut used, mut scatters, mut strongest, mut strongest_picked) = (Vec::new(), Vec::new(), 0.0f64, 0.0f64);
    for (c, (cause, values)) in trials.iter().enumerate() {
        let seen = projection.information[(c, c)];
        if seen.is_nan() || seen <= VISIBLE * raw[c] {
            continue;
        }
        let score: f64 = scores.iter().map(|s| s[c]).sum();
        let scatter = if inexact {
            own_scatter(scores.iter().map(|s| s[c]).zip(events.iter().map(|event| event.raw[c])), raw[c])
        } else {
            scores.iter().map(|s| s[c] * s[c]).sum::<f64>() - score * score / events.len() as f64
        } / seen;
        scatters.push(scatter);
        let strength = score / seen;
        let parameter = cause.about().parameters[0];
        let inside = strength.clamp(parameter.low, parameter.high);
        let gain = 2.0 * score * inside - seen * inside * inside;
        let squared = if inexact { as_normal(gain.max(0.0) / scatter.max(1.0), events.len() - 1) } else { gain };
        if picked[c] {
            strongest_picked = strongest_picked.max(squared);
        } else {
            used.push(c);
            strongest = strongest.max(squared);
        }
        let mut values = values.clone();
        values[0] = inside;
        let graded = cause.about().parameters.len() == 1
            && trials.iter().filter(|(c, _)| c.about().id == cause.about().id).count() > 1;
        let z = gain.max(0.0).sqrt() * score.signum();
        signs.push(Sign { cause: *cause, values, graded, z, gain, squared });
    }
    let widened = widening(scatters, events.len());
    if !inexact {
        (strongest, strongest_picked) = (strongest / widened, strongest_picked / widened);
    }
    let least = joint_probability(&projection.information, &used, strongest, seed)
        .min(picked_probability(strongest_picked, problem.cut.samples));
    // the lesser of two
    let p_value = -(2.0 * (-least).ln_1p()).exp_m1();
    let mut best: Vec<Sign> = Vec::new();
    for sign in signs {
        match best.iter_mut().find(|b| b.cause.about().id == sign.cause.about().id) {
            Some(known) if known.squared >= sign.squared => {}
            Some(known) => *known = sign,
            None => best.push(sign),
        }
    }
    best.sort_by(|a, b| b.squared.total_cmp(&a.squared));
    if inexact {
        let least = PART * best.first().map_or(0.0, |sign| sign.squared);
        best.retain(|sign| sign.squared >= least);
    }
    let alone = normal_two_sided(strongest.max(strongest_picked).max(0.0).sqrt());
    let detuning = Detuning::of(&events, state.lever.modes.len(), widened);
    let exponents = Exponent::all(problem, state, &events, widened);
    Ok(Screen { signs: best, p_value, alone, detuning, exponents })
}

/// What trials change in every event, beside everything that is fitted.
pub(super) struct Sensitivities {
    /// Every event's share of the normal equations.
    pub events: Vec<Scores>,
    /// Squared length of each trial before anything is projected out.
    pub raw: Vec<f64>,
    /// Off what is fitted.
    pub projection: Projection,
}

impl Sensitivities {
    /// Of trials beside a finished fit.
    pub fn of(problem: &Problem<'_>, linear: &Linear, trials: &[(&'static dyn Cause, Vec<f64>)]) -> Self {
        let state = linear.state();
        let mut sets: Vec<Effects> = vec![state.linear_effects()];
        sets.extend(trials.iter().map(|(cause, values)| {
            let mut effects = state.linear_effects();
            cause.add(values, &mut effects);
            effects
        }));
        let mut changes = changed(problem, &linear.whitener, state, &sets, Pace::COARSE);
        let strengths: Vec<f64> = trials.iter().map(|(_, values)| values[0]).collect();
        changes.par_iter_mut().for_each(|event| event.quotients(&strengths));
        let crossed = AllCrossed::of(&linear.basis, &linear.slopes);
        let events: Vec<Scores> = linear
            .events()
            .par_iter()
            .zip(&changes)
            .enumerate()
            .map(|(i, (event, changes))| Scores::of(event, &linear.basis, crossed.get(i), changes))
            .collect();
        let (known, count) = (events.first().map_or(0, |e| e.known), trials.len());
        let total = known + count;
        let mut information = Mat::<f64>::zeros(total, total);
        let mut raw = vec![0.0; count];
        for event in &events {
            information += &event.information;
            raw.iter_mut().zip(&event.raw).for_each(|(r, e)| *r += e);
        }
        let mut prior = vec![0.0; total];
        problem.add_prior(&state.lever, &mut information, &mut prior);
        Self { events, raw, projection: Projection::of(&information, known) }
    }
}

/// Variance of the sum of some events' scores, from how they scatter about their shares of it: an effect is the larger,
/// the larger the event. `squares` has the events' squared lengths of the effect beside their scores, `all` their sum.
fn own_scatter(squares: impl Iterator<Item = (f64, f64)> + Clone, all: f64) -> f64 {
    let score: f64 = squares.clone().map(|(score, _)| score).sum();
    let count = squares.clone().count() as f64;
    let rest = squares.map(|(own, length)| (own - score * length / all).powi(2)).sum::<f64>();
    rest * count / (count - 1.0).max(1.0)
}

/// The square of a normal deviate that is as improbable as that of a Student's one.
/// # Source
/// D. L. Wallace, Ann. Math. Stat. 30 (1959) 1121.
fn as_normal(squared: f64, degrees: usize) -> f64 {
    let n = degrees.max(1) as f64;
    let factor = (8.0 * n + 1.0) / (8.0 * n + 3.0);
    n * (squared / n).ln_1p() * factor * factor
}

/// Median scatter of the events' scores over what the noise model says, at least 1: of most trials, since a cause that
/// acts on few events makes its own scatter.
fn widening(mut scatters: Vec<f64>, events: usize) -> f64 {
    if events < SCATTER_EVENTS || scatters.is_empty() {
        return 1.0;
    }
    scatters.sort_by(f64::total_cmp);
    scatters[scatters.len() / 2].max(1.0)
}

/// One event's share of the normal equations of known parameters and trials.
pub(super) struct Scores {
    pub known: usize,
    pub information: Mat<f64>,
    pub gradient: Vec<f64>,
    /// Squared length of each trial before anything is projected out.
    pub raw: Vec<f64>,
}

impl Scores {
    fn of(event: &Event<'_>, basis: &Basis, crossed: Option<&Crossed<'_>>, trials: &Signals) -> Self {
        let (eliminated, information) = event.products(basis, crossed, Hold::Nothing, Some(trials)).eliminated();
        let raw: Vec<f64> = (0..trials.count()).map(|i| trials.get(i).iter().map(|v| v * v).sum()).collect();
        let known = eliminated.score.len() - raw.len();
        Self { known, information, gradient: eliminated.score, raw }
    }
}

/// Projection off the known parameters.
pub(super) struct Projection {
    known: usize,
    /// `G_CA G_AA^-1`: trials x known.
    weights: Mat<f64>,
    /// Of the trials: trials x trials.
    pub information: Mat<f64>,
}

impl Projection {
    pub fn of(information: &Mat<f64>, known: usize) -> Self {
        let trials = information.nrows() - known;
        let inner = symmetric_inverse(&Mat::from_fn(known, known, |i, j| information[(i, j)]));
        let cross = Mat::from_fn(trials, known, |i, j| information[(known + i, j)]);
        let weights = product(cross.as_ref(), inner.as_ref());
        let taken = product(weights.as_ref(), cross.transpose());
        let information = Mat::from_fn(trials, trials, |i, j| information[(known + i, known + j)] - taken[(i, j)]);
        Self { known, weights, information }
    }

    pub fn score(&self, gradient: &[f64]) -> Vec<f64> {
        (0..self.weights.nrows())
            .map(|c| {
                gradient[self.known + c] - (0..self.known).map(|a| self.weights[(c, a)] * gradient[a]).sum::<f64>()
            })
            .collect()
    }
}

/// Probability that the largest squared score at picked frequencies exceeds `strongest` without any cause.
///
/// As that of the largest of N independent scores. The frequencies are picked by energy, not by score: a low maximum is
/// one of few, a high one would have been picked wherever it had been. N as 60 clean archives of the exam (windows of
/// 8000 samples) show it, within a factor of two of white noise.
fn picked_probability(strongest: f64, samples: usize) -> f64 {
    let alone = normal_two_sided(strongest.max(0.0).sqrt());
    let number = (10.0 * (0.2 * strongest).exp()).min(0.25 * samples as f64);
    -(number * (-alone).ln_1p()).exp_m1()
}

/// Probability that the largest squared score of `used` trials exceeds `strongest` without any cause.
fn joint_probability(information: &Mat<f64>, used: &[usize], strongest: f64, seed: u64) -> f64 {
    let n = used.len();
    if n == 0 {
        return 1.0;
    }
    let scale: Vec<f64> = used.iter().map(|&c| information[(c, c)].sqrt()).collect();
    let mut factor = cholesky(&Mat::from_fn(n, n, |i, j| information[(used[i], used[j])] / (scale[i] * scale[j])));
    // trials that look alike leave rounding for a pivot, and what is divided by it: each score has unit variance
    for i in 0..n {
        let norm = (0..=i).map(|j| factor[(i, j)].powi(2)).sum::<f64>().sqrt();
        (0..=i).for_each(|j| factor[(i, j)] /= norm);
    }
    let mut largest: Vec<f64> = (0..DRAWS)
        .into_par_iter()
        .map(|draw| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(draw as u64);
            let deviates: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
            (0..n).map(|i| (0..=i).map(|j| factor[(i, j)] * deviates[j]).sum::<f64>().powi(2)).fold(0.0, f64::max)
        })
        .collect();
    largest.sort_by(f64::total_cmp);
    let beyond = largest.len() - largest.partition_point(|v| *v < strongest);
    if beyond >= 50 {
        return beyond as f64 / DRAWS as f64;
    }
    // as many independent scores as exceed the draws' hundredth as often
    let far = largest[DRAWS - DRAWS / 100];
    let number = (1.0f64 - 0.01).ln() / (1.0 - normal_two_sided(far.sqrt())).ln();
    (number * normal_two_sided(strongest.max(far).sqrt())).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::student_limit;

    #[test]
    fn scores_that_are_nearly_one_are_no_more_probable_than_one() {
        // the second trial is the first but for 1e-10, and the third's product with it is right to 1e-3 only: as where
        // little of a trial is left beside what is fitted
        let products = [[1.0, 1.0 - 5e-11, 0.5], [1.0 - 5e-11, 1.0, 0.501], [0.5, 0.501, 1.0]];
        let information = Mat::from_fn(3, 3, |i, j| products[i][j]);
        let p_value = joint_probability(&information, &[0, 1, 2], 3000.0, 1);
        assert!(p_value < 1e-12, "{p_value:.2e}");
    }

    #[test]
    fn a_students_deviate_is_a_normal_one_of_the_same_probability() {
        for degrees in [4, 9, 15] {
            for (p, normal) in [(0.05, 1.959_96), (1e-3, 3.290_53), (1e-5, 4.417_17)] {
                let found = as_normal(student_limit(p, degrees as f64).powi(2), degrees).sqrt();
                // the approximation is good to some hundredths of a deviate, to a tenth at the fewest degrees
                assert!((found - normal).abs() < 0.1, "{degrees} degrees: {found} for {normal}");
            }
        }
    }

    #[test]
    fn an_effect_that_grows_with_the_event_does_not_scatter() {
        // squared lengths go with the square of the amplitude, scores as they do where the strength is one
        let lengths: Vec<f64> = (0..12).map(|i| (1.0 + 0.1 * f64::from(i)).powi(2)).collect();
        let all: f64 = lengths.iter().sum();
        let even = lengths.iter().map(|length| (30.0 * length, *length));
        assert!(own_scatter(even.clone(), all) < 1e-18 * all);
        // one that turns its sign from event to event does: by as much as all scores together
        let turning = even.enumerate().map(|(i, (s, length))| (if i % 2 == 0 { s } else { -s }, length));
        let squares: f64 = turning.clone().map(|(s, _)| s * s).sum();
        assert!(own_scatter(turning, all) > 0.9 * squares);
    }
}
