//! `afmid modes`: from recordings to their modes.

use std::path::Path;

use afmid_pipeline::Registry;
use clap::ValueEnum;
use serde_json::{Value, json};

use super::at_once::answered;
use crate::batch::shell::quoted;
use crate::cli::{Goal, ModesArgs, RecordingsArgs};
use crate::failure::Failure;
use crate::output::print;
use crate::show::{Row, mode_lines, moves, pretty, rows};

/// What config, result and page are called by.
const KIND: &str = "modes";

/// Writes the config, runs it, writes the page, and prints the table and what to type next. Errors, usage: a goal that is
/// no modes; as `new pipeline` and `run`.
pub fn run(args: &ModesArgs, registry: &Registry) -> Result<(), Failure> {
    let without_modes = match args.goal {
        Some(Goal::Diagnosis) => {
            Some(("a diagnosis lists no modes", "`afmid diagnose` says what a linear model gets wrong"))
        }
        Some(Goal::SpringConstant) => Some((
            "a spring constant is no mode",
            "`afmid new pipeline --goal spring-constant` writes the config, `afmid run` finds it",
        )),
        _ => None,
    };
    if let Some((problem, help)) = without_modes {
        return Err(Failure::usage(problem, Some(help.to_owned())));
    }
    let answered = answered(&args.at_once, args.goal, KIND, registry)?;
    let last = answered.last();
    let found = answered.summary(last)?;
    let warnings = answered.stage(last).map(|stage| &stage.result.warnings[..]).unwrap_or_default();
    if args.at_once.json {
        let mut all = answered.as_json(found);
        if let Value::Object(all) = &mut all {
            let listed = rows(found);
            all.insert("goal".to_owned(), json!(answered.draft.goal));
            all.insert("warnings".to_owned(), json!(warnings));
            all.insert("doubtful".to_owned(), listed.iter().map(Row::is_doubtful).collect());
            // a resonance and an oscillation are modes where modes are asked for
            all.entry("modes").or_insert_with(|| listed.iter().map(Row::as_json).collect());
        }
        return print(&pretty(&all)?);
    }
    let more = match warnings.len() {
        0 => String::new(),
        1 => ", and a warning".to_owned(),
        count => format!(", and {count} warnings"),
    };
    let next = format!("all numbers{more}: afmid show {} {last} --all", path_word(&answered.files.result));
    let nonlinear = moves(found).then(|| {
        format!("a mode that moves is not linear; what by: afmid diagnose {}", words(&args.at_once.recordings))
    });
    let missed = missed(found).map(|fit| {
        format!(
            "the FIT of what was held out is {fit:.0} %; whether noise is all that is missing: afmid diagnose {}",
            words(&args.at_once.recordings)
        )
    });
    print(&answered.text(mode_lines(found).into_iter().chain([next]).chain(nonlinear).chain(missed)))
}

/// FIT of what was held out from which on a linear model is good without a further look, per cent: a hundredth of the squared
/// output is left.
const GOOD_FIT: f64 = 90.0;

/// The FIT of what was held out, per cent, where it is less than good.
fn missed(summary: &Value) -> Option<f64> {
    summary.pointer("/fit_percent/held_out").and_then(Value::as_f64).filter(|fit| *fit < GOOD_FIT)
}

/// A path as a word that no shell and no command reads as anything else.
fn path_word(path: &Path) -> String {
    if path.to_string_lossy().starts_with('-') { quoted(Path::new(".").join(path)) } else { quoted(path) }
}

/// Recordings and what was said of them, to be typed again.
fn words(args: &RecordingsArgs) -> String {
    let mut all: Vec<String> = args.paths.iter().map(|path| path_word(path)).collect();
    let mut add = |flag: &str, value: &str| all.extend([flag.to_owned(), quoted(value)]);
    args.channel.iter().for_each(|name| add("--channel", name));
    args.input.iter().for_each(|name| add("--input", name));
    args.reference.iter().for_each(|name| add("--reference", name));
    let records_are = args.records_are.and_then(|what| what.to_possible_value());
    records_are.iter().for_each(|what| add("--as", what.get_name()));
    args.rate.iter().for_each(|rate| add("--rate", &rate.to_string()));
    args.unit.iter().for_each(|unit| add("--unit", unit));
    all.extend(args.resample.then(|| "--resample".to_owned()));
    all.join(" ")
}
