//! afmid, the command line, as a library: a program with stages of its own is afmid with a longer registry.

mod cli;
mod commands;
mod diagnostic;
mod failure;
mod progress;
mod report;
mod show;

use std::process::ExitCode;

use afmid_pipeline::Registry;
use afmid_pipeline::stage::DoubleName;
use clap::Parser;

/// The built-in stages: add your own with [`Registry::with`]. Errors: two of one name.
pub fn registry() -> Result<Registry, DoubleName> {
    afmid_stages::registry()
}

/// The command line of a program with these stages: parses the arguments, runs the command, reports.
pub fn main(registry: &Registry) -> ExitCode {
    match commands::dispatch(cli::Cli::parse().command, registry) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
