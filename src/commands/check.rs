//! `afmid check`: everything that can be wrong without opening data.

use std::path::{Path, PathBuf};

use afmid_pipeline::config::Origin;
use afmid_pipeline::graph::{self, Stages};
use afmid_pipeline::{Node, Plan, Problem};
use serde_json::{Value, json};

use super::load::{load, read};
use crate::batch::shell::quoted;
use crate::diagnostic::MOST_PROBLEMS;
use crate::failure::{Failure, Message};
use crate::output::{print, report};
use crate::printable::{one_line, shown};
use crate::show::pretty;

/// Checks every config before it gives up.
pub fn run(configs: &[PathBuf], as_json: bool, stages: &dyn Stages) -> Result<(), Failure> {
    if as_json {
        return run_as_json(configs, stages);
    }
    let (mut wrong, mut printed) = (0, Ok(()));
    for config in configs {
        match load(config, &[], stages) {
            // the verdict counts, whether anybody reads on or not
            Ok(plan) if printed.is_ok() => {
                let points =
                    plan.points().map(|count| format!(", every point of a sweep of {count}")).unwrap_or_default();
                let right = format!("{}: right, {} stages{points}\n", shown(config), plan.nodes.len());
                printed = print(&(right + &not_checked(&plan)));
                // the process ends soon: of a hundred thousand stages, freeing each takes longer than giving all of it
                // back
                std::mem::forget(plan);
            }
            Ok(_) => {}
            Err(failure) => {
                wrong += 1;
                report(failure);
            }
        }
    }
    if wrong == 0 { printed } else { Err(Failure::Usage(Message::Rendered(String::new()))) }
}

/// The verdict on all configs as JSON. Errors: a config is wrong, which is said on stdout; one cannot be read.
fn run_as_json(configs: &[PathBuf], stages: &dyn Stages) -> Result<(), Failure> {
    let (mut all, mut wrong) = (Vec::new(), false);
    for config in configs {
        let text = read(config)?;
        let planned = graph::load(&config.display().to_string(), &text, &[], stages);
        wrong |= planned.is_err();
        all.push(match planned {
            Ok(plan) => right(config, &plan),
            Err(problems) => {
                let more = problems.len().saturating_sub(MOST_PROBLEMS);
                let listed: Vec<Value> = problems.iter().take(MOST_PROBLEMS).map(|one| problem(&text, one)).collect();
                json!({
                    "config": config.display().to_string(),
                    "right": false,
                    "ports_not_checked": [],
                    "problems": listed,
                    "more_problems": more,
                })
            }
        });
    }
    print(&pretty(&Value::Array(all))?)?;
    if wrong { Err(Failure::Usage(Message::Rendered(String::new()))) } else { Ok(()) }
}

fn right(config: &Path, plan: &Plan) -> Value {
    let ids = |nodes: &mut dyn Iterator<Item = &Node>| nodes.map(|node| node.id.clone()).collect::<Vec<String>>();
    json!({
        "config": config.display().to_string(),
        "right": true,
        "stages": ids(&mut plan.nodes.iter()),
        "ports_not_checked": ids(&mut plan.not_described()),
        "points": plan.points(),
        "problems": [],
        "more_problems": 0,
    })
}

/// What could not be checked without starting plugins: a line per stage, none if all was.
pub fn not_checked(plan: &Plan) -> String {
    let config = quoted(&plan.config.file);
    let note = |node: &Node| {
        format!(
            "note: stage {} ({}): ports not checked; `afmid trust {config}` asks the plugin what they are\n",
            one_line(&node.id),
            one_line(&node.uses)
        )
    };
    plan.not_described().map(note).collect()
}

/// A problem with its place: line and column count from 1, columns in characters.
pub fn problem(text: &str, problem: &Problem) -> Value {
    let (argument, text) = match &problem.origin {
        Origin::Config => (None, text),
        Origin::Argument(argument) => (Some(argument), argument.as_str()),
    };
    let place = |byte: usize| {
        let before = text.get(..byte.min(text.len())).unwrap_or(text);
        let line = before.rfind('\n').map_or(0, |end| end + 1);
        json!({ "line": before.matches('\n').count() + 1, "column": before[line..].chars().count() + 1 })
    };
    json!({
        "message": problem.message,
        "label": problem.label,
        "help": problem.help,
        "argument": argument,
        "from": place(problem.span.start),
        "to": place(problem.span.end),
    })
}
