//! The stage `model.pem`.

use afmid_pipeline::{
    Array, Attribute, Axis, Caching, Context, Document, Example, Matrix, Port, Ports, Spec, Stage, StageError,
    StateSpace,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::ensemble::LEAST_EVENTS;

use super::pem::{Ending, Experiment, Identified, NoiseModel, PemOptions, identify};
use super::{TestResult, fit_percent, input_dependence, whiteness};

/// Identifies a state-space model in innovations form from force and response.
///
/// Model: Eq. 8, x(t+Ts) = A x + B u + K e, y = C x + D u + e + offset + drift; the initial state is estimated along.
/// Method: minimum of the squared one-step prediction errors by Levenberg-Marquardt with analytic sensitivities; all that enters linearly is
/// eliminated exactly. Poles and predictor are stable by construction: sections of second order in reflection coefficients. Starts from a
/// subspace estimate at every order up to the wanted one.
/// Shapes: `residual`, `prediction` over time; A order x order; covariance of the 2 order + 1 parameters of A, B and D.
/// Units: volts to volts where the force is given as static deflection.
/// Accuracy: the Cramer-Rao bound within some per cent where the noise is white plus thermal. The covariance follows the residual's own
/// spectrum, so wander that the model leaves is counted.
/// Errors: too few samples for the order, values that are not finite, a response that is constant. No convergence is a warning.
/// Source: Stark et al. 2005, Eq. 8; L. Ljung, System Identification, 1999, chapters 7 and 10.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Pem {
    /// Number of states, 1 to 40. Default: 11, as in the paper: four modes and three detector poles.
    pub order: usize,
    /// Which events: `all`, or one half (`identification`, `verification`). Default: all.
    pub set: DataSet,
    /// Rows of the Hankel matrix that the start comes from, more than `order` and at most 1000. Default: 60; half as many blur close poles.
    pub block_rows: usize,
    /// Most iterations in each stretch of the search, 1 to 10000. Default: 60; ten to thirty are usual.
    pub max_iterations: usize,
    /// Parametrisation of the Kalman gain: `thermal` (white output noise and a white force on every section, one intensity each), `free` (all its
    /// elements) or `white` (none: output error). Default: thermal; a free gain also fits the dips that the fit itself leaves at resonances.
    pub noise: NoiseKind,
    /// Estimate a constant offset of the response. Default: true.
    pub offset: bool,
    /// Estimate a linear drift of the response. Default: true; averaged records wander.
    pub drift: bool,
    /// Seconds before t0 that are used, above 0. Default: none, all of them. After a snap-in a few periods suffice: before it the lever is another system.
    pub before_s: Option<f64>,
    /// Lags of the residual tests, 1 to 1000, beyond the order. Default: 25.
    pub test_lags: usize,
}

/// Which events a model is fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DataSet {
    /// All events.
    All,
    /// The identification half.
    Identification,
    /// The verification half.
    Verification,
}

impl DataSet {
    /// What its variables' names end in.
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::All => "",
            Self::Identification => "_identification",
            Self::Verification => "_verification",
        }
    }
}

/// Parametrisation of the Kalman gain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseKind {
    /// From noise intensities.
    Thermal,
    /// Every element free.
    Free,
    /// Zero.
    White,
}

impl Default for Pem {
    fn default() -> Self {
        Self {
            order: 11,
            set: DataSet::All,
            block_rows: 60,
            max_iterations: 60,
            noise: NoiseKind::Thermal,
            offset: true,
            drift: true,
            before_s: None,
            test_lags: 25,
        }
    }
}

pub(super) const PAIR: Port<Array> = Port::new("pair", "pair", "force and response over time since t0");
pub(super) const MODEL: Port<StateSpace> =
    Port::new("model", "model", "the model, with the covariance of its parameters");
const RESIDUALS: Port<Array> = Port::new("residuals", "residuals", "prediction errors and predictions over time");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "convergence, fits of the data that it was fitted to, residual tests");

impl Stage for Pem {
    const SPEC: Spec = Spec {
        name: "model.pem",
        version: 2,
        summary: "identifies a state-space model in innovations form by the prediction error method",
        inputs: &[PAIR.spec()],
        outputs: &[MODEL.spec(), RESIDUALS.spec(), SUMMARY.spec()],
        caching: Caching::Stored,
        seeded: false,
        source: "Stark et al., Rev. Sci. Instrum. 2005, Eq. 8; L. Ljung, System Identification, 1999",
    };

