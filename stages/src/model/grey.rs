//! The stage `model.grey`.

mod between;
mod rate_error;
mod tables;
#[cfg(test)]
mod tests;

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, StateSpace, Table,
};
use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use self::between::{between_document, name_of};
use self::rate_error::widen;
use self::tables::{mode_table, named, parameter_table, static_gain, with_interval};
use super::excitation::require_more_than_a_sine;
use super::known::KnownNumber;
use super::order::simulated_percent;
use super::pem::{MODEL, PAIR, RESIDUALS, SUMMARY, ending};
use super::whiteness::{coloured, residual_share, test_document};
use crate::artifacts::{
    DataSet, Pair, PairSeries, SAMPLE_RATE_HZ, innovations, mode_document, state_nuisances, state_space,
    state_t0_ambiguity,
};
use afmid_kernels::grey::{Grey, GreyHold, GreyOptions, GreyQuantity, GreyStart, fit_grey};
use afmid_kernels::model::ModelError;
use afmid_kernels::pem::{Experiment, Identified, ResidualColour};
use afmid_kernels::validation::{Nuisances, TestResult, fit_percent, simulate_held_out, whiteness};

/// Fits modes, real poles, delay and feedthrough to force and response: the grey modal form.
///
/// Model: G(s) = exp(-s d) [sum g_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) + d0] prod p_k / (s + p_k); y = G u + offset +
/// drift + e, with e unfiltered (output error). The delay may be any part of a sample; several inputs (`force` over
/// `input` and time) have gains and d0 each and share the rest.
/// Method: each partial fraction discretised for the force between its samples, delay included: in closed form
/// (modified z-transform) for a held or linear force, by quadrature under a windowed-sinc interpolation for a
/// band-limited one. With `between = "auto"` each is fitted from the held force's minimum, and the likeliest is taken
/// if twice its log likelihood is 3.84 above that of held (chi-square 95 %, one degree of freedom: a wrong one is taken
/// in at most 2.5 %); the noise is taken as autoregressive there, order by BIC; `input_between_samples` in the summary
/// has the figures. Gains, d0, offset, drift and initial state by variable projection, the rest by Levenberg-Marquardt
/// with analytic slopes. Starts from subspace estimates, given modes or the poles of the model on port `start`, and a
/// grid of real poles and delays. Missing responses are left out.
/// Shapes: `modes` by mode, `parameters` by parameter; `residual` and `prediction` (here the simulation) over time;
/// `model` as of `model.pem`, with one or two poles at z = 0 for the delay.
/// Units: Hz, seconds; gains in volts per volt where the force is given as static deflection.
/// Accuracy: the Cramer-Rao bound in white noise, unbiased, 95 % intervals that hold (docs/results/grey.md); the errors
/// follow the residual's own spectrum, but under thermal noise `model.ringdown` is more precise. A delay is
/// distinguished from a real pole by the shape of the first samples alone: the errors say how well. `model` is exact up
/// to two samples of delay, beyond which whole samples are reported as `dead_samples` and warned of. For a band-limited
/// force, whose response no causal model of finite order has, it is the closest one up to 0.9 of half the sample rate,
/// and its error is warned of.
/// Errors: too few samples, values that are not finite, a response that is constant, fewer oscillations than `modes`,
/// knowledge of what is not fitted. No convergence is a warning, and so are a number on a bound, whose error is
/// unknown, and a residual that is not white (Ljung-Box, p < 0.001).
/// Source: L. Ljung, System Identification, 1999, chapters 4 and 7; G. Golub and V. Pereyra, Inverse Problems 19 (2003)
/// R1; E. I. Jury, Theory and Application of the z-Transform Method, 1964.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct GreyEstimate {
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: GreyOptions,
    /// Which events: `all`, or one half (`identification`, `verification`).
    pub set: DataSet,
    /// Seconds before t0 that are used. Absent: all of them.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub before_s: Option<f64>,
    /// What is known beforehand, such as `{ quantity = "delay_s", fixed = 1e-6 }`, `{ quantity = "gain", mode = 2,
    /// between = [0.0, 0.2] }` or `{ quantity = "corner_hz", real_pole = 1, about = [1.3e6, 1e5] }`.
    pub known: Vec<KnownNumber>,
    /// Modes to start from, `[frequency in Hz, quality factor]` each, as many as `modes`. None: from the port `start`
    /// or from subspace estimates.
    pub start_modes: Vec<[f64; 2]>,
    /// Standard errors for `white` residuals or by the residual's own spectrum. Why: by the spectrum.
    pub coloured: bool,
}

