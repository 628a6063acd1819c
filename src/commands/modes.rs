//! `afmid modes`: from recordings to their modes.

use afmid_pipeline::Registry;
use serde_json::{Value, json};

use super::at_once::answered;
use crate::batch::shell::quoted;
use crate::cli::{Goal, ModesArgs};
use crate::failure::Failure;
use crate::output::print;
use crate::show::{mode_lines, moves, pretty};

/// What config, result and page are called by.
const KIND: &str = "modes";

/// Writes the config, runs it, writes the page, and prints the table and what to type next. Errors, usage: a goal that is
/// no modes; as `new pipeline` and `run`.
pub fn run(args: &ModesArgs, registry: &Registry) -> Result<(), Failure> {
    if args.goal == Some(Goal::Diagnosis) {
        let help = "`afmid diagnose` says what a linear model gets wrong".to_owned();
        return Err(Failure::usage("a diagnosis lists no modes", Some(help)));
    }
    let answered = answered(&args.at_once, args.goal, KIND, registry)?;
    let last = answered.last();
    let found = answered.summary(last)?;
    let warnings = answered.stage(last).map(|stage| &stage.result.warnings[..]).unwrap_or_default();
    if args.at_once.json {
        let mut all = answered.as_json(found);
        if let Value::Object(all) = &mut all {
            all.insert("goal".to_owned(), json!(answered.draft.goal));
            all.insert("warnings".to_owned(), json!(warnings));
        }
        return print(&pretty(&all)?);
    }
    let more = match warnings.len() {
        0 => String::new(),
        1 => ", and a warning".to_owned(),
        count => format!(", and {count} warnings"),
    };
    let next = format!("all numbers{more}: afmid show {} {last}", quoted(&answered.files.result));
    let nonlinear = moves(found).then(|| {
        let paths = args.at_once.recordings.paths.iter().map(quoted).collect::<Vec<String>>().join(" ");
        format!("a mode that moves is not linear; what by: afmid diagnose {paths}")
    });
    print(&answered.text(mode_lines(found).into_iter().chain([next]).chain(nonlinear)))
}
