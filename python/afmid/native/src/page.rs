//! The page about a result that is in no file.

use afmid_pipeline::{Ports, RunInfo, RunResult, StageRecord, StageResult};
use pyo3::prelude::*;

use crate::artifact::Artifact;
use crate::cause::{OwnCause, with_causes};
use crate::errors;
use crate::stage::{listed, with_all_params};

/// What `afmid report` writes of a stage by itself: its name, parameters (JSON), artifacts by port, and what it warned
/// of; `causes` that a diagnosis was given.
///
/// Errors: no such stage, a parameter that is wrong.
#[pyfunction]
#[pyo3(signature = (name, uses, params, ports, warnings, causes = Vec::new()))]
pub fn page(
    py: Python<'_>,
    name: &str,
    uses: &str,
    params: &str,
    ports: Vec<(String, Py<Artifact>)>,
    warnings: Vec<String>,
    causes: Vec<Py<OwnCause>>,
) -> PyResult<String> {
    let (version, params) = with_causes(&listed(&causes), || with_all_params(uses, params))?;
    let mut outputs = Ports::new();
    for (port, artifact) in &ports {
        outputs.insert(port, artifact.get().0.clone());
    }
    let stage = StageRecord {
        id: uses.rsplit('.').next().unwrap_or(uses).to_owned(),
        uses: uses.to_owned(),
        version,
        params,
        wires: Vec::new(),
        seed: None,
        key: String::new(),
        sources: Vec::new(),
        result: StageResult { outputs, warnings },
    };
    let run = RunResult {
        name: name.to_owned(),
        seed: 1,
        config: String::new(),
        overrides: Vec::new(),
        program: env!("CARGO_PKG_VERSION").to_owned(),
        stages: vec![stage],
        info: RunInfo::default(),
    };
    py.detach(|| afmid::page(&run)).map_err(errors::config)
}
