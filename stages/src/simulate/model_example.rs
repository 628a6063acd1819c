//! The example of `simulate.model`: a lever behind a photodiode that bends. The examples of `diagnosis` release the
//! same one.

use std::collections::BTreeMap;

use afmid_pipeline::{Document, Example, Port, Ports};

use super::lever_model::{Estimated, LeverModel, LinearPart, MODEL, ModelAmplitude, ModelCause, ModelMode, ModelNoise};

const TRUTH: Port<Document> = Port::new("truth", "truth", "the truth");

/// Weight of the square of the signal, 1/V.
pub(crate) const BEND: f64 = 0.02;
pub(crate) const RATE_HZ: f64 = 5e6;
pub(crate) const RECORDS: usize = 8;
/// White noise, V.
pub(crate) const NOISE_V: f64 = 1.2e-3;
/// Frequency in Hz, quality factor and static share of each mode.
pub(crate) const MODES: [(f64, f64, f64); 2] = [(46.3e3, 40.8, 0.92), (247.4e3, 193.2, 0.08)];
pub(crate) const DETECTOR_POLE_HZ: f64 = 1.5e6;

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "two records of a lever of two modes behind a bent photodiode",
        params: "records = 2\nseed = 5",
        inputs: || Ok(Ports::new().with(&MODEL, Document::new(&model())?)),
        expect: |outputs| {
            let truth = &outputs.get(&TRUTH).map_err(|error| error.to_string())?.0;
            let hidden = &truth["parameters"]["hidden"][0];
            if hidden["cause"] == "quadratic-detector" && truth["counts"]["snap_off"] == 2 {
                Ok(format!("two snap-offs through a detector with a2 = {} 1/V.", hidden["a2"]))
            } else {
                Err(truth["counts"].to_string())
            }
        },
    }]
}

/// That lever as a diagnosis would hand it on.
pub(crate) fn model() -> LeverModel {
    let known = |value: f64| Estimated { value, std: None };
    let mode = |(frequency_hz, quality_factor, share)| ModelMode {
        frequency_hz: known(frequency_hz),
        quality_factor: known(quality_factor),
        share: known(share),
    };
    let part = LinearPart { modes: MODES.map(mode).to_vec(), detector_poles_hz: vec![known(DETECTOR_POLE_HZ)] };
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
