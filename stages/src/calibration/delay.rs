//! The stage `calibration.delay`.

use afmid_pipeline::{Array, Axis, Context, Document, Example, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::artifacts::{Average, DataSet};
use afmid_kernels::calibration::{OnsetRule, onset_delay};

/// What the averaged snap-off says about the delay, and what it cannot say.
///
/// # Model
/// A delay and a later rupture are the same signal: only rupture + delay shows. Causality bounds it from above (the
/// first departure); the phase of mode 1 measures rupture + delay + the lag of the detector's poles, so that it is
/// known as well as these poles are.
/// # Method
/// First sustained departure from the line before the event; fit of one decaying oscillation to the ringing.
/// # Shapes
/// `average` over `time`.
/// # Units
/// s, on the average's own time axis.
/// # Accuracy
/// 3 ns from other modes for the paper's lever, and white-noise standard errors; fast poles that are not given enter in
/// full.
/// # Errors
/// No departure; no decaying oscillation.
/// # Source
/// Stark et al., Rev. Sci. Instrum. 2005, Data processing (t0 and its ambiguity of +-0.5 us).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Delay {
    /// Departure from the line before the event in standard errors.
    #[schemars(range(min = 2.0, max = 1000.0))]
    pub threshold: f64,
    /// Samples in a row that must depart.
    #[schemars(range(min = 1, max = 1000))]
    pub sustained_samples: usize,
    /// The ringing is fitted from this long after the departure, in s.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub skip_s: f64,
    /// Real detector poles in Hz, as far as they are known.
    #[schemars(inner(range(min = 1.0, max = 1e15)))]
    pub detector_poles_hz: Vec<f64>,
}

impl Default for Delay {
    fn default() -> Self {
        Self { threshold: 5.0, sustained_samples: 3, skip_s: 2e-5, detector_poles_hz: Vec::new() }
    }
}

const AVERAGE: Port<Array> = Port::new("average", "average", "the averaged snap-off: `mean` and `standard_error`");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "bounds on rupture + delay");

impl Stage for Delay {
    const SPEC: Spec = Spec {
        name: "calibration.delay",
        version: 1,
        summary: "bounds on the rupture's time plus the delay, which the response cannot tell apart",
        inputs: &[AVERAGE.spec()],
        outputs: &[SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Data processing",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let average = Average::new(inputs.get(&AVERAGE)?);
        let rule = OnsetRule {
            threshold: self.threshold,
            sustained_samples: self.sustained_samples,
            skip_s: self.skip_s,
            detector_pole_hz: self.detector_poles_hz.clone(),
        };
        let (time, all) = (&average.events().time()?.values, DataSet::All);
        let found = onset_delay(time, average.mean(all)?, average.standard_error(all)?, &rule)
            .map_err(StageError::from_error)?;
        let poles_known = !self.detector_poles_hz.is_empty();
        let summary = json!({
            "delay_s": null,
            "why": "a delay and a later rupture are the same signal; only their sum shows",
            "rupture_plus_delay_latest_s": found.latest_s.min(found.total_lag_s.value),
            "rupture_plus_delay_earliest_s": null,
            "first_departure_s": found.latest_s,
            "total_lag_s": found.total_lag_s,
            "pole_lag_s": poles_known.then_some(found.pole_lag_s),
            "rupture_plus_delay_s": poles_known.then_some(found.onset_and_delay_s),
            "frequency_hz": found.mode_1.0,
            "quality_factor": found.mode_1.1,
        });
        Ok(Ports::new().with(&SUMMARY, Document::new(&summary)?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "a release at 0.1 us seen through one pole at 1 MHz",
            params: "detector_poles_hz = [1e6]",
            inputs: released,
            expect: |outputs| {
                let summary = &outputs.get(&SUMMARY).map_err(|error| error.to_string())?.0;
                let sum = summary["rupture_plus_delay_s"]["value"].as_f64().unwrap_or(f64::NAN);
                // the pole delays mode 1 by its phase lag; noise of 0.1 mV: 0.1 ns
                if (sum - 1e-7).abs() < 1e-9 {
                    Ok(format!("{:.2} ns", sum * 1e9))
                } else {
                    Err(format!("{sum} s, wanted 1e-7"))
                }
            },
        }]
    }
}

/// One mode, 46 kHz, Q 40, released at 0.1 us; its pole at 1 MHz as the exact lag and a start of its own.
fn released() -> Result<Ports, StageError> {
    let (w, q, t0, pole) = (std::f64::consts::TAU * 46e3, 40.0, 1e-7, std::f64::consts::TAU * 1e6);
    let sigma: f64 = w / (2.0 * q);
    let wd = (w * w - sigma * sigma).sqrt();
    // after the pole: A e^{p t} with D(p), and the pole's own decay that keeps the value continuous
    let (re, im) = (pole - sigma, wd);
    let (gain, lag) = (pole / re.hypot(im), im.atan2(re));
    let size = (1.0 + (sigma / wd).powi(2)).sqrt();
    let ring = |t: f64| -0.9 * size * gain * (-sigma * t).exp() * (wd * t - (sigma / wd).atan() - lag).cos();
    let own = -0.9 - ring(0.0);
    let time: Vec<f64> = (-1000..6000).map(|k| f64::from(k) / 5e6).collect();
    let mean: Vec<f64> = time
        .iter()
        .enumerate()
        .map(|(k, t)| {
            let noise = 1e-4 * (k as f64 * 2.4).sin();
            noise + if *t < t0 { -0.9 } else { ring(t - t0) + own * (-pole * (t - t0)).exp() }
        })
        .collect();
    let error = vec![1e-4; time.len()];
    let average = Array::over(vec![Axis::new("time", "s", "time after the onset", time)])
        .with("mean", "V", "averaged event", &["time"], mean)
        .with("standard_error", "V", "its standard error", &["time"], error);
    Ok(Ports::new().with(&AVERAGE, average))
}
