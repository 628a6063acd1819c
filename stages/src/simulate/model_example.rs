//! The example of `simulate.model`: the model of the example of `diagnosis.replay`.

use afmid_pipeline::{Document, Example, Port, Ports};

use crate::diagnosis::{MODEL, example_model};

const TRUTH: Port<Document> = Port::new("truth", "truth", "the truth");

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "two records of a lever of two modes behind a bent photodiode",
        params: "records = 2\nseed = 5",
        inputs: || Ok(Ports::new().with(&MODEL, Document::new(&example_model())?)),
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
