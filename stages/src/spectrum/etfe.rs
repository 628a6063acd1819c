//! The stage `spectrum.etfe`.

use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::window::PAIR;
use crate::artifacts::{DataSet, NewTransfer, Pair};
use afmid_kernels::spectra::{
    Bins, EndTreatment, EtfeSettings, Intersample, SpectrumError, TransferEstimate, etfe, neighbour_scatter,
};

/// Empirical transfer function estimate: the ratio of the transforms of response and force.
///
/// Model: the system is linear; nothing else is assumed.
/// Method: G = Y / U (Eqs. 5 to 7), the transforms scaled by 1 / sqrt(N). Undefined (NaN) where the force vanishes and
/// above the bandwidth limit. The force is a step at a sample: held until the next one, so that the plain ratio lags by
/// half a sample and droops by sin(x) / x, x = pi f / fs; `intersample = "held"` takes both out. Divided by the
/// quasi-static gain.
/// Shapes: one complex value per bin k fs / N, from zero to half the sample rate.
/// Units: dimensionless, since the force is given as static deflection.
/// Accuracy: `variance` is the expected squared error phi / abs(U)^2 with phi from the standard error of the mean,
/// taken as white; where no standard error is known (a single measured record), phi is the scatter of 8 bins on either
/// side about a parabola: good to 27 %, and too large where a resonance is narrower than that. On the paper's lever in closed form, with its window: 1.5 % at the first resonance, 0.05 % at the
/// fourth, up to half the value at antiresonances. With `spectrum.window` set to `differenced` and rectangular, and
/// smoothed with a transient: 2e-6, 5e-6, 5e-5 and 4e-4 at the four resonances, below 4e-5 of the static gain elsewhere
/// (folding about half the sample rate, which no ratio of sampled series can avoid).
/// Errors: a force that is zero throughout, fewer than eight samples.
/// Source: Stark et al. 2005, Eqs. 5 to 7 and 10; Ljung, System Identification, 1999, ch. 6.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Etfe {
    /// Bins above are undefined, in Hz. Why: beyond the paper's fourth mode the response falls below the
    /// noise.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub bandwidth_hz: f64,
    /// Bins are undefined where the force is smaller than this share of its median over 32 bins on either side. Why:
    /// such a bin holds less than 1/400 of its neighbours' information.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
    pub vanishing_ratio: f64,
    /// What the force does between samples: `held` or `sampled` (no correction). Why: it is exact for a step at a
    /// sample.
    pub intersample: Intersample,
    /// Divide by the quasi-static gain found in the data. Why: it is one within the noise for a force in volts.
    pub normalise: bool,
}

impl Default for Etfe {
    fn default() -> Self {
        Self { bandwidth_hz: 1.2e6, vanishing_ratio: 0.05, intersample: Intersample::Held, normalise: true }
    }
}

pub(super) const ETFE: Port<Array> =
    Port::new("etfe", "transfer", "complex transfer function and its variance over frequency");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "what is defined, and the quasi-static gain");

impl Stage for Etfe {
    const SPEC: Spec = Spec {
        name: "spectrum.etfe",
        version: 3,
        summary: "estimates the transfer function as the ratio of the transforms of response and force",
        inputs: &[PAIR.spec()],
        outputs: &[ETFE.spec(), SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Eqs. 5 to 7",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let pair = Pair::new(inputs.get(&PAIR)?);
        let (rate, differenced) = (pair.sample_rate_hz()?, pair.differenced());
        if self.bandwidth_hz > 0.5 * rate {
            cx.warn(format!("bandwidth_hz {} lies above half the sample rate, {}", self.bandwidth_hz, 0.5 * rate));
        }
        let settings = EtfeSettings {
            sample_rate_hz: rate,
            bandwidth_hz: self.bandwidth_hz,
            vanishing_ratio: self.vanishing_ratio,
            ends: if differenced { EndTreatment::Differenced } else { EndTreatment::Windowed },
            intersample: self.intersample,
            normalise: self.normalise,
        };
        let all = DataSet::All;
        let (force, response) = (pair.force(all)?, pair.response(all)?);
        let found = match pair.has_standard_error(all) {
            true => etfe(force, response, pair.standard_error(all)?, settings),
            false => with_own_noise(force, response, settings),
        };
        let found = found.map_err(StageError::from_error)?;
        let defined = found.variance.iter().filter(|v| v.is_finite()).count();
        let summary = Document::new(&json!({
            "bins": found.transfer.len(),
            "defined": defined,
            "vanishing": found.vanishing,
            "bandwidth_hz": self.bandwidth_hz,
            "bin_width_hz": rate / pair.samples()? as f64,
            "static_gain": found.static_gain,
            "normalised": self.normalise,
            "noise": if pair.has_standard_error(all) { "standard error" } else { "scatter of neighbouring bins" },
        }))?;
        let mut result = NewTransfer {
            frequency_hz: found.frequency_hz,
            transfer: found.transfer,
            variance: found.variance,
            variance_from: "expected squared error",
            further_axes: Vec::new(),
            sample_rate_hz: rate,
            static_gain: found.static_gain,
            differenced,
            event_turns_per_bin: pair.event_turns_per_bin()?,
        }
        .array();
        pair.describe_kind(&mut result);
        let result = pair.rate_error().stated_by(result);
        Ok(Ports::new().with(&ETFE, result).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::etfe()
    }
}

/// Bins on either side whose scatter gives the noise: 14 complex degrees of freedom beside a parabola, 27 %.
const SCATTER_BINS: usize = 8;

/// The estimate of a record whose noise is not known.
fn with_own_noise(force: &[f64], response: &[f64], settings: EtfeSettings) -> Result<TransferEstimate, SpectrumError> {
    // noise of 1 gives the bins their relative variances
    let mut found = etfe(force, response, &vec![1.0; force.len()], settings)?;
    let bins = Bins { frequency_hz: &found.frequency_hz, transfer: &found.transfer, variance: &found.variance };
    found.variance = neighbour_scatter(bins, SCATTER_BINS)?;
    Ok(found)
}
