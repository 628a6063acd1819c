//! From the last point of the search to the model with its covariance.

use faer::Mat;

use super::columns::Columns;
use super::covariance::{ResidualColour, covariance};
use super::jacobian::Noise;
use super::options::{Identified, NoiseModel, PemOptions, Verdict};
use super::predictor::Problem;
use super::projection::{Present, present};
use super::state::State;
use crate::model::{
    Coefficients, InnovationsModel, InputGains, LIMIT, ModelError, Section, kalman_gains, roots, section_order,
    sections,
};
use crate::optimise::Ending;

pub(super) fn conclude(
    problem: &Problem,
    state: &State,
    sample_time_s: f64,
    options: &PemOptions,
    singular_values: Vec<f64>,
) -> Result<Identified, ModelError> {
    let n = problem.order;
    let theta = &state.projection.theta;
    let Realised { model, further_inputs, predictor: c } = realised(problem, state, sample_time_s, options.noise)?;
    let mut e = state.residual();
    problem.missing.iter().for_each(|&row| e[row] = 0.0);
    let covariance = parameter_covariance(problem, state, &e, options.colour)?;
    let lengths: Vec<usize> = problem.measured().iter().map(|(_, y)| y.len()).collect();
    let (count, measured) = (lengths.len(), lengths.iter().sum::<usize>());
    e.truncate(measured);
    let cost = e.iter().map(|e| e * e).sum::<f64>();
    let present = measured - problem.missing.len();
    problem.missing.iter().for_each(|&row| e[row] = f64::NAN);
    let own = |index: usize, entry: usize| theta[problem.nuisance_column(index) + entry];
    let half = |index: usize| 0.5 * (lengths[index] as f64 - 1.0) * sample_time_s;
    let freedom = present.saturating_sub(state.point.len() + problem.nuisance_column(count)).max(1);
    let mut rest = e.as_slice();
    let residuals = lengths
        .iter()
        .map(|&length| {
            let (head, tail) = rest.split_at(length);
            rest = tail;
            head.to_vec()
        })
        .collect();
    let at_limit = state.point.coordinates().iter().filter(|p| p.abs() >= LIMIT).count();
    Ok(Identified {
        model,
        further_inputs,
        initial_states: (0..count).map(|i| (0..n).map(|j| own(i, j)).collect()).collect(),
        offsets: (0..count).map(|i| if problem.offset { own(i, n) } else { 0.0 }).collect(),
        slopes: (0..count)
            .map(|i| if problem.slope { own(i, n + usize::from(problem.offset)) / half(i) } else { 0.0 })
            .collect(),
        noise_parameters: noise_parameters(&state.point.noise, options.noise),
        innovation_variance: cost / freedom as f64,
        residuals,
        covariance,
        predictor_poles: c.iter().enumerate().flat_map(|(i, &c)| roots(c, section_order(n, i))).collect(),
        singular_values,
        verdict: Verdict {
            ending: state.ending,
            converged: matches!(state.ending, Ending::Minimum | Ending::Exact) || state.gradient < SMALL_GRADIENT,
            iterations: state.iterations,
            gradient: state.gradient,
            at_limit,
        },
    })
}

/// A point's model.
pub(crate) struct Realised {
    pub model: InnovationsModel,
    pub further_inputs: Vec<InputGains>,
    /// Sections of the predictor's poles.
    predictor: Vec<Coefficients>,
}

