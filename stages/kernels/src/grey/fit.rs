//! The fit, from data to the grey form.

use faer::Mat;

use super::columns::Series;
use super::discrete::discrete;
use super::errors::{Errors, errors};
use super::evaluation::{Evaluation, Normal, Problem, combined, solved};
use super::fractions::Fractions;
use super::hold::unknown_ends;
use super::intersample::{IntersampleChoice, choose};
use super::layout::{Layout, Linear};
use super::options::{Before, GreyKnown, GreyOptions, GreyQuantity};
use super::result::{Grey, GreyExperiment, GreyHold, GreyMode, GreyModel, GreyParameter};
use super::rules::Rules;
use super::search::{Found, search};
use super::start::begin;
use crate::effects::Intersample;
use crate::model::{ModelError, finite};
use crate::pem::{Experiment, PemOptions, longest_complete};
use crate::ringdown::{Estimate, Knowledge};

/// Samples that the start leaves out while it does not know the delay: its grid ends at 16, and a step may go one
/// beyond.
const START_MASK: usize = 18;
/// Rounds in which the samples that hold earlier input are set again, and with them the noise that expectations are
/// weighed with.
const ROUNDS: usize = 4;

/// Fits modes, real poles, delay and feedthrough to inputs and output.
///
/// # Model
/// `G(s) = exp(-s d) [sum_n g_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) + d0] prod_k p_k / (s + p_k)`; `y = G u + offset +
/// slope t + what was left from before + e`, e not filtered (output error). Poles and delay are shared by all
/// experiments and inputs, gains and d0 by all experiments.
/// # Method
/// Each exponential of the partial fractions is discretised for the input between samples, delay included: in closed
/// form (modified z-transform) for held and linear input, by quadrature of the windowed-sinc interpolation for
/// band-limited input. Where the input between samples is left open, see [`IntersampleChoice`]. Gains, d0, offsets and
/// initial states are eliminated by variable projection; Levenberg-Marquardt with analytic slopes on ln w, ln Q, ln p
/// and d. Start: subspace estimates, then a grid of real poles and delays. A step costs `2 N m^2` operations for N
/// samples and m raw columns (8 per mode and 4 per real pole with an initial state): docs/results/timings.md.
/// # Shapes
/// N samples of output per experiment, NaN where missing; inputs one after the other.
/// # Units
/// Seconds, Hz; gains in units of y over those of u.
/// # Accuracy
/// The Cramer-Rao bound in white noise (docs/results/grey.md). Under coloured noise it is least squares; standard
/// errors follow the residual's spectrum. Further real poles, and real poles far above half the sample rate, are hard
/// to tell from a delay: their errors say so.
/// # Errors
/// Lengths, samples that are not finite, too few samples, parameters out of range, a constant output, fewer
/// oscillations than modes. No convergence is no error: see the verdict.
/// # Source
/// L. Ljung, System Identification (1999), chapters 4 and 7; G. Golub and V. Pereyra, Inverse Problems 19 (2003) R1; E.
/// I. Jury (1964), chapter 1.
pub fn fit_grey(experiments: &[Experiment<'_>], sample_time_s: f64, options: &GreyOptions) -> Result<Grey, ModelError> {
    let options = &settled(options);
    let mut problem = checked(experiments, sample_time_s, options)?;
    let longest = experiments.iter().max_by_key(|e| e.output.len()).ok_or(ModelError::NoExperiment)?;
    let rows = PemOptions { block_rows: options.block_rows, ..PemOptions::default() };
    let (input, output) = longest_complete(longest, &rows)?;
    let delayed = problem.rules.free.contains(&(problem.rules.scale.len() - 1));
    let given = options.known.iter().find_map(|k| match (k.quantity, k.knowledge) {
        (GreyQuantity::Delay, Knowledge::Fixed(value)) if value > 0.0 => Some(value / sample_time_s),
        _ => None,
    });
    mask(&mut problem, options, if delayed { Some(START_MASK as f64) } else { given });
    let start = begin(&problem, options, sample_time_s, (&input, output))?;
    let found = refined(&mut problem, options, start)?;
    if options.between.stated().is_some() {
        return conclude(&problem, &found, sample_time_s, options, None);
    }
    let (choice, likeliest) = choose(&problem, options, &found)?;
    match likeliest {
        None => conclude(&problem, &found, sample_time_s, options, Some(choice)),
        Some(point) => {
            problem.between = choice.chosen;
            mask(&mut problem, options, Some(point.delay + 1.0));
            let start = problem.evaluate(&point, problem.variance(&found.best))?;
            let found = refined(&mut problem, options, start)?;
            conclude(&problem, &found, sample_time_s, options, Some(choice))
        }
    }
}

/// Searches from `start`, until the samples that are left out and the noise that expectations are weighed with fit what
/// is found.
fn refined(problem: &mut Problem<'_>, options: &GreyOptions, start: Evaluation) -> Result<Found, ModelError> {
    let mut weighed = problem.variance(&start);
    let mut found = search(problem, start, weighed, options.max_iterations)?;
    let mut steps = found.verdict.iterations;
    let expects = options.known.iter().any(|k| matches!(k.knowledge, Knowledge::About(..)));
    let (lead, _) = unknown_ends(problem.between);
    for _ in 0..ROUNDS {
        let (delay, variance) = (found.best.point.delay, problem.variance(&found.best));
        let masked = problem.series.first().map_or(0, |series| series.masked) as f64;
        let enough = masked == 0.0 || (delay..delay + 2.5).contains(&(masked - lead as f64));
        if enough && (!expects || (variance / weighed - 1.0).abs() < 1e-2) {
            break;
        }
        mask(problem, options, Some(delay + 1.0));
        weighed = variance;
        let from = problem.evaluate(&found.best.point, weighed)?;
        found = search(problem, from, weighed, options.max_iterations)?;
        steps += found.verdict.iterations;
    }
    found.verdict.iterations = steps;
    Ok(found)
}

/// The options with what they leave unsaid: no delay is a delay of zero.
fn settled(options: &GreyOptions) -> GreyOptions {
    let mut settled = options.clone();
    if !options.delay && !options.known.iter().any(|k| k.quantity == GreyQuantity::Delay) {
        settled.known.push(GreyKnown { quantity: GreyQuantity::Delay, knowledge: Knowledge::Fixed(0.0) });
    }
    settled
}

/// Leaves out the samples that depend on what was put in before the record or after it.
fn mask(problem: &mut Problem<'_>, options: &GreyOptions, delay: Option<f64>) {
    mask_for(problem, options, delay, problem.between);
}

/// The same as an input of another kind has it.
pub(super) fn mask_for(problem: &mut Problem<'_>, options: &GreyOptions, delay: Option<f64>, kind: Intersample) {
    let (lead, tail) = unknown_ends(kind);
    let samples = match delay {
        _ if options.history != Before::Anything => 0,
        Some(delay) => delay.ceil() as usize + lead,
        None => lead,
    };
    for series in &mut problem.series {
        let most = series.output.len() / 2;
        (series.masked, series.masked_end) = (samples.min(most), tail.min(most / 2));
    }
}

/// Checked options and data as a problem. Errors: see [`fit_grey`].
fn checked<'a>(
    experiments: &[Experiment<'a>],
    sample_time_s: f64,
    options: &GreyOptions,
) -> Result<Problem<'a>, ModelError> {
    let outside = |name, found: f64, wanted| Err(ModelError::Parameter { name, found, wanted });
    if !(1..=100).contains(&options.modes) {
        return outside("modes", options.modes as f64, "1 to 100");
    }
    if options.real_poles > 20 {
        return outside("real_poles", options.real_poles as f64, "0 to 20");
    }
    if options.max_iterations == 0 {
        return outside("max_iterations", 0.0, "at least 1");
    }
    if options.block_rows < 2 * options.modes + options.real_poles + 6 {
        return outside(
            "block_rows",
            options.block_rows as f64,
            "six more than twice the modes and the real poles, at least",
        );
    }
    if !(sample_time_s > 0.0 && sample_time_s.is_finite()) {
        return outside("sample_time_s", sample_time_s, "positive");
    }
    let first = experiments.first().ok_or(ModelError::NoExperiment)?;
    let inputs = (first.input.len() / first.output.len().max(1)).max(1);
    let rules =
        Rules::of(&options.known, options.modes, options.real_poles, inputs, options.feedthrough, sample_time_s)?;
    let layout = Layout {
        modes: options.modes,
        poles: options.real_poles,
        inputs,
        initial: options.history == Before::Anything,
        slopes: true,
    };
    let mut problem = Problem {
        series: Vec::new(),
        layout,
        linear: Linear { feedthrough: options.feedthrough, offset: options.offset, slope: options.drift },
        between: options.between.stated().unwrap_or_default(),
        rules,
    };
    for experiment in experiments {
        problem.series.push(series(experiment, inputs, options, problem.own_count())?);
    }
    let wanted = 2 * (problem.rules.scale.len() + problem.rules.linear.len()) + START_MASK;
    if problem.present() < wanted {
        return Err(ModelError::TooShort { found: problem.present(), wanted });
    }
    Ok(problem)
}

