//! afmid, the command line.

mod cli;
mod commands;
mod diagnostic;
mod failure;
mod progress;
mod report;
mod show;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match commands::dispatch(cli::Cli::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
