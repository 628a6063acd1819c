//! A number's ancestry: the stage that made it, the stages that this one took, and so on down to files and bytes.

use afmid_pipeline::store::{ResultFile, StageSummary};
use afmid_pipeline::{SourceFile, StageRecord};
use serde_json::{Value, json};

use super::diff::file_name;
use super::files::{Finder, Now};
use crate::printable::one_line;

/// Characters in a line of parameters.
const WIDEST: usize = 110;

/// A stage and what it took, as text: each stage once, in full where it comes first.
pub fn tree_text(file: &ResultFile, stage: &StageSummary, finder: &Finder) -> String {
    let mut tree = Tree { file, finder, printed: Vec::new(), text: String::new() };
    tree.stage(&stage.record, "", "");
    tree.text
}

struct Tree<'a> {
    file: &'a ResultFile,
    finder: &'a Finder,
    printed: Vec<&'a str>,
    text: String,
}

impl<'a> Tree<'a> {
    /// `lead` is what stands before the first line, `indent` before the others.
    fn stage(&mut self, record: &'a StageRecord, lead: &str, indent: &str) {
        let key: String = record.key.chars().take(16).collect();
        let head = one_line(&format!("{} ({} version {}, key {key})", record.id, record.uses, record.version));
        if self.printed.contains(&record.id.as_str()) {
            self.text.push_str(&format!("{lead}{head}: see above\n"));
            return;
        }
        self.printed.push(&record.id);
        self.text.push_str(&format!("{lead}{head}\n"));
        let last = record.wires.is_empty() && record.sources.is_empty();
        let bar = if last { "   " } else { "│  " };
        for line in parameters(record) {
            self.text.push_str(&format!("{indent}{bar}{}\n", one_line(&line)));
        }
        let count = record.wires.len() + record.sources.len();
        let mark = |index: usize| if index + 1 == count { ("└─ ", "   ") } else { ("├─ ", "│  ") };
        for (index, (port, from, output)) in record.wires.iter().enumerate() {
            let (branch, below) = mark(index);
            let lead = format!("{indent}{branch}{} <- {} of ", one_line(port), one_line(output));
            match self.file.stage(from) {
                Some(stage) => self.stage(&stage.record, &lead, &format!("{indent}{below}")),
                None => self.text.push_str(&format!("{lead}{}: not in this file\n", one_line(from))),
            }
        }
        for (index, source) in record.sources.iter().enumerate() {
            let (branch, _) = mark(record.wires.len() + index);
            let line = file_line(source, &self.finder.find(source));
            self.text.push_str(&format!("{indent}{branch}{line}\n"));
        }
    }
}

fn file_line(file: &SourceFile, now: &Now) -> String {
    let hash: String = file.blake3.chars().take(16).collect();
    one_line(&format!("file {}, {} bytes, BLAKE3 {hash}...: {}", file.path, file.size, now.text()))
}

/// Parameters and seed in lines of no more than [`WIDEST`] characters, where words allow it.
fn parameters(record: &StageRecord) -> Vec<String> {
    let params = record.params.as_object().into_iter().flatten();
    let mut words: Vec<String> = params.map(|(name, value)| format!("{name} = {value}")).collect();
    words.extend(record.seed.map(|seed| format!("seed {seed}")));
    let mut lines: Vec<String> = Vec::new();
    for word in words {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() + 2 <= WIDEST => {
                line.push_str(", ");
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}

/// All stages that a stage comes from, itself last, in the order in which they ran.
pub fn ancestors<'a>(file: &'a ResultFile, stage: &'a StageSummary) -> Vec<&'a StageRecord> {
    let mut wanted = vec![stage.record.id.as_str()];
    let mut found = Vec::new();
    // in topological order, so backwards every stage comes after those that take it
    for stage in file.stages().iter().rev() {
        if wanted.contains(&stage.record.id.as_str()) {
            wanted.extend(stage.record.wires.iter().map(|(_, from, _)| from.as_str()));
            found.push(&stage.record);
        }
    }
    found.reverse();
    found
}

/// A stage with its parameters, wires and files as JSON.
pub fn stage_json(record: &StageRecord, finder: &Finder) -> Value {
    let input =
        |(port, stage, output): &(String, String, String)| json!({ "port": port, "stage": stage, "output": output });
    let file = |file: &SourceFile| {
        let now = finder.find(file);
        let found = match &now {
            Now::Same(path) | Now::Other(path) => Some(path.display().to_string()),
            Now::Missing | Now::Unreadable(_) => None,
        };
        json!({
            "name": file_name(&file.path),
            "path": file.path,
            "size_bytes": file.size,
            "blake3": file.blake3,
            "now": now.name(),
            "found": found,
        })
    };
    json!({
        "id": record.id,
        "uses": record.uses,
        "version": record.version,
        "params": record.params,
        "seed": record.seed,
        "key": record.key,
        "inputs": record.wires.iter().map(input).collect::<Vec<_>>(),
        "files": record.sources.iter().map(file).collect::<Vec<_>>(),
        "warnings": record.result.warnings,
    })
}
