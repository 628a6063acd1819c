//! `afmid new`: beginnings.

use std::path::PathBuf;

use afmid_pipeline::Registry;
use afmid_pipeline::files::replace_with;
use afmid_pipeline::recording::is_of_resampling;
use serde_json::json;

use super::load::plan_text;
use super::target::require_folder;
use crate::cli::{New, NewCauseArgs, NewFolderArgs, NewPipelineArgs, NewStageArgs};
use crate::failure::Failure;
use crate::output::{print, say};
use crate::printable::{one_line, shown};
use crate::relative::folder_of;
use crate::scaffold::{
    File, Wanted, choose, joined_files, left_out, look, pipeline, python, python_cause, rust, rust_cause,
};
use crate::show::pretty;

/// Writes what was asked for.
pub fn run(what: &New, registry: &Registry) -> Result<(), Failure> {
    match what {
        New::Pipeline(args) => new_pipeline(args, registry),
        New::Stage(args) => new_stage(args),
        New::Cause(args) => new_cause(args),
    }
}

fn new_pipeline(args: &NewPipelineArgs, registry: &Registry) -> Result<(), Failure> {
    let usage = |(problem, help): (String, Option<String>)| Failure::usage(problem, help);
    let wanted = Wanted {
        goal: args.goal,
        channels: &args.channel,
        inputs: &args.input,
        records_are: args.records_are,
        rate_hz: args.rate,
        unit: args.unit.as_deref(),
        resample: args.resample,
    };
    let joined = joined_files(&args.recordings, &wanted).map_err(usage)?;
    let (source, inputs, channels, notes) = match joined {
        Some(joined) => (joined.source, joined.inputs, joined.outputs, joined.notes),
        None => (look(&args.recordings, &wanted).map_err(usage)?, args.input.clone(), args.channel.clone(), Vec::new()),
    };
    let wanted = Wanted { inputs: &inputs, channels: &channels, ..wanted };
    let mut choice = choose(&source, &wanted).map_err(usage)?;
    choice.notes.extend(notes);
    choice.notes.extend(source.remarks.iter().filter(|remark| is_of_resampling(remark)).cloned());
    let output = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.toml", choice.goal.name())));
    // also a link to nothing
    if output.symlink_metadata().is_ok() {
        let help = "choose another file with -o, or remove it".to_owned();
        return Err(Failure::usage(format!("{} is there already", output.display()), Some(help)));
    }
    require_folder(folder_of(&output))?;
    choice.notes.extend(left_out(&source, args, &output));
    let text = pipeline(&source, &choice, wanted, folder_of(&output)).map_err(usage)?;
    let plan = plan_text(&output.display().to_string(), &text, &[], registry)?;
    replace_with(&output, |file| std::fs::write(file, &text))
        .map_err(|error| Failure::failed(&error, error.help.clone()))?;
    choice.notes.iter().for_each(|note| say(&format!("{}\n", one_line(note))));
    if args.json {
        return print(&pretty(&json!({
            "config": output.display().to_string(),
            "recordings": source.count(),
            "goal": choice.goal.name(),
            "chosen": choice.why,
            "notes": choice.notes,
        }))?);
    }
    let files = if source.count() == 1 { "1 file".to_owned() } else { format!("{} files", source.count()) };
    let name = output.file_stem().unwrap_or_default().to_string_lossy();
    let why = if choice.why.is_empty() { String::new() } else { format!("; {}", one_line(&choice.why)) };
    // the stage that all others lead to
    let last = plan.nodes.last().map_or("", |node| &node.id);
    print(&format!(
        "{}: {files}{why}\n  afmid run {0} -o {name}.h5\n  afmid show {name}.h5 {last}\n  afmid report {name}.h5\n",
        output.display()
    ))
}

fn new_stage(args: &NewStageArgs) -> Result<(), Failure> {
    let name = &args.name;
    let clone = begun(name, &args.place, args.rust)?;
    let (files, next) = match clone {
        Some(clone) => (rust(name, &clone), format!("cargo test\n  cargo run -- run {name}.toml")),
        None => (
            python(name),
            format!("afmid plugin check -- python3 {name}.py\n  afmid trust {name}.toml\n  afmid run {name}.toml"),
        ),
    };
    write(name, &args.place, files, &next)
}

fn new_cause(args: &NewCauseArgs) -> Result<(), Failure> {
    let name = &args.name;
    let clone = begun(name, &args.place, args.rust)?;
    let (files, next) = match clone {
        Some(clone) => (
            rust_cause(name, &clone),
            format!("cargo run -- run {name}.toml -o {name}.h5\n  cargo run -- show {name}.h5 diagnosis"),
        ),
        None => (python_cause(name), format!("python3 {name}.py")),
    };
    write(name, &args.place, files, &next)
}

/// The folder of what is begun.
fn folder(name: &str, place: &NewFolderArgs) -> PathBuf {
    place.output.clone().unwrap_or_else(|| PathBuf::from(name))
}

/// The clone that a crate depends on; none of Python. Errors, usage: the folder is there already, or cannot be made; there
/// is no such clone.
fn begun(name: &str, place: &NewFolderArgs, is_crate: bool) -> Result<Option<PathBuf>, Failure> {
    let folder = folder(name, place);
    if folder.symlink_metadata().is_ok() {
        let help = "choose another folder with -o, or remove it".to_owned();
        return Err(Failure::usage(format!("{} is there already", folder.display()), Some(help)));
    }
    require_folder(folder_of(&folder))?;
    let Some(sources) = place.sources.as_ref().filter(|_| is_crate) else { return Ok(None) };
    let clone = sources.join("pipeline/Cargo.toml").is_file().then(|| std::path::absolute(sources).ok()).flatten();
    let help = "give the folder of a clone of afmid's repository".to_owned();
    let missing = || Failure::usage(format!("{} holds no pipeline/Cargo.toml", sources.display()), Some(help));
    clone.ok_or_else(missing).map(Some)
}

/// Writes the files and says what to do with them.
fn write(name: &str, place: &NewFolderArgs, files: Vec<File>, next: &str) -> Result<(), Failure> {
    let folder = folder(name, place);
    let failed =
        |error: std::io::Error| Failure::failed(format!("{} cannot be written: {error}", folder.display()), None);
    let mut written = Vec::new();
    for (file, text) in files {
        let path = folder.join(file);
        std::fs::create_dir_all(folder_of(&path)).and_then(|()| std::fs::write(&path, text)).map_err(failed)?;
        written.push(path.display().to_string());
    }
    if place.json {
        return print(&pretty(&json!({ "folder": folder.display().to_string(), "files": written }))?);
    }
    print(&format!("{}\n  cd {0}\n  {next}\n", shown(&folder)))
}
