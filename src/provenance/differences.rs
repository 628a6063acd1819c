//! Differences between two result files as text.

use serde_json::Value;

use super::diff::{Diff, Files, Lines, Pair, ResultDiff, StageDiff};
use crate::printable::one_line;
use crate::show::{grid, number};

/// Datasets that are listed for one stage; `--json` has all.
const MOST: usize = 40;

/// Names of files that are listed in a row.
const NAMES: usize = 5;

/// Lines of configs and warnings that are listed for each side; `--json` has all.
const MOST_LINES: usize = 200;

/// Differences as text, the first file on the left; `all`: with every dataset and the hashes of files.
pub fn diff_text(diff: &Diff, all: bool) -> String {
    let (a, b) = (one_line(&diff.a), one_line(&diff.b));
    if diff.equal {
        return format!("{a} and {b} are equal\n");
    }
    let results = if diff.results_equal { ", their results are equal" } else { "" };
    let mut text = format!("{a} and {b} differ{results}\n");
    pairs(&diff.run, "", &mut text);
    lines("config", &diff.config, &mut text);
    diff.stages_only_in_a.iter().for_each(|id| text.push_str(&format!("stage {}: only in {a}\n", one_line(id))));
    diff.stages_only_in_b.iter().for_each(|id| text.push_str(&format!("stage {}: only in {b}\n", one_line(id))));
    diff.stages.iter().for_each(|stage| stage_text(stage, all, &mut text));
    for other in &diff.other {
        text.push_str(&format!("{}: {}\n", one_line(&other.place), one_line(&other.what)));
    }
    text
}

/// Whether datasets differ, of which the short text gives the number alone.
pub fn counts_datasets(diff: &Diff) -> bool {
    diff.stages.iter().any(|stage| stage.results.iter().any(|result| !result.place_only))
}

fn stage_text(stage: &StageDiff, all: bool, text: &mut String) {
    text.push_str(&format!("stage {}\n", one_line(&stage.id)));
    pairs(&stage.stage, "  ", text);
    pairs(&stage.parameters, "  parameter ", text);
    pairs(&stage.inputs, "  input ", text);
    files(&stage.files, all, text);
    lines("  warnings", &stage.warnings, text);
    let results: Vec<&ResultDiff> = stage.results.iter().filter(|result| !result.place_only).collect();
    if !all {
        counted(&results, text);
        return;
    }
    if !results.is_empty() {
        for line in results_text(&results).lines() {
            text.push_str(&format!("  {line}\n"));
        }
    }
    if results.len() > MOST {
        text.push_str(&format!("  ... {} more: see --json\n", results.len() - MOST));
    }
}

/// How many datasets of each output differ.
fn counted(results: &[&ResultDiff], text: &mut String) {
    let mut outputs: Vec<(&str, usize)> = Vec::new();
    for result in results {
        match outputs.iter_mut().find(|(output, _)| *output == result.output) {
            Some((_, count)) => *count += 1,
            None => outputs.push((&result.output, 1)),
        }
    }
    for (output, count) in outputs {
        let datasets = if count == 1 { "a dataset differs".to_owned() } else { format!("{count} datasets differ") };
        text.push_str(&format!("  {}: {datasets}\n", one_line(output)));
    }
}

fn pairs(pairs: &[Pair], head: &str, text: &mut String) {
    let side = |value: &Value| if value.is_null() { "none".to_owned() } else { value.to_string() };
    for pair in pairs {
        text.push_str(&format!("{head}{}: {} | {}\n", one_line(&pair.name), side(&pair.a), side(&pair.b)));
    }
}

fn lines(head: &str, lines: &Lines, text: &mut String) {
    if !lines.differs {
        return;
    }
    text.push_str(&format!("{head}:\n"));
    let indent = " ".repeat(head.len() - head.trim_start().len());
    for (sign, only) in [('-', &lines.lines_only_in_a), ('+', &lines.lines_only_in_b)] {
        only.iter().take(MOST_LINES).for_each(|line| text.push_str(&format!("{indent}  {sign} {}\n", one_line(line))));
        if only.len() > MOST_LINES {
            text.push_str(&format!("{indent}  {sign} ... {} more: see --json\n", only.len() - MOST_LINES));
        }
    }
    if lines.lines_only_in_a.is_empty() && lines.lines_only_in_b.is_empty() {
        text.push_str(&format!("{indent}  the same lines in another order\n"));
    }
}

fn files(files: &Files, all: bool, text: &mut String) {
    files.only_in_a.iter().for_each(|name| text.push_str(&format!("  - file {}\n", one_line(name))));
    files.only_in_b.iter().for_each(|name| text.push_str(&format!("  + file {}\n", one_line(name))));
    if !all && !files.other_bytes.is_empty() {
        let names: Vec<&str> = files.other_bytes.iter().map(|pair| &pair.name[..]).collect();
        text.push_str(&format!("  other bytes: {}\n", one_line(&few_names(&names))));
    }
    for pair in files.other_bytes.iter().filter(|_| all) {
        let short = |value: &Value| value.as_str().unwrap_or_default().chars().take(16).collect::<String>();
        let (name, a, b) = (one_line(&pair.name), short(&pair.a), short(&pair.b));
        text.push_str(&format!("  file {name}: other bytes, {a} | {b}\n"));
    }
    match files.moved {
        0 => {}
        1 => text.push_str("  1 file with the same bytes was found elsewhere\n"),
        many => text.push_str(&format!("  {many} files with the same bytes were found elsewhere\n")),
    }
    if files.reordered {
        text.push_str("  the same files in another order\n");
    }
}

/// Names in a row, the first of many.
fn few_names(names: &[&str]) -> String {
    match names.len().checked_sub(NAMES) {
        None | Some(0) => names.join(", "),
        Some(more) => format!("{} and {more} more", names[..NAMES].join(", ")),
    }
}

/// Results that differ as a table.
pub fn results_text(results: &[&ResultDiff]) -> String {
    let head = ["output", "dataset", "differ", "largest", "relative", "in errors", "at"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), number);
    for result in results.iter().take(MOST) {
        let dataset = if result.dataset.is_empty() { "-" } else { &result.dataset };
        let mut row = vec![result.output.clone(), dataset.to_owned()];
        match (result.differing, result.of) {
            (Some(differing), Some(of)) => {
                let numbers = [result.largest, result.relative, result.in_errors].map(shown);
                row.push(format!("{differing} of {of}"));
                row.extend(numbers);
                row.push(result.at.clone().unwrap_or_default());
            }
            _ => row.push(result.what.clone()),
        }
        rows.push(row);
    }
    grid(&rows)
}
