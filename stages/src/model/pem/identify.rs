//! The prediction error method, from data to model.

use faer::{Mat, c64};
use realfft::RealFftPlanner;

use super::autoregression::whitened;
use super::covariance::{ResidualColour, covariance};
use super::gradient::{Noise, Point};
use super::noise::{gain, intensities};
use super::optimiser::{Ending, Limits, State, minimise};
use super::parametrisation::{LIMIT, coordinates, roots, section_order, sections};
use super::predictor::Problem;
use super::starts::{candidates, instrumental, lowest, predictors, ranked, refined};
use super::tangent::Tangent;
use crate::model::error::{ModelError, finite};
use crate::model::innovations::{InnovationsModel, InputGains, Section, kalman_gains};
use crate::model::subspace::Subspace;

/// One record of input and output, equally sampled.
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// u, N samples; of several inputs one after the other, a multiple of N.
    pub input: &'a [f64],
    /// y, N samples; NaN where missing, which only output error allows ([`NoiseModel::White`] or [`Focus::Simulation`]).
    pub output: &'a [f64],
}

/// What is estimated, and how far the iteration goes.
#[derive(Debug, Clone, PartialEq)]
pub struct PemOptions {
    /// Order n of the model, at least 1; default 11 (the paper: four modes, three detector poles).
    pub order: usize,
    /// Rows of the Hankel matrix of the start, more than the order; default 60.
    pub block_rows: usize,
    /// Most iterations, at least 1; default 60 (20 are usual).
    pub max_iterations: usize,
    /// Estimate a constant offset of y per experiment; default true.
    pub offset: bool,
    /// Estimate a linear drift of y per experiment; default true: averaged records wander.
    pub slope: bool,
    /// How the Kalman gain is parametrised; default thermal.
    pub noise: NoiseModel,
    /// Which errors are made small; default prediction.
    pub focus: Focus,
    /// Starts that are refined, at least 1; default 3. Measured records of rich input need more: 8.
    pub starts: usize,
    /// Prior against responses that the data do not ask for, 0 or more: as if white noise of this share of each input's energy had been put in and nothing had
    /// come out. Default 0: none. It biases every estimate; the covariance does not count that.
    pub prior: f64,
    /// Share of the residual in the tangent space that counts as zero gradient; default 1e-4: a hundredth of a standard error at 8192 samples.
    pub gradient_tolerance: f64,
    /// How the covariance treats the residual; default its own spectrum.
    pub colour: ResidualColour,
}

impl Default for PemOptions {
    fn default() -> Self {
        Self {
            order: 11,
            block_rows: 60,
            max_iterations: 60,
            offset: true,
            slope: true,
            noise: NoiseModel::Thermal,
            focus: Focus::Prediction,
            starts: 3,
            prior: 0.0,
            gradient_tolerance: 1e-4,
            colour: ResidualColour::Spectrum,
        }
    }
}

/// How the Kalman gain is parametrised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseModel {
    /// K = 0: output error.
    White,
    /// K from the intensities of white output noise and of white forces on the sections (thermal noise): one parameter per section.
    Thermal,
    /// K free: n parameters.
    Free,
    /// K = 0, the noise whitened by an autoregressive filter of its own (Box and Jenkins): for noise that does not pass through the model's poles.
    Coloured,
}

/// Which errors are made small.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Focus {
    /// One-step prediction errors: most efficient where the noise model holds.
    Prediction,
    /// Simulation errors: output error, refined from the best of the subspace estimates and the prediction model; K = 0. For models of too low an order,
    /// this spreads what they cannot follow as the input's use asks.
    Simulation,
}

/// How the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// Why it ended.
    pub ending: Ending,
    /// Whether the result is a minimum: gradient small against the residual, or the residual rounding alone.
    pub converged: bool,
    /// Accepted steps, from the best start on.
    pub iterations: usize,
    /// Norm of the residual's part in the tangent space over the residual's norm; times `sqrt(N)`: standard errors from the minimum.
    pub gradient: f64,
    /// Coordinates at the limit of the parametrisation (undamped within any window).
    pub at_limit: usize,
}

