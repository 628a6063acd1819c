//! `afmid export`: a model, or modes with their shapes, for other programs.

use std::fmt::Display;
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
use crate::cli::{ExportArgs, ExportFormat, ModelFormat, ShapeFormat};
use crate::export::{ExportedModel, ExportedShapes, Origin, ShapesError, model_json, model_mat, shapes_uff, units};
use crate::failure::Failure;
use crate::output::print;
use crate::printable::shown;
use crate::show::{SUMMARY, pretty};

/// What can be exported, and where it is found.
struct Kind {
    /// One, and several.
    nouns: [&'static str; 2],
    /// The stage that is meant if nothing is said: that of every shipped config.
    usual: &'static str,
    makers: &'static str,
    is: fn(name: &str, shape: Shape) -> bool,
}

const MODELS: Kind = Kind {
    nouns: ["state-space model", "state-space models"],
    usual: "model",
    makers: "a stage such as `model.pem` or `model.vector_fitting` makes one",
    is: |_, shape| shape == Shape::StateSpace,
};

const SHAPES: Kind = Kind {
    nouns: ["mode shapes", "sets of mode shapes"],
    usual: "modes",
    makers: "`model.decay` and `model.frf_modes` find them",
    is: |name, shape| shape == Shape::Array && name == "shapes",
};

/// Writes what is wanted and says where.
pub fn run(args: &ExportArgs) -> Result<(), Failure> {
    let file = open(&args.result)?;
    let format = args.what.format().ok_or_else(|| Failure::usage("wanted --model or --shapes", None))?;
    let kind = if matches!(format, ExportFormat::Model(_)) { &MODELS } else { &SHAPES };
    let (id, port) = chosen(&file, kind, args.stage.as_deref())?;
    let output = args.output.clone().unwrap_or_else(|| default_output(&args.result, &id, format.extension()));
    prepare(&output, Target::Export, &[("the result file", args.result.clone())])?;
    let bytes = match format {
        ExportFormat::Model(ModelFormat::Mat) => model_mat(&model(&file, &id, &port)?).map_err(failed)?,
        ExportFormat::Model(ModelFormat::Json) => model_json(&model(&file, &id, &port)?).map_err(failed)?,
        ExportFormat::Shapes(ShapeFormat::Uff) => shapes_uff(&shapes(&file, &id)?).ok_or_else(|| failed("no mark"))?,
    };
    replace_with(&output, |temporary| fs::write(temporary, &bytes))
        .map_err(|error| Failure::failed(&error, error.help.clone()))?;
    if args.json {
        return print(&pretty(&json!({ "file": output.display().to_string(), "stage": id, "port": port }))?);
    }
    print(&(shown(&output) + "\n"))
}

fn failed(error: impl Display) -> Failure {
    Failure::failed(error, None)
}

fn artifact(file: &ResultFile, id: &str, port: &str) -> Result<Artifact, Failure> {
    file.artifact(id, port).map_err(|error| Failure::failed(&error, error.help.clone()))
}

/// Modes with their shapes, as the stage's summary states them.
fn shapes(file: &ResultFile, id: &str) -> Result<ExportedShapes, Failure> {
    let stage = find(file, id)?;
    let Artifact::Document(summary) = artifact(file, id, SUMMARY)? else {
        return Err(failed(format!("{id}.{SUMMARY} is no document")));
    };
    let run = file.run();
    let origin = Origin { pipeline: &run.name, source: id, uses: &stage.record.uses, program: &run.program };
    ExportedShapes::new(&summary.0, origin).map_err(|error| {
        let help = matches!(error, ShapesError::Pairs)
            .then(|| "let `files` of `io.frf` name the responses of one input, or of one output, alone".to_owned());
        Failure::failed(format!("{id}: {error}"), help)
    })
}

fn model(file: &ResultFile, id: &str, port: &str) -> Result<ExportedModel, Failure> {
    let stage = find(file, id)?;
    let artifact = artifact(file, id, port)?;
    let Artifact::StateSpace(model) = artifact else {
        return Err(Failure::failed(format!("{id}.{port} is {}, wanted a model", artifact.shape().name()), None));
    };
    let source = format!("{id}.{port}");
    let run = file.run();
    let origin = Origin { pipeline: &run.name, source: &source, uses: &stage.record.uses, program: &run.program };
    ExportedModel::new(&model, origin, units(file, stage)).map_err(|error| failed(format!("{source}: {error}")))
}

/// The stage and port to export. Errors, usage: none of this name; several, and none of them is usual.
fn chosen(file: &ResultFile, kind: &Kind, wanted: Option<&str>) -> Result<(String, String), Failure> {
    let all: Vec<(&str, &str)> = file
        .stages()
        .iter()
        .flat_map(|stage| {
            let own = stage.ports.iter().filter(|port| (kind.is)(&port.name, port.shape));
            own.map(|port| (stage.record.id.as_str(), port.name.as_str()))
        })
        .collect();
    let (shown, [noun, nouns]) = (file.path().display(), kind.nouns);
    if all.is_empty() {
        return Err(Failure::usage(format!("{shown} holds no {noun}"), Some(kind.makers.to_owned())));
    }
    let found: Vec<&(&str, &str)> = match wanted {
        Some(wanted) => all.iter().filter(|(id, port)| *id == wanted || is_port(wanted, id, port)).collect(),
        None if all.len() == 1 => all.iter().collect(),
        None => all.iter().filter(|(id, _)| *id == kind.usual).collect(),
    };
    let list = || all.iter().map(|(id, port)| name(&all, id, port)).collect::<Vec<String>>();
    match (&found[..], wanted) {
        ([(id, port)], _) => Ok(((*id).to_owned(), (*port).to_owned())),
        ([], Some(wanted)) => {
            let list = list();
            let help = match nearest(wanted, list.iter().map(String::as_str)) {
                Some(nearest) => format!("did you mean `{nearest}`?"),
                None => format!("there is: {}", list.join(", ")),
            };
            Err(Failure::usage(format!("{shown} has no {noun} `{wanted}`"), Some(help)))
        }
        (_, _) => {
            let help = format!("say which with --stage: {}", list().join(", "));
            Err(Failure::usage(format!("{shown} holds {} {nouns}", all.len()), Some(help)))
        }
    }
}

fn is_port(wanted: &str, id: &str, port: &str) -> bool {
    wanted.split_once('.') == Some((id, port))
}

/// As short as it is unique.
fn name(all: &[(&str, &str)], id: &str, port: &str) -> String {
    let alone = all.iter().filter(|(other, _)| *other == id).count() == 1;
    if alone { id.to_owned() } else { format!("{id}.{port}") }
}

/// `RESULT-STAGE.mat` in the working directory.
fn default_output(result: &Path, id: &str, ending: &str) -> PathBuf {
    let stem = result.file_stem().unwrap_or_default().to_string_lossy();
    PathBuf::from(format!("{stem}-{id}.{ending}"))
}
