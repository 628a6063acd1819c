//! The stage `force.extrapolation`.

use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::artifacts::{Average, DataSet, NewPair, PairSet, with_counts};
use afmid_kernels::events::EventKind;
use afmid_kernels::force::{ExtrapolationSettings, Lines, T0, T0Settings, ZeroLine, extrapolate, pair};

/// Derives the force that acted from the averaged event: input and response of the identification.
///
/// Model: at a snap-off the lever follows the load along a line before t0 and rings about the line without force after
/// it; the force is the difference of the lines before t0 and zero from t0 on. At a snap-in the force is zero before
/// t0, then a step and a ramp as the piezo goes on: the true contact force is not linear, and this is only the line
/// about which the signal rings.
/// Method: a uniform line before the event, a Hann-weighted one after it, which suppresses ringing without a model of
/// it. t0 is the last sample that still lies on the line before: the largest that leaves the transfer function causal.
/// It is found once, from all events, and used for both halves; each half has its own lines. Each value of the force is
/// held until the next sample.
/// Shapes: `force`, `response`, `standard_error` over time since t0; the same with `_identification` and
/// `_verification`.
/// Units: volts of static deflection, so that the transfer function is one at rest; `force_newton` where stiffness and
/// sensitivity are given.
/// Accuracy: the load's standard error counts the noise of the mean and its correlation over a window, not slower
/// drift. t0 has an ambiguity of some samples, reported: an earlier t0 is the same as a delay. It reaches from the
/// earliest that the data allow to the t0 that is used, also to one that is given by `t0_s`.
/// Errors: no departure near the onset, lines shorter than 32 samples, a load that does not stand out from the noise.
/// Source: Stark et al. 2005, section Data processing and Fig. 2(d).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Extrapolation {
    /// Time left out between the line before and the onset, 0 to 1 s. Why: ten times what t0 may be off.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub guard_s: f64,
    /// How far t0 may lie from the onset of the ensemble, above 0 to 1 s.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub reach_s: f64,
    /// A departure counts above this many standard deviations of the mean about its line. Why: noise alone crosses it
    /// once in 16000 samples, and only a few are looked at.
    #[schemars(range(min = 2.0, max = 100.0))]
    pub departure_sigma: f64,
    /// Share of the load by which the signal must leave the line to be the event.
    #[schemars(range(min = 0.001, max = 0.9))]
    pub sure_share: f64,
    /// Line without force: `linear` (offset and slope) or `constant`. Why: crosstalk of the piezo makes a slope.
    pub zero_line: ZeroLine,
    /// t0 in seconds after the ensemble's onset, moved to the next sample, instead of the largest causal one.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub t0_s: Option<f64>,
    /// Spring constant in N/m, for a force in newtons; it comes before the calibration's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness_n_per_m: Option<f64>,
    /// Optical lever sensitivity in volts per metre of deflection; it comes before the calibration's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sensitivity_v_per_m: Option<f64>,
}

impl Default for Extrapolation {
    fn default() -> Self {
        Self {
            guard_s: 10e-6,
            reach_s: 10e-6,
            departure_sigma: 4.0,
            sure_share: 0.1,
            zero_line: ZeroLine::Linear,
            t0_s: None,
            stiffness_n_per_m: None,
            sensitivity_v_per_m: None,
        }
    }
}

pub(super) const AVERAGE: Port<Array> = Port::new("average", "average", "averaged events, whole and halves");
const CALIBRATION: Port<Document> =
    Port::optional("calibration", "stiffness", "the summary of `calibration.stiffness`, for newtons");
pub(super) const PAIR: Port<Array> =
    Port::new("pair", "pair", "force and response over time since t0, whole and halves");
pub(super) const SUMMARY: Port<Document> = Port::new("summary", "summary", "load at the event, t0 and its ambiguity");