/// A model with everything that its estimate yields.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The model from the first input: A and A - K C stable.
    pub model: InnovationsModel,
    /// How the further inputs enter it.
    pub further_inputs: Vec<InputGains>,
    /// x0 of each experiment.
    pub initial_states: Vec<Vec<f64>>,
    /// Offset of y of each experiment, at its centre.
    pub offsets: Vec<f64>,
    /// Drift of y of each experiment, per second.
    pub slopes: Vec<f64>,
    /// Prediction errors of each experiment.
    pub residuals: Vec<Vec<f64>>,
    /// Mean square of e, corrected for the number of parameters.
    pub innovation_variance: f64,
    /// Covariance of [`InnovationsModel::parameters`], then of b and D of each further input.
    pub covariance: Mat<f64>,
    /// Poles of the predictor, eigenvalues of A - K C: the zeros of the noise model.
    pub predictor_poles: Vec<c64>,
    /// Singular values of the start's Hankel matrix.
    pub singular_values: Vec<f64>,
    /// How the iteration ended.
    pub verdict: Verdict,
}

/// Identifies a model in innovations form by minimising its one-step prediction errors.
///
/// # Model
/// Eq. 8: `x(t+Ts) = A x + B u + K e`, `y = C x + D u + e + offset + slope t`; x0, offset and slope per experiment; any number of inputs.
/// # Method
/// Parallel sections of second order in reflection coefficients (stable by construction, A as well as A - K C, and without
/// redundancy); b, D, x0, offset and slope eliminated by variable projection; Levenberg-Marquardt with analytic sensitivities on the rest,
/// from several starts: subspace estimates with and without instruments. Cost per iteration: about `2 N (3 n)^2` operations.
/// # Shapes
/// N samples per experiment; any number of experiments.
/// # Units
/// Those of u and y.
/// # Accuracy
/// Restricted maximum likelihood for Gaussian noise, white plus thermal (same poles). Over 60 seeds of the paper's lever in such noise the rms
/// errors of f and Q are 0.85 to 1.13 of the Cramer-Rao bound, and their squares 0.86 to 1.3 of the squared standard errors. Noise-free data
/// are recovered to rounding. The covariance allows for a coloured residual.
/// # Errors
/// Lengths, samples that are not finite, too few samples, parameters out of range, a constant output, no finite fit. No convergence is
/// no error: see the verdict.
/// # Source
/// L. Ljung, System Identification (1999), chapters 7 and 10; G. Golub and V. Pereyra, Inverse Problems 19 (2003) R1.
pub fn identify(
    experiments: &[Experiment<'_>],
    sample_time_s: f64,
    options: &PemOptions,
) -> Result<Identified, ModelError> {
    let mut problem = checked(experiments, sample_time_s, options)?;
    let prior = prior_records(experiments, problem.inputs, options)?;
    problem.experiments.extend(prior.iter().map(|(input, output)| (input.as_slice(), output.as_slice())));
    problem.priors = prior.len();
    let longest =
        experiments.iter().max_by_key(|experiment| experiment.output.len()).ok_or(ModelError::NoExperiment)?;
    let (input, output) = complete(longest, options)?;
    let subspace = Subspace::new(&input, output, options.block_rows)?;
    let limits = Limits { iterations: options.max_iterations, gradient: options.gradient_tolerance };
    let mut poles = candidates(&subspace, options.order)?;
    if options.starts > PemOptions::default().starts {
        poles.extend(instrumental(&input, output, options.order, options.block_rows));
    }
    let starts = ranked(&problem, &poles, options.starts)?;
    let many = options.starts > PemOptions::default().starts;
    let prediction = |starts: Vec<State>| match options.noise {
        NoiseModel::White => minimise(&problem, refined(&problem, starts, limits)?, limits),
        NoiseModel::Free if many => lowest(&problem, predictors(&problem, &poles, &starts), options.starts, limits),
        NoiseModel::Coloured => {
            let points = starts.into_iter().map(|state| state.point).collect();
            whitened(&problem, lowest(&problem, points, options.starts, limits)?, limits)
        }
        noise => thermal_or_free(&problem, starts, limits, noise),
    };
    let state = match options.focus {
        Focus::Prediction => prediction(starts)?,
        Focus::Simulation => simulation(&problem, starts, prediction, options.starts, limits)?,
    };
    conclude(&problem, &state, sample_time_s, options, subspace.singular_values().to_vec())
}

/// Inputs, one after the other, and output.
type Record = (Vec<f64>, Vec<f64>);

/// Input and output of each input's prior: an impulse of the share's energy, and silence. Errors: a share that is negative or not finite.
fn prior_records(
    experiments: &[Experiment<'_>],
    inputs: usize,
    options: &PemOptions,
) -> Result<Vec<Record>, ModelError> {
    if !(options.prior >= 0.0 && options.prior.is_finite()) {
        return Err(ModelError::Parameter { name: "prior", found: options.prior, wanted: "0 or more" });
    }
    if options.prior == 0.0 {
        return Ok(Vec::new());
    }
    let samples = experiments.iter().map(|experiment| experiment.output.len()).max().unwrap_or(0);
    let energy = |input: usize| -> f64 {
        let own = |e: &Experiment<'_>| {
            let n = e.output.len();
            e.input[input * n..(input + 1) * n].iter().map(|u| u * u).sum::<f64>()
        };
        experiments.iter().map(own).sum()
    };
    let record = |input: usize| {
        let mut impulse = vec![0.0; inputs * samples];
        impulse[input * samples] = (options.prior * energy(input)).sqrt();
        (impulse, vec![0.0; samples])
    };
    Ok((0..inputs).map(record).collect())
}

/// The model of these poles (order many) whose simulation is closest: b, D, x0, offset and slope by least squares, no iteration; K = 0.
///
/// For estimates that give poles: subspace methods, ERA, vector fitting. Unstable poles are reflected. Errors: as [`identify`].
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

/// The model of output error from these poles on (order many): for the same model on other data, where [`identify`]'s search is not needed again.
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
    let limits = Limits { iterations: options.max_iterations, gradient: options.gradient_tolerance };
    let start = State::new(&problem, Point { poles: coordinates(poles), noise: Noise::White })?;
    conclude(&problem, &minimise(&problem, start, limits)?, sample_time_s, &options, Vec::new())
}

