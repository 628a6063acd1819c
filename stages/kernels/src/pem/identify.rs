//! The prediction error method, from data to model.

use faer::c64;

use super::alternating::thermal_or_free;
use super::autoregression::whitened;
use super::conclusion::conclude;
use super::data::{checked, prior_records};
use super::estimates::Estimates;
use super::jacobian::{Noise, Point};
use super::levenberg_marquardt::{Limits, minimise};
use super::options::{Experiment, Focus, Identified, NoiseModel, PemOptions};
use super::predictor::Problem;
use super::starts::{Start, lowest, output_errors, predictors, ranked, refined};
use super::state::State;
use crate::model::{ModelError, coordinates};

/// Identifies a model in innovations form by minimising its one-step prediction errors.
///
/// # Model
/// Eq. 8: `x(t+Ts) = A x + B u + K e`, `y = C x + D u + e + offset + slope t`; x0, offset and slope per experiment; any
/// number of inputs.
/// # Method
/// Parallel sections of second order in reflection coefficients (stable by construction, A as well as A - K C, and
/// without redundancy); b, D, x0, offset and slope eliminated by variable projection; Levenberg-Marquardt with analytic
/// sensitivities on the rest, from several starts: subspace estimates, with instruments too where more than three are
/// asked for. The linear part by
/// inner products of the columns where these keep enough digits, which is checked, by rotations elsewhere. Cost per
/// iteration: about `N (3 n)^2` operations, twice as many by rotations.
/// # Shapes
/// N samples per experiment; any number of experiments.
/// # Units
/// Those of u and y.
/// # Accuracy
/// Restricted maximum likelihood for Gaussian noise, white plus thermal (same poles). Over 60 seeds of the paper's
/// lever in such noise the rms errors of f and Q are 0.85 to 1.13 of the Cramer-Rao bound, and their squares 0.86 to
/// 1.3 of the squared standard errors. Noise-free data are recovered to rounding. The covariance allows for a coloured
/// residual.
/// # Errors
/// Lengths, samples that are not finite, too few samples, parameters out of range, a constant output, no finite fit. No
/// convergence is no error: see the verdict.
/// # Source
/// L. Ljung, System Identification (1999), chapters 7 and 10; G. Golub and V. Pereyra, Inverse Problems 19 (2003) R1.
pub fn identify(
    experiments: &[Experiment<'_>],
    sample_time_s: f64,
    options: &PemOptions,
) -> Result<Identified, ModelError> {
    let prior = prior_records(experiments, options)?;
    let problem = checked(experiments, sample_time_s, options)?.with_priors(&prior);
    let estimates = Estimates::new(experiments, std::slice::from_ref(options))?;
    let state = minimum(&problem, &estimates, options)?;
    let singular_values = estimates.plain(options.block_rows)?.singular_values().to_vec();
    conclude(&problem, &state, sample_time_s, options, singular_values)
}

/// The lowest minimum from the estimates' poles. Errors: no finite fit.
pub(super) fn minimum(problem: &Problem, estimates: &Estimates, options: &PemOptions) -> Result<State, ModelError> {
    let shortened = problem.shortened();
    let short = shortened.as_ref().unwrap_or(problem);
    let limits = Limits::of(options);
    let poles = estimates.poles(options)?;
    let starts = ranked(short, output_errors(&poles), options.starts)?;
    let points = |starts: Vec<Start>| starts.into_iter().map(|start| start.point);
    let prediction = |starts: Vec<Start>| match options.noise {
        NoiseModel::White => {
            let state = refined(short, points(starts), limits)?;
            minimise(problem, State::carried(problem, state.point.clone(), &state)?, limits)
        }
        NoiseModel::Free if options.many_starts() => {
            let points = predictors(problem, &poles, &starts).into_iter();
            lowest(problem, ranked(problem, points, options.starts)?, limits)
        }
        NoiseModel::Coloured => {
            let starts = match shortened {
                Some(_) => ranked(problem, points(starts), options.starts)?,
                None => starts,
            };
            whitened(problem, lowest(problem, starts, limits)?, limits)
        }
        noise => thermal_or_free(problem, short, points(starts).collect(), limits, noise),
    };
    match options.focus {
        Focus::Prediction => prediction(starts),
        Focus::Simulation => {
            let mut all: Vec<Point> = starts.iter().map(|start| start.point.clone()).collect();
            if problem.missing.is_empty()
                && let Ok(state) = prediction(starts)
            {
                all.push(Point { poles: state.point.poles, noise: Noise::White });
            }
            lowest(problem, ranked(problem, all.into_iter(), options.starts + 1)?, limits)
        }
    }
}

/// The model of these poles (order many) whose simulation is closest: b, D, x0, offset and slope by least squares, no
/// iteration; K = 0.
///
/// For estimates that give poles: subspace methods, ERA, vector fitting. Unstable poles are reflected. Errors: as
/// [`identify`].
pub fn with_poles(
    experiments: &[Experiment<'_>],
    sample_time_s: f64,
    poles: &[c64],
    options: &PemOptions,
) -> Result<Identified, ModelError> {
    let options = PemOptions { order: poles.len(), noise: NoiseModel::White, ..options.clone() };
    let problem = checked(experiments, sample_time_s, &options)?;
    let state = State::new(&problem, Point { poles: coordinates(poles), noise: Noise::White })?;
    conclude(&problem, &state, sample_time_s, &options, Vec::new())
}

/// The model of output error from these poles on (order many): for the same model on other data, where [`identify`]'s
/// search is not needed again.
///
/// Errors: as [`identify`].
pub fn refit(
    experiments: &[Experiment<'_>],
    sample_time_s: f64,
    poles: &[c64],
    options: &PemOptions,
) -> Result<Identified, ModelError> {
    let options = PemOptions { order: poles.len(), noise: NoiseModel::White, ..options.clone() };
    let problem = checked(experiments, sample_time_s, &options)?;
    let limits = Limits::of(&options);
    let start = State::new(&problem, Point { poles: coordinates(poles), noise: Noise::White })?;
    conclude(&problem, &minimise(&problem, start, limits)?, sample_time_s, &options, Vec::new())
}
