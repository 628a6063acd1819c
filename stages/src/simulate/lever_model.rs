//! The extended model as an artifact: what a diagnosis says that a lever, its detector, its noise and its causes are.

use std::collections::BTreeMap;

use afmid_pipeline::{Document, Port, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Hidden, effects};
use crate::causes::find;
use afmid_kernels::effects::Effects;

/// Kind of the document port that carries a [`LeverModel`].
pub const LEVER_MODEL: &str = "lever-model";

/// The port `model` of stages that take one.
pub(crate) const MODEL: Port<Document> =
    Port::new("model", LEVER_MODEL, "lever, detector, noise and named causes of a diagnosis");

/// An estimate and its standard error, null where it is not known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub std: Option<f64>,
}

/// A mode of the lever.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelMode {
    /// Undamped frequency, Hz.
    pub frequency_hz: Estimated,
    /// Quality factor.
    pub quality_factor: Estimated,
    /// Share of the static response of the detector; the shares sum to one.
    pub share: Estimated,
}

/// Lever and detector of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinearPart {
    /// Modes, ascending.
    pub modes: Vec<ModelMode>,
    /// Real poles of the detector, Hz.
    pub detector_poles_hz: Vec<Estimated>,
}

/// A named cause.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelCause {
    /// Its id (`afmid causes`).
    pub id: String,
    /// All of its parameters, in the units of the catalogue.
    pub parameters: BTreeMap<String, Estimated>,
    /// Parameters that no data determine (phases of lines, each record's own): zero, or the limit next to it.
    pub assumed: Vec<String>,
}

/// A part of the readout's 1/f noise: an Ornstein-Uhlenbeck process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelWander {
    /// Inverse of the correlation time, 1/s.
    pub rate_per_s: f64,
    /// Variance, V^2.
    pub variance_v2: f64,
}

/// Noise beside the events.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelNoise {
    /// Variance of the white noise, rounding included, V^2.
    pub white_v2: f64,
    /// Variance of the thermal motion of each oscillation that was seen, at its frequency in Hz.
    pub thermal: Vec<ModelThermal>,
    /// 1/f noise, a decade from one part to the next.
    pub wander: Vec<ModelWander>,
}

/// Thermal motion of one oscillation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelThermal {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Variance of its part of the signal, V^2.
    pub variance_v2: f64,
}

/// The loads that the events released.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelAmplitude {
    /// Mean static deflection before the release, V; positive for loads that pulled down.
    pub mean_v: f64,
    /// Standard deviation from event to event, V.
    pub scatter_v: f64,
    /// Number of events.
    pub events: usize,
}

/// A lever as a diagnosis leaves it: an artifact that later configs use (`diagnosis.replay`, `simulate.model`,
/// `force.reconstruction`).
///
/// `baseline` is the best lever and detector without causes, `extended` with them; the two are the same where no cause
/// changes the events' shape. Causes are empty for every verdict but `named`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeverModel {
    /// Samples per second of the records, Hz.
    pub sample_rate_hz: f64,
    /// Number of records in the archive: causes that run along it count by it.
    pub records: usize,
    /// Lever and detector alone.
    pub baseline: LinearPart,
    /// Lever and detector beside the causes.
    pub extended: LinearPart,
    /// Named causes in the order of their finding.
    pub causes: Vec<ModelCause>,
    /// Noise beside the events.
    pub noise: ModelNoise,
    /// Loads of the events.
    pub amplitude: ModelAmplitude,
}

impl ModelCause {
    /// The same as an entry of `hidden`. Errors: an unknown cause.
    pub fn hidden(&self) -> Result<Hidden, StageError> {
        let cause = find(&self.id).ok_or_else(|| {
            StageError::new(format!("the model names the cause `{}`, which is not in the catalogue", self.id))
                .help("diagnose again with this version, or check the spelling: `afmid causes` lists all")
        })?;
        let about = cause.about();
        let values: Vec<f64> = about
            .parameters
            .iter()
            .map(|parameter| match self.parameters.get(parameter.name) {
                Some(estimated) => Ok(estimated.value),
                None => Err(StageError::new(format!("the model's cause `{}` lacks `{}`", self.id, parameter.name))),
            })
            .collect::<Result<_, _>>()?;
        Ok(Hidden::new(about, &values))
    }
}

