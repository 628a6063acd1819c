//! Configs and graphs, checked with small stages of their own.

mod config;
mod graph;
mod reference;
mod robustness;
mod stages;
mod sweep;

use afmid_pipeline::Problem;
use afmid_pipeline::config::Origin;
use afmid_pipeline::plugin::{AllStages, Plugins};

/// The text under the caret.
fn marked<'a>(text: &'a str, problem: &'a Problem) -> &'a str {
    match &problem.origin {
        Origin::Config => &text[problem.span.clone()],
        Origin::Argument(argument) => &argument[problem.span.clone()],
    }
}

/// Problems as `text under the caret | message | help`.
fn lines(text: &str, problems: &[Problem]) -> Vec<String> {
    let line = |problem: &Problem| {
        format!("{} | {} | {}", marked(text, problem), problem.message, problem.help.as_deref().unwrap_or("-"))
    };
    problems.iter().map(line).collect()
}

/// What planning this text with these `--set` arguments finds wrong.
fn wrong(text: &str, arguments: &[&str]) -> Vec<String> {
    let arguments: Vec<String> = arguments.iter().map(|&argument| argument.to_owned()).collect();
    let all = AllStages { registry: &stages::registry(), plugins: &Plugins::none() };
    match afmid_pipeline::graph::load("test.toml", text, &arguments, &all) {
        Ok(_) => Vec::new(),
        Err(problems) => lines(text, &problems),
    }
}
