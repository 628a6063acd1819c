//! A stage of one's own, with its own binary: what `afmid new stage NAME --rust` begins with.
//!
//! `cargo run -- run new_stage.toml` runs its config; `cargo test` tries the stage as afmid's own are tried.

use std::process::ExitCode;

use afmid_pipeline::{
    Array, Axis, Context, Document, Entry, Example, Port, Ports, Spec, Stage, StageError, schemars, serde,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

const AVERAGE: Port<Array> = Port::new("average", "average", "the averaged event; its first variable is used");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "root mean square of the end");

/// Root mean square of the end of an averaged event: what is left of ringing and noise when the window ends.
///
/// # Model
/// None.
/// # Method
/// `sqrt(mean((y - mean(y))^2))` over the last samples.
/// # Shapes
/// `average`: one variable over `time` (N samples).
/// # Units
/// Those of the signal.
/// # Accuracy
/// Of white noise alone, relative: `1 / sqrt(2 samples)`.
/// # Errors
/// Fewer samples than asked for.
/// # Source
/// The definition of a standard deviation.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, crate = "afmid_pipeline::serde")]
#[schemars(crate = "afmid_pipeline::schemars")]
struct NewStage {
    /// Samples at the end.
    #[schemars(range(min = 2))]
    samples: usize,
}

impl Default for NewStage {
    fn default() -> Self {
        Self { samples: 512 }
    }
}

impl Stage for NewStage {
    const SPEC: Spec = Spec {
        name: "custom.new_stage",
        version: 1,
        summary: "Root mean square of the end of an averaged event",
        inputs: &[AVERAGE.spec()],
        outputs: &[SUMMARY.spec()],
        source: "definition",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let average = inputs.get(&AVERAGE)?;
        let name = average.variables.first().map(|variable| variable.name.clone()).unwrap_or_default();
        let signal = average.real(&name)?;
        let Some(start) = signal.len().checked_sub(self.samples) else {
            let (found, wanted) = (signal.len(), self.samples);
            return Err(StageError::new(format!("`{name}` has {found} samples, wanted at least {wanted}"))
                .help("lower `samples`, or cut longer windows"));
        };
        let end = &signal[start..];
        let mean = end.iter().sum::<f64>() / end.len() as f64;
        let square = end.iter().map(|y| (y - mean) * (y - mean)).sum::<f64>() / end.len() as f64;
        Ok(Ports::new().with(&SUMMARY, Document(serde_json::json!({ "rms": square.sqrt(), "samples": end.len() }))))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "two levels",
            params: "samples = 4",
            inputs: || {
                let time = vec![0.0, 1e-6, 2e-6, 3e-6, 4e-6];
                let axis = Axis::new("time", "s", "time after the event", time);
                let values = vec![9.0, 1.0, 3.0, 1.0, 3.0];
                Ok(Ports::new()
                    .with(&AVERAGE, Array::over(vec![axis]).with("mean", "V", "averaged event", &["time"], values)))
            },
            expect: |outputs| {
                let summary = outputs.get(&SUMMARY).map_err(|error| error.to_string())?;
                match summary.0["rms"].as_f64() {
                    Some(1.0) => Ok("rms 1 V".to_owned()),
                    other => Err(format!("{other:?}")),
                }
            },
        }]
    }
}

fn main() -> ExitCode {
    match afmid::registry().and_then(|built_in| built_in.with(&[Entry::of::<NewStage>()])) {
        Ok(registry) => afmid::main(&registry),
        Err(double) => {
            eprintln!("{double}");
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_keeps_what_stages_promise() {
        // its ports, its documentation, its examples, the same bits twice, unknown parameters refused
        let broken = afmid_pipeline::conformance::violations(&Entry::of::<NewStage>());
        assert!(broken.is_empty(), "{broken:#?}");
    }
}
