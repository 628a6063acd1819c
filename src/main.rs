//! afmid, the command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    match afmid::registry() {
        Ok(registry) => afmid::main(&registry),
        Err(error) => afmid::fail(&error),
    }
}
