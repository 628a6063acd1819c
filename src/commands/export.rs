//! `afmid export`: a model for other programs.

use std::fs;
use std::path::{Path, PathBuf};

use afmid_pipeline::config::nearest;
use afmid_pipeline::files::replace_with;
use afmid_pipeline::store::ResultFile;
use afmid_pipeline::{Artifact, Shape};
use serde_json::json;

use super::diff::open;
use super::show::find;
use super::target::{Target, prepare};
use crate::cli::{ExportArgs, ModelFormat};
use crate::export::{ExportedModel, Origin, model_json, model_mat, units};
use crate::failure::Failure;
use crate::output::print;
use crate::printable::shown;
use crate::show::pretty;

/// What is exported if nothing is said: the stage that fits all events in every shipped config.
const USUAL: &str = "model";

/// Writes the model and says where.
pub fn run(args: &ExportArgs) -> Result<(), Failure> {
    let file = open(&args.result)?;
    let (id, port) = chosen(&file, args.stage.as_deref())?;
    let output = args.output.clone().unwrap_or_else(|| default_output(&args.result, &id, args.model));
    prepare(&output, Target::Model, &[("the result file", args.result.clone())])?;
    let model = exported(&file, &id, &port)?;
    let bytes = match args.model {
        ModelFormat::Mat => model_mat(&model).map_err(|error| Failure::failed(error, None))?,
        ModelFormat::Json => model_json(&model).map_err(|error| Failure::failed(error, None))?,
    };
    replace_with(&output, |temporary| fs::write(temporary, &bytes))
        .map_err(|error| Failure::failed(&error, error.help.clone()))?;
    if args.json {
        return print(&pretty(&json!({ "file": output.display().to_string(), "stage": id, "port": port }))?);
    }
    print(&(shown(&output) + "\n"))
}

fn exported(file: &ResultFile, id: &str, port: &str) -> Result<ExportedModel, Failure> {
    let stage = find(file, id)?;
    let artifact = file.artifact(id, port).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let Artifact::StateSpace(model) = artifact else {
        return Err(Failure::failed(format!("{id}.{port} is {}, wanted a model", artifact.shape().name()), None));
    };
    let source = format!("{id}.{port}");
    let run = file.run();
    let origin = Origin { pipeline: &run.name, source: &source, uses: &stage.record.uses, program: &run.program };
    ExportedModel::new(&model, origin, units(file, stage))
        .map_err(|error| Failure::failed(format!("{source}: {error}"), None))
}

/// The stage and port to export. Errors, usage: none of this name; several, and none of them is usual.
fn chosen(file: &ResultFile, wanted: Option<&str>) -> Result<(String, String), Failure> {
    let models: Vec<(&str, &str)> = file
        .stages()
        .iter()
        .flat_map(|stage| {
            let models = stage.ports.iter().filter(|port| port.shape == Shape::StateSpace);
            models.map(|port| (stage.record.id.as_str(), port.name.as_str()))
        })
        .collect();
    let shown = file.path().display();
    if models.is_empty() {
        let help = "a stage such as `model.pem` or `model.vector_fitting` makes one".to_owned();
        return Err(Failure::usage(format!("{shown} holds no state-space model"), Some(help)));
    }
    let found: Vec<&(&str, &str)> = match wanted {
        Some(wanted) => models.iter().filter(|(id, port)| *id == wanted || is_port(wanted, id, port)).collect(),
        None if models.len() == 1 => models.iter().collect(),
        None => models.iter().filter(|(id, _)| *id == USUAL).collect(),
    };
    let list = || models.iter().map(|(id, port)| name(&models, id, port)).collect::<Vec<String>>();
    match (&found[..], wanted) {
        ([(id, port)], _) => Ok(((*id).to_owned(), (*port).to_owned())),
        ([], Some(wanted)) => {
            let list = list();
            let help = match nearest(wanted, list.iter().map(String::as_str)) {
                Some(nearest) => format!("did you mean `{nearest}`?"),
                None => format!("there is: {}", list.join(", ")),
            };
            Err(Failure::usage(format!("{shown} has no state-space model `{wanted}`"), Some(help)))
        }
        (_, _) => {
            let help = format!("say which with --stage: {}", list().join(", "));
            Err(Failure::usage(format!("{shown} holds {} state-space models", models.len()), Some(help)))
        }
    }
}

fn is_port(wanted: &str, id: &str, port: &str) -> bool {
    wanted.split_once('.') == Some((id, port))
}

/// As short as it is unique.
fn name(models: &[(&str, &str)], id: &str, port: &str) -> String {
    let alone = models.iter().filter(|(other, _)| *other == id).count() == 1;
    if alone { id.to_owned() } else { format!("{id}.{port}") }
}

/// `RESULT-STAGE.mat` in the working directory.
fn default_output(result: &Path, id: &str, format: ModelFormat) -> PathBuf {
    let stem = result.file_stem().unwrap_or_default().to_string_lossy();
    PathBuf::from(format!("{stem}-{id}.{}", format.extension()))
}