    fn check(&self) -> Result<(), StageError> {
        within("order", self.order, 1, 40)?;
        within("block_rows", self.block_rows, self.order + 1, 1000)?;
        within("max_iterations", self.max_iterations, 1, 10_000)?;
        within("test_lags", self.test_lags, 1, 1000)?;
        match self.before_s {
            Some(before) if !(before > 0.0 && before.is_finite()) => {
                Err(StageError::new(format!("`before_s` is {before}, wanted above 0")))
            }
            _ => Ok(()),
        }
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let pair = inputs.get(&PAIR)?;
        self.require_set(pair)?;
        let rate = pair.number("sample_rate_hz")?;
        let first = self.first_sample(pair, rate)?;
        let suffix = self.set.suffix();
        let input = &pair.real(&format!("force{suffix}"))?[first..];
        let output = &pair.real(&format!("response{suffix}"))?[first..];
        let fit =
            identify(&[Experiment { input, output }], 1.0 / rate, &self.options()).map_err(StageError::from_error)?;
        if !fit.verdict.converged {
            cx.warn(format!(
                "no minimum after {} iterations: the gradient is {:.1e} of the residual, {:.2} standard errors; try another order",
                fit.verdict.iterations,
                fit.verdict.gradient,
                fit.verdict.gradient * (output.len() as f64).sqrt(),
            ));
        }
        if fit.verdict.at_limit > 0 {
            cx.warn(format!(
                "{} coordinates at their limit: a pole that does not decay; a lower order may do",
                fit.verdict.at_limit
            ));
        }
        let time = pair.axis("time")?.values[first..].to_vec();
        let summary = self.summary(&fit, input, output, first)?;
        let mut model = state_space(&fit, suffix, first)?;
        // what the model cannot know: `model.modes` counts it in the shares
        if let Some(ambiguity) = pair.attributes.get("t0_ambiguity_s") {
            model.attributes.insert("t0_ambiguity_s".to_owned(), ambiguity.clone());
        }
        let residual = fit.residuals.into_iter().next().unwrap_or_default();
        let prediction = output.iter().zip(&residual).map(|(y, e)| y - e).collect::<Vec<f64>>();
        let residuals = Array::over(vec![Axis::new("time", "s", "time since t0", time)])
            .with("residual", "V", "one-step prediction error", &["time"], residual)
            .with("prediction", "V", "response predicted one sample ahead", &["time"], prediction)
            .attribute("sample_rate_hz", rate);
        Ok(Ports::new().with(&MODEL, model).with(&RESIDUALS, residuals).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::pem()
    }
}

impl Pem {
    fn options(&self) -> PemOptions {
        PemOptions {
            order: self.order,
            block_rows: self.block_rows,
            max_iterations: self.max_iterations,
            offset: self.offset,
            slope: self.drift,
            noise: match self.noise {
                NoiseKind::Thermal => NoiseModel::Thermal,
                NoiseKind::Free => NoiseModel::Free,
                NoiseKind::White => NoiseModel::White,
            },
            ..PemOptions::default()
        }
    }

    /// Errors: a half is asked for, and the pair has none.
    fn require_set(&self, pair: &Array) -> Result<(), StageError> {
        let suffix = self.set.suffix();
        if suffix.is_empty() || pair.variable(&format!("force{suffix}")).is_ok() {
            return Ok(());
        }
        let half = suffix.trim_start_matches('_');
        let events = match pair.attributes.get("count").and_then(Attribute::as_f64) {
            Some(count) => format!(", made from {count} events"),
            None => String::new(),
        };
        Err(StageError::new(format!("`set` is \"{half}\", but the pair has no halves{events}")).help(format!(
            "set `split = true` in the stage `ensemble.average`; it splits {LEAST_EVENTS} events or more. With fewer, fit all of them: `set = \"all\"`"
        )))
    }

    fn first_sample(&self, pair: &Array, rate: f64) -> Result<usize, StageError> {
        let Some(before) = self.before_s else { return Ok(0) };
        let first = pair.number("t0_sample")? - (before * rate).ceil();
        Ok(first.clamp(0.0, pair.axis("time")?.values.len() as f64) as usize)
    }

