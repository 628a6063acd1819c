//! One file per command: each turns arguments into a call of the engine, and its answer into text.

mod batch;
mod causes;
mod check;
mod completions;
mod diff;
mod docs;
mod doctor;
pub mod doors;
mod exam;
mod explain;
mod export;
mod export_crate;
mod gc;
mod graph;
mod inspect;
mod load;
mod man;
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

use afmid_pipeline::Registry;

use crate::cli::{Command, GraphFormat};
use crate::failure::Failure;

/// Runs a command with the stages of a program.
pub fn dispatch(command: Command, registry: &Registry) -> Result<(), Failure> {
    match command {
        Command::Run(args) => run::run(&args, registry),
        Command::Batch(args) => batch::run(&args, registry),
        Command::Submit { to } => submit::run(&to, registry),
        Command::Explain(args) => explain::run(&args, registry),
        Command::Inspect { files, json } => inspect::run(&files, json),
        Command::Show { result, id, json } => show::run(&result, id.as_deref(), json),
        Command::Diff(args) => diff::run(&args),
        Command::Trace(args) => trace::run(&args),
        Command::Rerun(args) => rerun::run(&args, registry),
        Command::Export(args) => export::run(&args),
        Command::ExportCrate(args) => export_crate::run(&args),
        Command::Gc(args) => gc::run(&args),
        Command::Report(args) => report::run(&args),
        Command::New { what } => new::run(&what, registry),
        Command::Check { configs, json } => check::run(&configs, json, registry),
        Command::Graph { config, format, json } => {
            graph::run(&config, if json { GraphFormat::Json } else { format }, registry)
        }
        Command::Stages { name, json } => stages::run(name.as_deref(), json, registry),
        Command::Causes { name, json } => causes::run(name.as_deref(), json),
        Command::Exam(args) => exam::run(&args, registry),
        Command::Plugin { what } => plugin::run(&what),
        Command::Schema => schema::run(registry),
        Command::Doctor(args) => doctor::run(&args, registry),
        Command::Completions { shell } => completions::run(shell),
        Command::Man { folder } => man::run(folder.as_deref()),
        Command::Docs { folder, check } => docs::run(&folder, check, registry),
    }
}
