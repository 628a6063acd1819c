//! `afmid show`: what a run found.

use std::path::Path;

use afmid_pipeline::config::nearest;
use afmid_pipeline::store::{PortSummary, ResultFile, StageSummary};
use afmid_pipeline::{Artifact, Shape};

use super::open::{require_result, summary_of};
use crate::batch::shell::quoted;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::one_line;
use crate::show::{
    artifact_json, artifact_text, csv_text, overview_json, overview_text, pretty, stage_head, stage_json,
};

/// Shows a result file, one of its stages, or one artifact of a stage, as text or as JSON.
pub fn run(path: &Path, id: Option<&str>, all: bool, json: bool) -> Result<(), Failure> {
    let path = &summary_of(path);
    require_result(path)?;
    let file = ResultFile::open(path).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let text = match (id, json) {
        (None, false) => overview_text(&file, &modes(&file)?),
        (None, true) => pretty(&overview_json(&file))?,
        (Some(id), json) => match port(&file, id) {
            Some((stage, name)) => port_text(&file, find(&file, stage)?, name, json)?,
            None if json => pretty(&stage_json(&file, find(&file, id)?)?)?,
            None if all => stage_text(&file, find(&file, id)?)?,
            None => first_text(&file, find(&file, id)?)?,
        },
    };
    print(&text)
}

/// Prints a stage's table, that of its modes or else its first, or the one that is named, as comma-separated values.
/// Errors, usage: there is none.
pub fn table(path: &Path, id: &str) -> Result<(), Failure> {
    let path = &summary_of(path);
    require_result(path)?;
    let file = ResultFile::open(path).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let (stage, named) = match port(&file, id) {
        Some((stage, name)) => (find(&file, stage)?, Some(name)),
        None => (find(&file, id)?, None),
    };
    let tables: Vec<&str> =
        stage.ports.iter().filter(|port| port.shape == Shape::Table).map(|port| &port.name[..]).collect();
    let chosen = match named {
        Some(name) => tables.iter().find(|own| **own == name),
        None => tables.iter().find(|own| **own == "modes").or(tables.first()),
    };
    let id = &stage.record.id;
    let Some(chosen) = chosen else {
        let other = named.and_then(|name| stage.ports.iter().find(|port| port.name == name));
        if let Some(port) = other {
            let (name, shape) = (one_line(&format!("{id}.{}", port.name)), port.shape.name());
            return Err(Failure::usage(format!("`{name}` is of shape {shape}, wanted a table"), None));
        }
        let wanted = named.map_or_else(String::new, |name| format!(" `{}`", one_line(name)));
        let names: Vec<String> = tables.iter().map(|own| format!("{id}.{own}")).collect();
        let help = match names.is_empty() {
            true => "`--json` prints whatever a stage has".to_owned(),
            false => format!("there is: {}", names.join(", ")),
        };
        return Err(Failure::usage(format!("`{}` has no table{wanted}", one_line(id)), Some(help)));
    };
    match artifact(&file, id, chosen)? {
        Artifact::Table(table) => print(&csv_text(&table).map_err(|error| Failure::failed(error, None))?),
        other => Err(Failure::failed(format!("{id}.{chosen} is {}, wanted a table", other.shape().name()), None)),
    }
}

/// The tables of modes that are no longer than a window, each under its name. Errors: one is damaged.
fn modes(file: &ResultFile) -> Result<String, Failure> {
    let mut text = String::new();
    for stage in file.stages() {
        for port in stage.ports.iter().filter(|port| port.name == "modes") {
            let id = &stage.record.id;
            match &artifact(file, id, &port.name)? {
                table @ Artifact::Table(rows) if rows.rows() <= ROWS => {
                    text += &titled(&format!("{id}.{}", port.name), port, &artifact_text(table));
                    text.push('\n');
                }
                _ => {}
            }
        }
    }
    Ok(text)
}

/// The parts of `STAGE.PORT`; none of a stage's id.
fn port<'a>(file: &ResultFile, id: &'a str) -> Option<(&'a str, &'a str)> {
    if file.stage(id).is_some() { None } else { id.split_once('.') }
}