/// Prediction errors with a noise filter, from the output error's starts.
fn thermal_or_free(
    problem: &Problem,
    starts: Vec<State>,
    limits: Limits,
    noise: NoiseModel,
) -> Result<State, ModelError> {
    let state = thermal(problem, starts, limits)?;
    if noise == NoiseModel::Thermal {
        return Ok(state);
    }
    let poles = state.point.poles.clone();
    let c = state.point.predictor_coordinates(problem.order);
    let next = State::new(problem, Point { poles, noise: Noise::Free(c) })?;
    minimise(problem, State { iterations: state.iterations, ..next }, limits)
}

/// Output error from the prediction model's poles as well.
fn simulation(
    problem: &Problem,
    starts: Vec<State>,
    prediction: impl Fn(Vec<State>) -> Result<State, ModelError>,
    count: usize,
    limits: Limits,
) -> Result<State, ModelError> {
    let white = |poles: Vec<f64>| Point { poles, noise: Noise::White };
    let mut points: Vec<Point> = starts.iter().map(|state| state.point.clone()).collect();
    if problem.missing.is_empty()
        && let Ok(state) = prediction(starts)
    {
        points.push(white(state.point.poles));
    }
    lowest(problem, points, count + 1, limits)
}

/// The longest stretch of an experiment without a missing output, its inputs one after the other. Errors: it is too short for the start.
fn complete<'a>(
    experiment: &Experiment<'a>,
    options: &PemOptions,
) -> Result<(std::borrow::Cow<'a, [f64]>, &'a [f64]), ModelError> {
    let samples = experiment.output.len();
    let (mut best, mut first) = (0..0, 0);
    for k in 0..=samples {
        if experiment.output.get(k).is_none_or(|y| y.is_nan()) {
            if k - first > best.len() {
                best = first..k;
            }
            first = k + 1;
        }
    }
    if best.len() == samples {
        return Ok((experiment.input.into(), experiment.output));
    }
    let wanted = 3 * options.block_rows;
    if best.len() < wanted {
        return Err(ModelError::TooShort { found: best.len(), wanted });
    }
    let input: Vec<f64> = experiment.input.chunks_exact(samples).flat_map(|u| u[best.clone()].to_vec()).collect();
    Ok((input.into(), &experiment.output[best]))
}

/// Rounds of noise, then poles: the second changes either by a fraction of its error, the third by less than a hundredth.
const THERMAL_ROUNDS: usize = 3;

