//! `afmid plugin`: tries stages that run as processes of their own.

use std::path::Path;

use afmid_pipeline::plugin::{Check, Plugins, check};
use serde_json::json;

use crate::cli::PluginCommand;
use crate::failure::{Failure, Message};
use crate::output::print;
use crate::show::pretty;

/// Runs `afmid plugin check`. Errors: something did not pass.
pub fn run(what: &PluginCommand, plugins: &Plugins) -> Result<(), Failure> {
    let PluginCommand::Check { timeout, json, command } = what;
    let checks = check(plugins, command, Path::new("."), *timeout);
    print(&if *json { as_json(&checks)? } else { text(&checks) })?;
    // what was printed says all
    let passed = checks.iter().all(|check| check.outcome.is_ok());
    if passed { Ok(()) } else { Err(Failure::Failed(Message::Rendered(String::new()))) }
}

fn text(checks: &[Check]) -> String {
    let line = |check: &Check| match &check.outcome {
        Ok(seen) => format!("pass  {}: {}\n", check.name, seen.replace('\n', "\n      ")),
        Err(wrong) => format!("FAIL  {}: {}\n", check.name, wrong.replace('\n', "\n      ")),
    };
    let failed = checks.iter().filter(|check| check.outcome.is_err()).count();
    let end = match failed {
        0 => format!("a plugin: {} of {} passed\n", checks.len(), checks.len()),
        failed => {
            format!("{failed} failed, {} passed; what depends on a failure was not tried\n", checks.len() - failed)
        }
    };
    checks.iter().map(line).chain([end]).collect()
}

fn as_json(checks: &[Check]) -> Result<String, Failure> {
    let row = |check: &Check| {
        let (said, passed) = match &check.outcome {
            Ok(seen) => (seen, true),
            Err(wrong) => (wrong, false),
        };
        json!({ "check": check.name, "passed": passed, "said": said })
    };
    let passed = checks.iter().all(|check| check.outcome.is_ok());
    pretty(&json!({ "passed": passed, "checks": checks.iter().map(row).collect::<Vec<_>>() }))
}
