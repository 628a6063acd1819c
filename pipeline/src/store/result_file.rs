//! Writing result files: everything that a run left behind, in one NeXus file.

use std::path::Path;

use hdf5::{File, Group};
use serde_json::Value;

use super::error::{Result, StoreError};
use super::format::write_format;
use super::names::{TAKEN_BY_ENTRY, TAKEN_BY_STAGE, group_names};
use super::ports::write_ports;
use super::run_info::write_run_info;
use super::seal::seal;
use super::write;
use crate::artifact::{Artifact, Values};
use crate::runner::{RunResult, StageRecord};
use crate::stage::Ports;

pub(super) const KIND: &str = "result";
pub(super) const ENTRY: &str = "entry";
pub(super) const PIPELINE: &str = "pipeline";
pub(super) const RUN: &str = "run";
pub(super) const PROVENANCE: &str = "provenance";
pub(super) const STAGES: &str = "stages";
/// The groups of the stages, under the entry.
pub(super) const GROUPS: &str = "stage_groups";

/// Writes a run's result to a new file, seals and syncs it; [`crate::cache::write_result`] replaces an old one safely.
///
/// Errors: the file exists or cannot be written; an artifact is not valid.
pub fn write_result(path: &Path, run: &RunResult) -> std::result::Result<(), StoreError> {
    write_file(path, run).map_err(|error| error.file(path))?;
    seal(path)
}

fn write_file(path: &Path, run: &RunResult) -> Result<()> {
    let file = write::create_file(path)?;
    write_contents(&file, run)?;
    Ok(file.close()?)
}

fn write_contents(file: &File, run: &RunResult) -> Result<()> {
    write_format(file, KIND)?;
    write::text_attribute(file, "default", ENTRY)?;
    let entry = write::nexus_group(file, ENTRY, "NXentry")?;
    write::text(&entry, "title", &run.name)?;
    write_pipeline(&entry, run)?;
    let groups = group_names(run.stages.iter().map(|stage| stage.id.as_str()), &TAKEN_BY_ENTRY);
    let mut default = None;
    for (index, (stage, group)) in run.stages.iter().zip(&groups).enumerate() {
        let process = write_stage_record(&entry, group, stage, &run.program)?;
        write::scalar(&process, "sequence_index", index as i64 + 1)?;
        if let Some(port) = default_port(&stage.result.outputs) {
            write::text_attribute(&process, "default", &port)?;
            default = Some(group);
        }
    }
    if let Some(group) = default {
        write::text_attribute(&entry, "default", group)?;
    }
    write_run_info(&entry, RUN, &run.info)
}

fn write_pipeline(entry: &Group, run: &RunResult) -> Result<()> {
    let group = write::nexus_group(entry, PIPELINE, "NXcollection")?;
    write::text(&group, "name", &run.name)?;
    write::scalar(&group, "seed", run.seed)?;
    write::text(&group, "program", &run.program)?;
    write::texts(&group, "overrides", &run.overrides)?;
    let ids: Vec<&str> = run.stages.iter().map(|stage| stage.id.as_str()).collect();
    write::texts(&group, STAGES, &ids)?;
    write::texts(&group, GROUPS, &group_names(ids.into_iter(), &TAKEN_BY_ENTRY))?;
    let config = write::nexus_group(&group, "config", "NXnote")?;
    write::text(&config, "type", "application/toml")?;
    write::text(&config, "data", &run.config)?;
    Ok(())
}

fn write_stage_record(entry: &Group, group: &str, stage: &StageRecord, program: &str) -> Result<Group> {
    let process = write::nexus_group(entry, group, "NXprocess")?;
    write::text(&process, "program", "afmid")?;
    write::text(&process, "version", program)?;
    write_ports(&process, &stage.result.outputs)?;
    let group = write::nexus_group(&process, PROVENANCE, "NXcollection")?;
    write::text(&group, "uses", &stage.uses)?;
    write::scalar(&group, "stage_version", stage.version)?;
    let params = serde_json::to_string_pretty(&stage.params).map_err(|error| StoreError::new(error.to_string()))?;
    let dataset = write::text(&group, "params", &params)?;
    write_params(&dataset, &stage.params)?;
    for (name, of) in WIRES {
        let values: Vec<&str> = stage.wires.iter().map(of).collect();
        write::texts(&group, name, &values)?;
    }
    if let Some(seed) = stage.seed {
        write::scalar(&group, "seed", seed)?;
    }
    write::text(&group, "key", &stage.key)?;
    let sources = &stage.sources;
    write::texts(&group, "source_path", &sources.iter().map(|file| file.path.as_str()).collect::<Vec<_>>())?;
    let sizes: Vec<u64> = sources.iter().map(|file| file.size).collect();
    write::dataset(&group, "source_size", &[sizes.len()], &sizes)?;
    write::texts(&group, "source_blake3", &sources.iter().map(|file| file.blake3.as_str()).collect::<Vec<_>>())?;
    write::texts(&group, "warnings", &stage.result.warnings)?;
    Ok(process)
}

type Wire = (String, String, String);
/// A column of the wires' table: its name and how to read it.
pub(super) type WireColumn = (&'static str, fn(&Wire) -> &str);

pub(super) const WIRES: [WireColumn; 3] =
    [("input_port", |wire| &wire.0), ("input_stage", |wire| &wire.1), ("input_output", |wire| &wire.2)];

/// Scalar parameters as attributes as well: what people see at once in a viewer.
fn write_params(owner: &hdf5::Location, params: &Value) -> Result<()> {
    for (name, value) in params.as_object().into_iter().flatten() {
        match value {
            Value::Bool(flag) => write::attribute(owner, name, &i8::from(*flag)),
            Value::Number(number) => match number.as_i64() {
                Some(whole) => write::attribute(owner, name, &whole),
                None => write::attribute(owner, name, &number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) => write::text_attribute(owner, name, text),
            _ => Ok(()),
        }?;
    }
    Ok(())
}

/// The first array that is a curve or an image: what a viewer shows of a stage.
fn default_port(ports: &Ports) -> Option<String> {
    let plots = |artifact: &Artifact| match artifact {
        Artifact::Array(array) => array.variables.first().is_some_and(|signal| {
            !signal.dims.is_empty() && signal.values.len() > 1 && !matches!(signal.values, Values::Integer(_))
        }),
        _ => false,
    };
    let groups = group_names(ports.iter().map(|(name, _)| name), &TAKEN_BY_STAGE);
    ports.iter().zip(groups).find(|((_, artifact), _)| plots(artifact)).map(|(_, group)| group)
}
