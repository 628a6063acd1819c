//! `afmid export-crate`: a run as a Process Run RO-Crate.

use std::fs;
use std::path::{Path, PathBuf};

use afmid_pipeline::files::{open_regular, replace_with};
use serde_json::{Value, json};

use super::diff::open;
use crate::cli::CrateArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::provenance::files::{Finder, Now};
use crate::provenance::research_object::{CONFIG, CrateInput, METADATA, Stated, inputs, metadata, result_name};
use crate::show::pretty;

/// Writes a crate and says what is in it.
pub fn run(args: &CrateArgs) -> Result<(), Failure> {
    let file = open(&args.result)?;
    let folder = args.output.clone().unwrap_or_else(|| default_output(&args.result));
    let finder = Finder::new(&file.run().info, &args.data);
    let find = |source: &_| match finder.find(source) {
        Now::Same(path) => Some(path),
        _ => None,
    };
    let inputs = inputs(&file, find, args.with_data);
    let gone: Vec<&CrateInput> = inputs.iter().filter(|input| input.found.is_none()).collect();
    if let (true, Some(first)) = (args.with_data, gone.first()) {
        let message = format!(
            "{} of {} inputs are not there with the same bytes, first {}",
            gone.len(),
            inputs.len(),
            first.source.path
        );
        return Err(Failure::failed(message, Some("`--data FOLDER` looks there by name and hash".to_owned())));
    }
    let stated = Stated { agent: args.agent.clone(), agent_id: args.agent_id.clone(), license: args.license.clone() };
    let result = result_name(&args.result);
    let failed = |error: std::io::Error| Failure::failed(format!("an input cannot be read: {error}"), None);
    let metadata = metadata(&file, &result, &inputs, &stated).map_err(failed)?;
    make_folder(&folder)?;
    copy(&args.result, &folder.join(&result))?;
    write(&folder.join(CONFIG), &file.run().config)?;
    for input in &inputs {
        if let (Some(from), Some(place)) = (&input.found, &input.copy) {
            copy(from, &folder.join(place))?;
        }
    }
    // last: a folder without it is no crate
    write(&folder.join(METADATA), &text(&metadata)?)?;
    if args.json {
        let folder = folder.display().to_string();
        return print(&pretty(
            &json!({ "folder": folder, "inputs": inputs.len(), "missing": gone.len(), "copied": args.with_data }),
        )?);
    }
    print(&told(&folder, &inputs, gone.len()))
}

fn told(folder: &Path, inputs: &[CrateInput], gone: usize) -> String {
    let how = match inputs.first() {
        Some(CrateInput { copy: Some(_), .. }) => "copied",
        _ => "by their hashes",
    };
    let missing = if gone == 0 { String::new() } else { format!(", {gone} of them not there any more") };
    format!("{}: result, config, {} inputs {how}{missing}\n", folder.display(), inputs.len())
}

/// `NAME-crate` in the working directory.
fn default_output(result: &Path) -> PathBuf {
    PathBuf::from(format!("{}-crate", result.file_stem().unwrap_or_default().to_string_lossy()))
}

fn text(metadata: &Value) -> Result<String, Failure> {
    serde_json::to_string_pretty(metadata).map(|text| text + "\n").map_err(|error| Failure::failed(error, None))
}

/// Makes the crate's folder. Errors, usage: it is a file; it holds something and is no crate.
fn make_folder(folder: &Path) -> Result<(), Failure> {
    let shown = folder.display();
    let another = || Some("give another place with -o".to_owned());
    match fs::read_dir(folder).map(|mut entries| entries.next().is_some()) {
        Ok(true) if !folder.join(METADATA).is_file() => {
            Err(Failure::usage(format!("{shown} holds other things than a crate: only a crate is replaced"), another()))
        }
        Ok(_) => Ok(()),
        Err(_) => fs::create_dir(folder)
            .map_err(|error| Failure::usage(format!("the folder {shown} cannot be made: {error}"), another())),
    }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    replaced(path, |temporary| fs::write(temporary, text))
}

fn copy(from: &Path, to: &Path) -> Result<(), Failure> {
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder).map_err(|error| {
            Failure::failed(format!("the folder {} cannot be made: {error}", folder.display()), None)
        })?;
    }
    // a crate may be made of a result that lies in it
    let same = |path: &Path| fs::canonicalize(path).ok();
    if same(from).is_some() && same(from) == same(to) {
        return Ok(());
    }
    replaced(to, |temporary| std::io::copy(&mut open_regular(from)?, &mut fs::File::create(temporary)?).map(|_| ()))
}

fn replaced(path: &Path, fill: impl FnOnce(&Path) -> std::io::Result<()>) -> Result<(), Failure> {
    replace_with(path, fill).map_err(|error| Failure::failed(&error, error.help.clone()))
}
