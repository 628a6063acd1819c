//! `afmid new`: beginnings.

use std::path::PathBuf;

use afmid_pipeline::Registry;
use serde_json::json;

use super::draft::{Draft, is_free};
use super::target::provide_folder;
use crate::batch::shell::quoted;
use crate::cli::{New, NewCauseArgs, NewFolderArgs, NewPipelineArgs, NewStageArgs};
use crate::failure::Failure;
use crate::output::{print, say};
use crate::printable::{one_line, shown};
use crate::relative::folder_of;
use crate::scaffold::{File, python, python_cause, rust, rust_cause};
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
    let path = |goal: &str| {
        let path = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{goal}.toml")));
        is_free(&path).map(|()| path)
    };
    let draft = Draft::new(&args.recordings, args.goal, args.spring, path, registry)?;
    draft.write()?;
    draft.notes.iter().for_each(|note| say(&format!("{}\n", one_line(note))));
    let output = &draft.path;
    if args.json {
        return print(&pretty(&json!({
            "config": output.display().to_string(),
            "recordings": draft.recordings,
            "goal": draft.goal,
            "chosen": draft.why,
            "notes": draft.notes,
        }))?);
    }
    let files = if draft.recordings == 1 { "1 file".to_owned() } else { format!("{} files", draft.recordings) };
    let result = quoted(output.with_extension("h5").file_name().unwrap_or_default());
    let why = if draft.why.is_empty() { String::new() } else { format!("; {}", one_line(&draft.why)) };
    // the stage that all others lead to
    let last = draft.plan.nodes.last().map_or("", |node| &node.id);
    print(&format!(
        "{}: {files}{why}\n  afmid run {} -o {result}\n  afmid show {result} {last}\n  afmid report {result}\n",
        output.display(),
        quoted(output)
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
    provide_folder(folder_of(&folder))?;
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
