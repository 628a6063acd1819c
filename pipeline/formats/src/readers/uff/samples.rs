//! Reads the samples of a function.

use super::fixed::number;
use crate::fail;
use crate::pinned::{Pinned, read_at, stretch_end};
use crate::{FormatError, Raw, Source};
use std::sync::{Arc, OnceLock};

/// The numbers of a dataset 58 in text, parsed once.
#[derive(Debug)]
pub(super) struct Text {
    pub(super) pinned: Pinned,
    pub(super) from: u64,
    pub(super) to: u64,
    /// Widths of the fields of a line, over and over.
    pub(super) widths: &'static [usize],
    /// Numbers in it.
    pub(super) numbers: usize,
    pub(super) parsed: OnceLock<Result<Vec<f64>, FormatError>>,
}

/// Every second number of a text, or every one.
#[derive(Debug)]
pub(super) struct Picked {
    pub(super) text: Arc<Text>,
    pub(super) first: usize,
    pub(super) every: usize,
    pub(super) samples: usize,
}

impl Source for Picked {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        stretch_end(start, count, self.samples)?;
        let numbers = self.text.parsed.get_or_init(|| self.text.parse()).as_ref().map_err(Clone::clone)?;
        let picked = numbers.iter().skip(self.first + start * self.every).step_by(self.every.max(1)).take(count);
        Ok(Raw::Float64(picked.copied().collect()))
    }

    fn kept_bytes(&self) -> u64 {
        8 * self.text.numbers as u64
    }
}

impl Text {
    fn parse(&self) -> Result<Vec<f64>, FormatError> {
        let file = self.pinned.reopen()?;
        // The dataset lies within the file: `scan` has found its end.
        let mut bytes = vec![0; self.to.saturating_sub(self.from) as usize];
        read_at(&file, self.from, &mut bytes)?;
        let mut numbers = Vec::with_capacity(self.numbers);
        let mut at = self.from;
        for line in bytes.split(|&b| b == b'\n') {
            if numbers.len() < self.numbers {
                let found = self.line(line).ok_or_else(|| {
                    let text = super::fixed::text(line, 0, 80);
                    fail::at(at, format!("«{text}» was found, numbers were wanted"), fail::COPY_AGAIN)
                })?;
                numbers.extend(found.into_iter().take(self.numbers - numbers.len()));
            }
            at += line.len() as u64 + 1;
        }
        if numbers.len() < self.numbers {
            let problem = format!("{} numbers were found, {} were wanted", numbers.len(), self.numbers);
            return Err(fail::at(self.from, problem, fail::COPY_AGAIN));
        }
        Ok(numbers)
    }

    /// The numbers of a line: at fixed columns (where they may touch), or else between blanks (as some programs write
    /// them).
    fn line(&self, line: &[u8]) -> Option<Vec<f64>> {
        let line = line.trim_ascii_end();
        let mut rest = line;
        let mut fields = Vec::new();
        for &width in self.widths.iter().cycle() {
            if rest.is_empty() {
                break;
            }
            let (field, behind) = rest.split_at(width.min(rest.len()));
            fields.push(field);
            rest = behind;
        }
        let fixed: Option<Vec<f64>> = fields.into_iter().map(number).collect();
        let blanks = || line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).map(number).collect();
        // Fields cut in two would parse, too: with as many words as fields nothing was cut.
        let words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).count();
        match fixed {
            Some(numbers) if numbers.len() >= words => Some(numbers),
            _ => blanks(),
        }
    }
}
