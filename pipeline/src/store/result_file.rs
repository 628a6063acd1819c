//! The contents of result files: everything that a run left behind, in one NeXus file.

use std::path::{Path, PathBuf};

use hdf5::{File, Group};
use serde_json::Value;

use super::format::write_format;
use super::names::{RESERVED_STAGE_IDS, TAKEN_BY_STAGE, group_names};
use super::ports::write_ports;
use super::run_info::write_run_info;
use crate::artifact::{Artifact, Values};
use crate::error::{Result, StoreError};
use crate::hdf5_files::write;
use crate::outcome::{Ports, RunInfo, StageRecord};

pub(super) const KIND: &str = "result";
pub(super) const ENTRY: &str = "entry";
pub(super) const PIPELINE: &str = "pipeline";
pub(super) const RUN: &str = "run";
pub(super) const PROVENANCE: &str = "provenance";
pub(super) const STAGES: &str = "stages";
/// The groups of the stages, under the entry.
pub(super) const GROUPS: &str = "stage_groups";

/// The order in which stages are written, whatever the order in which they end: those that need nothing, those that
/// need these, and so on. So a run of several threads seldom waits for one that ends late.
fn by_depth(needs: &[Vec<usize>]) -> Vec<usize> {
    let mut depths: Vec<usize> = Vec::new();
    for sources in needs {
        // in topological order: the sources have theirs
        let depth = sources.iter().filter_map(|&source| depths.get(source)).max().map_or(0, |deepest| deepest + 1);
        depths.push(depth);
    }
    let mut order: Vec<usize> = (0..needs.len()).collect();
    order.sort_by_key(|&index| depths[index]);
    order
}

/// Before so many stages the library writes down what it has put off, the headers of hundreds of objects: most runs end
/// with stages that others wait for, and at the very end somebody waits.
const LAST: usize = 2;

/// What is known of a run before its stages.
pub(crate) struct RunHead<'a> {
    pub(crate) name: &'a str,
    pub(crate) seed: u64,
    pub(crate) config: &'a str,
    pub(crate) overrides: &'a [String],
    pub(crate) program: &'a str,
    /// The stages in topological order.
    pub(crate) ids: &'a [&'a str],
    /// What each needs, by its place among them.
    pub(crate) needs: &'a [Vec<usize>],
}

/// A result file that grows while its stages run: the same bytes as if it were written at the end.
pub(crate) struct ResultWriter {
    path: PathBuf,
    // before the file, which does not close while it lives
    entry: Group,
    file: File,
    program: String,
    /// Of the stages, in order.
    groups: Vec<String>,
    /// The places of those that are still to be written, the next one last.
    rest: Vec<usize>,
    /// The last stage in the plan that has something to plot.
    default: Option<usize>,
}

impl ResultWriter {
    /// A new file. Errors: it exists or cannot be written.
    pub(crate) fn new(path: &Path, run: &RunHead) -> std::result::Result<Self, StoreError> {
        let begin = || -> Result<Self> {
            let file = write::create_file(path)?;
            write_format(&file, KIND)?;
            write::text_attribute(&file, "default", ENTRY)?;
            let entry = write::nexus_group(&file, ENTRY, "NXentry")?;
            write::text(&entry, "title", run.name)?;
            let groups = group_names(run.ids.iter().copied(), &RESERVED_STAGE_IDS);
            write_pipeline(&entry, run, &groups)?;
            let (path, program) = (path.to_owned(), run.program.to_owned());
            let rest = by_depth(run.needs).into_iter().rev().collect();
            Ok(Self { path, entry, file, program, groups, rest, default: None })
        };
        begin().map_err(|error| error.file(path))
    }

    /// The place in the plan of the stage that is to be written next. None: all are written.
    pub(crate) fn next_stage(&self) -> Option<usize> {
        self.rest.last().copied()
    }

    /// Writes the next stage. Errors: the file cannot be written; an artifact is not valid.
    pub(crate) fn stage(&mut self, stage: &StageRecord) -> std::result::Result<(), StoreError> {
        self.write_stage(stage).map_err(|error| error.file(&self.path))
    }

    fn write_stage(&mut self, stage: &StageRecord) -> Result<()> {
        let Some((index, group)) = self.rest.pop().and_then(|index| Some((index, self.groups.get(index)?))) else {
            return Err(StoreError::new(format!("`{}` is one stage too many", stage.id)));
        };
        let process = write_stage_record(&self.entry, group, stage, &self.program)?;
        write::scalar(&process, "sequence_index", index as i64 + 1)?;
        if let Some(port) = default_port(&stage.result.outputs) {
            write::text_attribute(&process, "default", &port)?;
            self.default = self.default.max(Some(index));
        }
        // at a fixed place in the file's making: what is written where depends on it
        if self.rest.len() == LAST {
            self.file.flush()?;
        }
        Ok(())
    }

    /// Ends the file, unsealed. Errors: a stage is missing; it cannot be written.
    pub(crate) fn finish(self, info: &RunInfo) -> std::result::Result<(), StoreError> {
        let Self { path, entry, file, groups, rest, default, .. } = self;
        let end = move || -> Result<()> {
            let group = |index: &usize| groups.get(*index).map_or("", String::as_str);
            if let Some(missing) = rest.last().map(group) {
                return Err(StoreError::new(format!("the stage of group `{missing}` was not written")));
            }
            if let Some(default) = default.as_ref().map(group) {
                write::text_attribute(&entry, "default", default)?;
            }
            write_run_info(&entry, RUN, info)?;
            drop(entry);
            Ok(file.close()?)
        };
        end().map_err(|error| error.file(&path))
    }
}

fn write_pipeline(entry: &Group, run: &RunHead, groups: &[String]) -> Result<()> {
    let group = write::nexus_group(entry, PIPELINE, "NXcollection")?;
    write::text(&group, "name", run.name)?;
    write::scalar(&group, "seed", run.seed)?;
    write::text(&group, "program", run.program)?;
    write::texts(&group, "overrides", run.overrides)?;
    write::texts(&group, STAGES, run.ids)?;
    write::texts(&group, GROUPS, groups)?;
    let config = write::nexus_group(&group, "config", "NXnote")?;
    write::text(&config, "type", "application/toml")?;
    write::text(&config, "data", run.config)?;
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
    write::texts(&group, "warnings", &stage.result.warnings_of(&stage.id))?;
    Ok(process)
}

type Wire = (String, String, String);
/// A column of the wires' table: its name and how to read it.
pub(super) type WireColumn = (&'static str, fn(&Wire) -> &str);

pub(super) const WIRES: [WireColumn; 3] =
    [("input_port", |wire| &wire.0), ("input_stage", |wire| &wire.1), ("input_output", |wire| &wire.2)];

/// Scalar parameters as attributes as well: what people see at once in a viewer. The text of all has those whose names
/// or values HDF5 does not take.
fn write_params(owner: &hdf5::Location, params: &Value) -> Result<()> {
    for (name, value) in params.as_object().into_iter().flatten() {
        if name.is_empty() || name.contains('\0') {
            continue;
        }
        match value {
            Value::String(text) if text.contains('\0') => Ok(()),
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

#[cfg(test)]
mod tests {
    use super::by_depth;

    #[test]
    fn stages_are_written_by_their_distance_from_the_beginning() {
        // a chain 0, 1, 2, 3 and a branch 0, 4, that joins it in 5
        let needs = [vec![], vec![0], vec![1], vec![2], vec![0], vec![3, 4]];
        assert_eq!(by_depth(&needs), [0, 1, 4, 2, 3, 5]);
        assert!(by_depth(&[]).is_empty());
    }
}
