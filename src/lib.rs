//! afmid, the command line, as a library: a program with stages of its own is afmid with a longer registry.

// the macros panic where a pipe is closed or a disk full: `output` is the one place that prints
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod address_space;
mod batch;
mod cli;
mod commands;
mod determined;
mod diagnostic;
mod doctor;
mod export;
mod failure;
mod inspect;
mod interrupt;
mod output;
mod printable;
mod progress;
mod provenance;
mod relative;
mod report;
mod scaffold;
mod show;
mod sweep;

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::Path;
use std::process::ExitCode;

use afmid_pipeline::graph::Stages;
use afmid_pipeline::own_command::own_arguments;
use afmid_pipeline::runner::Observer;
use afmid_pipeline::stage::DoubleName;
use afmid_pipeline::{InputFiles, Registry, RunResult};
use clap::FromArgMatches;
use clap::error::{ContextKind, ContextValue};

#[doc(hidden)]
pub use commands::doors;
use failure::{Failure, Message};
use printable::printable;

/// The built-in stages: add your own with [`Registry::with`]. Errors: two of one name.
pub fn registry() -> Result<Registry, DoubleName> {
    afmid_stages::registry()
}

/// The command line of a program with these stages: parses the arguments, runs the command, reports. Of an interpreter
/// that runs it, the arguments that are its own are stated first
/// ([`own_arguments_are_last`](afmid_pipeline::own_command::own_arguments_are_last)).
pub fn main(registry: &Registry) -> ExitCode {
    ExitCode::from(exit_code(registry))
}

/// As [`main`]: the exit code as a number.
pub fn exit_code(registry: &Registry) -> u8 {
    if let Some(code) = afmid_pipeline::plugin::host_main() {
        return code;
    }
    address_space::fit();
    if let Err(error) = interrupt::listen() {
        // a signal ends the program as the system does it
        output::say(&format!("warning: signals cannot be caught: {error}\n"));
    }
    let arguments = std::iter::once(OsString::from("afmid")).chain(own_arguments());
    let parsed =
        cli::command().try_get_matches_from(arguments).and_then(|matches| cli::Cli::from_arg_matches(&matches));
    let done = match parsed {
        Ok(cli) => match address_space::too_little().filter(|_| cli.command.computes()) {
            Some((problem, help)) => Err(Failure::failed(problem, Some(help))),
            None => commands::dispatch(cli.command, registry),
        },
        Err(error) => recordings_alone(&error).map_or_else(|| help_or_mistake(&error), Err),
    };
    interrupt::check().and(done).map_or_else(output::report, |()| 0)
}

/// What `inspect --json` says of a file, as JSON text.
pub fn inspect_json(path: &Path) -> String {
    inspect::inspected_json(&inspect::inspect(path, &InputFiles::new(), false)).to_string()
}

/// The page that `report` writes, of a run that is in no file. Errors: its template does not go through.
pub fn page(run: &RunResult) -> Result<String, String> {
    report::report(run, &|_| String::new(), None).map_err(|error| error.to_string())
}

/// Runs a config in this process with these stages, as `run` does, and writes its result file. Errors: what the command
/// would say on stderr, and its exit code.
pub fn run_here(
    config: &Path,
    set: &[String],
    output: &Path,
    cache: Option<&Path>,
    stages: &dyn Stages,
    observer: &dyn Observer,
) -> Result<(), (String, u8)> {
    commands::run_here(config, set, output, cache, stages, observer).map_err(Failure::text_and_code)
}

/// How a program ends whose stages do not make a registry.
pub fn fail(error: &DoubleName) -> ExitCode {
    ExitCode::from(output::report(Failure::failed(error, None)))
}

/// What to do with a path that stands where a command should; none of anything else.
fn recordings_alone(error: &clap::Error) -> Option<Failure> {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else { return None };
    let path = Path::new(word);
    path.exists().then(|| {
        let quoted = batch::shell::quoted(path);
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let help = match ending {
            "toml" => format!("`afmid run {quoted}` runs a config"),
            _ => format!(
                "of recordings: `afmid modes {quoted}` finds their modes, `afmid diagnose {quoted}` what a linear model gets \
                 wrong, `afmid inspect {quoted}` says what they hold; of a result `afmid show {quoted}`"
            ),
        };
        Failure::usage(format!("{} stands where a command should", path.display()), Some(help))
    })
}

/// Help and version go to stdout, mistakes to stderr, in colour if a person looks at them and nothing that they typed
/// acts on the terminal.
fn help_or_mistake(error: &clap::Error) -> Result<(), Failure> {
    let plain = error.render().to_string();
    let styled = |terminal: bool| {
        let colour = terminal && std::env::var_os("NO_COLOR").is_none() && printable(&plain) == plain;
        if colour { error.render().ansi().to_string() } else { printable(&plain).into_owned() }
    };
    if error.use_stderr() {
        return Err(Failure::Usage(Message::Styled(styled(std::io::stderr().is_terminal()))));
    }
    output::print_styled(&styled(std::io::stdout().is_terminal()))
}
