//! One table of all data sets, in the formats of people, statisticians and viewers.

use std::path::{Path, PathBuf};

use afmid_pipeline::artifact::ColumnValues;
use afmid_pipeline::files::replace_with;
use afmid_pipeline::store::write_result;
use afmid_pipeline::{Ports, RunInfo, RunResult, Shaped, StageRecord, StageResult, Table};
use serde_json::json;

use super::harvest::ModeFound;
use super::ledger::Entry;
use super::{parquet, trends};
use crate::failure::Failure;

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
        .with("error", "", "why it failed", text(&|entry| entry.error.as_deref()))
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

/// Writes `summary.csv`, `summary.parquet`, `trends.csv` and `summary.h5`, each whole or not at all: the same bytes from the same entries, whoever computed them.
pub fn write(folder: &Path, title: &Title<'_>, entries: &[Entry]) -> Result<PathBuf, Failure> {
    let (table, trends) = (table(entries), trends::table(entries));
    let failed = |error: afmid_pipeline::error::StoreError| Failure::failed(&error, error.help.clone());
    for (name, table) in [("summary.csv", &table), ("trends.csv", &trends)] {
        replace_with(&folder.join(name), |path| csv(path, table)).map_err(failed)?;
    }
    replace_with(&folder.join("summary.parquet"), |path| parquet::write(path, &table)).map_err(failed)?;
    let path = folder.join("summary.h5");
    write_result(&path, &summary(title, entries)).map_err(failed)?;
    Ok(path)
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

/// Writes `summary.h5`, `summary.parquet` and `summary.csv` of a sweep, each whole or not at all. The first of them says whose the others are.
pub fn write_sweep(folder: &Path, title: &Title<'_>, table: Table) -> Result<PathBuf, Failure> {
    let failed = |error: afmid_pipeline::error::StoreError| Failure::failed(&error, error.help.clone());
    let path = folder.join("summary.h5");
    let mut outputs = Ports::new();
    outputs.insert("points", table.clone().wrap());
    write_result(&path, &result(title, SWEEP, outputs)).map_err(failed)?;
    replace_with(&folder.join("summary.parquet"), |path| parquet::write(path, &table)).map_err(failed)?;
    replace_with(&folder.join("summary.csv"), |path| csv(path, &table)).map_err(failed)?;
    Ok(path)
}

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

/// Comma-separated, a header line, unknown numbers empty, numbers to the last bit.
fn csv(path: &Path, table: &Table) -> std::io::Result<()> {
    let mut writer = csv::Writer::from_path(path).map_err(std::io::Error::other)?;
    let line =
        |writer: &mut csv::Writer<_>, fields: Vec<String>| writer.write_record(fields).map_err(std::io::Error::other);
    line(&mut writer, table.columns.iter().map(|column| column.name.clone()).collect())?;
    for row in 0..table.rows() {
        line(&mut writer, table.columns.iter().map(|column| field(&column.values, row)).collect())?;
    }
    writer.flush()
}

fn field(values: &ColumnValues, row: usize) -> String {
    match values {
        ColumnValues::Real(values) => values.get(row).filter(|value| value.is_finite()).map(f64::to_string),
        ColumnValues::Integer(values) => values.get(row).map(i64::to_string),
        ColumnValues::Flag(values) => values.get(row).map(bool::to_string),
        ColumnValues::Text(values) => values.get(row).cloned(),
    }
    .unwrap_or_default()
}
