//! Result files: everything that a run left behind, in one NeXus file.

use std::path::{Path, PathBuf};

use hdf5::{File, Group};
use serde_json::Value;

use super::error::{Result, StoreError};
use super::format::{check_format, write_format};
use super::ports::{list_ports, read_port, read_ports, write_ports};
use super::run_info::{read_run_info, write_run_info};
use super::{read, write};
use crate::artifact::{Artifact, Shape, Values};
use crate::runner::{RunInfo, RunResult, SourceFile, StageRecord, StageResult};
use crate::stage::Ports;

const KIND: &str = "result";
const ENTRY: &str = "entry";
const PIPELINE: &str = "pipeline";
const RUN: &str = "run";
const PROVENANCE: &str = "provenance";
const STAGES: &str = "stages";

/// Stage ids that a result file has another use for.
pub const RESERVED_STAGE_IDS: [&str; 4] = [PIPELINE, RUN, "title", "definition"];

/// Port names that a result file has another use for.
pub const RESERVED_PORTS: [&str; 6] = [PROVENANCE, "program", "version", "sequence_index", "date", "note"];

/// Writes a run's result to a new file, without syncing it: see [`crate::cache::write_result`] for the safe way.
///
/// Errors: the file exists or cannot be written; an artifact is not valid; a stage's id or port is reserved.
pub fn write_result(path: &Path, run: &RunResult) -> std::result::Result<(), StoreError> {
    write_file(path, run).map_err(|error| error.file(path))
}

fn write_file(path: &Path, run: &RunResult) -> Result<()> {
    let file = write::create_file(path, 0)?;
    write_contents(&file, run)?;
    Ok(file.close()?)
}

