//! Units of a model's inputs and outputs: those of the pair that it was identified from.

use afmid_pipeline::store::{ResultFile, StageSummary};
use afmid_pipeline::{Artifact, Shape};
use serde::Serialize;

/// Units; empty (null) where the model was not identified from a pair of the result file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Units {
    /// Of the sample time.
    pub time: &'static str,
    /// Of the inputs.
    pub input: Option<String>,
    /// Of the outputs.
    pub output: Option<String>,
}

/// The units of `force` and `response` in the first array that goes into a stage and has both.
pub fn units(file: &ResultFile, stage: &StageSummary) -> Units {
    let mut arrays = stage.record.wires.iter().filter_map(|(_, from, port)| {
        let have = file.stage(from)?.ports.iter().find(|have| have.name == *port)?;
        if have.shape != Shape::Array {
            return None;
        }
        // an artifact that cannot be read has no units to give: the export of the artifact itself reports why
        match file.artifact(from, port).ok()? {
            Artifact::Array(array) => Some(array),
            _ => None,
        }
    });
    let unit = |array: &afmid_pipeline::Array, name: &str| array.variable(name).ok().map(|found| found.unit.clone());
    let found = arrays.find_map(|array| Some((unit(&array, "force")?, unit(&array, "response")?)));
    let (input, output) = found.unzip();
    Units { time: "s", input, output }
}
