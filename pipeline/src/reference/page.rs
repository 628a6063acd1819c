//! The page of a stage, in Markdown.

use std::fmt::Write;

use super::headings::Sections;
use super::parameters::parameters;
use crate::outcome::PortSpec;
use crate::stage::{Caching, Entry, Example, run_example};

/// Whether a page tells what its examples gave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Examples {
    /// They are run.
    Run,
    /// They are only shown.
    Shown,
}

/// The page of a stage, in Markdown. Errors: an example that fails.
pub fn page(entry: &Entry, examples: Examples) -> Result<String, String> {
    let spec = entry.spec;
    let (schema, _) = super::params_schema(entry);
    let doc = Sections::of(schema["description"].as_str().unwrap_or_default());
    let mut text = format!("# {}\n\n{}\n", spec.name, doc.intro);
    // writing to a String cannot fail
    let _ = writeln!(text, "\nVersion {}; {}.", spec.version, facts(entry));
    ports(&mut text, "Inputs", spec.inputs);
    ports(&mut text, "Outputs", spec.outputs);
    parameter_table(&mut text, entry);
    for (heading, body) in &doc.sections {
        let _ = write!(text, "\n## {heading}\n\n{}\n", begun(body));
    }
    if doc.get("Source").is_none() {
        let _ = write!(text, "\n## Source\n\n{}\n", spec.source);
    }
    for example in entry.examples() {
        let _ = write!(text, "\n## Example: {}\n\n```toml\n{}```\n", example.title, example_toml(entry, &example));
        if examples == Examples::Run {
            let outcome = run_example(entry, &example).and_then(|outputs| (example.expect)(&outputs));
            let sentence = outcome.map_err(|why| format!("{}: example {:?}: {why}", spec.name, example.title))?;
            let _ = write!(text, "\n{}.\n", capitalised(&sentence));
        }
    }
    Ok(text)
}

fn facts(entry: &Entry) -> String {
    let caching = match entry.spec.caching {
        Caching::Stored => "its result is kept in the cache",
        Caching::Always => "it runs every time",
    };
    let seeded = if entry.spec.seeded { ", it draws random numbers from the pipeline's seed" } else { "" };
    format!("{caching}{seeded}")
}

fn ports(text: &mut String, title: &str, ports: &[PortSpec]) {
    let _ = write!(text, "\n## {title}\n\n");
    if ports.is_empty() {
        text.push_str("None.\n");
        return;
    }
    text.push_str("| port | shape | tag | meaning |\n|---|---|---|---|\n");
    for port in ports {
        let tag = if port.tag.is_empty() { "any".to_owned() } else { format!("`{}`", port.tag) };
        let optional = if port.optional { " (optional)" } else { "" };
        let _ = writeln!(text, "| `{}`{optional} | {} | {tag} | {} |", port.name, port.shape.name(), cell(port.doc));
    }
}

fn parameter_table(text: &mut String, entry: &Entry) {
    text.push_str("\n## Parameters\n\n");
    let rows = parameters(entry);
    if rows.is_empty() {
        text.push_str("None.\n");
        return;
    }
    // most ranges are stated in words: a column of its own only where the schema states one
    let ranges = rows.iter().any(|row| !row.range.is_empty());
    let (title, rule) = if ranges { ("range | ", "---|") } else { ("", "") };
    let _ = writeln!(text, "| parameter | type | default | {title}meaning |\n|---|---|---|{rule}---|");
    for row in rows {
        let default = row.default.map_or("required".to_owned(), |value| format!("`{}`", cell(&value)));
        let range = if ranges { format!("{} | ", row.range) } else { String::new() };
        let _ = writeln!(text, "| `{}` | {} | {default} | {range}{} |", row.name, cell(&row.kind), cell(&row.doc));
    }
}

/// An example as a stage of a config.
fn example_toml(entry: &Entry, example: &Example) -> String {
    let name = entry.spec.name;
    let id = name.rsplit('.').next().unwrap_or(name);
    let wires: Vec<String> = entry
        .spec
        .inputs
        .iter()
        .filter(|port| !port.optional)
        .map(|port| format!("{0} = \"{0}\"", port.name))
        .collect();
    let mut text = format!("[[stage]]\nid = \"{id}\"\nuses = \"{name}\"\n");
    if !wires.is_empty() {
        let _ = writeln!(text, "inputs = {{ {} }}", wires.join(", "));
    }
    if !example.params.trim().is_empty() {
        let _ = write!(text, "[stage.params]\n{}\n", example.params.trim());
    }
    text
}

/// Text that fits into a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

/// With a capital letter if it begins with a word; a symbol stays as it is.
fn begun(text: &str) -> String {
    let word = text.split([' ', ',', '.', ':', ';', '\n']).next().unwrap_or_default();
    let is_word = word == "a" || (word.len() > 1 && word.chars().all(|c| c.is_ascii_lowercase() || c == '-'));
    match text.get(..1) {
        Some(first) if is_word => format!("{}{}", first.to_uppercase(), &text[1..]),
        _ => text.to_owned(),
    }
}

/// With a capital letter, without a full stop.
fn capitalised(text: &str) -> String {
    let mut letters = text.trim().trim_end_matches('.').chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