impl LeverModel {
    /// Reads and checks a document. Errors: another layout, no mode or pole, numbers out of range, an unknown cause.
    pub fn read(document: &Document) -> Result<Self, StageError> {
        let model: Self = document.read()?;
        model.check()?;
        Ok(model)
    }

    fn check(&self) -> Result<(), StageError> {
        let wrong = |what: String| Err(StageError::new(format!("the model's {what}")));
        if !(self.sample_rate_hz > 0.0 && self.sample_rate_hz.is_finite()) {
            return wrong(format!("sample_rate_hz is {}, wanted above 0", self.sample_rate_hz));
        }
        for (name, part) in [("baseline", &self.baseline), ("extended", &self.extended)] {
            if part.modes.is_empty() {
                return wrong(format!("{name} has no mode"));
            }
            for mode in &part.modes {
                let (f, q, share) = (mode.frequency_hz.value, mode.quality_factor.value, mode.share.value);
                if !(f > 0.0 && f < 0.5 * self.sample_rate_hz && q > 0.5 && q.is_finite() && share.is_finite()) {
                    return wrong(format!(
                        "{name} has a mode at {f} Hz with Q {q} and share {share}, wanted one below half the sample rate with Q above 0.5"
                    ));
                }
            }
            if let Some(pole) = part.detector_poles_hz.iter().find(|p| !(p.value > 0.0 && p.value.is_finite())) {
                return wrong(format!("{name} has a detector pole at {} Hz, wanted above 0", pole.value));
            }
        }
        self.effects().map(|_| ())
    }

    /// The causes as entries of `hidden`.
    pub fn hidden(&self) -> Result<Vec<Hidden>, StageError> {
        self.causes.iter().map(ModelCause::hidden).collect()
    }

    /// What the causes add to a simulation. Errors: an unknown cause, values out of its limits.
    pub fn effects(&self) -> Result<Effects, StageError> {
        effects(&self.hidden()?).map_err(|error| StageError::new(format!("the model's causes: {error}")))
    }

    /// Standard deviation of what a window of that length (s) shows beside an event, its offset and slope taken out, V.
    ///
    /// Model: white, thermal, and the wander that is faster than the window; slower wander is an offset and a slope.
    pub fn noise_v(&self, window_s: f64) -> f64 {
        let thermal: f64 = self.noise.thermal.iter().map(|mode| mode.variance_v2).sum();
        let fast = self.noise.wander.iter().filter(|part| part.rate_per_s * window_s > FAST);
        (self.noise.white_v2 + thermal + fast.map(|part| part.variance_v2).sum::<f64>()).sqrt()
    }
}

/// Correlation times within a window from which on wander is no line: three half waves.
const FAST: f64 = 3.0 * std::f64::consts::PI;

#[cfg(test)]
impl LeverModel {
    /// The truth of a simulation as a diagnosis would hand it on.
    pub(crate) fn of(afm: &super::Afm) -> Self {
        let known = |value: f64| Estimated { value, std: None };
        let shares = afm.quality_factors.iter().zip(&afm.detector_shares);
        let modes = afm.frequencies_hz.iter().zip(shares).map(|(f, (q, share))| ModelMode {
            frequency_hz: known(*f),
            quality_factor: known(*q),
            share: known(*share),
        });
        let part = LinearPart {
            modes: modes.collect(),
            detector_poles_hz: afm.detector_poles_hz.iter().map(|pole| known(*pole)).collect(),
        };
        let causes = afm.hidden.iter().map(|entry| {
            let (cause, values) = entry.resolve().expect("a cause");
            let names = cause.about().parameters.iter().map(|p| p.name.to_owned());
            ModelCause {
                id: cause.about().id.to_owned(),
                parameters: names.zip(values.into_iter().map(known)).collect(),
                assumed: Vec::new(),
            }
        });
        let mean_v = afm.adhesion_n / afm.stiffness_n_per_m * afm.sensitivity_v_per_m;
        Self {
            sample_rate_hz: afm.sample_rate_hz,
            records: afm.records,
            baseline: part.clone(),
            extended: part,
            causes: causes.collect(),
            noise: ModelNoise { white_v2: afm.white_v.powi(2), thermal: Vec::new(), wander: Vec::new() },
            amplitude: ModelAmplitude { mean_v, scatter_v: afm.adhesion_scatter * mean_v, events: afm.records },
        }
    }
}