fn series<'a>(
    experiment: &Experiment<'a>,
    inputs: usize,
    options: &GreyOptions,
    own: usize,
) -> Result<Series<'a>, ModelError> {
    let Experiment { input, output } = *experiment;
    if input.len() != inputs * output.len() {
        return Err(ModelError::Length { what: "input", found: input.len(), wanted: inputs * output.len() });
    }
    finite("input", input)?;
    if let Some(index) = output.iter().position(|y| y.is_infinite()) {
        return Err(ModelError::NotFinite { what: "output", index });
    }
    let mut present = output.iter().filter(|y| !y.is_nan());
    let first = present.next();
    if first.is_some() && present.all(|y| Some(y) == first) {
        return Err(ModelError::ConstantOutput);
    }
    let inputs: Vec<&[f64]> = input.chunks_exact(output.len().max(1)).collect();
    let levels = inputs
        .iter()
        .map(|u| if options.history == Before::Rest { 0.0 } else { u.first().copied().unwrap_or(0.0) })
        .collect();
    let series = Series { inputs, output, levels, masked: 0, masked_end: 0 };
    let (lead, tail) = unknown_ends(options.between.stated().unwrap_or_default());
    let wanted = 2 * own + 2 * START_MASK + lead + tail;
    if series.present() < wanted {
        return Err(ModelError::TooShort { found: series.present(), wanted });
    }
    Ok(series)
}