impl Default for GreyEstimate {
    fn default() -> Self {
        Self {
            fit: GreyOptions::default(),
            set: DataSet::All,
            before_s: None,
            known: Vec::new(),
            start_modes: Vec::new(),
            coloured: true,
        }
    }
}

const START: Port<StateSpace> = Port::optional("start", "model", "a model whose poles the search starts from");
const MODES: Port<Table> = Port::new("modes", "modes", "the modes, ascending as started");
const PARAMETERS: Port<Table> =
    Port::new("parameters", "grey-parameters", "all numbers of the grey form, with their errors");

impl Stage for GreyEstimate {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.grey",
        version: 10,
        summary: "fits modes, real poles, delay and feedthrough: the grey modal form",
        inputs: &[PAIR.spec(), START.spec()],
        outputs: &[MODEL.spec(), RESIDUALS.spec(), SUMMARY.spec(), MODES.spec(), PARAMETERS.spec()],
        source: "L. Ljung, System Identification, 1999; G. Golub and V. Pereyra, Inverse Problems 19 (2003) R1",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (rows, least) = (self.fit.block_rows, 2 * self.fit.modes + self.fit.real_poles + 6);
        faults.require(rows >= least, || format!("`block_rows` is {rows}, wanted {least} to 1000"));
        let (found, modes) = (self.start_modes.len(), self.fit.modes);
        faults.require(found == 0 || found == modes, || {
            format!("`start_modes` has {found}, wanted {modes} as `modes` says, or none")
        });
        for [f, q] in &self.start_modes {
            faults.require(*f > 0.0 && *q > 0.5 && f.is_finite() && q.is_finite(), || {
                format!("`start_modes` has [{f}, {q}], wanted a frequency above 0 and a quality factor above 0.5")
            });
        }
        faults.take(self.check_known());
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let pair = Pair::new(inputs.get(&PAIR)?);
        let (rate, first) = (pair.sample_rate_hz()?, pair.first_sample(self.before_s)?);
        let series = pair.series(self.set, first)?;
        let options = self.options(inputs.find(&START)?)?;
        if let Err(one) = require_more_than_a_sine(&series.input, &series.output, rate) {
            cx.warn(one.problem);
        }
        let experiment = Experiment { input: &series.input, output: &series.output };
        let mut fit = fit_grey(&[experiment], 1.0 / rate, &options).map_err(StageError::from_error)?;
        widen(&mut fit, series.rate_error);
        let test = residual_test(&fit);
        self.warn(&fit, &test, &series.output, cx);
        let identified = identified(&fit, &series)?;
        let mut model = state_space(&identified, self.set, first)?;
        state_nuisances(&mut model, Nuisances { offset: self.fit.offset, slope: self.fit.drift });
        state_t0_ambiguity(&mut model, pair.t0_ambiguity_s());
        series.rate_error.state_in(&mut model);
        model.attributes.insert("delay_s".to_owned(), fit.model.delay_s.into());
        model.attributes.insert("input_between_samples".to_owned(), name_of(fit.model.between).into());
        model.attributes.insert("dead_samples".to_owned(), fit.discrete.dead_samples.into());
        let summary = self.summary(&fit, &test, (&identified, &series), first)?;
        let residual = fit.experiments.first().map_or_else(Vec::new, |own| own.residual.clone());
        let prediction = series.output.iter().zip(&residual).map(|(y, e)| y - e).collect::<Vec<f64>>();
        let residuals = Array::over(vec![Axis::new("time", "s", "time since t0", series.time.clone())])
            .with("residual", &series.unit, "response less simulation", &["time"], residual)
            .with("prediction", &series.unit, "response simulated from the force", &["time"], prediction)
            .attribute(SAMPLE_RATE_HZ, rate);
        Ok(Ports::new()
            .with(&MODEL, model)
            .with(&RESIDUALS, residuals)
            .with(&SUMMARY, summary)
            .with(&MODES, mode_table(&fit))
            .with(&PARAMETERS, parameter_table(&fit)))
    }

    fn examples() -> Vec<Example> {
        super::example::grey()
    }
}

