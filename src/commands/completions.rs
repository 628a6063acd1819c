//! `afmid completions`: what a shell completes.

use clap_complete::{Shell, generate};

use crate::cli::command;
use crate::failure::Failure;
use crate::output::print;

/// Prints the completions of a shell.
pub fn run(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    generate(shell, &mut command(), "afmid", &mut script);
    print(&String::from_utf8_lossy(&script))
}
