//! The stage `model.vector_fitting`.

use afmid_kernels::spectra::{Intersample, Presence};
use afmid_pipeline::{Array, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, StateSpace};
use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::realised::MODEL;
use crate::artifacts::{DataSet, RateError, Transfer, state_space};
use afmid_kernels::pem::{Ending, Identified, Verdict};
use afmid_kernels::vector_fitting::{MeasuredResponse, VectorFit, VectorFitting, vector_fitting};

/// Fits a rational transfer function to a frequency response: relaxed vector fitting in the z plane.
///
/// Model: G(z) = sum c / (z - p) + d at z = exp(i w Ts), plus noise of the variance given; with a transient, exp(i w
/// t0) T(z) of the same poles. The hold's lag and droop, which the spectrum stages took out, are put back first: a
/// sampled decay is rational in z, not in s.
/// Method: poles relocated to the zeros of sigma(z) until they settle (Gustavsen 2006), from three sets of starting
/// poles; then, unless `refine` is false, Gauss-Newton on the weighted error. Poles outside the unit circle are kept,
/// with a warning, unless `stable` is true.
/// Shapes: as `model.pem`; one input. K, x0, offset and drift are zero: a spectrum does not hold them; nor does it hold
/// the variance of e, which is NaN.
/// Units: the response's.
/// Accuracy: rounding without noise. With `refine` the maximum of the likelihood for the variance given, on the paper's
/// lever with 0.2 to 0.4 of the errors of `model.subspace` and 0.6 to 0.8 of those of `model.era`, without bias over 40
/// seeds (test); plain vector fitting is up to a seventh worse, since sigma weights the noise. The covariance is that
/// of the last weighted least squares times the misfit; of a smoothed response also times the correlation of
/// neighbouring residuals, which leaves them some 1.7 times too large (8 seeds, test). Window ends that no transient
/// describes (tapered series) are model error and in no error bar.
/// Errors: a response with fewer defined bins than coefficients; a transient for a response that does not say when the
/// event was.
/// Source: B. Gustavsen, IEEE Trans. Power Delivery 21 (2006) 1587; B. Gustavsen and A. Semlyen, ibid. 14 (1999) 1052.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct VectorFittingEstimate {
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: VectorFitting,
    /// Lowest frequency that is used, in Hz.
    #[schemars(range(min = 0.0))]
    pub min_frequency_hz: f64,
    /// Highest frequency that is used, in Hz, above the lowest. Absent: all that is defined.
    pub max_frequency_hz: Option<f64>,
    /// How bins count: `variance` (each by its own) or `uniform`.
    pub weight: ResponseWeight,
    /// What the force does between samples: `held` or `sampled`, as in the stage that made the response. Why: as there.
    pub intersample: Intersample,
    /// What the ends of the window add: `auto` (fitted for a response from differences that is not smoothed), `on` or
    /// `off`.
    pub transient: Presence,
}

/// How bins count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ResponseWeight {
    /// By the response's own variance.
    Variance,
    /// All alike.
    Uniform,
}

impl Default for VectorFittingEstimate {
    fn default() -> Self {
        Self {
            fit: VectorFitting::default(),
            min_frequency_hz: 0.0,
            max_frequency_hz: None,
            weight: ResponseWeight::Variance,
            intersample: Intersample::Held,
            transient: Presence::Auto,
        }
    }
}

pub(super) const TRANSFER: Port<Array> =
    Port::new("transfer", "transfer", "transfer function and its variance over frequency");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "order, pairs, fit of the response, convergence");

impl Stage for VectorFittingEstimate {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.vector_fitting",
        version: 3,
        summary: "fits a rational transfer function to a frequency response: relaxed vector fitting in z",
        inputs: &[TRANSFER.spec()],
        outputs: &[MODEL.spec(), SUMMARY.spec()],
        source: "B. Gustavsen, IEEE Trans. Power Delivery 21 (2006) 1587",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (modes, most) = (self.fit.modes.unwrap_or(0), self.fit.order / 2);
        faults.require(modes <= most, || format!("`modes` is {modes}, wanted at most half the order, {most}"));
        let (low, high) = (self.min_frequency_hz, self.max_frequency_hz.unwrap_or(f64::MAX));
        faults.require(high > low && high.is_finite(), || {
            format!("`max_frequency_hz` is {high}, wanted above `min_frequency_hz`, {low}")
        });
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let given = Transfer::new(inputs.get(&TRANSFER)?)?;
        let rate_error = RateError::of(inputs.get(&TRANSFER)?);
        let (frequency_hz, rate) = (given.frequency_hz, given.sample_rate_hz);
        let (transfer, variance) = self.sequences(&given);
        let settings = self.settings(&given)?;
        let weighted = self.weight == ResponseWeight::Variance;
        let response = MeasuredResponse { frequency_hz, transfer: &transfer, variance: Some(&variance) };
        let fit = vector_fitting(response, 1.0 / rate, &settings).map_err(|error| {
            StageError::from_error(error).help("a lower `order`, or a wider band in the stage that made the response")
        })?;
        let pairs = fit.model.sections.iter().flat_map(|s| s.poles()).filter(|z| z.im > 0.0).count();
        self.warn(&fit, pairs, cx);
        let summary = Document::new(&json!({
            "order": self.fit.order,
            "pairs": pairs,
            "real_poles": self.fit.order - 2 * pairs,
            "bins": fit.points,
            "weight": if weighted { "variance" } else { "uniform" },
            "transient": settings.transient_delay_s.is_some(),
            "response_fit_percent": fit.fit_percent,
            "misfit": fit.misfit,
            "correlation_factor": fit.correlation_factor,
            "iterations": fit.iterations,
            "converged": fit.converged,
            "gradient": fit.gradient,
            "unstable_poles": fit.unstable,
        }))?;
        let mut model = artifact(fit)?;
        rate_error.state_in(&mut model);
        Ok(Ports::new().with(&MODEL, model).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::vector_fitting()
    }
}