impl GreyEstimate {
    fn check_known(&self) -> Result<(), StageError> {
        let known = self.known.iter().map(KnownNumber::of_grey).collect::<Result<Vec<_>, _>>()?;
        for (i, entry) in known.iter().enumerate() {
            let name = named(entry.quantity).0;
            if known[..i].iter().any(|other| other.quantity == entry.quantity) {
                return Err(StageError::new(format!("`known` has two entries for {name}")));
            }
            let there = match entry.quantity {
                GreyQuantity::Frequency(n) | GreyQuantity::QualityFactor(n) | GreyQuantity::Gain { mode: n, .. } => {
                    n < self.fit.modes
                }
                GreyQuantity::RealPole(k) => k < self.fit.real_poles,
                GreyQuantity::Delay => self.fit.delay,
                GreyQuantity::Feedthrough(_) => self.fit.feedthrough,
            };
            if !there {
                return Err(StageError::new(format!("`known` names the {name}, which is not fitted")));
            }
            if let Err(error) = entry.check() {
                return Err(StageError::new(format!("`known`, {name}: {error}")));
            }
        }
        Ok(())
    }

    fn options(&self, start: Option<&StateSpace>) -> Result<GreyOptions, StageError> {
        let start = match start {
            _ if !self.start_modes.is_empty() => GreyStart::Modes(self.start_modes.clone()),
            Some(model) => {
                let (model, _) = innovations(model)?;
                GreyStart::Poles(model.sections.iter().flat_map(|section| section.poles()).collect::<Vec<c64>>())
            }
            None => GreyStart::Subspace,
        };
        Ok(GreyOptions {
            known: self.known.iter().map(KnownNumber::of_grey).collect::<Result<_, _>>()?,
            start,
            colour: if self.coloured { ResidualColour::Spectrum } else { ResidualColour::White },
            ..self.fit.clone()
        })
    }

    fn warn(&self, fit: &Grey, test: &Result<TestResult, ModelError>, output: &[f64], cx: &Context) {
        let samples = output.len();
        if !fit.verdict.converged {
            cx.warn(format!(
                "no minimum after {} steps: {:.2} standard errors to go; try other modes, real poles or starts",
                fit.verdict.iterations,
                fit.verdict.gradient * (samples as f64).sqrt(),
            ));
        }
        for parameter in &fit.parameters {
            let (name, unit) = named(parameter.quantity);
            let value = parameter.estimate.value;
            if parameter.hold == GreyHold::Bound {
                cx.warn(format!("the {name} sits on a bound, at {value:.6e} {unit}: its error is unknown"));
            } else if parameter.hold == GreyHold::Free && parameter.estimate.std.is_nan() {
                cx.warn(format!("the data say nothing of the {name}: leave it out or give it"));
            }
        }
        let errors = if self.coloured { "follow its spectrum" } else { "do not count this (`coloured = true` does)" };
        let chosen = match fit.intersample {
            Some(_) => ", as which the choice of `between` counts it",
            None => "",
        };
        let remedy = format!(
            "standard errors {errors}, and what the model cannot follow is not noise{chosen}: try more modes or real poles, or `model.pem`"
        );
        let share = residual_share(fit.experiments.first().map_or(&[][..], |own| own.residual.as_slice()), output);
        if let Some(warning) = coloured(test, share, &remedy) {
            cx.warn(warning);
        }
        if fit.discrete.response_error > 0.0 {
            cx.warn(format!(
                "the force is band-limited between its samples: the model on port `model`, which is causal, has its response up to 0.9 of half the sample rate to {:.1e} rms; `parameters` and `modes` are exact",
                fit.discrete.response_error
            ));
        }
        if fit.discrete.dead_samples > 0 {
            cx.warn(format!(
                "the model comes {} whole samples before the delay of {:.4e} s: shift the force by them before it is simulated",
                fit.discrete.dead_samples, fit.model.delay_s
            ));
        }
    }