impl Stage for Extrapolation {
    const SPEC: Spec = Spec {
        name: "force.extrapolation",
        version: 3,
        summary: "derives force input and response from the lines before and after the averaged event",
        inputs: &[AVERAGE.spec(), CALIBRATION.spec()],
        outputs: &[PAIR.spec(), SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Data processing, Fig. 2(d)",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let average = Average::new(inputs.get(&AVERAGE)?);
        let scale = self.newtons_per_volt(inputs.find(&CALIBRATION)?)?;
        let (rate, onset, event) =
            (average.events().sample_rate_hz()?, average.events().onset_sample()?, average.kind()?);
        let settings = self.settings(event, onset, rate);
        let (mean, error) = (average.mean(DataSet::All)?, average.standard_error(DataSet::All)?);
        let causal = extrapolate(mean, error, settings, None);
        let lines = match self.given_onset(onset, rate) {
            None => causal.map_err(StageError::from_error)?,
            Some(mut given) => {
                // the data know the event no better because somebody chose a t0: the interval still begins where they
                // say
                if let Ok(causal) = &causal {
                    given.earliest = given.earliest.min(causal.onset.earliest);
                }
                if let Ok(causal) =
                    causal.as_ref().map(|lines| lines.onset).map(|c| given.latest.saturating_sub(c.latest))
                    && causal > 0
                {
                    cx.warn(format!(
                        "t0_s lies {causal} samples after the last one on the line: the response comes first"
                    ));
                }
                extrapolate(mean, error, settings, Some(given)).map_err(StageError::from_error)?
            }
        };
        let t0 = lines.onset.latest;
        if t0 >= mean.len() {
            return Err(StageError::new(format!("t0 is sample {t0} of a window of {}", mean.len())));
        }
        let mut result = NewPair { sample_rate_hz: rate, t0_sample: t0, kind: event.name() }.samples(mean.len());
        let (mut sets, mut counts) = (Vec::new(), Vec::new());
        for set in DataSet::EACH.into_iter().filter(|set| average.has(*set)) {
            let (mean, error) = (average.mean(set)?, average.standard_error(set)?);
            let own = match set {
                DataSet::All => lines,
                _ => extrapolate(mean, error, settings, Some(lines.onset)).map_err(StageError::from_error)?,
            };
            let found = pair(mean, &own, event);
            let own_set = PairSet {
                set,
                dims: &["time"],
                response_dims: &["time"],
                response: found.response,
                force: found.force,
                standard_error: Some(error.to_vec()),
                newtons_per_volt: scale.map(|scale| scale.per_volt),
                labels: PairSet::LEVER,
            };
            result = own_set.add(result);
            sets.push((set, own));
            counts.extend(average.count(set).map(|count| (set, count.clone())));
        }
        let result = average.events().rate_error().stated_by(result);
        let result = with_counts(result, &counts, lines.onset.ambiguity() / rate)
            .attribute("load_v", lines.load)
            .attribute("load_std_v", lines.load_std);
        let summary = summary(&sets, event, onset, rate, scale)?;
        Ok(Ports::new().with(&PAIR, result).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::examples()
    }
}

impl Extrapolation {
    fn settings(&self, event: EventKind, near: usize, rate: f64) -> ExtrapolationSettings {
        let samples = |seconds: f64| (seconds * rate).ceil() as usize;
        ExtrapolationSettings {
            event,
            zero_line: self.zero_line,
            guard: samples(self.guard_s),
            onset: T0Settings {
                near,
                reach: samples(self.reach_s),
                departure_sigma: self.departure_sigma,
                sure_share: self.sure_share,
            },
        }
    }

    fn given_onset(&self, near: usize, rate: f64) -> Option<T0> {
        let sample = (near as f64 + (self.t0_s? * rate).round()).max(0.0);
        Some(T0 { latest: sample as usize, earliest: sample })
    }

    /// Stiffness over sensitivity, from the parameters or the calibration.
    fn newtons_per_volt(&self, calibration: Option<&Document>) -> Result<Option<Newtons>, StageError> {
        let given = |value: Option<f64>| value.map(|value| (value, 0.0));
        let stiffness = given(self.stiffness_n_per_m).or_else(|| calibrated(calibration, "stiffness_n_per_m"));
        let sensitivity = given(self.sensitivity_v_per_m).or_else(|| calibrated(calibration, "sensitivity_v_per_m"));
        match (stiffness, sensitivity) {
            (Some((k, k_std)), Some((s, s_std))) => {
                // both errors added, although a sensitivity that is too high raises k twice and lowers 1 / s once
                Ok(Some(Newtons { per_volt: k / s, relative_std: (k_std / k).hypot(s_std / s) }))
            }
            (None, None) => Ok(None),
            _ => Err(StageError::new(
                "a force in newtons wants both `stiffness_n_per_m` and `sensitivity_v_per_m`, found one",
            )
            .help("give the other as a parameter, or wire a calibration that has both")),
        }
    }
}

/// From volts of static deflection to newtons.
#[derive(Debug, Clone, Copy)]
struct Newtons {
    per_volt: f64,
    relative_std: f64,
}

/// A number of the calibration with its standard error, plain or as `{ "value": ..., "std": ... }`.
fn calibrated(calibration: Option<&Document>, name: &str) -> Option<(f64, f64)> {
    let found = calibration?.0.get(name)?;
    let part = |key: &str| found.get(key).and_then(Value::as_f64);
    found.as_f64().map(|value| (value, 0.0)).or_else(|| Some((part("value")?, part("std").unwrap_or(0.0))))
}

fn summary(
    sets: &[(DataSet, Lines)],
    event: EventKind,
    onset: usize,
    rate: f64,
    scale: Option<Newtons>,
) -> Result<Document, StageError> {
    let Some((_, whole)) = sets.first() else { return Err(StageError::new("there is no average")) };
    let with_std = |value: f64, std: f64, unit: &str| json!({ "value": value, "std": std, "unit": unit });
    let half = |half: DataSet| {
        sets.iter().find(|h| h.0 == half).map_or(Value::Null, |h| with_std(h.1.load, h.1.load_std, "V"))
    };
    let zero = if event == EventKind::SnapOff { whole.after } else { whole.before };
    Document::new(&json!({
        "kind": event.name(),
        "load": with_std(whole.load, whole.load_std, "V"),
        "load_identification": half(DataSet::Identification),
        "load_verification": half(DataSet::Verification),
        "force": scale.map(|scale| {
            let force = scale.per_volt * whole.load;
            with_std(force, (scale.per_volt * whole.load_std).hypot(force * scale.relative_std), "N")
        }),
        "load_rate_v_per_s": whole.load_slope * rate,
        "t0_s": (whole.onset.latest as f64 - onset as f64) / rate,
        "t0_sample": whole.onset.latest,
        "t0_ambiguity_s": whole.onset.ambiguity() / rate,
        "zero_line_v": zero.at(whole.onset.latest as f64),
        "zero_line_v_per_s": zero.slope * rate,
        "noise_before_v": whole.rms_before,
    }))
}