fn write_contents(file: &File, run: &RunResult) -> Result<()> {
    write_format(file, KIND)?;
    write::text_attribute(file, "default", ENTRY)?;
    let entry = write::nexus_group(file, ENTRY, "NXentry")?;
    write::text(&entry, "title", &run.name)?;
    write_pipeline(&entry, run)?;
    for (index, stage) in run.stages.iter().enumerate() {
        write_stage_record(&entry, index, stage, &run.program)?;
    }
    if let Some(stage) = run.stages.iter().rev().find(|stage| default_port(&stage.result.outputs).is_some()) {
        write::text_attribute(&entry, "default", &stage.id)?;
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
    let config = write::nexus_group(&group, "config", "NXnote")?;
    write::text(&config, "type", "application/toml")?;
    write::text(&config, "data", &run.config)?;
    Ok(())
}

fn write_stage_record(entry: &Group, index: usize, stage: &StageRecord, program: &str) -> Result<()> {
    if RESERVED_STAGE_IDS.contains(&stage.id.as_str()) {
        return Err(StoreError::new(format!("the stage id `{}` is reserved: choose another", stage.id)));
    }
    if let Some((port, _)) = stage.result.outputs.iter().find(|(port, _)| RESERVED_PORTS.contains(port)) {
        return Err(StoreError::new(format!("stage `{}`: the port name `{port}` is reserved", stage.id)));
    }
    let process = write::nexus_group(entry, &stage.id, "NXprocess")?;
    write::text(&process, "program", "afmid")?;
    write::text(&process, "version", program)?;
    write::scalar(&process, "sequence_index", index as i64 + 1)?;
    write_ports(&process, &stage.result.outputs)?;
    if let Some(port) = default_port(&stage.result.outputs) {
        write::text_attribute(&process, "default", port)?;
    }
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
    Ok(())
}

type Wire = (String, String, String);
/// A column of the wires' table: its name and how to read it.
type WireColumn = (&'static str, fn(&Wire) -> &str);

const WIRES: [WireColumn; 3] =
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
fn default_port(ports: &Ports) -> Option<&str> {
    let plots = |artifact: &Artifact| match artifact {
        Artifact::Array(array) => array.variables.first().is_some_and(|signal| {
            !signal.dims.is_empty() && signal.values.len() > 1 && !matches!(signal.values, Values::Integer(_))
        }),
        _ => false,
    };
    ports.iter().find(|(_, artifact)| plots(artifact)).map(|(port, _)| port)
}

/// A stage of a result file, without its artifacts.
#[derive(Debug, Clone)]
pub struct StageSummary {
    /// Everything but `result.outputs`, which is empty.
    pub record: StageRecord,
    /// Names and shapes of its artifacts, in order.
    pub ports: Vec<(String, Shape)>,
}

/// A result file, opened for reading: artifacts are read when they are asked for.
#[derive(Debug)]
pub struct ResultFile {
    path: PathBuf,
    file: File,
    /// The run without its stages.
    run: RunResult,
    stages: Vec<StageSummary>,
}

impl ResultFile {
    /// Opens a result file and reads everything but the artifacts. Errors: not a result file, damaged, another version.
    pub fn open(path: &Path) -> std::result::Result<Self, StoreError> {
        Self::open_file(path).map_err(|error| error.file(path))
    }

    fn open_file(path: &Path) -> Result<Self> {
        let file = read::open_file(path)?;
        check_format(&file, KIND)?;
        let entry = read::group(&file, ENTRY)?;
        let (run, ids) = read_pipeline(&entry)?;
        let stages = ids.iter().map(|id| read_summary(&entry, id)).collect::<Result<_>>()?;
        Ok(Self { path: path.to_owned(), file, run, stages })
    }

    /// The stages, in topological order.
    pub fn stages(&self) -> &[StageSummary] {
        &self.stages
    }

    /// The stage with this id.
    pub fn stage(&self, id: &str) -> Option<&StageSummary> {
        self.stages.iter().find(|stage| stage.record.id == id)
    }

    /// Name, seed, config, overrides, program and run information; its list of stages is empty.
    pub fn run(&self) -> &RunResult {
        &self.run
    }

    /// Where the file lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// One artifact. Errors: no such stage or port; damaged.
    pub fn artifact(&self, id: &str, port: &str) -> std::result::Result<Artifact, StoreError> {
        let fail = |problem: String| StoreError::new(problem).file(&self.path);
        let stage = self.stage(id).ok_or_else(|| {
            let have: Vec<&str> = self.stages.iter().map(|stage| stage.record.id.as_str()).collect();
            fail(format!("there is no stage `{id}`; there is: {}", have.join(", ")))
        })?;
        let shape = stage.ports.iter().find(|(name, _)| name == port).map(|(_, shape)| *shape);
        let shape = shape.ok_or_else(|| {
            let have: Vec<&str> = stage.ports.iter().map(|(name, _)| name.as_str()).collect();
            fail(format!("stage `{id}` has no output `{port}`; it has: {}", have.join(", ")))
        })?;
        self.process(id).and_then(|process| read_port(&process, port, shape)).map_err(|error| error.file(&self.path))
    }

    fn process(&self, id: &str) -> Result<Group> {
        read::group(&read::group(&self.file, ENTRY)?, id)
    }

    /// The whole run with all artifacts. Errors: one is damaged.
    pub fn read(&self) -> std::result::Result<RunResult, StoreError> {
        let mut run = self.run.clone();
        for summary in &self.stages {
            let mut record = summary.record.clone();
            let outputs = self.process(&record.id).and_then(|process| read_ports(&process));
            record.result.outputs = outputs.map_err(|error| error.file(&self.path))?;
            run.stages.push(record);
        }
        Ok(run)
    }
}

/// Reads a result file with all its artifacts. Errors: not a result file, damaged, another version.
pub fn read_result(path: &Path) -> std::result::Result<RunResult, StoreError> {
    ResultFile::open(path)?.read()
}

fn read_pipeline(entry: &Group) -> Result<(RunResult, Vec<String>)> {
    let group = read::group(entry, PIPELINE)?;
    let run = RunResult {
        name: read::text(&group, "name")?,
        seed: read::number(&group, "seed")?,
        config: read::text(&read::group(&group, "config")?, "data")?,
        overrides: read::texts(&group, "overrides")?,
        program: read::text(&group, "program")?,
        stages: Vec::new(),
        info: if entry.link_exists(RUN) { read_run_info(entry, RUN)? } else { RunInfo::default() },
    };
    Ok((run, read::texts(&group, STAGES)?))
}

fn read_summary(entry: &Group, id: &str) -> Result<StageSummary> {
    let process = read::group(entry, id)?;
    let group = read::group(&process, PROVENANCE)?;
    let params = serde_json::from_str(&read::text(&group, "params")?)
        .map_err(|error| StoreError::new(format!("the parameters are not JSON: {error}")).at(group.name()))?;
    let [inputs, stages, outputs] = WIRES.map(|(name, _)| read::texts(&group, name));
    let (inputs, stages, outputs) = (inputs?, stages?, outputs?);
    let paths = read::texts(&group, "source_path")?;
    let sizes: Vec<u64> = read::numbers(&group, "source_size")?;
    let hashes = read::texts(&group, "source_blake3")?;
    if inputs.len() != stages.len() || stages.len() != outputs.len() {
        return Err(StoreError::new("the lists of inputs differ in length").at(group.name()));
    }
    if paths.len() != sizes.len() || sizes.len() != hashes.len() {
        return Err(StoreError::new("the lists of sources differ in length").at(group.name()));
    }
    let record = StageRecord {
        id: id.to_owned(),
        uses: read::text(&group, "uses")?,
        version: read::number(&group, "stage_version")?,
        params,
        wires: inputs.into_iter().zip(stages).zip(outputs).map(|((to, from), output)| (to, from, output)).collect(),
        seed: if group.link_exists("seed") { Some(read::number(&group, "seed")?) } else { None },
        key: read::text(&group, "key")?,
        sources: paths
            .into_iter()
            .zip(sizes)
            .zip(hashes)
            .map(|((path, size), blake3)| SourceFile { path, size, blake3 })
            .collect(),
        result: StageResult { outputs: Ports::new(), warnings: read::texts(&group, "warnings")? },
    };
    Ok(StageSummary { record, ports: list_ports(&process)? })
}
