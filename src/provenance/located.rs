//! From a path to a number and to the dataset that holds it.

use afmid_pipeline::artifact::{ColumnValues, std_name};
use afmid_pipeline::error::StoreError;
use afmid_pipeline::store::{PortSummary, ResultFile, StageSummary};
use afmid_pipeline::{Array, Artifact, Shape, Table, Values};
use serde::Serialize;
use serde_json::{Value, json};

use super::path::{Step, pointer, suggestion, typed, walk};
use crate::show::{SUMMARY, artifact_json};

/// A place in a result file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Dataset {
    /// The HDF5 object; `object@attribute` for an attribute.
    pub dataset: String,
    /// Where in it; empty: all of it.
    pub index: Vec<usize>,
    /// Where in the JSON that it holds; null: it holds none.
    pub pointer: Option<String>,
}

/// A value of a stage and where it lies.
#[derive(Debug, Clone, Serialize)]
pub struct Located {
    /// The path in full.
    pub path: String,
    /// The value.
    pub value: Value,
    /// Its standard error; null: none is stated.
    pub standard_error: Option<f64>,
    /// The output that holds it.
    pub output: String,
    /// Where that lies.
    #[serde(flatten)]
    pub place: Dataset,
    /// Columns of the stage's tables that hold the same number under the same name.
    pub also: Vec<Dataset>,
}

/// Why a path leads nowhere.
#[derive(Debug)]
pub enum Lost {
    /// The path is wrong: the problem, and what would be right.
    Path(String, String),
    /// The file is damaged.
    File(StoreError),
}

impl From<StoreError> for Lost {
    fn from(error: StoreError) -> Self {
        Self::File(error)
    }
}

impl From<(String, String)> for Lost {
    fn from((problem, help): (String, String)) -> Self {
        Self::Path(problem, help)
    }
}

/// Finds a value by its steps in the JSON of a stage, as `afmid show RESULT ID --json` prints it; outputs beside the
/// summary are found by their names. Where the JSON has a key of the stage's own name, the path may leave it out:
/// `modes[0]` is `modes.modes[0]`.
pub fn locate(file: &ResultFile, stage: &StageSummary, steps: &[Step]) -> Result<Located, Lost> {
    let id = &stage.record.id;
    let named = |name: &str| stage.ports.iter().find(|port| port.name == name);
    let first = match steps.first() {
        Some(Step::Key(key)) => Some(key.as_str()),
        _ => None,
    };
    let summary = named(SUMMARY).filter(|port| port.shape == Shape::Document);
    if let Some(port) = summary {
        let artifact = file.artifact(id, SUMMARY)?;
        let json = artifact_json(&artifact);
        let steps = implied(id, &json, steps);
        // a key of the summary and an output may have one name
        let other_port = first.and_then(named).filter(|_| walk(&json, id, &steps).is_err());
        if other_port.is_none() {
            known(id, &json, stage, &steps)?;
            return in_artifact(file, stage, port, &artifact, &steps, id.clone());
        }
    }
    let ports: Value =
        stage.ports.iter().map(|port| (port.name.clone(), Value::Null)).collect::<serde_json::Map<_, _>>().into();
    let steps = implied(id, &ports, steps);
    let names = || stage.ports.iter().map(|port| port.name.as_str());
    let (port, steps) = match steps.split_first() {
        Some((Step::Key(key), rest)) => {
            let port =
                named(key).ok_or_else(|| (format!("stage `{id}` has no output `{key}`"), suggestion(key, names())))?;
            (port, rest)
        }
        _ => {
            let help = format!("name one of its outputs: {}", names().collect::<Vec<_>>().join(", "));
            return Err(Lost::Path(format!("`{}` names no output of stage `{id}`", typed(id, &steps)), help));
        }
    };
    let artifact = file.artifact(id, &port.name)?;
    in_artifact(file, stage, port, &artifact, steps, format!("{id}.{}", port.name))
}

/// Errors: the first step is neither a key of the summary nor an output.
fn known(id: &str, summary: &Value, stage: &StageSummary, steps: &[Step]) -> Result<(), (String, String)> {
    let (Some(Step::Key(key)), Some(entries)) = (steps.first(), summary.as_object()) else { return Ok(()) };
    let outputs = stage.ports.iter().map(|port| port.name.as_str());
    let names = || entries.keys().map(String::as_str).chain(outputs.clone());
    if names().any(|name| name == key) {
        return Ok(());
    }
    Err((format!("`{id}` has no `{key}`"), suggestion(key, names())))
}

/// The steps with the key of the stage's own name, where only that makes them lead anywhere.
fn implied(id: &str, json: &Value, steps: &[Step]) -> Vec<Step> {
    let has = |step: Option<&Step>| match step {
        Some(Step::Key(key)) => json.get(key).is_some(),
        Some(Step::Index(index)) => json.get(index).is_some(),
        None => true,
    };
    let inner = json.get(id);
    let inside = match steps.first() {
        Some(Step::Key(key)) => inner.is_some_and(|inner| inner.get(key).is_some() || inner.is_null()),
        _ => inner.is_some(),
    };
    let own = (!has(steps.first()) && inside).then(|| Step::Key(id.to_owned()));
    own.into_iter().chain(steps.iter().cloned()).collect()
}

