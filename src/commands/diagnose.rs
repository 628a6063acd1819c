//! `afmid diagnose`: from recordings to a verdict.

use afmid_pipeline::Registry;
use afmid_stages::diagnosis::Diagnosis;

use super::at_once::answered;
use crate::cli::{AtOnceArgs, Goal};
use crate::failure::Failure;
use crate::output::print;
use crate::show::{pretty, verdict_lines};

/// The stage that diagnoses, in every config of the goal.
const STAGE: &str = "diagnosis";

/// Writes the config, runs it, writes the page, and says the verdict.
pub fn run(args: &AtOnceArgs, registry: &Registry) -> Result<(), Failure> {
    let answered = answered(args, Some(Goal::Diagnosis), STAGE, registry)?;
    let answer = answered.summary(STAGE)?;
    if args.json {
        return print(&pretty(&answered.as_json(answer))?);
    }
    let unknown = |error: serde_json::Error| {
        let result = answered.files.result.display();
        Failure::failed(format!("{result}: the diagnosis does not read as one: {error}"), None)
    };
    let answer: Diagnosis = serde_json::from_value(answer.clone()).map_err(unknown)?;
    print(&answered.text(verdict_lines(&answer).into_iter()))
}
