//! One table of all data sets, in the formats of people, statisticians and viewers.

use std::path::{Path, PathBuf};

use afmid_pipeline::artifact::ColumnValues;
use afmid_pipeline::files::FilledFolder;
use afmid_pipeline::store::{ResultFile, write_result};
use afmid_pipeline::{Column, Ports, RunInfo, RunResult, Shaped, StageRecord, StageResult, Table};
use serde_json::json;

use super::harvest::ModeFound;
use super::ledger::Entry;
use super::work::in_the_way;
use super::{parquet, trends};
use crate::failure::Failure;
use crate::show::csv_text;

/// A row per data set and mode; a set without modes has one row.
pub fn table(entries: &[Entry]) -> Table {
    let none = ModeFound::default();
    let rows: Vec<(&Entry, i64, &ModeFound)> = entries
        .iter()
        .flat_map(|entry| {
            let modes = (1..).zip(&entry.found.modes).map(move |(number, mode)| (entry, number, mode));
            let alone = entry.found.modes.is_empty().then_some((entry, 0, &none));
            modes.chain(alone)
        })
        .collect();
    let text = |of: &dyn Fn(&Entry) -> Option<&str>| -> Vec<String> {
        rows.iter().map(|(entry, ..)| of(entry).unwrap_or_default().to_owned()).collect()
    };
    let whole = |of: fn(&Entry) -> Option<f64>| -> Vec<f64> {
        rows.iter().map(|(entry, ..)| of(entry).unwrap_or(f64::NAN)).collect()
    };
    let mode = |of: fn(&ModeFound) -> Option<f64>| -> Vec<f64> {
        rows.iter().map(|(.., mode)| of(mode).unwrap_or(f64::NAN)).collect()
    };
    Table::new()
        .with("data_set", "", "its name", text(&|entry| Some(&entry.name)))
        .with("started_at", "", "start of its first record", text(&|entry| entry.found.started_at.as_deref()))
        .with("status", "", "done or failed", text(&|entry| Some(if entry.is_done() { "done" } else { "failed" })))
        .with(
            "mode",
            "1",
            "number of the mode, 0: none",
            rows.iter().map(|(_, number, _)| *number).collect::<Vec<i64>>(),
        )
        .with("frequency_hz", "Hz", "resonance frequency", mode(|mode| mode.frequency_hz))
        .with("frequency_std_hz", "Hz", "its standard error", mode(|mode| mode.frequency_std_hz))
        .with("quality_factor", "1", "quality factor", mode(|mode| mode.quality_factor))
        .with("quality_factor_std", "1", "its standard error", mode(|mode| mode.quality_factor_std))
        .with("damping_ratio", "1", "damping ratio", mode(|mode| mode.damping_ratio))
        .with("damping_ratio_std", "1", "its standard error", mode(|mode| mode.damping_ratio_std))
        .with("static_share", "1", "part of the static gain", mode(|mode| mode.static_share))
        .with("static_share_std", "1", "its standard error", mode(|mode| mode.static_share_std))
        .with("stiffness_n_per_m", "N/m", "spring constant", whole(|entry| entry.found.stiffness_n_per_m))
        .with("stiffness_std_n_per_m", "N/m", "its standard error", whole(|entry| entry.found.stiffness_std_n_per_m))
        .with(
            "fit_identification_percent",
            "1",
            "fit of the identification half",
            whole(|entry| entry.found.fit_identification_percent),
        )
        .with("fit_held_out_percent", "1", "fit of the held-out half", whole(|entry| entry.found.fit_held_out_percent))
        .with("verdict", "", "of a diagnosis", text(&|entry| entry.found.verdict.as_deref()))
        .with("causes", "", "named by a diagnosis", text(&|entry| entry.found.causes.as_deref()))
        .with(
            "warnings",
            "1",
            "what its stages warned of, how often",
            rows.iter().map(|(entry, ..)| entry.found.warnings.len() as i64).collect::<Vec<i64>>(),
        )
        .with(
            "first_warning",
            "",
            "the first of these",
            text(&|entry| entry.found.warnings.first().map(String::as_str)),
        )
        .with("error", "", "why it failed", text(&|entry| entry.error.as_deref()))
}

/// Columns that people read at the terminal.
const READ: [&str; 13] = [
    "data_set",
    "mode",
    "frequency_hz",
    "frequency_std_hz",
    "quality_factor",
    "quality_factor_std",
    "damping_ratio",
    "damping_ratio_std",
    "stiffness_n_per_m",
    "stiffness_std_n_per_m",
    "verdict",
    "causes",
    "warnings",
];

/// What a person reads of [`table`] at the terminal: the columns in which something was found; no row of what failed.
pub fn shown(entries: &[Entry]) -> Table {
    let done: Vec<Entry> = entries.iter().filter(|entry| entry.is_done()).cloned().collect();
    let any = done.iter().any(|entry| !entry.found.modes.is_empty());
    let keep = |column: &Column| {
        READ.contains(&&column.name[..]) && is_known(&column.values) && (any || column.name != "mode")
    };
    let columns = table(&done).columns.into_iter().filter(keep).collect();
    Table { columns, ..Table::default() }
}

/// Whether anything is in a column.
pub fn is_known(values: &ColumnValues) -> bool {
    match values {
        ColumnValues::Real(values) => values.iter().any(|value| value.is_finite()),
        ColumnValues::Text(values) => values.iter().any(|value| !value.is_empty()),
        ColumnValues::Integer(values) => values.iter().any(|value| *value != 0),
        _ => true,
    }
}

