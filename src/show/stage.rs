//! A stage of a result file as JSON.

use afmid_pipeline::Artifact;
use afmid_pipeline::store::{ResultFile, StageSummary};
use serde_json::{Map, Value};

use super::json::artifact_json;
use crate::failure::Failure;

/// The port whose document stands for a stage.
pub const SUMMARY: &str = "summary";

/// The stage's summary, or else all its artifacts by port. Errors: one is damaged.
pub fn stage_json(file: &ResultFile, stage: &StageSummary) -> Result<Value, Failure> {
    let mut ports = Map::new();
    for port in &stage.ports {
        let artifact = file.artifact(&stage.record.id, &port.name);
        match artifact.map_err(|error| Failure::failed(&error, error.help.clone()))? {
            Artifact::Document(document) if port.name == SUMMARY => return Ok(document.0.clone()),
            artifact => ports.insert(port.name.clone(), artifact_json(&artifact)),
        };
    }
    Ok(Value::Object(ports))
}
