//! The example of `diagnosis.replay`: the releases of `diagnosis.release`, and the model that made them.

use afmid_pipeline::{Document, Example, Port};

use super::release_example::inputs;
use crate::simulate::MODEL;
use crate::simulate::example::model;

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
            // the mean of 4000 values of white noise: its rms scatters by 1.1 %, four of them; two rows of five fit
            // parameters take less
            if before > 2.0 && (after - 1.0).abs() < 0.05 {
                Ok(format!("the mean residual falls from {before:.1} to {after:.2} times what noise leaves."))
            } else {
                Err(found.to_string())
            }
        },
    }]
}
