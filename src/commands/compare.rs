//! `afmid compare`: the modes of several results beside one another.

use std::path::{Path, PathBuf};

use afmid_pipeline::store::{ResultFile, StageSummary};
use serde_json::Value;

use super::open::require_result;
use crate::failure::Failure;
use crate::output::print;
use crate::show::{Compared, SUMMARY, compared_json, compared_text, pretty, rows, stage_json};

/// Prints the modes of all results, each beside those of the others. Errors: a file is no result, or damaged.
pub fn run(results: &[PathBuf], json: bool) -> Result<(), Failure> {
    let all = results.iter().map(|path| of(path)).collect::<Result<Vec<Compared>, Failure>>()?;
    print(&if json { pretty(&compared_json(&all))? } else { compared_text(&all) })
}

/// The modes of the last stage that lists any, and the verdict of the last one that has one.
pub fn of(path: &Path) -> Result<Compared, Failure> {
    require_result(path)?;
    let file = ResultFile::open(path).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let mut found = Compared { name: path.display().to_string(), verdict: None, modes: Vec::new() };
    let has_summary = |stage: &&StageSummary| stage.ports.iter().any(|port| port.name == SUMMARY);
    for stage in file.stages().iter().filter(has_summary) {
        let summary = stage_json(&file, stage)?;
        let listed = rows(&summary);
        if !listed.is_empty() {
            found.modes = listed;
        }
        found.verdict = verdict(&summary).or(found.verdict);
    }
    Ok(found)
}

/// What a diagnosis concludes, with the names of the causes.
fn verdict(summary: &Value) -> Option<String> {
    let verdict = summary.get("verdict")?.as_str()?;
    let causes = summary.get("causes").and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let names: Vec<&str> = causes.iter().filter_map(|cause| cause.get("id")?.as_str()).collect();
    Some(if names.is_empty() { verdict.to_owned() } else { format!("{verdict}: {}", names.join(", ")) })
}
