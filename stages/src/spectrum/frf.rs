//! The stage `spectrum.frf`.

use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Spec, Stage, StageError};
use rustfft::num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::artifacts::{DataSet, Ensemble, NewTransfer, Pair};
use crate::ensemble::{Rows, moments, scatter};
use afmid_kernels::spectra::{
    EnsembleResponse, EnsembleResponseSettings, bin_frequencies, difference, ensemble_response,
};

/// Frequency response of all events at once, with noise, timing and distortion distinguished by their scatter.
///
/// # Model
/// Each event is the linear response to a force of its own size, a lag, a distortion that goes with the size, and
/// noise.
/// # Method
/// The pair's force times each event's amplitude; first differences of both; sum of cross spectra over sum of the
/// force's power. What scatters between events is split by regression on a shift in time and on the force's size. A
/// held force's lag and droop are taken out as in `spectrum.etfe`.
/// # Shapes
/// One value per bin, from zero to half the sample rate; `lag` one per event. `spectrum.smoothing` takes `frf` with its
/// own variance per bin.
/// # Units
/// Dimensionless; levels in V^2, transforms scaled by 1 / sqrt(N).
/// # Accuracy
/// `variance` is measured, not assumed: its relative standard error is 1 / sqrt((n - 1) (2 h + 1)) for n events and h
/// bins. The window's end (0.7 % of the first peak) is left to the smoothing, which fits it.
/// # Errors
/// Fewer than four events; a pair of another length than the events.
/// # Source
/// R. Pintelon, J. Schoukens, System Identification, 2012, ch. 2 and 4; Stark et al. 2005, Eqs. 5 to 7.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Frf {
    /// Bins above are undefined, in Hz. Why: as for `spectrum.etfe`.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub bandwidth_hz: f64,
    /// Bins on either side over which levels and variance are averaged. Why: with 24 events the variance is then good
    /// to a tenth, and a thermal peak two bins wide is widened little.
    #[schemars(range(min = 0, max = 1000))]
    pub half_width_bins: usize,
    /// Chance per bin below which distortion counts in the summary. Why: 0.2 false bins among 2000.
    #[schemars(range(min = 1e-12, max = 0.1))]
    pub significance: f64,
}

impl Default for Frf {
    fn default() -> Self {
        Self { bandwidth_hz: 1.2e6, half_width_bins: 2, significance: 1e-4 }
    }
}

pub(super) const ENSEMBLE: Port<Array> =
    Port::new("ensemble", "ensemble", "aligned events: signal over event and time");
pub(super) const PAIR: Port<Array> = Port::new("pair", "pair", "force and response of the mean, for the force's shape");
pub(super) const FRF: Port<Array> =
    Port::new("frf", "transfer", "transfer function, its variance, coherence and levels");
pub(super) const SUMMARY: Port<Document> = Port::new("summary", "summary", "lags, coherence, where distortion shows");

