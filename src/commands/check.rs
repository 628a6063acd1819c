//! `afmid check`: everything that can be wrong without opening data.

use std::path::{Path, PathBuf};

use afmid_pipeline::config::Origin;
use afmid_pipeline::{Plan, Problem, Registry, graph};
use serde_json::{Value, json};

use super::load::{load, read};
use crate::failure::{Failure, Message};
use crate::output::print;
use crate::show::pretty;

/// Checks every config before it gives up.
pub fn run(configs: &[PathBuf], as_json: bool, registry: &Registry) -> Result<(), Failure> {
    if as_json {
        return told(configs, registry);
    }
    let (mut wrong, mut printed) = (0, Ok(()));
    for config in configs {
        match load(config, &[], registry) {
            // the verdict counts, whether anybody reads on or not
            Ok(plan) if printed.is_ok() => {
                let points =
                    plan.points().map(|count| format!(", every point of a sweep of {count}")).unwrap_or_default();
                printed = print(&format!("{}: right, {} stages{points}\n", config.display(), plan.nodes.len()));
            }
            Ok(_) => {}
            Err(failure) => {
                wrong += 1;
                failure.report();
            }
        }
    }
    if wrong == 0 { printed } else { Err(Failure::Usage(Message::Rendered(String::new()))) }
}

/// The verdict on all configs as JSON. Errors: a config is wrong, which is said on stdout; one cannot be read.
fn told(configs: &[PathBuf], registry: &Registry) -> Result<(), Failure> {
    let (mut all, mut wrong) = (Vec::new(), false);
    for config in configs {
        let text = read(config)?;
        let planned = graph::load(&config.display().to_string(), &text, &[], registry);
        wrong |= planned.is_err();
        all.push(match planned {
            Ok(plan) => right(config, &plan),
            Err(problems) => {
                let problems: Vec<Value> = problems.iter().map(|one| problem(&text, one)).collect();
                json!({ "config": config.display().to_string(), "right": false, "problems": problems })
            }
        });
    }
    print(&pretty(&Value::Array(all))?)?;
    if wrong { Err(Failure::Usage(Message::Rendered(String::new()))) } else { Ok(()) }
}

fn right(config: &Path, plan: &Plan) -> Value {
    let stages: Vec<&str> = plan.nodes.iter().map(|node| node.id.as_str()).collect();
    json!({ "config": config.display().to_string(), "right": true, "stages": stages, "points": plan.points(), "problems": [] })
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
