//! The stage `ensemble.average`.

use afmid_pipeline::rows::{RowSource, RowView};
use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::rows::{all, check_rows};
use super::{Moments, Scatter, Split, moments, scatter, split_halves};
use crate::artifacts::{AveragedSet, DataSet, Ensemble};

/// Averages aligned events: all of them, and two halves drawn at random.
///
/// Model: every event is a common shape times an amplitude, plus an offset, a loading ramp on either side of the onset,
/// a fraction of a sample of misalignment, and noise.
/// Method: mean and variance per sample (corrected two-pass). Each event is regressed on the mean, its slope, a
/// constant and the ramps; what remains is noise, whose variance over the number of events is the squared standard
/// error. Adhesion scatter is therefore in `variance`, not in `standard_error`. The halves are a random split seeded by
/// the pipeline.
/// Shapes: `ensemble.signal` is events x samples; `mean` and the rest are one value per sample, the same with
/// `_identification` and `_verification` for the halves; `amplitude`, `offset`, `lag`, `rms`, `half` one per event.
/// Units: those of the ensemble; `amplitude` is relative to the mean, `lag` in seconds.
/// Accuracy: a noise variance from n events has a relative standard error of sqrt(2 / (n - 1)) per sample.
/// Errors: fewer than two events, values that are not finite, a mean without shape.
/// Source: Stark et al. 2005, section Data processing; Chan, Golub, LeVeque, The American Statistician 37 (1983) 242.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Average {
    /// Whether to average two random halves beside the whole. Why: models are judged on the half that they have not
    /// seen.
    pub split: bool,
}

impl Default for Average {
    fn default() -> Self {
        Self { split: true }
    }
}

const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "aligned events: signal over event and time");
const AVERAGE: Port<Array> =
    Port::new("average", "average", "mean, variance and standard error of all events and of two halves");
const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "how many events, how they scatter, how noisy they are");

/// Misalignment above this share of a sample is worth a warning: at the paper's fourth mode it turns phases by 8
/// degrees.
const LAG_LIMIT_SAMPLES: f64 = 0.1;

impl Stage for Average {
    const SPEC: Spec = Spec {
        name: "ensemble.average",
        version: 2,
        summary: "averages aligned events, all of them and two random halves, and tells noise from scatter",
        inputs: &[ENSEMBLE.spec()],
        outputs: &[AVERAGE.spec(), SUMMARY.spec()],
        seeded: true,
        source: "Stark et al., Rev. Sci. Instrum. 2005, Data processing",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let ensemble = Ensemble::new(inputs.get(&ENSEMBLE)?);
        let (rows, unit) = (checked_rows(&ensemble)?, ensemble.unit()?);
        let (onset, rate) = (ensemble.onset_sample()?, ensemble.sample_rate_hz()?);
        let whole = Averaged::new(rows, &all(&rows), onset)?;
        let split = match split_halves(rows.rows(), cx.seed()) {
            Ok(split) if self.split => Some(split),
            Ok(_) => None,
            Err(error) => {
                if self.split {
                    cx.warn(format!("{error}: nothing is held out"));
                }
                None
            }
        };
        let lag = root_mean_square(&whole.scatter.lag);
        if lag > LAG_LIMIT_SAMPLES {
            cx.warn(format!("the events are aligned to {lag:.2} samples rms: their mean blurs high modes"));
        }
        let axes = vec![ensemble.time()?.clone(), ensemble.event()?.clone()];
        let mut average = whole.of(DataSet::All, unit).add(Array::over(axes));
        if let Some(split) = &split {
            let halves =
                [(DataSet::Identification, &split.identification), (DataSet::Verification, &split.verification)];
            for (set, chosen) in halves {
                average = Averaged::new(rows, chosen, onset)?.of(set, unit).add(average);
            }
        }
        average = per_event(average, &whole, split.as_ref(), rate, unit);
        let average = ensemble.described(average);
        let summary = Document::new(&json!({
            "events": rows.rows(),
            "identification": split.as_ref().map(|s| &s.identification),
            "verification": split.as_ref().map(|s| &s.verification),
            "amplitude_spread": spread(&whole.scatter.amplitude),
            "lag_rms_s": lag / rate,
            "noise_rms": { "value": root_mean_square(&whole.scatter.rms), "unit": unit },
        }))?;
        Ok(Ports::new().with(&AVERAGE, average).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "Amplitudes scatter by a tenth, the noise is a millivolt",
            params: "split = true",
            inputs: || Ok(Ports::new().with(&ENSEMBLE, super::example::ensemble())),
            expect: |outputs| {
                let noise = outputs
                    .get(&AVERAGE)
                    .and_then(|average| average.real("noise_variance").map(root_mean))
                    .map_err(|error| error.to_string())?;
                // 12 events of 4096 samples: relative standard error sqrt(1 / 90000) = 0.3 %, six of them
                if (noise / 1e-3 - 1.0).abs() < 0.02 {
                    Ok(format!("The noise of one event comes out as {:.3} mV.", 1e3 * noise))
                } else {
                    Err(format!("noise {noise}"))
                }
            },
        }]
    }
}

/// The events of an ensemble, checked, wherever they lie.
pub(super) fn checked_rows<'a>(ensemble: &Ensemble<'a>) -> Result<RowView<'a>, StageError> {
    let rows = ensemble.rows()?;
    check_rows(&rows).map_err(StageError::from_error)?;
    Ok(rows)
}

struct Averaged {
    moments: Moments,
    scatter: Scatter,
}

impl Averaged {
    fn new(rows: RowView<'_>, chosen: &[usize], onset: usize) -> Result<Self, StageError> {
        let moments = moments(rows, chosen).map_err(StageError::from_error)?;
        let scatter = scatter(rows, chosen, &moments.mean, onset).map_err(StageError::from_error)?;
        Ok(Self { moments, scatter })
    }

    fn of<'a>(&self, set: DataSet, unit: &'a str) -> AveragedSet<'a> {
        AveragedSet {
            set,
            mean: self.moments.mean.clone(),
            standard_error: self.scatter.standard_error(),
            noise_variance: Some(self.scatter.noise_variance.clone()),
            variance: Some(self.moments.variance.clone()),
            count: self.moments.count,
            unit,
        }
    }
}

fn per_event(to: Array, whole: &Averaged, split: Option<&Split>, rate: f64, unit: &str) -> Array {
    let scatter = &whole.scatter;
    let half = |event: &usize| match split {
        Some(split) if split.verification.binary_search(event).is_ok() => 2,
        Some(_) => 1,
        None => 0,
    };
    let over = &["event"];
    let halves: Vec<i64> = (0..scatter.amplitude.len()).map(|event| half(&event)).collect();
    let lag: Vec<f64> = scatter.lag.iter().map(|lag| lag / rate).collect();
    to.with("amplitude", "1", "amplitude relative to the mean", over, scatter.amplitude.clone())
        .with("offset", unit, "offset against the mean", over, scatter.offset.clone())
        .with("lag", "s", "how much later than the mean", over, lag)
        .with("rms", unit, "root mean square of what is left", over, scatter.rms.clone())
        .with("half", "1", "1 identification, 2 verification, 0 neither", over, halves)
}

/// Relative standard deviation.
fn spread(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt() / mean.abs()
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn root_mean(values: &[f64]) -> f64 {
    (values.iter().sum::<f64>() / values.len().max(1) as f64).sqrt()
}
