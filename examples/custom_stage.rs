//! A stage of one's own, registered beside the built-in ones: `cargo run --example custom_stage`.
//!
//! It measures how fast the averaged event rings down, from its envelope alone: a check of mode 1 that needs no model.
//! The config is `examples/custom_stage.toml`; the program is afmid with one more stage.

use std::process::ExitCode;

use afmid_pipeline::{
    Array, Axis, Context, Document, Entry, Example, Faults, Port, Ports, Spec, Stage, StageError, schemars, serde,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

const AVERAGE: Port<Array> = Port::new("average", "average", "the averaged event; its first variable is used");
const ENVELOPE: Port<Array> = Port::new("envelope", "envelope", "root mean square per block");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "the decay time");

/// Decay time of a ringdown from its envelope.
///
/// # Model
/// A dominant mode rings down as `exp(-t / tau)`; `tau = Q / (pi f)`.
/// # Method
/// Root mean square over blocks; a straight line through its logarithm from `start_s` on, by least squares.
/// # Shapes
/// `average`: one variable over `time` (N samples); `envelope`: N / `block_samples`.
/// # Units
/// Those of the signal; seconds.
/// # Accuracy
/// Blocks must be longer than a period and shorter than `tau`; other modes must have died out by `start_s`.
/// # Errors
/// Fewer than three blocks after `start_s`, or an envelope that does not fall.
/// # Source
/// Any textbook on vibration, "logarithmic decrement".
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, crate = "afmid_pipeline::serde")]
#[schemars(crate = "afmid_pipeline::schemars")]
struct Envelope {
    /// Samples per block. Why: a few periods of the paper's mode 1.
    #[schemars(range(min = 2))]
    block_samples: usize,
    /// Seconds after the event at which the line begins. Why: higher modes are gone.
    #[schemars(range(min = 0.0))]
    start_s: f64,
    /// Seconds after the event at which the line ends; default 6e-4: the ringing still stands above the noise.
    end_s: f64,
}

impl Default for Envelope {
    fn default() -> Self {
        Self { block_samples: 256, start_s: 2e-4, end_s: 6e-4 }
    }
}

impl Stage for Envelope {
    const SPEC: Spec = Spec {
        name: "example.envelope",
        version: 1,
        summary: "Decay time of a ringdown from its envelope",
        inputs: &[AVERAGE.spec()],
        outputs: &[ENVELOPE.spec(), SUMMARY.spec()],
        source: "logarithmic decrement",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (start, end) = (self.start_s, self.end_s);
        faults.require(end > start, || format!("`end_s` is {end}, wanted more than `start_s` ({start})"));
    }

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let average = inputs.get(&AVERAGE)?;
        let time = &average.axis("time")?.values;
        let name = average.variables.first().map(|variable| variable.name.clone()).unwrap_or_default();
        let (centres, rms) = envelope(time, average.real(&name)?, self.block_samples);
        let tau = decay_time(&centres, &rms, self.start_s, self.end_s)?;
        let axis = Axis::new("time", "s", "time after the event", centres);
        let array = Array::over(vec![axis]).with("envelope", "V", "root mean square per block", &["time"], rms);
        Ok(Ports::new()
            .with(&ENVELOPE, array)
            .with(&SUMMARY, Document::new(&serde_json::json!({ "decay_time_s": tau }))?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "a mode that decays in 0.28 ms",
            params: "block_samples = 256",
            inputs: || {
                let time: Vec<f64> = (0..8192).map(|k| f64::from(k) / 5e6).collect();
                let ring = time
                    .iter()
                    .map(|t| (-t / 2.8e-4).exp() * (std::f64::consts::TAU * 46.3e3 * t).cos())
                    .collect::<Vec<f64>>();
                let axis = Axis::new("time", "s", "time after the event", time);
                Ok(Ports::new()
                    .with(&AVERAGE, Array::over(vec![axis]).with("mean", "V", "averaged event", &["time"], ring)))
            },
            expect: |outputs| {
                let summary = outputs.get(&SUMMARY).map_err(|error| error.to_string())?;
                let tau = summary.0["decay_time_s"].as_f64().unwrap_or(f64::NAN);
                // blocks of 2.4 periods leave a ripple of some per cent on the envelope
                if (tau / 2.8e-4 - 1.0).abs() < 0.05 {
                    Ok(format!("decay time {:.3} ms", tau * 1e3))
                } else {
                    Err(format!("{tau} s"))
                }
            },
        }]
    }
}

/// Root mean square of each whole block, and the times of the blocks' centres.
fn envelope(time: &[f64], signal: &[f64], block: usize) -> (Vec<f64>, Vec<f64>) {
    let rms = |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
    let centre = |times: &[f64]| times.iter().sum::<f64>() / times.len() as f64;
    (time.chunks_exact(block).map(centre).collect(), signal.chunks_exact(block).map(rms).collect())
}

/// Minus the inverse slope of the envelope's logarithm between two times.
fn decay_time(time: &[f64], rms: &[f64], start: f64, end: f64) -> Result<f64, StageError> {
    let points: Vec<(f64, f64)> = time
        .iter()
        .zip(rms)
        .filter(|(t, r)| **t >= start && **t <= end && **r > 0.0)
        .map(|(t, r)| (*t, r.ln()))
        .collect();
    if points.len() < 3 {
        return Err(StageError::new(format!(
            "{} blocks between {start} s and {end} s, wanted at least 3",
            points.len()
        ))
        .help("use shorter blocks, or a longer window"));
    }
    let count = points.len() as f64;
    let (mean_t, mean_r) =
        points.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0 / count, sum.1 + point.1 / count));
    let covariance: f64 = points.iter().map(|(t, r)| (t - mean_t) * (r - mean_r)).sum();
    let variance: f64 = points.iter().map(|(t, _)| (t - mean_t).powi(2)).sum();
    let slope = covariance / variance;
    if slope < 0.0 { Ok(-1.0 / slope) } else { Err(StageError::new("the envelope does not fall, wanted a ringdown")) }
}

fn main() -> ExitCode {
    match afmid::registry().and_then(|built_in| built_in.with(&[Entry::of::<Envelope>()])) {
        Ok(registry) => afmid::main(&registry),
        Err(double) => {
            eprintln!("{double}");
            ExitCode::from(2)
        }
    }
}
