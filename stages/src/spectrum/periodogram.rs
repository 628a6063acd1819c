//! The stage `spectrum.periodogram`.

use afmid_pipeline::{Array, Axis, Context, Example, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::window::PAIR;
use crate::artifacts::{DataSet, Pair, SAMPLE_RATE_HZ};
use afmid_kernels::spectra::{bin_frequencies, power_spectrum};

/// Periodograms of force and response: their power spectral densities, as a first look.
///
/// Model: the normalised absolute square of the Fourier transform.
/// Method: P = 2 abs(X)^2 / (fs sum w^2), without the factor two at zero and at half the sample rate, with the sum over
/// the window that the pair went through (its number of samples if none). For a transient this is its energy spectrum
/// over the window's length.
/// Shapes: one value per bin, from zero to half the sample rate.
/// Units: V^2/Hz, one-sided; its sum times the bin width is the mean square.
/// Accuracy: a bin of noise scatters by 100 %; `noise` is the level that the standard error of the response makes.
/// Errors: a pair of differences.
/// Source: Stark et al. 2005, Results and discussion.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Periodogram {}

pub(super) const PERIODOGRAM: Port<Array> =
    Port::new("periodogram", "spectrum", "power spectral densities over frequency");

impl Stage for Periodogram {
    const SPEC: Spec = Spec {
        name: "spectrum.periodogram",
        version: 1,
        summary: "computes power spectral densities of force and response",
        inputs: &[PAIR.spec()],
        outputs: &[PERIODOGRAM.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Results and discussion",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let pair = Pair::new(inputs.get(&PAIR)?);
        if pair.differenced() {
            return Err(StageError::new("the pair holds differences, which are no signals")
                .help("wire a window without `differenced`, or the pair of `force.extrapolation`"));
        }
        let (rate, samples, all) = (pair.sample_rate_hz()?, pair.samples()?, DataSet::All);
        let power = pair.noise_gain() * samples as f64;
        let density = |values: &[f64]| -> Result<Vec<f64>, StageError> {
            Ok(power_spectrum(values, power, rate).map_err(StageError::from_error)?.density)
        };
        let (response, force) = (density(pair.response(all)?)?, density(pair.force(all)?)?);
        // white noise of this variance, windowed: sum w^2 divides out
        let noise = 2.0 * pair.standard_error(all)?.iter().map(|s| s * s).sum::<f64>() / (rate * power);
        let over = &["frequency_hz"];
        let bins = bin_frequencies(samples, rate);
        let noise = vec![noise; bins.len()];
        let result = Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", bins)])
            .with("response", "V^2/Hz", "power spectral density of the response", over, response)
            .with("force", "V^2/Hz", "power spectral density of the force", over, force)
            .with("noise", "V^2/Hz", "density of the response's standard error", over, noise)
            .attribute(SAMPLE_RATE_HZ, rate);
        Ok(Ports::new().with(&PERIODOGRAM, result))
    }

    fn examples() -> Vec<Example> {
        super::example::periodogram()
    }
}
