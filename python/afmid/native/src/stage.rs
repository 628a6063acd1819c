//! Stages by themselves.

use std::collections::BTreeMap;
use std::path::Path;

use afmid_pipeline::stage::{Bounds, NoProgress};
use afmid_pipeline::{Context, DynStage, Entry, Ports, Stage, toml};
use pyo3::prelude::*;

use crate::artifact::Artifact;
use crate::cause::{OwnCause, PythonCause, with_causes};
use crate::errors;
use crate::watch::watched;

/// What a stage hands on, by port, and what it warns of.
type Outcome = (Vec<(String, Artifact)>, Vec<String>);

/// The stage of this name. Errors: there is none.
fn entry(name: &str) -> PyResult<Entry> {
    let registry = afmid::registry().map_err(errors::config)?;
    registry.find(name).copied().ok_or_else(|| errors::config(format!("there is no stage `{name}`")))
}

/// The stage with these parameters. Errors: a parameter that is wrong, or beyond its range.
fn parsed(entry: &Entry, params: toml::Table) -> PyResult<Box<dyn DynStage>> {
    let stage = entry.parse(params.clone()).map_err(|error| {
        let place = if matches!(error.path.as_str(), "" | ".") { String::new() } else { format!("`{}`: ", error.path) };
        errors::config(format!("{place}{}", error.message))
    })?;
    if let Some(wrong) = Bounds::of(entry).check(&params).into_iter().next() {
        return Err(errors::config(format!("`{}` {}", wrong.path.join("."), wrong.message)));
    }
    match stage.faults().into_iter().next() {
        Some(fault) => Err(errors::config(fault.problem)),
        None => Ok(stage),
    }
}

/// Version and all parameters of a stage, of which these (JSON) are given. Errors: there is no such stage; as [`parsed`].
pub fn with_all_params(name: &str, params: &str) -> PyResult<(u32, serde_json::Value)> {
    let entry = entry(name)?;
    let stage = parsed(&entry, serde_json::from_str(params).map_err(errors::config)?)?;
    Ok((entry.spec.version, stage.params().map_err(errors::stage)?))
}

/// The parameters of a reader that arrays stand in for; `instead`: what it wants where a file was. Errors: as [`parsed`].
pub fn checked<S: Stage>(params: &str, instead: (&str, serde_json::Value)) -> PyResult<S> {
    let mut params: serde_json::Value = serde_json::from_str(params).map_err(errors::config)?;
    params[instead.0] = instead.1;
    parsed(&Entry::of::<S>(), serde_json::from_value(params.clone()).map_err(errors::config)?)?;
    serde_json::from_value(params).map_err(errors::config)
}

/// Runs a stage with parameters (JSON; what is not stated has its default) on artifacts by port; returns its artifacts by
/// port, and its warnings. `base`: the folder of relative paths; `causes`: further ones for a diagnosis. Without the
/// interpreter's lock; Ctrl-C ends it.
///
/// Errors: a parameter that is wrong; as the stage.
#[pyfunction]
#[pyo3(signature = (name, inputs, params, seed = 1, base = ".", causes = Vec::new()))]
pub fn run_stage(
    py: Python<'_>,
    name: &str,
    inputs: BTreeMap<String, Py<Artifact>>,
    params: &str,
    seed: u64,
    base: &str,
    causes: Vec<Py<OwnCause>>,
) -> PyResult<Outcome> {
    let causes = listed(&causes);
    let params = serde_json::from_str(params).map_err(errors::config)?;
    let stage = with_causes(&causes, || parsed(&entry(name)?, params))?;
    let mut ports = Ports::new();
    for (port, artifact) in &inputs {
        ports.insert(port, artifact.get().0.clone());
    }
    let (outputs, warnings) = watched(py, |cancel| {
        with_causes(&causes, || {
            let cx = Context::new(Path::new(base), seed, &NoProgress).with_cancel(cancel);
            let outputs = stage.run(&ports, &cx).map_err(errors::stage)?;
            Ok((outputs, cx.into_warnings()))
        })
    })?;
    let outputs = outputs.iter().map(|(port, artifact)| (port.to_owned(), Artifact(artifact.clone()))).collect();
    Ok((outputs, warnings))
}

/// What the catalogue takes of causes.
pub fn listed(causes: &[Py<OwnCause>]) -> Vec<&'static PythonCause> {
    causes.iter().map(|cause| cause.get().0).collect()
}

/// All parameters of a stage with their defaults, as JSON. Errors: there is no such stage.
#[pyfunction]
pub fn stage_parameters(name: &str) -> PyResult<String> {
    let stage = entry(name)?.parse(toml::Table::new()).map_err(|error| errors::config(error.message))?;
    Ok(stage.params().map_err(errors::stage)?.to_string())
}

/// Id and name of each stage of a config. Errors: it is no TOML; a stage without id or name.
#[pyfunction]
pub fn stages_of(config: &str) -> PyResult<Vec<(String, String)>> {
    let config: toml::Table = toml::from_str(config).map_err(errors::config)?;
    let stages = config.get("stage").and_then(toml::Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let text = |stage: &toml::Value, key: &str| {
        let found = stage.get(key).and_then(toml::Value::as_str);
        found.map(str::to_owned).ok_or_else(|| errors::config(format!("a stage has no `{key}`")))
    };
    stages.iter().map(|stage| Ok((text(stage, "id")?, text(stage, "uses")?))).collect()
}
