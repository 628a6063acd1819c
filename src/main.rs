//! afmid, the command line.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    match afmid::registry() {
        Ok(registry) => afmid::main(&registry),
        Err(error) => afmid::fail(&error),
    }
}