impl VectorFittingEstimate {
    /// Transfer function from sequence to sequence, and its variance; undefined outside the band.
    fn sequences(&self, given: &Transfer<'_>) -> (Vec<c64>, Vec<f64>) {
        let (frequency_hz, rate) = (given.frequency_hz, given.sample_rate_hz);
        let high = self.max_frequency_hz.unwrap_or(f64::INFINITY);
        // of differences a drift is a constant: it sits in the bin at zero alone, and nowhere else
        let differenced = given.differenced();
        let used = |f: f64| (self.min_frequency_hz..=high).contains(&f) && !(differenced && f == 0.0);
        let held = |f: f64| self.intersample.correction(f, 1.0 / rate);
        let nothing = c64::new(f64::NAN, f64::NAN);
        let transfer = frequency_hz
            .iter()
            .zip(given.transfer)
            .map(|(&f, g)| if used(f) { c64::new(g.re, g.im) / held(f) } else { nothing })
            .collect();
        let own = |(&f, &v): (&f64, &f64)| match self.weight {
            ResponseWeight::Variance => v / held(f).norm_sqr(),
            ResponseWeight::Uniform => 0.0,
        };
        (transfer, frequency_hz.iter().zip(given.variance).map(own).collect())
    }

    fn settings(&self, given: &Transfer<'_>) -> Result<VectorFitting, StageError> {
        let smoothed = given.half_width_bins()?;
        let differenced = given.differenced();
        let wanted = self.transient.given().unwrap_or(differenced && smoothed.is_none());
        let width = match given.frequency_hz {
            [first, second, ..] => second - first,
            _ => f64::NAN,
        };
        let delay = if wanted { Some(given.event_turns_per_bin()? / width) } else { None };
        // two estimates share data as far as both reach
        let reach = |values: &[f64]| values.iter().filter(|h| h.is_finite()).fold(0.0_f64, |most, h| most.max(*h));
        Ok(VectorFitting {
            transient_delay_s: delay,
            correlated_bins: smoothed.map_or(0, |bins| 2 * reach(bins) as usize),
            ..self.fit.clone()
        })
    }

    fn warn(&self, fit: &VectorFit, pairs: usize, cx: &Context) {
        if !fit.converged && self.fit.refine {
            cx.warn(format!(
                "the poles did not settle in {} steps: the gradient is {:.1e} of the residual; another order may do",
                fit.iterations, fit.gradient
            ));
        }
        if fit.unstable > 0 {
            cx.warn(format!(
                "{} of {} poles lie outside the unit circle; a lower order may do, or `stable = true`",
                fit.unstable, self.fit.order
            ));
        }
        if let Some(modes) = self.fit.modes.filter(|modes| *modes != pairs) {
            cx.warn(format!(
                "{modes} oscillating pairs were wanted, the response has {pairs} at order {}",
                self.fit.order
            ));
        }
    }
}

/// The artifact, in the layout of `model.pem`.
fn artifact(fit: VectorFit) -> Result<StateSpace, StageError> {
    let order = fit.model.order();
    let poles = fit.model.sections.iter().flat_map(|section| section.poles()).collect();
    let identified = Identified {
        model: fit.model,
        further_inputs: Vec::new(),
        initial_states: vec![vec![0.0; order]],
        offsets: Vec::new(),
        slopes: Vec::new(),
        residuals: Vec::new(),
        noise_parameters: 0,
        innovation_variance: f64::NAN,
        covariance: fit.covariance,
        predictor_poles: poles,
        singular_values: Vec::new(),
        verdict: Verdict {
            ending: if fit.converged { Ending::Minimum } else { Ending::Stalled },
            converged: fit.converged,
            iterations: fit.iterations,
            gradient: fit.gradient,
            at_limit: 0,
        },
    };
    state_space(&identified, DataSet::All, 0)
}

#[cfg(test)]
mod tests;