    fn summary(&self, fit: &Identified, input: &[f64], output: &[f64], first: usize) -> Result<Document, StageError> {
        let residual = fit.residuals.first().map_or(&[][..], Vec::as_slice);
        let predicted: Vec<f64> = output.iter().zip(residual).map(|(y, e)| y - e).collect();
        let lags = self.test_lags + self.order;
        let test = |result: Result<TestResult, super::ModelError>| {
            result.map_or(
                json!(null),
                |t| json!({ "statistic": t.statistic, "freedom": t.freedom, "p_value": t.p_value }),
            )
        };
        let verdict = &fit.verdict;
        let samples = output.len() as f64;
        Document::new(&json!({
            "order": self.order,
            "set": self.set,
            "samples": output.len(),
            "first_sample": first,
            "converged": verdict.converged,
            "ending": ending(verdict.ending),
            "iterations": verdict.iterations,
            "gradient_standard_errors": verdict.gradient * samples.sqrt(),
            "coordinates_at_limit": verdict.at_limit,
            "innovation_std": { "value": fit.innovation_variance.sqrt(), "unit": "V" },
            "prediction_fit_percent": fit_percent(output, &predicted).ok(),
            "offset_v": fit.offsets.first(),
            "drift_v_per_s": fit.slopes.first(),
            "whiteness": test(whiteness(residual, lags, self.order)),
            "input_dependence": test(input_dependence(input, residual, lags)),
            "singular_values": fit.singular_values,
        }))
    }
}

fn ending(ending: Ending) -> &'static str {
    match ending {
        Ending::Minimum => "minimum",
        Ending::Exact => "exact",
        Ending::Stalled => "stalled",
        Ending::IterationLimit => "iteration-limit",
    }
}

fn within(name: &str, value: usize, least: usize, most: usize) -> Result<(), StageError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(StageError::new(format!("`{name}` is {value}, wanted {least} to {most}")))
}

/// The artifact: matrices in the sections' observer form, parameters a, b, d with their covariance.
fn state_space(fit: &Identified, suffix: &str, first: usize) -> Result<StateSpace, StageError> {
    let model = &fit.model;
    let n = model.order();
    let (a, b, c, k) = model.matrices();
    let names =
        (1..=n).map(|i| format!("a{i}")).chain((1..=n).map(|i| format!("b{i}"))).chain(["d".to_owned()]).collect();
    let count = 2 * n + 1;
    let values =
        (0..count).flat_map(|i| (0..count).map(move |j| (i, j))).map(|(i, j)| fit.covariance[(i, j)]).collect();
    let mut artifact = StateSpace {
        a: Matrix::new(n, n, (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| a[(i, j)]).collect())?,
        b: Matrix::column(b),
        c: Matrix::row(c),
        d: Matrix::row(vec![model.feedthrough]),
        k: Matrix::column(k),
        x0: fit.initial_states.first().cloned().unwrap_or_default(),
        sample_time_s: model.sample_time_s,
        innovation_variance: fit.innovation_variance,
        parameter_names: names,
        parameters: model.parameters(),
        covariance: Matrix::new(count, count, values)?,
        ..StateSpace::default()
    };
    let set = suffix.trim_start_matches('_');
    artifact.attributes.insert("set".to_owned(), if set.is_empty() { "all" } else { set }.into());
    artifact.attributes.insert("first_sample".to_owned(), first.into());
    artifact.attributes.insert("converged".to_owned(), fit.verdict.converged.into());
    artifact.attributes.insert("offset_v".to_owned(), fit.offsets.first().copied().unwrap_or(0.0).into());
    artifact.attributes.insert("drift_v_per_s".to_owned(), fit.slopes.first().copied().unwrap_or(0.0).into());
    Ok(artifact)
}

#[cfg(test)]
#[test]
fn a_half_that_the_pair_does_not_have_is_refused_with_what_to_do() {
    let pair = Array::over(vec![Axis::new("time", "s", "time", vec![0.0; 64])])
        .with("response", "V", "response", &["time"], vec![0.0; 64])
        .with("force", "V", "force", &["time"], vec![0.0; 64])
        .attribute("sample_rate_hz", 5e6)
        .attribute("count", 3.0);
    let cx = Context::new(std::path::Path::new("."), 0, &afmid_pipeline::stage::NoProgress);
    let stage = Pem { set: DataSet::Identification, ..Pem::default() };
    let error = stage.run(&Ports::new().with(&PAIR, pair), &cx).unwrap_err();
    assert_eq!(error.problem, "`set` is \"identification\", but the pair has no halves, made from 3 events");
    let help = error.help.unwrap_or_default();
    assert!(help.contains("split = true") && help.contains("ensemble.average") && help.contains("4 events"), "{help}");
}
