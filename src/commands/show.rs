//! `afmid show`: what a run found.

use std::path::Path;

use afmid_pipeline::Artifact;
use afmid_pipeline::config::nearest;
use afmid_pipeline::store::{ResultFile, StageSummary};

use super::open::require_result;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::one_line;
use crate::show::{artifact_text, overview_json, overview_text, pretty, stage_head, stage_json};

/// Shows a result file, or one of its stages, as text or as JSON.
pub fn run(path: &Path, id: Option<&str>, json: bool) -> Result<(), Failure> {
    require_result(path)?;
    let file = ResultFile::open(path).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let text = match (id, json) {
        (None, false) => overview_text(&file),
        (None, true) => pretty(&overview_json(&file))?,
        (Some(id), json) => {
            let stage = find(&file, id)?;
            if json { pretty(&stage_json(&file, stage)?)? } else { stage_text(&file, stage)? }
        }
    };
    print(&text)
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
        let help = match nearest(id, ids.iter().copied()) {
            Some(nearest) => format!("did you mean `{nearest}`?"),
            None => format!("there is: {}", ids.join(", ")),
        };
        Failure::usage(format!("{} has no stage `{id}`", file.path().display()), Some(help))
    })
}

fn artifact(file: &ResultFile, id: &str, port: &str) -> Result<Artifact, Failure> {
    file.artifact(id, port).map_err(|error| Failure::failed(&error, error.help.clone()))
}

/// A stage with all its artifacts. Errors: one is damaged.
pub fn stage_text(file: &ResultFile, stage: &StageSummary) -> Result<String, Failure> {
    let mut text = stage_head(&stage.record);
    for port in &stage.ports {
        let artifact = artifact(file, &stage.record.id, &port.name)?;
        text.push_str(&format!("\n{} ({})\n{}", one_line(&port.name), port.shape.name(), artifact_text(&artifact)));
    }
    Ok(text)
}
