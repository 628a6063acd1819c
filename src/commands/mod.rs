//! One file per command: each turns arguments into a call of the engine, and its answer into text.

mod at_once;
mod batch;
mod causes;
mod check;
mod compare;
mod completions;
mod consent;
mod diagnose;
mod diff;
mod docs;
mod doctor;
pub mod doors;
mod draft;
mod exam;
mod explain;
mod export;
mod export_crate;
mod gc;
mod graph;
mod inspect;
mod load;
mod man;
mod modes;
mod new;
mod open;
mod plugin;
mod report;
mod rerun;
mod run;
mod schema;
mod show;
mod stages;
mod submit;
mod sweep;
mod target;
mod trace;
mod trust;

use std::path::Path;

use afmid_pipeline::Registry;
use afmid_pipeline::plugin::{AllStages, Plugins};

pub use run::run_here;

use crate::cli::{AllowArgs, Command, GraphFormat};
use crate::failure::Failure;

/// Runs a command with the stages of a program.
pub fn dispatch(command: Command, registry: &Registry) -> Result<(), Failure> {
    match command {
        Command::Run(args) => starting(&args.plugins, None, registry, |stages| run::run(&args, stages)),
        Command::Batch(args) => {
            let agreed = args.agreed_plugins.as_deref();
            starting(&args.plugins, agreed, registry, |stages| batch::run(&args, stages))
        }
        Command::Submit { to } => submit::run(&to, registry),
        Command::Explain(args) => explain::run(&args, &planning(registry, &consent::none())),
        Command::Inspect { files, resample, json } => inspect::run(&files, resample, json),
        Command::Show { result, id, csv: true, .. } => show::table(&result, id.as_deref().unwrap_or_default()),
        Command::Show { result, id, all, json, .. } => show::run(&result, id.as_deref(), all, json),
        Command::Compare { results, json } => compare::run(&results, json),
        Command::Diff(args) => diff::run(&args),
        Command::Trace(args) => trace::run(&args),
        Command::Rerun(args) => starting(&args.plugins, None, registry, |stages| rerun::run(&args, stages)),
        Command::Export(args) => export::run(&args),
        Command::ExportCrate(args) => export_crate::run(&args),
        Command::Gc(args) => gc::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Modes(args) => modes::run(&args, registry),
        Command::Diagnose(args) => diagnose::run(&args, registry),
        Command::New { what } => new::run(&what, registry),
        Command::Check { configs, json } => check::run(&configs, json, &planning(registry, &consent::none())),
        Command::Graph { config, format, json } => {
            let format = if json { GraphFormat::Json } else { format };
            graph::run(&config, format, &planning(registry, &consent::none()))
        }
        Command::Stages { name, json } => stages::run(name.as_deref(), json, registry),
        Command::Causes { name, json } => causes::run(name.as_deref(), json),
        Command::Exam(args) => starting(&args.plugins, None, registry, |stages| exam::run(&args, stages)),
        Command::Trust(args) => trust::run(&args),
        Command::Plugin { what } => plugin::run(&what, &consent::all()),
        Command::Schema => schema::run(registry),
        Command::Doctor(args) => doctor::run(&args, registry),
        Command::Completions { shell } => completions::run(shell),
        Command::Man { folder } => man::run(folder.as_deref()),
        Command::Docs { folder, check } => docs::run(&folder, check, registry),
    }
}

/// The stages of a command that starts nothing.
fn planning<'a>(registry: &'a Registry, plugins: &'a Plugins) -> AllStages<'a> {
    AllStages { registry, plugins }
}

/// Does what may start plugins, and ends them.
fn starting(
    allow: &AllowArgs,
    agreed: Option<&Path>,
    registry: &Registry,
    work: impl FnOnce(&AllStages<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let plugins = consent::plugins(allow, agreed)?;
    let done = work(&AllStages { registry, plugins: &plugins });
    let ended = consent::end(&plugins);
    done.and(ended)
}
