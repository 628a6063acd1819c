//! The files of docs/stages.

use std::fmt::Write;

use super::page::{Examples, page};
use crate::stage::{Entry, Registry};

/// The index of all stages, in Markdown.
pub fn index(registry: &Registry) -> String {
    let mut text =
        "# Stages\n\nGenerated from the registry by `afmid docs`; `afmid stages NAME` prints the same.\n".to_owned();
    let mut last = "";
    for entry in registry.entries() {
        let domain = domain(entry);
        if domain != last {
            // writing to a String cannot fail
            let _ = write!(text, "\n## {domain}\n\n| stage | does |\n|---|---|\n");
            last = domain;
        }
        let _ = writeln!(text, "| [`{}`]({}) | {} |", entry.spec.name, file_name(entry), entry.spec.summary);
    }
    text
}

/// The name of a stage's page.
pub fn file_name(entry: &Entry) -> String {
    format!("{}.md", entry.spec.name)
}

/// All files of docs/stages by name: the pages and `README.md`. The examples are run. Errors: an example that fails.
pub fn files(registry: &Registry) -> Result<Vec<(String, String)>, String> {
    let mut files = vec![("README.md".to_owned(), index(registry))];
    for entry in registry.entries() {
        files.push((file_name(entry), page(entry, Examples::Run)?));
    }
    Ok(files)
}

fn domain(entry: &Entry) -> &'static str {
    entry.spec.name.split('.').next().unwrap_or(entry.spec.name)
}
