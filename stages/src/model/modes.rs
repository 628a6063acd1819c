//! The stage `model.modes`.

mod driven;
mod none;

use afmid_kernels::spectra::{Intersample, response_frequencies};
use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, StateSpace, Table,
};
use faer::Mat;
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use self::driven::mark_unexcited;
use self::none::no_mode;
use super::pem::MODEL;
use crate::artifacts::{
    DataSet, Pair, RateError, SAMPLE_RATE_HZ, first_sample, further_inputs, innovations, mode_document, mode_table,
    nuisances, root_table, t0_ambiguity_s,
};
use afmid_kernels::model::InnovationsModel;
use afmid_kernels::modes::{
    Interval, LEVEL, ModeCriteria, Pole, PoleClass, ResponsePoint, at_rest, poles, response, share_error_from_onset,
    zeros,
};
use afmid_kernels::ringdown::{Estimate, ModeEstimate};
use afmid_kernels::validation::{noise_ceiling_percent, simulate_held_out};

/// Extracts modes, poles and zeros from a model, each with its standard error, and judges the model on held-out events.
///
/// Model: s = ln(z) / Ts, f = |s| / 2 pi, Q = |s| / (-2 Re s), pole by pole; a mode is an established, weakly damped
/// pair, and of a pair that was measured (no averaged event) one near which the response follows the input: its
/// coherence there is above chance at 0.1 %; else it is unexcited. Established pairs of a quality factor between 0.5 and
/// `min_quality_factor` are damped; the rest are detector poles, doubtful pairs, and real negative ones, which have no
/// continuous counterpart.
/// Method: zeros are the invariant zeros of (A, B, C, D). Standard errors by the delta method from the model's
/// covariance. Held-out fit: the model of the identification half simulated on the verification half's force, initial
/// state, offset and drift fitted again. The error of a static share counts the ambiguity of t0: an event that was d
/// earlier turns and raises the mode's amplitude by exp(-s d); the root mean square over the pair's `t0_ambiguity_s`,
/// at least one sample, is added in squares. Intervals are those of 95 %: normal for frequencies, quality factors, gain
/// and delay, log-normal for the response's magnitude; the phase's is 1.96 `phase_std` on either side.
/// Shapes: `modes` and `roots` by row, ascending in frequency (of a pair the upper one; `damped` and `unexcited` pairs are
/// in `roots` by their class and in the summary); `response` over frequency. Of
/// a model with several inputs zeros, shares and response are those of the first. `at_rest` in the summary: static
/// gain, and the group delay at zero frequency, without the hold's half sample if `intersample` is held.
/// Units: Hz; static shares are parts of the static gain.
/// Accuracy: first order in the errors; over 300 seeds of a second-order system the intervals of zeros, gain, delay and
/// response cover 90 to 99 % each (test). A static share is the mode's own partial fraction: within the detector's
/// roll-off it is turned and damped by it. Zeros map as poles do; the hold makes them differ from the continuous
/// system's by 2e-3 in frequency (closed-form test).
/// Errors: a model that is not one of `model.pem`, or without covariance; a pair of another sample rate.
/// Source: Stark et al. 2005, Table I and Fig. 5; L. Ljung, System Identification, 1999, section 9.4.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Modes {
    /// What counts as a mode.
    #[serde(flatten)]
    pub criteria: ModeCriteria,
    /// Points of the frequency response, logarithmic from `response_from_hz` to half the sample rate.
    #[schemars(range(min = 2, max = 100_000))]
    pub response_points: usize,
    /// Lowest frequency of the response in Hz. Absent: 1000, or a thousandth of half the sample rate where that is
    /// lower. Why: three decades show the modes of a record of any rate.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub response_from_hz: Option<f64>,
    /// What the force does between samples, for `response`: `held` (half a sample's lag and droop are taken out, as in
    /// `spectrum.etfe`) or `sampled`. Why: it is exact for a step at a sample.
    pub intersample: Intersample,
    /// Reference frequencies in Hz (a sweep), to compare with.
    #[schemars(inner(range(min = 1e-12)))]
    pub reference_frequency_hz: Vec<f64>,
    /// Reference quality factors, as many as frequencies, or none.
    #[schemars(inner(range(min = 1e-12)))]
    pub reference_quality_factor: Vec<f64>,
}

