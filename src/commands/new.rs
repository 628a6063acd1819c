//! `afmid new`: beginnings.

use std::path::PathBuf;

use afmid_pipeline::Registry;
use afmid_pipeline::cache::replace_with;

use super::load::plan_text;
use crate::cli::{New, NewPipelineArgs};
use crate::failure::Failure;
use crate::output::print;
use crate::relative::folder_of;
use crate::scaffold::{Wanted, look, pipeline};

/// Writes what was asked for.
pub fn run(what: &New, registry: &Registry) -> Result<(), Failure> {
    match what {
        New::Pipeline(args) => new_pipeline(args, registry),
    }
}

fn new_pipeline(args: &NewPipelineArgs, registry: &Registry) -> Result<(), Failure> {
    let output = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.toml", args.goal.name())));
    if output.exists() {
        let help = "choose another file with -o, or remove it".to_owned();
        return Err(Failure::usage(format!("{} is there already", output.display()), Some(help)));
    }
    let usage = |(problem, help): (String, Option<String>)| Failure::usage(problem, help);
    let source = look(&args.recordings).map_err(usage)?;
    let wanted =
        Wanted { goal: args.goal, channel: args.channel.as_deref(), rate_hz: args.rate, unit: args.unit.as_deref() };
    let text = pipeline(&source, wanted, folder_of(&output)).map_err(usage)?;
    plan_text(&output.display().to_string(), &text, &[], registry)?;
    replace_with(&output, |file| std::fs::write(file, &text))
        .map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let files = if source.files == 1 { "1 file".to_owned() } else { format!("{} files", source.files) };
    print(&format!(
        "{}: {files}\n  afmid run {0} -o {1}.h5\n",
        output.display(),
        output.file_stem().unwrap_or_default().to_string_lossy()
    ))
}
