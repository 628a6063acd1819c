//! afmid, the command line, as a library: a program with stages of its own is afmid with a longer registry.

// the macros panic where a pipe is closed or a disk full: `output` is the one place that prints
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod batch;
mod cli;
mod commands;
mod diagnostic;
mod doctor;
mod export;
mod failure;
mod inspect;
mod output;
mod progress;
mod provenance;
mod relative;
mod report;
mod scaffold;
mod show;
mod sweep;

use std::io::IsTerminal;
use std::process::ExitCode;

use afmid_pipeline::Registry;
use afmid_pipeline::stage::DoubleName;
use clap::FromArgMatches;

#[doc(hidden)]
pub use commands::doors;
use failure::{Failure, Message};

/// The built-in stages: add your own with [`Registry::with`]. Errors: two of one name.
pub fn registry() -> Result<Registry, DoubleName> {
    afmid_stages::registry()
}

/// The command line of a program with these stages: parses the arguments, runs the command, reports.
pub fn main(registry: &Registry) -> ExitCode {
    let parsed = cli::command().try_get_matches().and_then(|matches| cli::Cli::from_arg_matches(&matches));
    let done = match parsed {
        Ok(cli) => commands::dispatch(cli.command, registry),
        Err(error) => told(&error),
    };
    afmid_pipeline::plugin::shut_down();
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// How a program ends whose stages do not make a registry.
pub fn fail(error: &DoubleName) -> ExitCode {
    Failure::failed(error, None).report()
}

/// Help and version go to stdout, mistakes to stderr, in colour if a person looks at them.
fn told(error: &clap::Error) -> Result<(), Failure> {
    let text = |terminal: bool| {
        let colour = terminal && std::env::var_os("NO_COLOR").is_none();
        if colour { error.render().ansi().to_string() } else { error.render().to_string() }
    };
    if error.use_stderr() {
        return Err(Failure::Usage(Message::Rendered(text(std::io::stderr().is_terminal()))));
    }
    output::print(&text(std::io::stdout().is_terminal()))
}