/// One artifact of a stage, as text or as JSON. Errors: damaged; usage: none of this name.
fn port_text(file: &ResultFile, stage: &StageSummary, name: &str, json: bool) -> Result<String, Failure> {
    let id = &stage.record.id;
    let Some(port) = stage.ports.iter().find(|port| port.name == name) else {
        let names: Vec<String> = stage.ports.iter().map(|port| format!("{id}.{}", port.name)).collect();
        let help = format!("there is: {}", names.join(", "));
        return Err(Failure::usage(format!("`{id}` has no artifact `{name}`"), Some(help)));
    };
    let artifact = artifact(file, id, name)?;
    if json {
        return pretty(&artifact_json(&artifact));
    }
    Ok(titled(&format!("{id}.{name}"), port, &artifact_text(&artifact)))
}

fn titled(name: &str, port: &PortSummary, text: &str) -> String {
    format!("{} ({})\n{text}", one_line(name), port.shape.name())
}

/// The stage with this id. Errors, usage: there is none.
pub fn find<'a>(file: &'a ResultFile, id: &str) -> Result<&'a StageSummary, Failure> {
    file.stage(id).ok_or_else(|| {
        let without = file.run().info.unfinished.iter().find(|stage| stage.id == id);
        if let Some(stage) = without {
            let why = stage.reason.clone().unwrap_or_else(|| "something that it needs failed".to_owned());
            let message = format!("{} is incomplete: `{id}` has no result, {why}", file.path().display());
            return Failure::usage(
                message,
                Some(format!("`afmid show {}` lists the stages that have", file.path().display())),
            );
        }
        let ids: Vec<&str> = file.stages().iter().map(|stage| stage.record.id.as_str()).collect();
        let nearest = nearest(id, ids.iter().copied()).map(|nearest| format!("did you mean `{nearest}`? "));
        let help = format!("{}there is: {}", nearest.unwrap_or_default(), ids.join(", "));
        let about = one_line(&file.run().name);
        Failure::usage(format!("{}, of a config `{about}`, has no stage `{id}`", file.path().display()), Some(help))
    })
}

fn artifact(file: &ResultFile, id: &str, port: &str) -> Result<Artifact, Failure> {
    file.artifact(id, port).map_err(|error| Failure::failed(&error, error.help.clone()))
}

/// Rows of a table that a stage shows among its other artifacts: as many as most windows do. A longer one is shown alone.
const ROWS: usize = 50;

/// The table of a stage's modes, and how to see what else it has; all of a stage without one. Errors: as of
/// [`stage_text`].
fn first_text(file: &ResultFile, stage: &StageSummary) -> Result<String, Failure> {
    let id = &stage.record.id;
    let Some(port) = stage.ports.iter().find(|port| port.name == "modes") else { return stage_text(file, stage) };
    let others: Vec<&str> = stage.ports.iter().map(|port| &port.name[..]).filter(|name| *name != "modes").collect();
    let table = match artifact(file, id, &port.name)? {
        Artifact::Table(table) if table.rows() > ROWS => elsewhere(file, id, port, table.rows()),
        table => artifact_text(&table),
    };
    let mut text = stage_head(&stage.record) + "\n" + &titled(&port.name, port, &table);
    if !others.is_empty() {
        let names = one_line(&others.join(", "));
        text += &format!("\n{names}: afmid show {} {} --all\n", quoted(file.path()), one_line(id));
    }
    Ok(text)
}

/// A stage with all its artifacts, first what is read: tables, documents, then what is shown by its ranges, long tables
/// by their number of rows. Errors: one is damaged.
pub fn stage_text(file: &ResultFile, stage: &StageSummary) -> Result<String, Failure> {
    let id = &stage.record.id;
    let mut shown: Vec<(u8, String)> = Vec::new();
    for port in &stage.ports {
        let artifact = artifact(file, id, &port.name)?;
        let (place, text) = match &artifact {
            Artifact::Table(table) if table.rows() > ROWS => (3, elsewhere(file, id, port, table.rows())),
            Artifact::Table(_) => (0, artifact_text(&artifact)),
            Artifact::Document(_) => (1, artifact_text(&artifact)),
            _ => (2, artifact_text(&artifact)),
        };
        shown.push((place, titled(&port.name, port, &text)));
    }
    shown.sort_by_key(|(place, _)| *place);
    let head = stage_head(&stage.record);
    Ok(shown.into_iter().fold(head, |text, (_, artifact)| text + "\n" + &artifact))
}

/// How to see a long table.
fn elsewhere(file: &ResultFile, id: &str, port: &PortSummary, rows: usize) -> String {
    let path = quoted(file.path());
    format!("{rows} rows: afmid show {path} {}\n", one_line(&format!("{id}.{}", port.name)))
}