fn in_artifact(
    file: &ResultFile,
    stage: &StageSummary,
    port: &PortSummary,
    artifact: &Artifact,
    steps: &[Step],
    root: String,
) -> Result<Located, Lost> {
    let group = format!("/entry/{}/{}", stage.group, port.group);
    let json = artifact_json(artifact);
    let (value, standard_error, place) = match (artifact, variable(artifact, steps)) {
        (_, Some((value, error, name, index))) => {
            (value, error, Dataset { dataset: format!("{group}/{name}"), index, pointer: None })
        }
        _ => {
            let value = walk(&json, &root, steps)?.clone();
            (value, error_beside(&json, steps), dataset(&group, artifact, steps))
        }
    };
    let also = same_numbers(file, stage, steps, &value, &place)?;
    let output = port.name.clone();
    Ok(Located { path: typed(&root, steps), value, standard_error, output, place, also })
}

/// The number that stands beside a value under the name of its standard error.
fn error_beside(json: &Value, steps: &[Step]) -> Option<f64> {
    let (last, before) = steps.split_last()?;
    let (Step::Key(name), Ok(Value::Object(entries))) = (last, walk(json, "", before)) else { return None };
    entries.get(std_name(name, entries.keys().map(String::as_str))?)?.as_f64()
}

/// What the JSON of an artifact does not show: the values of an array's variables, as `variable[1][2]`.
fn variable(artifact: &Artifact, steps: &[Step]) -> Option<(Value, Option<f64>, String, Vec<usize>)> {
    let (Artifact::Array(array), Some((Step::Key(name), indices))) = (artifact, steps.split_first()) else {
        return None;
    };
    let variable = array.variable(name).ok()?;
    let index: Vec<usize> = indices
        .iter()
        .map(|step| match step {
            Step::Index(index) => Some(*index),
            Step::Key(_) => None,
        })
        .collect::<Option<_>>()?;
    let flat = flat_index(array, &variable.dims, &index)?;
    let names = array.variables.iter().map(|variable| variable.name.as_str());
    let error = std_name(name, names).and_then(|std| array.real(std).ok()?.get(flat).copied());
    let (value, dataset) = match &variable.values {
        Values::Real(_) | Values::Stored(_) => (json!(variable.values.real()?.ok()?.get(flat)?), name.clone()),
        Values::Integer(values) => (json!(values.get(flat)?), name.clone()),
        Values::Complex(values) => {
            let value = values.get(flat)?;
            (json!({ "real": value.re, "imag": value.im }), format!("{name}_real"))
        }
    };
    Some((value, error.filter(|error| error.is_finite()), dataset, index))
}

fn flat_index(array: &Array, dims: &[String], index: &[usize]) -> Option<usize> {
    if dims.len() != index.len() {
        return None;
    }
    dims.iter().zip(index).try_fold(0, |flat, (dim, &index)| {
        let length = array.axis(dim).ok()?.values.len();
        (index < length).then_some(flat * length + index)
    })
}

/// The HDF5 object that holds a value of an artifact's JSON.
fn dataset(group: &str, artifact: &Artifact, steps: &[Step]) -> Dataset {
    let whole = |name: &str| Dataset { dataset: format!("{group}{name}"), index: Vec::new(), pointer: None };
    match (artifact, steps) {
        (Artifact::Document(_), _) => Dataset { pointer: Some(pointer(steps)), ..whole("/data") },
        (Artifact::Table(_), [Step::Index(row), Step::Key(column)]) => {
            Dataset { index: vec![*row], ..whole(&format!("/{column}")) }
        }
        (Artifact::Array(_) | Artifact::StateSpace(_), [Step::Key(kind), Step::Key(name)]) if kind == "attributes" => {
            whole(&format!("@{name}"))
        }
        (Artifact::StateSpace(_), [Step::Key(name), rest @ ..]) => {
            let index = rest.iter().filter_map(|step| if let Step::Index(index) = step { Some(*index) } else { None });
            // matrices bear capital letters in the file
            let name = if name.len() == 1 { name.to_uppercase() } else { name.clone() };
            Dataset { index: index.collect(), ..whole(&format!("/{name}")) }
        }
        (Artifact::Recording(_), [Step::Index(row), Step::Key(name)]) => {
            let column = match name.as_str() {
                "name" => "/records/file",
                "size_bytes" => "/records/size",
                "sample_rate_hz" => "/records/sample_rate",
                "blake3" => "/records/blake3",
                "path" => "/records/path",
                _ => "/channels",
            };
            Dataset { index: vec![*row], ..whole(column) }
        }
        _ => whole(""),
    }
}

/// The columns of the stage's tables that hold the same number under the same name.
fn same_numbers(
    file: &ResultFile,
    stage: &StageSummary,
    steps: &[Step],
    value: &Value,
    place: &Dataset,
) -> Result<Vec<Dataset>, StoreError> {
    let (Some(Step::Key(name)), Some(wanted)) = (steps.last(), value.as_f64()) else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    for port in stage.ports.iter().filter(|port| port.shape == Shape::Table) {
        let Artifact::Table(table) = file.artifact(&stage.record.id, &port.name)? else { continue };
        let rows = rows_with(&table, name, wanted);
        let dataset = format!("/entry/{}/{}/{name}", stage.group, port.group);
        let places = rows.into_iter().map(|row| Dataset { dataset: dataset.clone(), index: vec![row], pointer: None });
        found.extend(places.filter(|other| other != place));
    }
    Ok(found)
}

fn rows_with(table: &Table, name: &str, wanted: f64) -> Vec<usize> {
    let Ok(column) = table.column(name) else { return Vec::new() };
    let ColumnValues::Real(values) = &column.values else { return Vec::new() };
    (0..).zip(values).filter(|(_, value)| value.to_bits() == wanted.to_bits()).map(|(row, _)| row).collect()
}