/// The model of a point. Errors: no gain of these poles.
pub(super) fn realised(
    problem: &Problem,
    state: &State,
    sample_time_s: f64,
    noise: NoiseModel,
) -> Result<Realised, ModelError> {
    let n = problem.order;
    let theta = &state.projection.theta;
    let a = state.point.a();
    let c = match &state.point.noise {
        Noise::White => a.clone(),
        Noise::Frozen(..) if noise == NoiseModel::Coloured => a.clone(),
        Noise::Frozen(_, c) => c.clone(),
        Noise::Free(c) => sections(c),
    };
    let gains = match (&state.point.noise, noise) {
        (Noise::White, _) | (_, NoiseModel::Coloured) => vec![[0.0; 2]; a.len()],
        _ => kalman_gains(n, &a, &c)?,
    };
    let inputs: Vec<InputGains> = (0..problem.inputs)
        .map(|input| {
            let own = &theta[gains_column(problem, input)..];
            let second = |i: usize| if section_order(n, i) == 2 { own[2 * i + 1] } else { 0.0 };
            let feedthrough = theta[problem.input_column(input) + n];
            InputGains { b: (0..a.len()).map(|i| [own[2 * i], second(i)]).collect(), feedthrough }
        })
        .collect();
    let section = |i: usize| Section { order: section_order(n, i), a: a[i], b: inputs[0].b[i], k: gains[i] };
    let model = InnovationsModel {
        sections: (0..a.len()).map(section).collect(),
        feedthrough: inputs[0].feedthrough,
        sample_time_s,
    };
    Ok(Realised { model, further_inputs: inputs.into_iter().skip(1).collect(), predictor: c })
}

/// Parameters that whiten the errors.
fn noise_parameters(noise: &Noise, model: NoiseModel) -> usize {
    match (noise, model) {
        (Noise::White, _) => 0,
        // one autoregressive filter; a section of first order has no second coefficient
        (Noise::Frozen(filter, _), NoiseModel::Coloured) => filter.iter().flatten().filter(|c| **c != 0.0).count(),
        (Noise::Frozen(sections, _), _) => sections.len(),
        (Noise::Free(c), _) => c.len(),
    }
}

/// First of the columns whose coefficients are an input's b. Where nothing was put in, what rings began with the first
/// sample: the first input is taken for a pulse one sample earlier, whose b is the first experiment's initial state.
fn gains_column(problem: &Problem, input: usize) -> usize {
    let silent = problem.experiments.iter().all(|(u, _)| u.iter().all(|u| *u == 0.0));
    if silent && input == 0 { problem.nuisance_column(0) } else { problem.input_column(input) }
}

/// Gradient share below which an iteration counts as converged however it ended: a tenth of a standard error at 8192
/// samples.
const SMALL_GRADIENT: f64 = 1e-3;

/// Covariance of all a, then all b and D of each input; everything else (c, x0, offset, slope) is estimated along and
/// left out.
fn parameter_covariance(
    problem: &Problem,
    state: &State,
    e: &[f64],
    colour: ResidualColour,
) -> Result<Mat<f64>, ModelError> {
    let n = problem.order;
    let jacobian = Jacobian::new(problem, state);
    let lengths: Vec<usize> = problem.experiments.iter().map(|(_, y)| y.len()).collect();
    let all = covariance(&jacobian.columns(), e, &lengths, colour)?;
    let linear = jacobian.nonlinear.count();
    let of_input = |input: usize| {
        let first = linear + gains_column(problem, input);
        (first..first + n).chain([linear + problem.input_column(input) + n])
    };
    let kept: Vec<usize> = (0..n).chain((0..problem.inputs).flat_map(of_input)).collect();
    // the prediction errors fall where a regressor's share grows
    let sign = |parameter: usize| if parameter < linear { 1.0 } else { -1.0 };
    Ok(Mat::from_fn(kept.len(), kept.len(), |i, j| sign(kept[i]) * sign(kept[j]) * all[(kept[i], kept[j])]))
}

/// Derivatives of e: to all a and free c, then to all linear parameters, these with the sign of the regressors.
pub(super) struct Jacobian<'a> {
    nonlinear: Columns,
    regressors: Present<'a>,
    linear: usize,
}

impl<'a> Jacobian<'a> {
    pub fn new(problem: &Problem, state: &'a State) -> Self {
        let nonlinear = state.coefficient_jacobian(problem);
        Self { nonlinear, regressors: present(problem, &state.regressors), linear: problem.columns() }
    }

    pub fn columns(&self) -> Vec<&[f64]> {
        let mut all = self.nonlinear.slices();
        all.extend((0..self.linear).map(|index| self.regressors.column(index)));
        all
    }
}
