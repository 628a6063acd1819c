//! `model`: a state-space model in innovations form.

use afmid_kernels::model::{InnovationsModel, InputGains};
use afmid_kernels::pem::Identified;
use afmid_kernels::validation::Nuisances;
use afmid_pipeline::{Attribute, Matrix, StageError, StateSpace};
use faer::Mat;

use super::DataSet;

const SET: &str = "set";
const FIRST_SAMPLE: &str = "first_sample";
const OFFSET_FITTED: &str = "offset_fitted";
const DRIFT_FITTED: &str = "drift_fitted";
const T0_AMBIGUITY_S: &str = "t0_ambiguity_s";

/// The artifact: matrices in the sections' observer form, parameters a, then b and d of each input, with their
/// covariance.
pub(crate) fn state_space(fit: &Identified, set: DataSet, first: usize) -> Result<StateSpace, StageError> {
    let model = &fit.model;
    let n = model.order();
    let (a, b, c, k) = model.matrices();
    let mut columns = vec![(b, model.feedthrough)];
    for gains in &fit.further_inputs {
        let (_, b, ..) = model.from_input(gains).map_err(StageError::from_error)?.matrices();
        columns.push((b, gains.feedthrough));
    }
    let inputs = columns.len();
    let mut names: Vec<String> = (1..=n).map(|i| format!("a{i}")).collect();
    let mut parameters = model.parameters();
    parameters.truncate(n);
    for (input, (b, d)) in columns.iter().enumerate() {
        let mark = if input == 0 { String::new() } else { format!("_{}", input + 1) };
        names.extend((1..=n).map(|i| format!("b{i}{mark}")).chain([format!("d{mark}")]));
        parameters.extend(b.iter().copied().chain([*d]));
    }
    let count = parameters.len();
    let square = |matrix: &faer::Mat<f64>, n: usize| {
        Matrix::new(n, n, (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| matrix[(i, j)]).collect())
    };
    let mut artifact = StateSpace {
        a: square(&a, n)?,
        b: Matrix::new(n, inputs, (0..n).flat_map(|i| columns.iter().map(move |(b, _)| b[i])).collect())?,
        c: Matrix::row(c),
        d: Matrix::row(columns.iter().map(|(_, d)| *d).collect()),
        k: Matrix::column(k),
        x0: fit.initial_states.first().cloned().unwrap_or_default(),
        sample_time_s: model.sample_time_s,
        innovation_variance: fit.innovation_variance,
        parameter_names: names,
        parameters,
        covariance: square(&fit.covariance, count)?,
        ..StateSpace::default()
    };
    let attributes = [
        (SET, set.name().into()),
        (FIRST_SAMPLE, first.into()),
        ("converged", fit.verdict.converged.into()),
        ("offset_v", fit.offsets.first().copied().unwrap_or(0.0).into()),
        ("drift_v_per_s", fit.slopes.first().copied().unwrap_or(0.0).into()),
    ];
    artifact.attributes.extend(attributes.map(|(name, value): (&str, Attribute)| (name.to_owned(), value)));
    Ok(artifact)
}

/// Column `input` of B.
fn input_column(artifact: &StateSpace, input: usize) -> Vec<f64> {
    artifact.b.values.iter().skip(input).step_by(artifact.b.columns.max(1)).copied().collect()
}

/// Gains of the inputs beyond the first.
pub(crate) fn further_inputs(artifact: &StateSpace) -> Vec<InputGains> {
    let gains = |input: usize| {
        let b = input_column(artifact, input);
        let pairs = b.chunks(2).map(|b| [b[0], b.get(1).copied().unwrap_or(0.0)]).collect();
        InputGains { b: pairs, feedthrough: artifact.d.values.get(input).copied().unwrap_or(0.0) }
    };
    (1..artifact.b.columns).map(gains).collect()
}

/// Model, from the first input, and covariance of an artifact that a stage of this domain made.
pub(crate) fn innovations(artifact: &StateSpace) -> Result<(InnovationsModel, Mat<f64>), StageError> {
    let n = artifact.order();
    let a = Mat::from_fn(n, n, |i, j| artifact.a.at(i, j));
    let feedthrough = artifact.d.values.first().copied().unwrap_or(0.0);
    let model = InnovationsModel::from_matrices(
        &a,
        &input_column(artifact, 0),
        &artifact.k.values,
        feedthrough,
        artifact.sample_time_s,
    )
    .map_err(StageError::from_error)?;
    let count = n + artifact.b.columns * (n + 1);
    if (artifact.covariance.rows, artifact.covariance.columns) != (count, count) {
        return Err(StageError::new(format!(
            "the model's covariance is {} x {}, wanted {count} x {count}: all a, then all b and d of each input",
            artifact.covariance.rows, artifact.covariance.columns
        )));
    }
    let count = 2 * n + 1;
    Ok((model, Mat::from_fn(count, count, |i, j| artifact.covariance.at(i, j))))
}

/// States what else was fitted.
pub(crate) fn state_nuisances(model: &mut StateSpace, nuisances: Nuisances) {
    model.attributes.insert(OFFSET_FITTED.to_owned(), nuisances.offset.into());
    model.attributes.insert(DRIFT_FITTED.to_owned(), nuisances.slope.into());
}

/// What else was fitted: both where nothing is stated.
pub(crate) fn nuisances(model: &StateSpace) -> Nuisances {
    let fitted = |name: &str| model.attributes.get(name) != Some(&Attribute::Flag(false));
    Nuisances { offset: fitted(OFFSET_FITTED), slope: fitted(DRIFT_FITTED) }
}

/// The first sample that was used.
pub(crate) fn first_sample(model: &StateSpace) -> usize {
    model.attributes.get(FIRST_SAMPLE).and_then(Attribute::as_f64).unwrap_or(0.0) as usize
}

/// States how wide the interval is in which t0 may lie: what the model cannot know, and its modes' shares count.
pub(crate) fn state_t0_ambiguity(model: &mut StateSpace, ambiguity_s: Option<f64>) {
    if let Some(ambiguity) = ambiguity_s {
        model.attributes.insert(T0_AMBIGUITY_S.to_owned(), ambiguity.into());
    }
}

/// The width of that interval, where it is stated.
pub(crate) fn t0_ambiguity_s(model: &StateSpace) -> Option<f64> {
    model.attributes.get(T0_AMBIGUITY_S).and_then(Attribute::as_f64)
}
