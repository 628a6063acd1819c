//! `afmid doctor`: what a run needs of this machine.

use afmid_pipeline::Registry;
use serde_json::{Value, json};

use super::run::cache_folder;
use crate::cli::DoctorArgs;
use crate::doctor::{Finding, State, examine};
use crate::failure::Failure;
use crate::output::print;
use crate::printable::one_line;
use crate::show::pretty;

/// Looks at everything and says how it stands. Errors: something without which a run fails.
pub fn run(args: &DoctorArgs, registry: &Registry) -> Result<(), Failure> {
    let findings = examine(&cache_folder(args.cache.as_deref()), registry);
    print(&if args.json { pretty(&as_json(&findings))? } else { as_text(&findings) })?;
    match findings.iter().filter(|finding| finding.state == State::Bad).count() {
        0 => Ok(()),
        bad => Err(Failure::failed(format!("{bad} of {} things are not as a run needs them", findings.len()), None)),
    }
}

fn as_text(findings: &[Finding]) -> String {
    let width = findings.iter().map(|finding| finding.what.len()).max().unwrap_or(0);
    findings
        .iter()
        .map(|finding| {
            let mark = match finding.state {
                State::Good => "  ",
                State::Warning => "! ",
                State::Bad => "x ",
            };
            let help = finding
                .help
                .as_ref()
                .map(|help| format!("  {:width$}  help: {}\n", "", one_line(help)))
                .unwrap_or_default();
            format!("{mark}{:width$}  {}\n{help}", finding.what, one_line(&finding.found))
        })
        .collect()
}

fn as_json(findings: &[Finding]) -> Value {
    let one = |finding: &Finding| {
        json!({
            "what": finding.what,
            "state": finding.state.name(),
            "found": finding.found,
            "help": finding.help,
        })
    };
    json!({ "findings": findings.iter().map(one).collect::<Vec<_>>() })
}
