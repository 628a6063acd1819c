//! A config for recordings before it is written: what `afmid new pipeline` and `afmid diagnose` write.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::is_of_resampling;
use afmid_pipeline::{Plan, Registry};

use super::load::plan_text;
use super::target::provide_folder;
use crate::cli::{Goal, RecordingsArgs, SpringArgs};
use crate::failure::Failure;
use crate::relative::folder_of;
use crate::scaffold::{Wanted, choose, joined_files, left_out, look, pipeline};

/// A config, checked, and what was chosen.
pub struct Draft {
    /// Where it goes.
    pub path: PathBuf,
    pub text: String,
    pub plan: Plan,
    /// The goal's name.
    pub goal: &'static str,
    /// How many recordings it is of.
    pub recordings: usize,
    /// Why the recordings lead to this; empty where the user chose.
    pub why: String,
    /// What is to be said of what was left out or taken for granted.
    pub notes: Vec<String>,
}

impl Draft {
    /// Looks at the recordings and chooses. `path`: where the config goes, by the goal's name.
    ///
    /// Errors, usage: what is not known of the recordings, and how to say it; a folder that is not there.
    pub fn new(
        args: &RecordingsArgs,
        goal: Option<Goal>,
        spring: SpringArgs,
        path: impl FnOnce(&str) -> Result<PathBuf, Failure>,
        registry: &Registry,
    ) -> Result<Self, Failure> {
        let usage = |(problem, help): (String, Option<String>)| Failure::usage(problem, help);
        let wanted = Wanted {
            goal,
            channels: &args.channel,
            inputs: &args.input,
            reference: args.reference.as_deref(),
            records_are: args.records_are,
            rate_hz: args.rate,
            unit: args.unit.as_deref(),
            resample: args.resample,
            spring,
        };
        let joined = joined_files(&args.paths, &wanted).map_err(usage)?;
        let (source, inputs, channels, reference, notes) = match joined {
            Some(joined) => (joined.source, joined.inputs, joined.outputs, joined.reference, joined.notes),
            None => {
                let source = look(&args.paths, &wanted).map_err(usage)?;
                (source, args.input.clone(), args.channel.clone(), args.reference.clone(), Vec::new())
            }
        };
        let wanted = Wanted { inputs: &inputs, channels: &channels, reference: reference.as_deref(), ..wanted };
        let mut choice = choose(&source, &wanted).map_err(usage)?;
        choice.notes.extend(notes);
        choice.notes.extend(source.remarks.iter().filter(|remark| is_of_resampling(remark)).cloned());
        let path = path(choice.name())?;
        provide_folder(folder_of(&path))?;
        choice.notes.extend(left_out(&source, args, goal, &path));
        let text = pipeline(&source, &choice, wanted, folder_of(&path)).map_err(usage)?;
        let plan = plan_text(&path.display().to_string(), &text, &[], registry)?;
        let (goal, recordings) = (choice.name(), source.count());
        Ok(Self { path, text, plan, goal, recordings, why: choice.why, notes: choice.notes })
    }

    /// Writes it. Errors: it cannot be written.
    pub fn write(&self) -> Result<(), Failure> {
        afmid_pipeline::files::replace_with(&self.path, |file| std::fs::write(file, &self.text))
            .map_err(|error| Failure::failed(&error, error.help.clone()))
    }
}

/// Errors, usage: a file of that name is there, also a link to nothing.
pub fn is_free(path: &Path) -> Result<(), Failure> {
    if path.symlink_metadata().is_err() {
        return Ok(());
    }
    let help = "choose another file with -o, or remove it".to_owned();
    Err(Failure::usage(format!("{} is there already", path.display()), Some(help)))
}
