//! The stage `model.pem`.

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, StateSpace,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::excitation::{require_a_change, require_more_than_a_sine};
use super::order::{Order, choice_document, simulated_percent};
use super::whiteness::{coloured, residual_share, test_document};
use crate::artifacts::{DataSet, Pair, PairSeries, SAMPLE_RATE_HZ, state_nuisances, state_space, state_t0_ambiguity};
use crate::ensemble::LEAST_EVENTS;
use crate::watched::{Watched, watch};
use afmid_kernels::model::ModelError;
use afmid_kernels::pem::{Ending, Experiment, Focus, Identified, NoiseModel, PemOptions, identify};
use afmid_kernels::validation::{
    Nuisances, OrderChoice, TestResult, choose_order, fit_percent, input_dependence, whiteness,
};

/// A residual test, or why there is none.
type Tested = Result<TestResult, ModelError>;

/// Identifies a state-space model in innovations form from force and response.
///
/// Model: Eq. 8, x(t+Ts) = A x + B u + K e, y = C x + D u + e + offset + drift; the initial state is estimated along.
/// Method: minimum of the squared one-step prediction errors by Levenberg-Marquardt with analytic sensitivities; all
/// that enters linearly is eliminated exactly. Poles and predictor are stable by construction: sections of second order
/// in reflection coefficients. Starts from subspace estimates of the wanted order and of up to six less. The model is
/// one in discrete time: an input that is held between samples and one that runs linearly give the same poles and other
/// B and D, which are free, so that both are fitted exactly and the data cannot tell them apart; poles and errors are
/// right for either. A band-limited input is fitted approximately (`model.grey` has it exactly).
/// Shapes: `residual`, `prediction` over time; A order x order; covariance of the 2 order + 1 parameters of A, B and D.
/// Several inputs (`force` over `input` and time) give B and D as many columns.
/// Units: volts to volts where the force is given as static deflection.
/// Accuracy: the Cramer-Rao bound within some per cent where the noise is white plus thermal. The covariance follows
/// the residual's own spectrum, so wander that the model leaves is counted.
/// Errors: too few samples for the order, values that are not finite, a response that is constant; an input that is one
/// sine, of which nothing else shows in the output; missing outputs,
/// unless the errors that are made small are those of the simulation without noise filter (`noise = "white"`), which
/// leaves them out. No convergence is a warning, and so is a residual that is not white (Ljung-Box, p < 0.001).
/// Source: Stark et al. 2005, Eq. 8; L. Ljung, System Identification, 1999, chapters 7 and 10.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Pem {
    /// Number of states, 1 to 40, or `auto`: the smallest up to `max_order` whose simulation of the last third of the
    /// data, fitted on the rest, is within a standard error of the best; after a release the least BIC. Not fitted are
    /// orders whose start lacks a mode, and those above one whose errors are white and independent of the input. Why: as
    /// in the paper: four modes and three detector poles.
    pub order: Order,
    /// Largest order that `auto` tries. Why: each may take a fit.
    #[schemars(range(min = 1, max = 40))]
    pub max_order: usize,
    /// Which events: `all`, or one half (`identification`, `verification`).
    pub set: DataSet,
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: PemOptions,
    /// Seconds before t0 that are used. Absent: all of them. After a snap-in a few periods suffice: before it the lever
    /// is another system.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub before_s: Option<f64>,
    /// Lags of the residual tests, beyond the order.
    #[schemars(range(min = 1, max = 1000))]
    pub test_lags: usize,
}

impl Default for Pem {
    fn default() -> Self {
        Self {
            order: Order::Fixed(11),
            max_order: 16,
            set: DataSet::All,
            fit: PemOptions::default(),
            before_s: None,
            test_lags: 25,
        }
    }
}

pub(super) const PAIR: Port<Array> = Port::new("pair", "pair", "force and response over time since t0");
pub(super) const MODEL: Port<StateSpace> =
    Port::new("model", "model", "the model, with the covariance of its parameters");
pub(super) const RESIDUALS: Port<Array> =
    Port::new("residuals", "residuals", "prediction errors and predictions over time");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "convergence, fits of the data that it was fitted to, residual tests");

impl Stage for Pem {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.pem",
        version: 14,
        summary: "identifies a state-space model in innovations form by the prediction error method",
        inputs: &[PAIR.spec()],
        outputs: &[MODEL.spec(), RESIDUALS.spec(), SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Eq. 8; L. Ljung, System Identification, 1999",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (rows, least) = (self.fit.block_rows, self.order.largest(self.max_order) + 1);
        faults.require(rows >= least, || format!("`block_rows` is {rows}, wanted {least} to 1000"));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let pair = Pair::new(inputs.get(&PAIR)?);
        self.require_set(&pair)?;
        let (rate, first) = (pair.sample_rate_hz()?, pair.first_sample(self.before_s)?);
        let PairSeries { input, output, time, unit, .. } = pair.series(self.set, first)?;
        require_a_change(&input)?;
        require_more_than_a_sine(&input, &output, rate)?;
        let experiment = Experiment { input: &input, output: &output };
        let choice = match self.order {
            Order::Fixed(_) => None,
            Order::Auto => {
                let options = self.options(self.max_order, cx);
                Some(choose_order(experiment, 1.0 / rate, self.max_order, &options, &Watched(cx)))
            }
        };
        let choice = choice.transpose().map_err(StageError::from_error)?;
        let order = choice.as_ref().map_or(self.order.largest(0), |choice| choice.order);
        let fit = identify(&[experiment], 1.0 / rate, &self.options(order, cx)).map_err(StageError::from_error)?;
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
        let tests = self.tests(&fit, &input, &output);
        let share = residual_share(fit.residuals.first().map_or(&[], Vec::as_slice), &output);
        if let Some(warning) = coloured(&tests.0, share, self.remedy()) {
            cx.warn(warning);
        }
        let summary = self.summary(&fit, choice.as_ref(), (&input, &output, &unit), first, &tests)?;
        let mut model = state_space(&fit, self.set, first)?;
        state_nuisances(&mut model, Nuisances { offset: self.fit.offset, slope: self.fit.drift });
        state_t0_ambiguity(&mut model, pair.t0_ambiguity_s());
        pair.rate_error().state_in(&mut model);
        let residual = fit.residuals.into_iter().next().unwrap_or_default();
        let prediction = output.iter().zip(&residual).map(|(y, e)| y - e).collect::<Vec<f64>>();
        let residuals = Array::over(vec![Axis::new("time", "s", "time since t0", time)])
            .with("residual", &unit, "one-step prediction error", &["time"], residual)
            .with("prediction", &unit, "response predicted one sample ahead", &["time"], prediction)
            .attribute(SAMPLE_RATE_HZ, rate);
        Ok(Ports::new().with(&MODEL, model).with(&RESIDUALS, residuals).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::pem()
    }
}

impl Pem {
    fn options(&self, order: usize, cx: &Context) -> PemOptions {
        PemOptions { order, watch: watch(cx), ..self.fit.clone() }
    }

