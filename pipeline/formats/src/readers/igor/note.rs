//! A wave's note, and what Asylum Research's `key: value` lines in it say.

use super::header::{Header, Part};
use crate::opened::Opened;
use crate::text;

/// The lines of a note.
#[derive(Debug, Default)]
pub(super) struct Note {
    lines: Vec<String>,
}

impl Note {
    /// Reads the note and the formula; says what they hold.
    pub(super) fn read(file: &Opened, header: &Header, remarks: &mut Vec<String>) -> Self {
        if let Some(formula) = part(file, "the formula", header.formula, remarks) {
            // one byte of old files' formulas is a control code, so no quoting character by character
            let formula = text::brief(text::decode(&formula).trim_matches('\0'), 200);
            remarks.push(format!("the wave depends on the formula `{}`", formula.trim()));
        }
        let Some(bytes) = part(file, "the note", header.note, remarks) else { return Self::default() };
        let lines: Vec<String> = text::decode(&bytes)
            .split(['\r', '\n'])
            .map(|l| l.trim_matches('\0').trim().to_owned())
            .filter(|l| !l.is_empty())
            .collect();
        if let [first, others @ ..] = lines.as_slice() {
            let more = if others.is_empty() { String::new() } else { format!(" (and {} lines more)", others.len()) };
            remarks.push(format!("note: {}{more}", text::brief(first, 200)));
        }
        Self { lines }
    }

    /// The value of the first line `key: value`.
    pub(super) fn value(&self, key: &str) -> Option<&str> {
        self.lines.iter().find_map(|line| Some(line.split_once(':').filter(|(k, _)| k.trim() == key)?.1.trim()))
    }

    /// The same as a finite number.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        text::number(self.value(key)?)
    }

    /// The same as a number above 0.
    pub(super) fn positive(&self, key: &str) -> Option<f64> {
        self.number(key).filter(|&x| x > 0.0)
    }
}

/// A part's bytes; none if it is empty or, with a remark, outside the file.
pub(super) fn part(file: &Opened, what: &str, part: Part, remarks: &mut Vec<String>) -> Option<Vec<u8>> {
    if part.bytes == 0 {
        return None;
    }
    match file.read(what, part.at, part.bytes) {
        Ok(bytes) => Some(bytes),
        Err(e) => {
            remarks.push(format!("left out {}", e.problem));
            None
        }
    }
}