fn conclude(
    problem: &Problem<'_>,
    found: &Found,
    sample_time_s: f64,
    options: &GreyOptions,
    intersample: Option<IntersampleChoice>,
) -> Result<Grey, ModelError> {
    let at = &found.best;
    let variance = problem.variance(at);
    let normal = problem.normal(at, variance);
    let errors = errors(problem, at, &normal, options.colour)?;
    let discrete = discrete(problem, at, &normal.shared, &errors.covariance, sample_time_s);
    let natural = Natural::of(problem, at, &normal);
    let parameters = natural.parameters(&errors.covariance);
    let model = model(problem, at, &parameters, sample_time_s);
    Ok(Grey {
        model,
        covariance: natural.spread(&errors.covariance),
        sandwich: errors.sandwich.as_ref().map(|sandwich| natural.spread(sandwich)),
        parameters,
        experiments: own(problem, at, &normal, &errors, variance),
        noise_variance: variance,
        intersample,
        verdict: found.verdict,
        discrete,
    })
}

/// From the search's coordinates to the parameters: per parameter its place among the estimated, and its slope there.
struct Natural {
    quantities: Vec<GreyQuantity>,
    values: Vec<f64>,
    place: Vec<Option<usize>>,
    slope: Vec<f64>,
    hold: Vec<GreyHold>,
}

impl Natural {
    fn of(problem: &Problem<'_>, at: &Evaluation, normal: &Normal) -> Self {
        let (modes, poles) = (problem.layout.modes, problem.layout.poles);
        let (values, rules) = (at.point.values(), &problem.rules);
        let edges = rules.edges(&values);
        let mut all =
            Self { quantities: Vec::new(), values: Vec::new(), place: Vec::new(), slope: Vec::new(), hold: Vec::new() };
        for (i, value) in values.iter().enumerate() {
            let free = rules.free.iter().position(|&f| f == i);
            all.quantities.push(match i {
                i if i < 2 * modes && i % 2 == 0 => GreyQuantity::Frequency(i / 2),
                i if i < 2 * modes => GreyQuantity::QualityFactor(i / 2),
                i if i < 2 * modes + poles => GreyQuantity::RealPole(i - 2 * modes),
                _ => GreyQuantity::Delay,
            });
            all.values.push(rules.number(i, *value));
            all.slope.push(rules.slope(i, *value));
            all.hold.push(match free {
                None => GreyHold::Fixed,
                Some(k) if edges[k] != 0 => GreyHold::Bound,
                Some(_) => GreyHold::Free,
            });
            all.place.push(free.map(|k| normal.shared.len() + k));
        }
        let per_input = modes + usize::from(problem.linear.feedthrough);
        for (i, value) in at.shared.iter().enumerate() {
            let (input, mode) = (i / per_input, i % per_input);
            let gain = GreyQuantity::Gain { mode, input };
            all.quantities.push(if mode < modes { gain } else { GreyQuantity::Feedthrough(input) });
            all.values.push(*value);
            all.slope.push(1.0);
            all.hold.push(match at.held[i] {
                None => GreyHold::Free,
                Some(0) => GreyHold::Fixed,
                Some(_) => GreyHold::Bound,
            });
            all.place.push(normal.shared.iter().position(|&f| f == i));
        }
        all
    }