    /// Errors: a half is asked for, and the pair has none.
    fn require_set(&self, pair: &Pair<'_>) -> Result<(), StageError> {
        if self.set == DataSet::All || pair.has(self.set) {
            return Ok(());
        }
        let half = self.set.name();
        let events = match pair.count(DataSet::All) {
            Some(count) => format!(", made from {count} events"),
            None => String::new(),
        };
        Err(StageError::new(format!("`set` is \"{half}\", but the pair has no halves{events}")).help(format!(
            "set `split = true` in the stage `ensemble.average`; it splits {LEAST_EVENTS} events or more. With fewer, fit all of them: `set = \"all\"`"
        )))
    }

    /// Whiteness of the residual, and what of the first input is left in it.
    fn tests(&self, fit: &Identified, input: &[f64], output: &[f64]) -> (Tested, Tested) {
        let residual = fit.residuals.first().map_or(&[][..], Vec::as_slice);
        let first = input.get(..output.len()).unwrap_or(input);
        let lags = self.test_lags + fit.noise_parameters;
        let delays = self.test_lags + fit.model.order();
        (whiteness(residual, lags, fit.noise_parameters), input_dependence(first, residual, delays))
    }

    /// What to do about a residual that is not white.
    fn remedy(&self) -> &'static str {
        match (self.fit.noise, self.fit.focus) {
            (NoiseModel::White, _) | (_, Focus::Simulation) => {
                "standard errors follow its spectrum, but the fit is not the most efficient: try a higher order, or a noise model (`noise`, `focus`)"
            }
            _ => {
                "standard errors follow its spectrum, but modes or noise are missing in the model: try a higher order or another `noise`"
            }
        }
    }

    fn summary(
        &self,
        fit: &Identified,
        choice: Option<&OrderChoice>,
        (input, output, unit): (&[f64], &[f64], &str),
        first: usize,
        tests: &(Tested, Tested),
    ) -> Result<Document, StageError> {
        let residual = fit.residuals.first().map_or(&[][..], Vec::as_slice);
        let predicted: Vec<f64> = output.iter().zip(residual).map(|(y, e)| y - e).collect();
        let nuisances = Nuisances { offset: self.fit.offset, slope: self.fit.drift };
        let verdict = &fit.verdict;
        let samples = output.len() as f64;
        Document::new(&json!({
            "order": fit.model.order(),
            "order_choice": choice.map(choice_document),
            "set": self.set,
            "samples": output.len(),
            "first_sample": first,
            "converged": verdict.converged,
            "ending": ending(verdict.ending),
            "iterations": verdict.iterations,
            "gradient_standard_errors": verdict.gradient * samples.sqrt(),
            "coordinates_at_limit": verdict.at_limit,
            "innovation_std": { "value": fit.innovation_variance.sqrt(), "unit": unit },
            "prediction_fit_percent": fit_percent(output, &predicted).ok(),
            "simulation_fit_percent": simulated_percent(fit, input, output, nuisances),
            "offset_v": fit.offsets.first(),
            "drift_v_per_s": fit.slopes.first(),
            "whiteness": test_document(&tests.0),
            "input_dependence": test_document(&tests.1),
            "singular_values": fit.singular_values,
        }))
    }
}

pub(super) fn ending(ending: Ending) -> &'static str {
    match ending {
        Ending::Minimum => "minimum",
        Ending::Exact => "exact",
        Ending::Stalled => "stalled",
        Ending::IterationLimit => "iteration-limit",
    }
}

#[cfg(test)]
#[test]
fn a_half_that_the_pair_does_not_have_is_refused_with_what_to_do() {
    let pair = Array::over(vec![Axis::new("time", "s", "time", vec![0.0; 64])])
        .with("response", "V", "response", &["time"], vec![0.0; 64])
        .with("force", "V", "force", &["time"], vec![0.0; 64])
        .attribute("sample_rate_hz", 5e6)
        .attribute("count", 3.0);
    let stage = Pem { set: DataSet::Identification, ..Pem::default() };
    let error = stage.run(&Ports::new().with(&PAIR, pair), &Context::alone(0)).unwrap_err();
    assert_eq!(error.problem, "`set` is \"identification\", but the pair has no halves, made from 3 events");
    let help = error.help.unwrap_or_default();
    assert!(help.contains("split = true") && help.contains("ensemble.average") && help.contains("4 events"), "{help}");
}
