//! One file per command: each turns arguments into a call of the engine, and its answer into text.

mod check;
mod docs;
mod explain;
mod graph;
mod load;
mod report;
mod run;
mod schema;
mod show;
mod stages;

use afmid_pipeline::Registry;

use crate::cli::Command;
use crate::failure::Failure;

/// Runs a command.
pub fn dispatch(command: Command) -> Result<(), Failure> {
    match command {
        Command::Run(args) => run::run(&args),
        Command::Explain(args) => explain::run(&args),
        Command::Show { result, id, json } => show::run(&result, id.as_deref(), json),
        Command::Report(args) => report::run(&args),
        Command::Check { configs } => check::run(&configs),
        Command::Graph { config, format } => graph::run(&config, format),
        Command::Stages { name } => stages::run(name.as_deref()),
        Command::Schema => schema::run(),
        Command::Docs { folder, check } => docs::run(&folder, check),
    }
}

/// All stages of this program.
fn registry() -> Result<Registry, Failure> {
    afmid_stages::registry().map_err(|error| Failure::failed(error, None))
}
