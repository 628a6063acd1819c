//! What commands say of files and texts of others, as functions without arguments, processes or a terminal: the doors
//! of the fuzz targets and of the replay of their corpus. Nothing else calls them.

use std::path::Path;

use afmid_pipeline::graph::{self, Format};
use afmid_pipeline::store::{ResultFile, read_result};
use afmid_pipeline::{InputFiles, Registry};
use serde_json::{Value, json};

use super::{check, show};
use crate::diagnostic::render;
use crate::failure::{Failure, Message};
use crate::inspect::{file_text, folder_text, inspect, inspected_json};
use crate::provenance::diff::Diff;
use crate::provenance::differences::diff_text;
use crate::provenance::files::Finder;
use crate::provenance::located::{Lost, locate};
use crate::provenance::path::{Step, typed};
use crate::provenance::tree::tree_text;
use crate::report::{figures, report};
use crate::show::{overview_json, overview_text, pretty, stage_json};

const CONFIG: &str = "config.toml";

/// All that `check` and `graph` say of a config with `--set` arguments, for people and for scripts. A registry starts
/// no process.
pub fn say_of_config(text: &str, set: &[String], registry: &Registry) -> String {
    let problems = match graph::load(CONFIG, text, set, registry) {
        Ok(plan) => {
            let last = plan.points().and_then(|points| points.checked_sub(1));
            let swept = last.map(|last| format!("{:?}", plan.values(last))).unwrap_or_default();
            let drawn = [Format::Text, Format::Mermaid, Format::Dot].map(|format| plan.render(format));
            return drawn.concat() + &swept;
        }
        Err(problems) => problems,
    };
    let listed: Vec<Value> = problems.iter().map(|problem| check::problem(text, problem)).collect();
    render(CONFIG, text, &problems) + &Value::Array(listed).to_string()
}

/// All that `inspect` says of a file, for people and for scripts.
pub fn say_of_recording(path: &Path) -> String {
    let inspected = inspect(path, &InputFiles::new(), false);
    let json = inspected_json(&inspected).to_string();
    file_text(&inspected) + &folder_text(path, &[inspected]) + &json
}

/// All that `show`, `trace`, `report` and `diff` (with `other`) say of a result file. Errors: it is none, or damaged.
pub fn say_of_result(path: &Path, other: &Path) -> Result<String, String> {
    let file = ResultFile::open(path).map_err(|error| error.to_string())?;
    let mut said = overview_text(&file, "") + &pretty(&overview_json(&file)).map_err(message)?;
    let finder = Finder::new(&file.run().info, &[]);
    for stage in file.stages() {
        let id = &stage.record.id;
        said += &show::stage_text(&file, stage).map_err(message)?;
        let json = stage_json(&file, stage).map_err(message)?;
        said += &pretty(&json!({ "stage": &json })).map_err(message)?;
        let mut steps = Vec::new();
        if first_number(&json, &mut steps) {
            said += &typed(id, &steps);
            match locate(&file, stage, &steps) {
                Ok(located) => said += &format!(" = {}\n", located.value),
                Err(Lost::Path(problem, _)) => said += &problem,
                Err(Lost::File(error)) => return Err(error.to_string()),
            }
        }
        said += &tree_text(&file, stage, &finder);
    }
    let run = read_result(path).map_err(|error| error.to_string())?;
    said += &report(&run, &|_| String::new(), None).map_err(|error| error.to_string())?;
    said.extend(figures(&run).into_iter().map(|(_, text)| text));
    let other = ResultFile::open(other).map_err(|error| error.to_string())?;
    said += &diff_text(&Diff::of(&file, &other).map_err(|error| error.to_string())?, true);
    Ok(said)
}

/// What reading a stage file says, if it is the one that `identity` is about. Errors: it is not, or damaged.
pub fn say_of_stage(path: &Path, identity: &afmid_pipeline::store::StageIdentity) -> Result<String, String> {
    let result = afmid_pipeline::store::read_stage(path, identity, &InputFiles::new());
    let result = result.map_err(|error| error.to_string())?;
    let artifacts =
        result.outputs.iter().map(|(name, artifact)| format!("{name}: {}", crate::show::artifact_text(artifact)));
    Ok(artifacts.chain(result.warnings.iter().cloned()).collect())
}

/// Whether there is a number in a stage's JSON, and the steps to it: what `trace` is asked for.
fn first_number(json: &Value, steps: &mut Vec<Step>) -> bool {
    let mut into = |step: Step, value: &Value| {
        steps.push(step);
        let found = first_number(value, steps);
        if !found {
            steps.pop();
        }
        found
    };
    match json {
        Value::Number(_) => true,
        Value::Array(values) => values.iter().take(8).enumerate().any(|(index, value)| into(Step::Index(index), value)),
        Value::Object(fields) => fields.iter().take(32).any(|(name, value)| into(Step::Key(name.clone()), value)),
        _ => false,
    }
}

fn message(failure: Failure) -> String {
    match failure {
        Failure::Usage(message) | Failure::Failed(message) | Failure::Partly(message) => match message {
            Message::Line(line, help) => format!("{line} {}", help.unwrap_or_default()),
            Message::Listed(line, list, help) => format!("{line} {} {}", list.join(" "), help.unwrap_or_default()),
            Message::Rendered(text) | Message::Styled(text) => text,
        },
        Failure::Interrupted(_) | Failure::Closed => String::new(),
    }
}
