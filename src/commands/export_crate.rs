//! `afmid export-crate`: a run as a Process Run RO-Crate.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use afmid_pipeline::InputFiles;
use afmid_pipeline::error::StoreError;
use afmid_pipeline::files::{FilledFolder, LIST, is_temporary, open_regular, sweep_below};
use serde_json::{Value, json};

use super::diff::open;
use super::target::{make_folder, provide_folder, text_of};
use crate::cli::CrateArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::shown;
use crate::provenance::files::{Finder, Now};
use crate::provenance::research_object::{CONFIG, CrateInput, METADATA, Stated, inputs, metadata, result_name};
use crate::relative::folder_of;
use crate::show::pretty;

/// Writes a crate and says what is in it.
pub fn run(args: &CrateArgs) -> Result<(), Failure> {
    let file = open(&args.result)?;
    let folder = args.output.clone().unwrap_or_else(|| default_output(&args.result));
    if is_crate(&folder) {
        sweep_below(&folder);
    }
    require_crate(&folder)?;
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
    let unread = |error: std::io::Error| Failure::failed(format!("an input cannot be read: {error}"), None);
    let metadata = metadata(&file, &result, &inputs, &stated).map_err(unread)?;
    make_folder(&folder)?;
    let held = Held::open(&folder)?;
    let hash = InputFiles::new().hash(&args.result).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let mut copies = vec![Copied { from: &args.result, name: &result, blake3: &hash }];
    copies.extend(inputs.iter().filter_map(|input| {
        Some(Copied { from: input.found.as_deref()?, name: input.copy.as_deref()?, blake3: &input.source.blake3 })
    }));
    copies.iter().try_for_each(|copied| held.require_own(copied.name))?;
    [CONFIG, METADATA].iter().try_for_each(|name| held.require_own(name))?;
    copies.iter().try_for_each(|copied| held.copy(copied))?;
    held.write(CONFIG, &file.run().config)?;
    // last: a folder without it is no crate
    held.write(METADATA, &text(&metadata)?)?;
    if args.json {
        let folder = folder.display().to_string();
        return print(&pretty(
            &json!({ "folder": folder, "inputs": inputs.len(), "missing": gone.len(), "copied": args.with_data }),
        )?);
    }
    print(&summary(&folder, &inputs, gone.len()))
}

fn summary(folder: &Path, inputs: &[CrateInput], gone: usize) -> String {
    let how = match inputs.first() {
        Some(CrateInput { copy: Some(_), .. }) => "copied",
        _ => "by their hashes",
    };
    let missing = if gone == 0 { String::new() } else { format!(", {gone} of them not there any more") };
    format!("{}: result, config, {} inputs {how}{missing}\n", shown(folder), inputs.len())
}

/// `NAME-crate` in the working directory.
fn default_output(result: &Path) -> PathBuf {
    PathBuf::from(format!("{}-crate", result.file_stem().unwrap_or_default().to_string_lossy()))
}

fn text(metadata: &Value) -> Result<String, Failure> {
    serde_json::to_string_pretty(metadata).map(|text| text + "\n").map_err(|error| Failure::failed(error, None))
}

/// Whether a folder is a crate, or one in the making.
fn is_crate(folder: &Path) -> bool {
    [METADATA, LIST].iter().any(|name| folder.join(name).is_file())
}

/// Sees to it that a folder may become a crate. What a killed export left under temporary names before its first file
/// was whole is nobody's. Errors, usage: it is a file; the folder above it is not there; it holds something else and is
/// no crate.
fn require_crate(folder: &Path) -> Result<(), Failure> {
    let others = |entries: fs::ReadDir| entries.flatten().any(|entry| !is_temporary(&entry.path()));
    match fs::read_dir(folder).map(others) {
        Ok(true) if !is_crate(folder) => Err(Failure::usage(
            format!("{} holds other things than a crate: only a crate is replaced", folder.display()),
            Some("give another place with -o".to_owned()),
        )),
        Ok(_) => Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => provide_folder(folder_of(folder)),
        Err(_) => provide_folder(folder),
    }
}

/// A file that is copied into a crate.
struct Copied<'a> {
    from: &'a Path,
    /// In the crate.
    name: &'a str,
    /// BLAKE3 hash of its bytes, in hexadecimal.
    blake3: &'a str,
}

/// What lies in a crate's folder.
struct Held {
    folder: FilledFolder,
    /// Whether a version that kept no list made the crate: its files are known by it.
    earlier: bool,
}

impl Held {
    fn open(folder: &Path) -> Result<Self, Failure> {
        let metadata = text_of(&folder.join(METADATA));
        let earlier = metadata.contains("\"SoftwareApplication\"") && metadata.contains("\"name\": \"afmid\"");
        Ok(Self { folder: FilledFolder::open(folder).map_err(failed)?, earlier })
    }

    fn require_own(&self, name: &str) -> Result<(), Failure> {
        self.folder.require_own(name, |_| self.earlier).map_err(failed)
    }

    fn write(&self, name: &str, text: &str) -> Result<(), Failure> {
        self.folder.write(name, |_| self.earlier, text.as_bytes()).map_err(failed)
    }

    /// Copies a file; one that an export which was ended has copied already stays. Errors: it cannot be copied.
    fn copy(&self, Copied { from, name, blake3 }: &Copied) -> Result<(), Failure> {
        let to = self.folder.folder().join(name);
        if let Some(folder) = to.parent() {
            fs::create_dir_all(folder).map_err(|error| {
                Failure::failed(format!("the folder {} cannot be made: {error}", folder.display()), None)
            })?;
        }
        // a crate may be made of a result that lies in it
        let same = |path: &Path| fs::canonicalize(path).ok();
        if same(from).is_some() && same(from) == same(&to) || self.folder.holds(name, blake3) {
            return Ok(());
        }
        let copied =
            |temporary: &Path| std::io::copy(&mut open_regular(from)?, &mut fs::File::create(temporary)?).map(|_| ());
        self.folder.replace_with(name, |_| self.earlier, copied).map_err(failed)
    }
}

fn failed(error: StoreError) -> Failure {
    Failure::failed(&error, error.help.clone())
}