/// Poles and noise intensities in turn.
///
/// The noise comes first from the best start alone; under its whitening all starts compete: unwhitened, a spare pole would rather fit the
/// thermal noise of a strong mode than the detector.
fn thermal(problem: &Problem, starts: Vec<State>, limits: Limits) -> Result<State, ModelError> {
    let mut poles: Vec<Vec<f64>> = starts.iter().map(|state| state.point.poles.clone()).collect();
    let first = refined(problem, starts.into_iter().take(1).collect(), limits)?;
    if first.ending == Ending::Exact {
        return minimise(problem, first, limits);
    }
    let noise = thermal_noise(problem, &first)?;
    poles.push(first.point.poles);
    let whitened = poles.into_iter().map(|poles| State::new(problem, Point { poles, noise: noise.clone() }));
    let mut state = refined(problem, whitened.filter_map(Result::ok).collect(), limits)?;
    for round in 0..THERMAL_ROUNDS {
        if round > 0 {
            let next = State::new(
                problem,
                Point { poles: state.point.poles.clone(), noise: thermal_noise(problem, &state)? },
            )?;
            state = State { iterations: state.iterations, ..next };
        }
        state = minimise(problem, state, limits)?;
    }
    state = without_drift(problem, state, limits)?;
    // K belongs to the final poles: one more linear solution with exactly that predictor
    if let Noise::Frozen(_, c) = &state.point.noise {
        let noise = Noise::Frozen(state.point.a(), c.clone());
        let point = Point { poles: state.point.poles.clone(), noise };
        let State { iterations, ending, gradient, .. } = state;
        state = State { iterations, ending, gradient, ..State::new(problem, point)? };
    }
    Ok(state)
}

/// Exchanges real poles slower than the window for a fast one, unless the data insist on them.
///
/// What such a pole explains is the business of offset and drift; its static gain is arbitrary and spoils everyone's share of it.
fn without_drift(problem: &Problem, state: State, limits: Limits) -> Result<State, ModelError> {
    let rows = problem.rows() as f64;
    let all: Vec<c64> =
        state.point.a().iter().enumerate().flat_map(|(i, &a)| roots(a, section_order(problem.order, i))).collect();
    let slow = |z: &c64| z.im == 0.0 && z.re > 1.0 - 1.0 / rows;
    if !all.iter().any(slow) || problem.order == 1 {
        return Ok(state);
    }
    let exchanged: Vec<c64> = all.iter().map(|z| if slow(z) { c64::new(EXCHANGE, 0.0) } else { *z }).collect();
    let point = Point { poles: coordinates(&exchanged), noise: state.point.noise.clone() };
    let start = State { iterations: state.iterations, ..State::new(problem, point)? };
    let other = minimise(problem, start, limits)?;
    let loss = rows * (other.projection.cost / state.projection.cost - 1.0);
    // as for a resonance: the best of N chances gains 2 ln N
    Ok(if loss < 2.0 * rows.ln() { other } else { state })
}

/// Where an exchanged pole begins: fast, apart from the usual starts.
const EXCHANGE: f64 = 0.4;

/// Whitening by the noise that the residual shows.
fn thermal_noise(problem: &Problem, state: &State) -> Result<Noise, ModelError> {
    let tangent = Tangent::new(&full_jacobian(problem, state))?;
    let e = state.residual();
    let mut planner = RealFftPlanner::<f64>::new();
    let mut top = 0;
    let mut spectra = Vec::new();
    for (_, y) in problem.measured() {
        spectra.push((tangent.spectra(&e, top, y.len(), &mut planner), y.len()));
        top += y.len();
    }
    let a = state.point.a();
    let intensities = intensities(&a, &state.point.whitening(), &spectra);
    let (_, predictor) = gain(problem.order, &a, &intensities)?;
    Ok(Noise::Frozen(a, sections(&coordinates(&predictor))))
}

fn checked<'a>(
    experiments: &[Experiment<'a>],
    sample_time_s: f64,
    options: &PemOptions,
) -> Result<Problem<'a>, ModelError> {
    let range = |name, found: usize, ok, wanted| {
        if ok { Ok(()) } else { Err(ModelError::Parameter { name, found: found as f64, wanted }) }
    };
    range("order", options.order, options.order >= 1, "at least 1")?;
    range("block_rows", options.block_rows, options.block_rows > options.order, "more than the order")?;
    range("max_iterations", options.max_iterations, options.max_iterations >= 1, "at least 1")?;
    if !(sample_time_s > 0.0 && sample_time_s.is_finite()) {
        return Err(ModelError::Parameter { name: "sample_time_s", found: sample_time_s, wanted: "positive" });
    }
    if experiments.is_empty() {
        return Err(ModelError::NoExperiment);
    }
    let inputs = experiments.first().map_or(0, |first| first.input.len() / first.output.len().max(1)).max(1);
    let (mut missing, mut top) = (Vec::new(), 0);
    for Experiment { input, output } in experiments {
        if input.len() != inputs * output.len() {
            return Err(ModelError::Length { what: "input", found: input.len(), wanted: inputs * output.len() });
        }
        finite("input", input)?;
        if let Some(index) = output.iter().position(|y| y.is_infinite()) {
            return Err(ModelError::NotFinite { what: "output", index });
        }
        missing.extend(output.iter().enumerate().filter(|(_, y)| y.is_nan()).map(|(k, _)| top + k));
        let wanted = (3 * options.block_rows).max((4 + 2 * inputs) * options.order + 6);
        let found = top + output.len() - missing.len();
        if output.len() < wanted || found < wanted {
            return Err(ModelError::TooShort { found: found.min(output.len()), wanted });
        }
        let mut present = output.iter().filter(|y| !y.is_nan());
        let first = present.next();
        if present.all(|y| Some(y) == first) {
            return Err(ModelError::ConstantOutput);
        }
        top += output.len();
    }
    if let (Some(&index), true) = (missing.first(), options.noise != NoiseModel::White) {
        return Err(ModelError::Missing { count: missing.len(), index });
    }
    Ok(Problem {
        experiments: experiments.iter().map(|experiment| (experiment.input, experiment.output)).collect(),
        inputs,
        order: options.order,
        offset: options.offset,
        slope: options.slope,
        missing,
        priors: 0,
    })
}

