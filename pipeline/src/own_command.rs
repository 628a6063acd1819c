//! How this program is started again: as the host of a plugin, by the jobs of a cluster.
//!
//! A program's own arguments follow its name; where an interpreter runs it (`python -m afmid run a.toml`), they follow
//! the interpreter's.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// How many of the process's arguments come before the program's own. A process has one command line.
static BEFORE: OnceLock<usize> = OnceLock::new();

/// This program without arguments: its name alone, unless an interpreter runs it.
const NAME_ALONE: usize = 1;

/// States that the last `count` arguments of the process are the program's own: an interpreter runs it. Only the first
/// statement counts.
pub fn own_arguments_are_last(count: usize) {
    BEFORE.get_or_init(|| std::env::args_os().len().saturating_sub(count).max(NAME_ALONE));
}

fn before() -> usize {
    BEFORE.get().copied().unwrap_or(NAME_ALONE)
}

/// The arguments of this program.
pub fn own_arguments() -> impl Iterator<Item = OsString> {
    std::env::args_os().skip(before())
}

/// What starts this program again, even when its file has been replaced meanwhile, under a name for lists of processes
/// where it needs no other. None: the system does not say where it is.
pub fn own_command(name: &str) -> Option<Command> {
    let own = PathBuf::from("/proc/self/exe");
    own.exists().then(|| {
        let mut command = Command::new(own);
        let mut arguments = std::env::args_os().take(before());
        let first = arguments.next().filter(|_| before() > NAME_ALONE);
        named(&mut command, first.unwrap_or_else(|| name.into()));
        command.args(arguments);
        command
    })
}

#[cfg(unix)]
fn named(command: &mut Command, name: OsString) {
    use std::os::unix::process::CommandExt;
    command.arg0(name);
}

#[cfg(not(unix))]
fn named(_command: &mut Command, _name: OsString) {}

/// The file that starts this program on another machine that sees it: the program, or the script that an interpreter
/// runs. Errors: the system does not say; it is run as a module of an interpreter.
pub fn own_file() -> std::io::Result<PathBuf> {
    let arguments: Vec<OsString> = std::env::args_os().take(before()).collect();
    match &arguments[..] {
        [] | [_] => std::env::current_exe(),
        [_, script] if PathBuf::from(script).is_file() => std::path::absolute(script),
        _ => Err(std::io::Error::other("it runs as a module of an interpreter: call its script")),
    }
}