    fn spread(&self, covariance: &Mat<f64>) -> Mat<f64> {
        let n = self.values.len();
        Mat::from_fn(n, n, |i, j| match (self.place[i], self.place[j]) {
            (Some(a), Some(b)) => self.slope[i] * covariance[(a, b)] * self.slope[j],
            _ => 0.0,
        })
    }

    fn parameters(&self, covariance: &Mat<f64>) -> Vec<GreyParameter> {
        let spread = self.spread(covariance);
        (0..self.values.len())
            .map(|i| {
                let variance = spread[(i, i)];
                let std = match self.hold[i] {
                    GreyHold::Fixed => 0.0,
                    GreyHold::Free if variance > 0.0 => variance.sqrt(),
                    // nothing is known of it: on a bound, or a direction that the data do not see
                    _ => f64::NAN,
                };
                let estimate = Estimate { value: self.values[i], std };
                GreyParameter { quantity: self.quantities[i], estimate, hold: self.hold[i] }
            })
            .collect()
    }
}

fn model(problem: &Problem<'_>, at: &Evaluation, parameters: &[GreyParameter], sample_time_s: f64) -> GreyModel {
    let (modes, inputs) = (problem.layout.modes, problem.layout.inputs);
    let value = |i: usize| parameters[i].estimate.value;
    let per_input = modes + usize::from(problem.linear.feedthrough);
    let first = 2 * modes + problem.layout.poles;
    GreyModel {
        modes: (0..modes)
            .map(|n| GreyMode {
                frequency_hz: value(2 * n),
                quality_factor: value(2 * n + 1),
                gain: (0..inputs).map(|i| at.shared[i * per_input + n]).collect(),
            })
            .collect(),
        real_pole_hz: (0..problem.layout.poles).map(|k| value(2 * modes + k)).collect(),
        delay_s: value(first),
        feedthrough: (0..inputs)
            .map(|i| if problem.linear.feedthrough { at.shared[i * per_input + modes] } else { 0.0 })
            .collect(),
        between: problem.between,
        sample_time_s,
    }
}

/// Each experiment's own numbers, with errors for white residuals and the shared parameters' beside.
fn own(problem: &Problem<'_>, at: &Evaluation, normal: &Normal, errors: &Errors, variance: f64) -> Vec<GreyExperiment> {
    let fractions = Fractions::of(&at.point);
    let (count, shared) = (problem.own_count(), normal.shared.len() + problem.rules.free.len());
    (0..problem.series.len())
        .map(|e| {
            let (columns, _) = problem.jacobian(at, &fractions, &normal.shared, e);
            let r = combined(&at.triangles[e], &columns);
            let along: Vec<Vec<f64>> = (0..shared).map(|j| solved(r.as_ref(), count, count + j)).collect();
            let units: Vec<Vec<f64>> = (0..count)
                .map(|j| {
                    let unit =
                        Mat::from_fn(count, count + 1, |i, k| if k < count { r[(i, k)] } else { f64::from(i == j) });
                    solved(unit.as_ref(), count, count)
                })
                .collect();
            let std = |i: usize| {
                let white: f64 = units.iter().map(|u| u[i] * u[i]).sum::<f64>() * variance;
                let others: f64 = (0..shared)
                    .map(|j| (0..shared).map(|k| along[j][i] * errors.covariance[(j, k)] * along[k][i]).sum::<f64>())
                    .sum();
                (white + others.max(0.0)).sqrt()
            };
            let estimate = |i: usize| Estimate { value: at.own[e][i], std: std(i) };
            let initial = count - usize::from(problem.linear.offset) - usize::from(problem.linear.slope);
            let none = Estimate { value: 0.0, std: 0.0 };
            GreyExperiment {
                offset: if problem.linear.offset { estimate(initial) } else { none },
                slope: if problem.linear.slope { estimate(count - 1) } else { none },
                initial: (0..initial).map(estimate).collect(),
                residual: errors.residuals[e].clone(),
            }
        })
        .collect()
}