impl Default for Modes {
    fn default() -> Self {
        Self {
            criteria: ModeCriteria::default(),
            response_points: 2000,
            response_from_hz: None,
            intersample: Intersample::Held,
            reference_frequency_hz: Vec::new(),
            reference_quality_factor: Vec::new(),
        }
    }
}

const HALF: Port<StateSpace> =
    Port::optional("half", "model", "the model of the identification half, for the held-out fit");
const PAIR: Port<Array> = Port::optional("pair", "pair", "force and response with both halves, for the held-out fit");
pub(super) const MODES: Port<Table> = Port::new("modes", "modes", "mechanical modes, ascending");
pub(super) const ROOTS: Port<Table> =
    Port::new("roots", "roots", "all poles and zeros, with classes and standard errors");
const RESPONSE: Port<Array> = Port::new("response", "model-response", "frequency response with its standard errors");
pub(super) const SUMMARY: Port<Document> = Port::new("summary", "summary", "modes and fits");

impl Stage for Modes {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.modes",
        version: 12,
        summary: "extracts modes, poles and zeros with standard errors, and the held-out fit",
        inputs: &[MODEL.spec(), HALF.spec(), PAIR.spec()],
        outputs: &[MODES.spec(), ROOTS.spec(), RESPONSE.spec(), SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Table I and Fig. 5",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (f, q) = (self.reference_frequency_hz.len(), self.reference_quality_factor.len());
        faults.require(q == 0 || q == f, || {
            let wanted = match f {
                0 => "none, since `reference_frequency_hz` has none".to_owned(),
                _ => format!("{f}, one for each of `reference_frequency_hz`, or none"),
            };
            let values = if q == 1 { "1 value".to_owned() } else { format!("{q} values") };
            format!("`reference_quality_factor` has {values}, wanted {wanted}")
        });
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let artifact = inputs.get(&MODEL)?;
        let (model, covariance) = innovations(artifact)?;
        let mut found = poles(&model, &covariance, &self.criteria).map_err(StageError::from_error)?;
        let pair = inputs.find(&PAIR)?;
        if let Some(pair) = pair {
            mark_unexcited(&mut found, pair, cx)?;
        }
        let ambiguity_s = onset_ambiguity(artifact);
        for pole in found.iter_mut().filter(|pole| pole.root.is_complex()) {
            let from_onset = share_error_from_onset(pole.amplitude, pole.root.s, ambiguity_s.unwrap_or(0.0));
            pole.static_share_std = pole.static_share_std.hypot(from_onset);
        }
        let mut zeros = zeros(&model, &covariance).map_err(StageError::from_error)?;
        let rate_error = RateError::of_model(artifact);
        found.iter_mut().map(|pole| &mut pole.root).chain(&mut zeros).for_each(|root| rate_error.widen_root(root));
        let of = |kind: PoleClass| found.iter().filter(|pole| pole.kind == kind).collect::<Vec<&Pole>>();
        let modes = of(PoleClass::Mechanical);
        let listed = |kind: PoleClass| of(kind).into_iter().map(with_share).collect::<Vec<Value>>();
        if modes.is_empty() {
            cx.warn(no_mode(&found, &self.criteria));
        }
        let half = inputs.find(&HALF)?;
        let fits = match (half, pair) {
            (Some(half), Some(pair)) => held_out(half, pair)?,
            _ => Fits::default(),
        };
        let points = response(
            &model,
            &covariance,
            &response_frequencies(self.lowest_hz(model.sample_time_s), model.sample_time_s, self.response_points),
        )
        .map_err(StageError::from_error)?;
        let summary = Document::new(&json!({
            "modes": listed(PoleClass::Mechanical),
            "damped": listed(PoleClass::Damped),
            "unexcited": listed(PoleClass::Unexcited),
            "fit_percent": {
                "identification": fits.identification,
                "held_out": fits.held_out,
                "noise_ceiling": fits.noise_ceiling,
            },
            "t0_ambiguity_s": ambiguity_s,
            "at_rest": self.at_rest(&model, &covariance, rate_error)?,
            "reference": self.compared(&modes),
        }))?;
        Ok(Ports::new()
            .with(&MODES, modes_with_shares(&modes))
            .with(&ROOTS, root_table(&found, &zeros))
            .with(&RESPONSE, response_array(&points, artifact, self.intersample))
            .with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::modes()
    }
}

impl Modes {
    fn lowest_hz(&self, sample_time_s: f64) -> f64 {
        self.response_from_hz.unwrap_or_else(|| 1000_f64.min(5e-4 / sample_time_s))
    }

