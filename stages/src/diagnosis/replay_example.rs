//! The example of `diagnosis.replay`: the releases of `diagnosis.release`, and the model that made them.

use std::collections::BTreeMap;

use afmid_pipeline::{Document, Example, Port};

use super::lever_model::{Estimated, LeverModel, LinearPart, MODEL, ModelAmplitude, ModelCause, ModelMode, ModelNoise};
use super::release_example::{BEND, NOISE_V, RATE_HZ, RECORDS, inputs, lever};

const SUMMARY: Port<Document> = Port::new("summary", "summary", "what is left");

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "eight releases through a detector with 0.02 per volt of the square, simulated without and with it",
        params: "window_samples = 4000",
        inputs: || Ok(inputs().with(&MODEL, Document::new(&model())?)),
        expect: |outputs| {
            let found = &outputs.get(&SUMMARY).map_err(|error| error.to_string())?.0;
            let ratio = |part: &str| found[part]["mean_over_noise"].as_f64().unwrap_or(f64::NAN);
            let (before, after) = (ratio("before"), ratio("after"));
            // the mean of 4000 values of white noise: its rms scatters by 1.1 %, four of them; two rows of five fit parameters take less
            if before > 2.0 && (after - 1.0).abs() < 0.05 {
                Ok(format!("the mean residual falls from {before:.1} to {after:.2} times what noise leaves."))
            } else {
                Err(found.to_string())
            }
        },
    }]
}

/// The truth of the example as a diagnosis would hand it on.
pub(crate) fn model() -> LeverModel {
    let known = |value: f64| Estimated { value, std: None };
    let lever = lever();
    let part = LinearPart {
        modes: lever
            .modes
            .iter()
            .map(|mode| ModelMode {
                frequency_hz: known(mode.omega / std::f64::consts::TAU),
                quality_factor: known(mode.quality_factor),
                share: known(mode.share),
            })
            .collect(),
        detector_poles_hz: lever.poles.iter().map(|pole| known(pole / std::f64::consts::TAU)).collect(),
    };
    LeverModel {
        sample_rate_hz: RATE_HZ,
        records: RECORDS,
        baseline: part.clone(),
        extended: part,
        causes: vec![ModelCause {
            id: "quadratic-detector".to_owned(),
            parameters: BTreeMap::from([("a2".to_owned(), known(BEND))]),
            assumed: Vec::new(),
        }],
        noise: ModelNoise { white_v2: NOISE_V * NOISE_V, thermal: Vec::new(), wander: Vec::new() },
        amplitude: ModelAmplitude { mean_v: 0.95, scatter_v: 0.09, events: RECORDS },
    }
}
