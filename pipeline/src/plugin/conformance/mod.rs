//! The conformance test of a plugin: what `docs/plugins.md` asks for, tried on a command.

mod generated;
mod steps;

use std::path::Path;

use super::consent::Candidate;
use super::launch::Launch;
use super::plugins::Plugins;

/// One thing that was tried.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Check {
    /// What a plugin must do.
    pub name: &'static str,
    /// What was seen; `Err` says what is wrong and what to do.
    pub outcome: Result<String, String>,
}

/// Tries a plugin, from its start to its end. To type its command is to agree to it. What cannot be tried because of an
/// earlier failure is not listed.
pub fn check(plugins: &Plugins, command: &[String], folder: &Path, timeout_s: f64) -> Vec<Check> {
    let name = command.last().map_or("plugin", |word| word.rsplit('/').next().unwrap_or(word));
    let mut steps = steps::Steps::default();
    let pool = plugins.pool();
    let candidate = Launch::command(name, command, folder, timeout_s);
    match candidate.and_then(|launch| Candidate::new(launch, &pool.hashes)) {
        Ok(candidate) => steps.all(&candidate, pool),
        Err(error) => steps.wrong("it starts", &error),
    }
    steps.checks
}
