//! `afmid trace`: from a number back to stages, parameters and bytes.

use afmid_pipeline::store::ResultFile;
use serde_json::{Value, json};

use super::diff::open;
use super::show::find;
use crate::cli::TraceArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::{one_line, shown};
use crate::provenance::files::Finder;
use crate::provenance::located::{Dataset, Located, Lost, locate};
use crate::provenance::path::parse;
use crate::provenance::tree::{ancestors, stage_json, tree_text};
use crate::show::{named_with_std, pretty};

/// Traces a number and prints its ancestry.
pub fn run(args: &TraceArgs) -> Result<(), Failure> {
    let form = || Some("write the stage's id and the place in its JSON, such as `modes[0].frequency_hz`".to_owned());
    let (id, steps) = parse(&args.path).map_err(|problem| Failure::usage(problem, form()))?;
    let file = open(&args.result)?;
    let stage = find(&file, &id)?;
    let located = locate(&file, stage, &steps).map_err(|lost| match lost {
        Lost::Path(problem, help) => Failure::usage(problem, Some(help)),
        Lost::File(error) => Failure::failed(&error, error.help.clone()),
    })?;
    let finder = Finder::new(&file.run().info, &[]);
    if args.json {
        let stages: Vec<Value> = ancestors(&file, stage).iter().map(|record| stage_json(record, &finder)).collect();
        return print(&pretty(&as_json(&file, &located, stages)?)?);
    }
    print(&format!("{}{}", head(&file, &located), tree_text(&file, stage, &finder)))
}

fn head(file: &ResultFile, located: &Located) -> String {
    let run = file.run();
    let value = match (&located.value, located.standard_error) {
        (Value::Number(number), Some(std)) => {
            let name = located.path.rsplit(['.', '/']).next().unwrap_or_default();
            named_with_std(name, number.as_f64().unwrap_or(f64::NAN), std)
        }
        (value, _) => shortened(&value.to_string()),
    };
    let mut text = format!("{} = {value}\n", one_line(&located.path));
    text.push_str(&format!("in {}: {}\n", shown(file.path()), place(&located.place)));
    for other in &located.also {
        text.push_str(&format!("the same number: {}\n", place(other)));
    }
    let sets: String = run.overrides.iter().map(|set| format!(" --set {set}")).collect();
    let config = if run.info.config_file.is_empty() { "its config" } else { &run.info.config_file };
    let ran =
        format!("{} ran `{}` (seed {}) from {config}{sets}, {}", run.program, run.name, run.seed, run.info.started_at);
    text + &one_line(&ran) + "\n\n"
}

fn place(place: &Dataset) -> String {
    let index: String = place.index.iter().map(|index| format!("[{index}]")).collect();
    let pointer = place.pointer.as_ref().map(|pointer| format!(" at {pointer}")).unwrap_or_default();
    one_line(&format!("{}{index}{pointer}", place.dataset))
}

fn shortened(text: &str) -> String {
    const MOST: usize = 100;
    if text.chars().count() <= MOST { text.to_owned() } else { text.chars().take(MOST).chain("...".chars()).collect() }
}

fn as_json(file: &ResultFile, located: &Located, stages: Vec<Value>) -> Result<Value, Failure> {
    let mut json = serde_json::to_value(located).map_err(|error| Failure::failed(error, None))?;
    let run = file.run();
    json["file"] = json!(file.path().display().to_string());
    json["run"] = json!({
        "program": run.program,
        "name": run.name,
        "seed": run.seed,
        "overrides": run.overrides,
        "config_file": run.info.config_file,
        "folder": run.info.folder,
        "started_at": run.info.started_at,
    });
    json["stages"] = Value::Array(stages);
    Ok(json)
}