    fn summary(
        &self,
        fit: &Grey,
        test: &Result<TestResult, ModelError>,
        (identified, series): (&Identified, &PairSeries),
        first: usize,
    ) -> Result<Document, StageError> {
        let samples = series.output.len();
        let residual = fit.experiments.first().map_or(&[][..], |own| own.residual.as_slice());
        let present: Vec<usize> = (0..samples).filter(|&k| residual.get(k).is_some_and(|e| e.is_finite())).collect();
        let measured: Vec<f64> = present.iter().map(|&k| series.output[k]).collect();
        let simulated: Vec<f64> = present.iter().map(|&k| series.output[k] - residual[k]).collect();
        let nuisances = Nuisances { offset: self.fit.offset, slope: self.fit.drift };
        let shares = fit.static_shares(0);
        let modes: Vec<Value> = fit
            .modes()
            .iter()
            .zip(&shares)
            .map(|(mode, share)| {
                let mut document = mode_document(mode);
                document["static_share"] = share.value.into();
                document["static_share_std"] = share.std.into();
                document
            })
            .collect();
        let parameters: Vec<Value> = fit
            .parameters
            .iter()
            .map(|p| {
                let (name, unit) = named(p.quantity);
                json!({ "name": name, "unit": unit, "estimate": with_interval(p.estimate) })
            })
            .collect();
        Document::new(&json!({
            "modes": modes,
            "parameters": parameters,
            "delay_s": fit.parameter(GreyQuantity::Delay).map(with_interval),
            "static_gain": with_interval(static_gain(fit)),
            "set": self.set,
            "samples": samples,
            "used_samples": present.len(),
            "first_sample": first,
            "order": fit.discrete.model.order(),
            "dead_samples": fit.discrete.dead_samples,
            "converged": fit.verdict.converged,
            "ending": ending(fit.verdict.ending),
            "iterations": fit.verdict.iterations,
            "gradient_standard_errors": fit.verdict.gradient * (present.len() as f64).sqrt(),
            "numbers_on_a_bound": fit.verdict.at_limit,
            "innovation_std": { "value": fit.noise_variance.sqrt(), "unit": series.unit },
            "prediction_fit_percent": fit_percent(&measured, &simulated).ok(),
            "simulation_fit_percent": simulated_percent(identified, &late(fit, series), &series.output, nuisances),
            "offset_v": identified.offsets.first(),
            "drift_v_per_s": identified.slopes.first(),
            "input_between_samples": between_document(fit),
            "whiteness": test_document(test),
        }))
    }
}

/// Whiteness of what is left of the samples that count. Output error has no noise parameters.
fn residual_test(fit: &Grey) -> Result<TestResult, ModelError> {
    let residual = fit.experiments.first().map_or(&[][..], |own| own.residual.as_slice());
    whiteness(residual, 25, 0)
}

/// The inputs, later by the whole samples that the discrete model leaves out.
fn late(fit: &Grey, series: &PairSeries) -> Vec<f64> {
    let (samples, dead) = (series.output.len().max(1), fit.discrete.dead_samples);
    let moved = |u: &[f64]| (0..u.len()).map(|k| u[k.saturating_sub(dead)]).collect::<Vec<f64>>();
    series.input.chunks(samples).flat_map(moved).collect()
}

/// The fit in the terms of `model.pem`; its initial state is the one from which the discrete model simulates the same.
fn identified(fit: &Grey, series: &PairSeries) -> Result<Identified, StageError> {
    let none = || StageError::new("the fit has no experiment");
    let own = fit.experiments.first().ok_or_else(none)?;
    let samples = series.output.len();
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    let level = |k: usize| own.offset.value + own.slope.value * (k as f64 - centre) / centre;
    let clean: Vec<f64> = (0..samples).map(|k| series.output[k] - own.residual[k] - level(k)).collect();
    let nuisances = Nuisances { offset: false, slope: false };
    let discrete = &fit.discrete;
    let simulated = simulate_held_out(&discrete.model, &discrete.further, &late(fit, series), &clean, nuisances);
    Ok(Identified {
        model: discrete.model.clone(),
        further_inputs: discrete.further.clone(),
        initial_states: vec![simulated.map_err(StageError::from_error)?.initial_state],
        offsets: vec![own.offset.value],
        slopes: vec![own.slope.value * series.rate / centre],
        residuals: vec![own.residual.clone()],
        noise_parameters: 0,
        innovation_variance: fit.noise_variance,
        covariance: discrete.covariance.clone(),
        predictor_poles: Vec::new(),
        singular_values: Vec::new(),
        verdict: fit.verdict,
    })
}