    /// Gain and delay with their intervals.
    fn at_rest(
        &self,
        model: &InnovationsModel,
        covariance: &Mat<f64>,
        rate_error: RateError,
    ) -> Result<Value, StageError> {
        let rest = at_rest(model, covariance).map_err(StageError::from_error)?;
        let hold_s = self.intersample.delay_s(model.sample_time_s);
        let delay_s = rest.delay_s - hold_s;
        let with_interval = |value: f64, std: f64| {
            let Interval { low, high } = Interval::normal(value, std);
            json!({ "value": value, "std": std, "low": low, "high": high })
        };
        Ok(json!({
            "gain": with_interval(rest.gain, rest.gain_std),
            "delay_s": with_interval(delay_s, rate_error.widened(delay_s, rest.delay_std_s)),
            "level": LEVEL,
        }))
    }

    /// Each reference value beside the nearest mode.
    fn compared(&self, modes: &[&Pole]) -> Vec<Value> {
        let row = |(i, &reference): (usize, &f64)| {
            let distance = |mode: &Pole| (mode.root.frequency_hz / reference).ln().abs();
            let numbered = modes.iter().enumerate().min_by(|(_, x), (_, y)| distance(x).total_cmp(&distance(y)));
            let nearest = numbered.map(|(_, mode)| mode.root);
            let q = self.reference_quality_factor.get(i);
            json!({
                "mode": numbered.map(|(index, _)| index + 1),
                "reference_frequency_hz": reference,
                "reference_quality_factor": q,
                "frequency_hz": nearest.map(|root| root.frequency_hz),
                "frequency_std_hz": nearest.map(|root| root.frequency_std_hz),
                "frequency_difference": nearest.map(|root| root.frequency_hz / reference - 1.0),
                "frequency_difference_in_errors":
                    nearest.and_then(|root| in_errors(root.frequency_hz - reference, root.frequency_std_hz)),
                "quality_factor": nearest.map(|root| root.quality_factor),
                "quality_factor_std": nearest.map(|root| root.quality_factor_std),
                "quality_factor_difference": nearest.zip(q).map(|(root, q)| root.quality_factor / q - 1.0),
                "quality_factor_difference_in_errors":
                    nearest.zip(q).and_then(|(root, q)| in_errors(root.quality_factor - q, root.quality_factor_std)),
            })
        };
        self.reference_frequency_hz.iter().enumerate().map(row).collect()
    }
}

/// Width of the interval in which t0 may lie, as `force.extrapolation` states it; at least a sample, since t0 lies on
/// the grid and the event does not. None for a pair that says nothing of it.
fn onset_ambiguity(model: &StateSpace) -> Option<f64> {
    Some(t0_ambiguity_s(model)?.max(model.sample_time_s))
}

/// A difference in standard errors; unknown where there is no error.
fn in_errors(difference: f64, std: f64) -> Option<f64> {
    Some(difference / std).filter(|ratio| ratio.is_finite())
}

/// FIT % of the half-split model; unknown where a part is missing.
#[derive(Default)]
struct Fits {
    identification: Option<f64>,
    held_out: Option<f64>,
    noise_ceiling: Option<f64>,
}

fn held_out(half: &StateSpace, pair: &Array) -> Result<Fits, StageError> {
    let (model, _) = innovations(half)?;
    let pair = Pair::new(pair);
    let rate = pair.sample_rate_hz()?;
    if (rate * model.sample_time_s - 1.0).abs() > 1e-9 {
        return Err(StageError::new(format!(
            "the pair's sample rate is {rate} Hz, the model's {} Hz",
            1.0 / model.sample_time_s
        )));
    }
    let (first, further) = (first_sample(half), further_inputs(half));
    // what the model was fitted with is fitted again
    let nuisances = nuisances(half);
    let simulated = |set: DataSet| -> Result<f64, StageError> {
        let series = pair.series(set, first)?;
        let simulation = simulate_held_out(&model, &further, &series.input, &series.output, nuisances);
        Ok(simulation.map_err(StageError::from_error)?.fit_percent)
    };
    let held_out = DataSet::Verification;
    let ceiling = match pair.standard_error(held_out) {
        Ok(error) => {
            let series = pair.series(held_out, first)?;
            let error = error.get(first..).unwrap_or(&[]);
            Some(noise_ceiling_percent(&series.output, error).map_err(StageError::from_error)?)
        }
        // a measured record without repetition does not say how noisy it is
        Err(_) => None,
    };
    Ok(Fits {
        identification: Some(simulated(DataSet::Identification)?),
        held_out: Some(simulated(held_out)?),
        noise_ceiling: ceiling,
    })
}

fn estimate(mode: &Pole) -> ModeEstimate {
    ModeEstimate {
        frequency_hz: Estimate { value: mode.root.frequency_hz, std: mode.root.frequency_std_hz },
        quality_factor: Estimate { value: mode.root.quality_factor, std: mode.root.quality_factor_std },
    }
}

fn with_share(mode: &Pole) -> Value {
    let mut document = mode_document(&estimate(mode));
    document["static_share"] = mode.static_share.into();
    document["static_share_std"] = mode.static_share_std.into();
    document
}

fn modes_with_shares(modes: &[&Pole]) -> Table {
    let column = |value: fn(&Pole) -> f64| modes.iter().map(|mode| value(mode)).collect::<Vec<f64>>();
    let estimates: Vec<ModeEstimate> = modes.iter().map(|mode| estimate(mode)).collect();
    mode_table(&estimates)
        .with("static_share", "1", "part of the static gain", column(|m| m.static_share))
        .with("static_share_std", "1", "its standard error", column(|m| m.static_share_std))
        .with("significance", "1", "ringing amplitude over its standard error", column(|m| m.significance))
}

fn response_array(points: &[ResponsePoint], model: &StateSpace, intersample: Intersample) -> Array {
    let over = &["frequency_hz"];
    let factor = |point: &ResponsePoint| intersample.correction(point.frequency_hz, model.sample_time_s);
    let interval = |p: &ResponsePoint| {
        let scale = factor(p).norm();
        Interval::positive(p.value.norm() * scale, p.magnitude_std() * scale)
    };
    let axis = Axis::new("frequency_hz", "Hz", "frequency", points.iter().map(|p| p.frequency_hz).collect());
    Array::over(vec![axis])
        .with(
            "transfer",
            "1",
            "transfer function of the model",
            over,
            points.iter().map(|p| Complex64::new(p.value.re, p.value.im) * factor(p)).collect::<Vec<_>>(),
        )
        .with(
            "magnitude_std",
            "1",
            "standard error of its magnitude",
            over,
            points.iter().map(|p| p.magnitude_std() * factor(p).norm()).collect::<Vec<_>>(),
        )
        .with(
            "magnitude_low",
            "1",
            "lower end of the magnitude's 95 % interval",
            over,
            points.iter().map(|p| interval(p).low).collect::<Vec<_>>(),
        )
        .with("magnitude_high", "1", "upper end", over, points.iter().map(|p| interval(p).high).collect::<Vec<_>>())
        .with(
            "phase_std",
            "rad",
            "standard error of its phase",
            over,
            points.iter().map(ResponsePoint::phase_std_rad).collect::<Vec<_>>(),
        )
        .attribute(SAMPLE_RATE_HZ, 1.0 / model.sample_time_s)
        .attribute("order", model.order())
}

#[cfg(test)]
mod tests;