fn conclude(
    problem: &Problem,
    state: &State,
    sample_time_s: f64,
    options: &PemOptions,
    singular_values: Vec<f64>,
) -> Result<Identified, ModelError> {
    let n = problem.order;
    let theta = &state.projection.theta;
    let a = state.point.a();
    let c = match &state.point.noise {
        Noise::White => a.clone(),
        Noise::Frozen(..) if options.noise == NoiseModel::Coloured => a.clone(),
        Noise::Frozen(_, c) => c.clone(),
        Noise::Free(c) => sections(c),
    };
    let gains = match (&state.point.noise, options.noise) {
        (Noise::White, _) | (_, NoiseModel::Coloured) => vec![[0.0; 2]; a.len()],
        _ => kalman_gains(n, &a, &c)?,
    };
    let inputs: Vec<InputGains> = (0..problem.inputs)
        .map(|input| {
            let own = &theta[problem.input_column(input)..];
            let second = |i: usize| if section_order(n, i) == 2 { own[2 * i + 1] } else { 0.0 };
            InputGains { b: (0..a.len()).map(|i| [own[2 * i], second(i)]).collect(), feedthrough: own[n] }
        })
        .collect();
    let section = |i: usize| Section { order: section_order(n, i), a: a[i], b: inputs[0].b[i], k: gains[i] };
    let model = InnovationsModel {
        sections: (0..a.len()).map(section).collect(),
        feedthrough: inputs[0].feedthrough,
        sample_time_s,
    };
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
        further_inputs: inputs.into_iter().skip(1).collect(),
        initial_states: (0..count).map(|i| (0..n).map(|j| own(i, j)).collect()).collect(),
        offsets: (0..count).map(|i| if problem.offset { own(i, n) } else { 0.0 }).collect(),
        slopes: (0..count)
            .map(|i| if problem.slope { own(i, n + usize::from(problem.offset)) / half(i) } else { 0.0 })
            .collect(),
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

/// Gradient share below which an iteration counts as converged however it ended: a tenth of a standard error at 8192 samples.
const SMALL_GRADIENT: f64 = 1e-3;

/// Covariance of all a, then all b and D of each input; everything else (c, x0, offset, slope) is estimated along and left out.
fn parameter_covariance(
    problem: &Problem,
    state: &State,
    e: &[f64],
    colour: ResidualColour,
) -> Result<Mat<f64>, ModelError> {
    let n = problem.order;
    let jacobian = full_jacobian(problem, state);
    let lengths: Vec<usize> = problem.experiments.iter().map(|(_, y)| y.len()).collect();
    let all = covariance(&jacobian, e, &lengths, colour)?;
    let linear = jacobian.ncols() - problem.columns();
    let kept: Vec<usize> = (0..n).chain(linear..linear + problem.input_column(problem.inputs)).collect();
    Ok(Mat::from_fn(kept.len(), kept.len(), |i, j| all[(kept[i], kept[j])]))
}

/// Derivatives of e to all a, free c, then all linear parameters.
fn full_jacobian(problem: &Problem, state: &State) -> Mat<f64> {
    let nonlinear = state.coefficient_jacobian(problem);
    let (rows, q, p) = (nonlinear.nrows(), nonlinear.ncols(), problem.columns());
    let mut jacobian = Mat::zeros(rows, q + p);
    jacobian.as_mut().get_mut(.., ..q).copy_from(&nonlinear);
    for j in 0..p {
        jacobian.col_mut(q + j).iter_mut().zip(state.regressors.col(j).iter()).for_each(|(t, x)| *t = -x);
    }
    problem.mask(&mut jacobian);
    jacobian
}
