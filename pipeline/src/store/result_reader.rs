//! Reading result files: everything but the artifacts at once, artifacts when they are asked for.

use std::path::{Path, PathBuf};

use hdf5::File;

use super::format::check_format;
use super::ports::{PortSummary, list_ports, read_port, read_ports};
use super::result_file::{ENTRY, GROUPS, KIND, PIPELINE, PROVENANCE, RUN, STAGES, WIRES};
use super::run_info::read_run_info;
use super::seal::check_seal;
use crate::artifact::Artifact;
use crate::error::{Result, StoreError};
use crate::hdf5_files::Vetted;
use crate::hdf5_files::read::{self, Apart, Node, Opened};
use crate::outcome::{Ports, RunInfo, RunResult, SourceFile, StageRecord, StageResult};
use crate::recording::InputFiles;

/// A stage of a result file, without its artifacts.
#[derive(Debug, Clone)]
pub struct StageSummary {
    /// Everything but `result.outputs`, which is empty.
    pub record: StageRecord,
    /// Its group under `/entry`: the id, as far as NeXus allows.
    pub group: String,
    /// Its artifacts, in order.
    pub ports: Vec<PortSummary>,
}

/// A result file, opened for reading: artifacts are read when they are asked for.
#[derive(Debug)]
pub struct ResultFile {
    path: PathBuf,
    file: Opened<File>,
    /// The run without its stages.
    run: RunResult,
    stages: Vec<StageSummary>,
    /// For the samples of recordings.
    files: InputFiles,
}

impl ResultFile {
    /// Opens a result file and reads everything but the artifacts.
    ///
    /// Errors: not a result file, damaged or altered since it was written, another version.
    pub fn open(path: &Path) -> std::result::Result<Self, StoreError> {
        let vetted = check_seal(path)?;
        Self::open_file(path, &vetted).map_err(|error| error.file(path))
    }

    fn open_file(path: &Path, vetted: &Vetted) -> Result<Self> {
        let file = read::open_file(path, vetted)?;
        let root = file.root();
        check_format(&root, KIND)?;
        let entry = read::group(&root, ENTRY)?;
        let (run, ids) = read_pipeline(&entry)?;
        let mut apart = Apart::default();
        let stages =
            ids.iter().map(|(id, group)| read_summary(&entry, id, group, &mut apart)).collect::<Result<_>>()?;
        Ok(Self { path: path.to_owned(), file, run, stages, files: InputFiles::new() })
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
        let found = stage.ports.iter().find(|have| have.name == port).ok_or_else(|| {
            let have: Vec<&str> = stage.ports.iter().map(|port| port.name.as_str()).collect();
            fail(format!("stage `{id}` has no output `{port}`; it has: {}", have.join(", ")))
        })?;
        self.process(&self.file.root(), stage)
            .and_then(|process| read_port(&process, found, &self.files, None))
            .map_err(|error| error.file(&self.path))
    }

    fn process(&self, root: &Node, stage: &StageSummary) -> Result<Node> {
        read::group(&read::group(root, ENTRY)?, &stage.group)
    }

    /// The whole run with all artifacts. Errors: one is damaged.
    pub fn read(&self) -> std::result::Result<RunResult, StoreError> {
        let (mut run, root) = (self.run.clone(), self.file.root());
        for summary in &self.stages {
            let mut record = summary.record.clone();
            let outputs = self.process(&root, summary).and_then(|process| read_ports(&process, &self.files, None));
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

/// The run, and its stages as (id, group).
fn read_pipeline(entry: &Node) -> Result<(RunResult, Vec<(String, String)>)> {
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
    let (ids, groups) = (read::texts(&group, STAGES)?, read::texts(&group, GROUPS)?);
    if ids.len() != groups.len() {
        return Err(StoreError::new("the lists of stages differ in length").at(group.name()));
    }
    Ok((run, ids.into_iter().zip(groups).collect()))
}

fn read_summary(entry: &Node, id: &str, group_name: &str, apart: &mut Apart) -> Result<StageSummary> {
    let process = read::group(entry, group_name)?;
    apart.add(&process)?;
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
    let ports = list_ports(&process)?;
    ports.iter().try_for_each(|port| apart.add(&read::group(&process, &port.group)?))?;
    Ok(StageSummary { record, group: group_name.to_owned(), ports })
}