/// What identifies a summary.
pub struct Title<'a> {
    /// The pipeline's name and seed.
    pub name: &'a str,
    /// See there.
    pub seed: u64,
    /// The config, byte for byte.
    pub config: &'a str,
    /// The program and its version.
    pub program: &'a str,
}

/// The tables of a batch or a sweep, and the folder that they lie in.
#[derive(Debug)]
pub struct Tables {
    folder: FilledFolder,
    /// Whether `summary.h5` is the table of an earlier run of the same kind: then the tables beside it are known,
    /// though earlier versions kept no list.
    earlier: bool,
}

/// The table that says whose the others are.
pub const SUMMARY: &str = "summary.h5";

impl Tables {
    /// Sees, before anything runs, that no table of others would be replaced. `uses` is [`BATCH`] or [`SWEEP`].
    ///
    /// Errors, usage: one lies there.
    pub fn open(folder: &Path, uses: &str) -> Result<Self, Failure> {
        let usage = |problem: String, help: &str| Err(Failure::usage(problem, Some(help.to_owned())));
        let summary = folder.join(SUMMARY);
        let others = "give another folder with -o, or remove the file first if it is no longer needed";
        if let Some(found) = in_the_way(&summary) {
            return usage(format!("{} exists and {found}: it is not replaced", summary.display()), others);
        }
        let stages = ResultFile::open(&summary).map(|file| file.stages().iter().any(|stage| stage.record.uses == uses));
        if let Ok(false) = stages {
            let kind = uses.split('.').next().unwrap_or_default();
            let problem = format!("{} exists and is no table of a {kind}: it is not replaced", summary.display());
            return usage(problem, "give another folder with -o");
        }
        let opened = FilledFolder::open(folder).map_err(|error| Failure::failed(&error, error.help.clone()))?;
        let tables = Self { folder: opened, earlier: stages.is_ok() };
        for name in ["summary.csv", "trends.csv", "summary.parquet"] {
            let own = tables.folder.require_own(name, |_| tables.earlier);
            own.map_err(|error| Failure::usage(error.to_string(), Some(others.to_owned())))?;
        }
        Ok(tables)
    }

    fn csv(&self, name: &str, table: &Table) -> Result<(), Failure> {
        self.put(name, |path| std::fs::write(path, csv_text(table)?))
    }

    fn parquet(&self, table: &Table) -> Result<(), Failure> {
        self.put("summary.parquet", |path| parquet::write(path, table))
    }

    fn put(&self, name: &str, fill: impl FnOnce(&Path) -> std::io::Result<()>) -> Result<(), Failure> {
        let replaced = self.folder.replace_with(name, |_| self.earlier, fill);
        replaced.map_err(|error| Failure::failed(&error, error.help.clone()))
    }

    fn summary(&self, run: &RunResult) -> Result<PathBuf, Failure> {
        let path = self.folder.folder().join(SUMMARY);
        write_result(&path, run).map_err(|error| Failure::failed(&error, error.help.clone()))?;
        Ok(path)
    }

    /// Writes `summary.csv`, `summary.parquet`, `trends.csv` and `summary.h5`, each whole or not at all: the same bytes
    /// from the same entries, wherever they were computed.
    pub fn write_batch(&self, title: &Title<'_>, entries: &[Entry]) -> Result<PathBuf, Failure> {
        let (table, trends) = (table(entries), trends::table(entries));
        self.csv("summary.csv", &table)?;
        self.csv("trends.csv", &trends)?;
        self.parquet(&table)?;
        self.summary(&summary(title, entries))
    }

    /// Writes `summary.h5`, `summary.parquet` and `summary.csv` of a sweep, each whole or not at all.
    pub fn write_sweep(&self, title: &Title<'_>, table: Table) -> Result<PathBuf, Failure> {
        let mut outputs = Ports::new();
        outputs.insert("points", table.clone().wrap());
        let path = self.summary(&result(title, SWEEP, outputs))?;
        self.parquet(&table)?;
        self.csv("summary.csv", &table)?;
        Ok(path)
    }
}

/// What `summary.h5` holds.
pub fn summary(title: &Title<'_>, entries: &[Entry]) -> RunResult {
    let mut outputs = Ports::new();
    outputs.insert("modes", table(entries).wrap());
    outputs.insert("trends", trends::table(entries).wrap());
    outputs.insert("values", trends::values(entries).wrap());
    result(title, BATCH, outputs)
}

/// What the summary of a batch uses.
pub const BATCH: &str = "batch.summary";

/// What the summary of a sweep uses.
pub const SWEEP: &str = "sweep.summary";

/// The tables as the result of a stage, so that `afmid show`, `report` and HDF5 viewers open them.
fn result(title: &Title<'_>, uses: &str, outputs: Ports) -> RunResult {
    let stage = StageRecord {
        id: "summary".to_owned(),
        uses: uses.to_owned(),
        version: 1,
        params: json!({}),
        wires: Vec::new(),
        seed: None,
        key: String::new(),
        sources: Vec::new(),
        result: StageResult { outputs, warnings: Vec::new() },
    };
    RunResult {
        name: title.name.to_owned(),
        seed: title.seed,
        config: title.config.to_owned(),
        overrides: Vec::new(),
        program: title.program.to_owned(),
        stages: vec![stage],
        info: RunInfo::default(),
    }
}