impl Stage for Frf {
    const SPEC: Spec = Spec {
        name: "spectrum.frf",
        version: 2,
        summary: "estimates the frequency response from all events, with noise and distortion levels",
        inputs: &[ENSEMBLE.spec(), PAIR.spec()],
        outputs: &[FRF.spec(), SUMMARY.spec()],
        source: "R. Pintelon, J. Schoukens, System Identification, 2012, ch. 2 and 4",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let (ensemble, pair) = (Ensemble::new(inputs.get(&ENSEMBLE)?), Pair::new(inputs.get(&PAIR)?));
        let (samples, rows, force) = (ensemble.samples()?, Rows::of(&ensemble)?, pair.force(DataSet::All)?);
        if force.len() != samples {
            let problem = format!("the pair has {} samples, the events {samples}", force.len());
            return Err(StageError::new(problem).help("wire the force that was derived from the same events"));
        }
        let rate = ensemble.sample_rate_hz()?;
        let all = rows.all();
        let mean = moments(rows, &all).map_err(StageError::from_error)?.mean;
        let amplitude = scatter(rows, &all, &mean, ensemble.onset_sample()?).map_err(StageError::from_error)?.amplitude;
        let step = difference(force);
        let forces: Vec<Vec<f64>> = amplitude.iter().map(|a| step.iter().map(|u| a * u).collect()).collect();
        let responses: Vec<Vec<f64>> = all.iter().map(|&i| difference(rows.row(i))).collect();
        let frequency = bin_frequencies(samples, rate);
        let band = frequency.partition_point(|f| *f <= self.bandwidth_hz);
        let settings = EnsembleResponseSettings { half_width_bins: self.half_width_bins, band_bins: band };
        let found = ensemble_response(&forces, &responses, settings).map_err(StageError::from_error)?;
        let distorted: Vec<usize> = (1..band).filter(|&k| found.distortion_p[k] < self.significance).collect();
        let expected = self.significance * band as f64;
        if distorted.len() as f64 > expected + 5.0 * expected.sqrt() + 2.0 {
            let worst =
                distorted.iter().copied().min_by(|&a, &b| found.distortion_p[a].total_cmp(&found.distortion_p[b]));
            cx.warn(format!(
                "the response changes with the force's size in {} bins ({expected:.1} by chance), most surely at {:.0} Hz: the system is not linear",
                distorted.len(),
                worst.map_or(f64::NAN, |k| frequency[k])
            ));
        }
        let share = |level: &[f64]| {
            let sum = |values: &[f64]| values[1..band.max(2)].iter().filter(|v| v.is_finite()).sum::<f64>();
            sum(level) / sum(&found.scatter)
        };
        let lag_rms = (found.lag.iter().map(|l| l * l).sum::<f64>() / found.lag.len() as f64).sqrt();
        let summary = Document::new(&json!({
            "events": rows.count(),
            "bins": band,
            "lag_rms_s": lag_rms / rate,
            "amplitude_spread": spread(&amplitude),
            "share_of_scatter": { "noise": share(&found.noise), "timing": share(&found.timing), "distortion": share(&found.distortion) },
            "distorted_bins": distorted.len(),
            "distorted_bins_by_chance": expected,
            "distorted_hz": distorted.iter().take(50).map(|&k| frequency[k]).collect::<Vec<f64>>(),
        }))?;
        let mut array = frf_array(frequency, found, band, &ensemble, pair.t0_sample()? / samples as f64)?;
        ensemble.describe_kind(&mut array);
        Ok(Ports::new().with(&FRF, array).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::frf_example::examples()
    }
}

fn spread(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
}

/// Undefined above the band; a held force's lag and droop taken out.
fn frf_array(
    frequency: Vec<f64>,
    found: EnsembleResponse,
    band: usize,
    ensemble: &Ensemble<'_>,
    event_turns_per_bin: f64,
) -> Result<Array, StageError> {
    let (bins, rate) = (frequency.len(), ensemble.sample_rate_hz()?);
    let held = |k: usize| {
        let turn = std::f64::consts::TAU * frequency[k] / rate;
        if k == 0 {
            Complex64::new(1.0, 0.0)
        } else {
            Complex64::new(0.0, turn) / (1.0 - Complex64::from_polar(1.0, -turn))
        }
    };
    let cut = |values: &[f64]| (0..bins).map(|k| if k < band { values[k] } else { f64::NAN }).collect::<Vec<f64>>();
    let unknown = Complex64::new(f64::NAN, f64::NAN);
    let transfer: Vec<Complex64> =
        (0..bins).map(|k| if k < band { found.transfer[k] * held(k) } else { unknown }).collect();
    let variance: Vec<f64> = (0..bins).map(|k| found.variance[k] * held(k).norm_sqr()).collect();
    let lag: Vec<f64> = found.lag.iter().map(|l| l / rate).collect();
    let over = &["frequency_hz"];
    let response = NewTransfer {
        frequency_hz: frequency,
        transfer,
        variance: cut(&variance),
        variance_from: "expected squared error, from the scatter between events",
        further_axes: vec![ensemble.event()?.clone()],
        sample_rate_hz: rate,
        static_gain: 1.0,
        differenced: true,
        event_turns_per_bin,
    };
    let response = ensemble.rate_error().stated_by(response.array());
    Ok(response
        .with("coherence", "1", "ordinary coherence", over, cut(&found.coherence))
        .with("scatter", "V^2", "scatter between events about the linear response", over, cut(&found.scatter))
        .with("noise", "V^2", "part of the scatter that is noise", over, cut(&found.noise))
        .with("timing", "V^2", "part of the scatter that is a shift in time", over, cut(&found.timing))
        .with("distortion", "V^2", "part of the scatter that goes with the force's size", over, cut(&found.distortion))
        .with(
            "distortion_p_value",
            "1",
            "chance of such a distortion in a linear system",
            over,
            cut(&found.distortion_p),
        )
        .with("lag", "s", "how much later than the mean", &["event"], lag))
}
