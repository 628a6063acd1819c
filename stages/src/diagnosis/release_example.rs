//! The example of `diagnosis.release`: releases seen through a photodiode that bends.

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{Array, Axis, Document, Example, Port, Ports, Recording, Shaped};

use crate::io::{memory_channel, memory_record};
use crate::simulate::example::{BEND, DETECTOR_POLE_HZ, MODES, NOISE_V, RATE_HZ, RECORDS};
use afmid_kernels::diagnosis::release::{Lever, LeverMode};

const SUMMARY: Port<Document> = Port::new("summary", "summary", "the verdict");
/// First sample after the release.
const RELEASE: usize = 6000;
const SAMPLES: usize = 60_000;

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "eight releases through a detector with 0.02 per volt of the square",
        params: "modes = 2\ndetector_poles_hz = [1.5e6]\nwindow_samples = 4000",
        inputs: || Ok(inputs()),
        expect: |outputs| {
            let text = |error: afmid_pipeline::StageError| error.to_string();
            let found = &outputs.get(&SUMMARY).map_err(text)?.0;
            let cause = &found["causes"][0];
            let a2 = &cause["parameters"]["a2"];
            let (value, std) = (a2["value"].as_f64().unwrap_or(f64::NAN), a2["std"].as_f64().unwrap_or(f64::NAN));
            // four standard errors
            if found["verdict"] == "named" && cause["id"] == "quadratic-detector" && (value - BEND).abs() < 4.0 * std {
                Ok(format!("named: quadratic-detector, a2 = {value:.4} +- {std:.4} 1/V."))
            } else {
                Err(found.to_string())
            }
        },
    }]
}

/// The lever that is released.
fn lever() -> Lever {
    let omega = |frequency_hz: f64| std::f64::consts::TAU * frequency_hz;
    let mode = |(frequency_hz, quality_factor, share)| LeverMode { omega: omega(frequency_hz), quality_factor, share };
    Lever { modes: MODES.map(mode).to_vec(), poles: vec![omega(DETECTOR_POLE_HZ)] }
}

/// Eight records with a release each, and their ensemble.
pub(super) fn inputs() -> Ports {
    let exponentials = lever().release();
    let mut state = 4711_u32;
    // a linear congruential generator (Numerical Recipes); twelve of them make a normal deviate
    let mut draw = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX)
    };
    let (mut records, mut onsets) = (Vec::new(), Vec::new());
    for number in 0..RECORDS {
        let load = 0.8 + 0.3 * draw();
        let lead = draw();
        onsets.push((RELEASE as f64 - lead) / RATE_HZ);
        let values: Vec<f64> = (0..SAMPLES)
            .map(|k| {
                let s = match k.checked_sub(RELEASE) {
                    None => -load,
                    Some(after) => {
                        let t = (after as f64 + lead) / RATE_HZ;
                        load * exponentials.iter().map(|e| e.value(t)).sum::<f64>()
                    }
                };
                let noise: f64 = (0..12).map(|_| draw()).sum::<f64>() - 6.0;
                s + BEND * s * s + NOISE_V * noise
            })
            .collect();
        let channel = memory_channel("deflection", Raw::Float64(values), 1.0);
        records.push(memory_record(&format!("record_{number}.h5"), RATE_HZ, vec![channel]));
    }
    let ensemble = Array::over(vec![Axis::new("event", "1", "event", (0..RECORDS).map(|k| k as f64).collect())])
        .with("onset", "s", "time of the onset in its record", &["event"], onsets)
        .with("record", "1", "number of the record", &["event"], (0..RECORDS as i64).collect::<Vec<_>>())
        .attribute("sample_rate_hz", RATE_HZ);
    let mut ports = Ports::new();
    ports.insert("records", Recording { records }.wrap());
    ports.insert("ensemble", ensemble.wrap());
    ports
}
