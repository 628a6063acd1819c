//! Finds delimiter and decimal sign of a plain table by looking at its first lines.

use super::lines::BYTE_ORDER_MARK;
use super::number;
use crate::text::decode;

/// How fields are set apart and numbers printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    /// Tab, semicolon or comma; a blank stands for any number of blanks and tabs.
    pub(super) delimiter: char,
    pub(super) decimal: char,
}

/// In the order in which they win a draw.
const DIALECTS: [Dialect; 7] = [
    Dialect { delimiter: '\t', decimal: '.' },
    Dialect { delimiter: '\t', decimal: ',' },
    Dialect { delimiter: ';', decimal: '.' },
    Dialect { delimiter: ';', decimal: ',' },
    Dialect { delimiter: ',', decimal: '.' },
    Dialect { delimiter: ' ', decimal: '.' },
    Dialect { delimiter: ' ', decimal: ',' },
];

/// What the first lines show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sniffed {
    pub(super) dialect: Dialect,
    pub(super) columns: usize,
    /// Which of the lines is the first row.
    pub(super) first_row: usize,
    /// Whether `1,2` could as well be one number with a decimal comma.
    pub(super) ambiguous: bool,
    /// Whether the rows have a delimiter behind their last field.
    pub(super) ends_with_delimiter: bool,
}

impl Dialect {
    /// The fields of a row.
    pub(super) fn fields<'a>(&self, line: &'a str) -> Vec<&'a str> {
        if self.delimiter == ' ' { line.split_whitespace().collect() } else { line.split(self.delimiter).collect() }
    }

    /// Fields that are numbers, and such that are neither empty nor numbers.
    fn count(&self, fields: &[&str]) -> (usize, usize) {
        let numbers = fields.iter().filter(|f| number::parse(f, self.decimal).is_some()).count();
        let filled = fields.iter().filter(|f| !number::bare(f).is_empty()).count();
        (numbers, filled - numbers.min(filled))
    }

    fn is_row(&self, line: &str) -> Option<usize> {
        let fields = self.fields(line);
        let (numbers, others) = self.count(&fields);
        (!is_comment(line) && numbers > 0 && numbers >= others).then_some(fields.len())
    }

    /// Numbers in the lines, less the fields of text: a wrong delimiter makes fewer numbers and some text.
    fn score(&self, lines: &[&str]) -> i64 {
        let rows = lines.iter().filter(|line| self.is_row(line).is_some());
        rows.map(|line| self.count(&self.fields(line))).map(|(numbers, others)| numbers as i64 - others as i64).sum()
    }
}

/// Whether a line is a comment.
pub(super) fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with(['#', '%'])
}

/// Looks at lines. None if there are no rows of numbers in them.
pub(super) fn sniff(lines: &[&str]) -> Option<Sniffed> {
    let (score, dialect) = DIALECTS.iter().rev().map(|d| (d.score(lines), *d)).max_by_key(|(score, _)| *score)?;
    if score <= 0 {
        return None;
    }
    let widths: Vec<Option<usize>> = lines.iter().map(|line| dialect.is_row(line)).collect();
    // The last row looked at is far behind any header; a cut off one is left out by the caller.
    let columns = most_frequent(widths.iter().flatten().copied())?;
    let first_row = widths.iter().position(|w| *w == Some(columns))?;
    let comma_pairs = dialect == Dialect { delimiter: ',', decimal: '.' } && columns == 2;
    let rows = || lines.iter().zip(&widths).filter(|(_, w)| **w == Some(columns)).map(|(line, _)| *line);
    let ambiguous = comma_pairs && rows().all(|line| number::parse(line, ',').is_some());
    // `0,05`: no whole number is printed with a leading 0, so the comma is decimal.
    let leading_zero = |line: &str| line.split_once(',').is_some_and(|(_, b)| b.len() > 1 && b.starts_with('0'));
    if ambiguous && rows().any(leading_zero) {
        let dialect = Dialect { delimiter: ' ', decimal: ',' };
        return Some(Sniffed { dialect, columns: 1, first_row, ambiguous: false, ends_with_delimiter: false });
    }
    let ends_with_delimiter = dialect.delimiter != ' ' && rows().all(|line| line.ends_with(dialect.delimiter));
    Some(Sniffed { dialect, columns, first_row, ambiguous, ends_with_delimiter })
}

fn most_frequent(widths: impl Iterator<Item = usize>) -> Option<usize> {
    let mut counts: Vec<(usize, usize)> = Vec::new();
    for width in widths {
        match counts.iter_mut().find(|(w, _)| *w == width) {
            Some((_, count)) => *count += 1,
            None => counts.push((width, 1)),
        }
    }
    counts.into_iter().max_by_key(|&(width, count)| (count, width)).map(|(width, _)| width)
}

/// Whether a file's first bytes are text with rows of numbers.
pub(super) fn looks_like_a_table(head: &[u8]) -> bool {
    let head = head.strip_prefix(BYTE_ORDER_MARK).unwrap_or(head);
    // Control bytes are in no table of text; 0x1A ends some of old programs'.
    let is_text = |&b: &u8| b >= 0x20 || matches!(b, b'\t' | b'\r' | b'\n' | 0x0C | 0x1A);
    if head.is_empty() || !head.iter().all(is_text) {
        return false;
    }
    let text = decode(head);
    let lines: Vec<&str> = text.lines().collect();
    sniff(&lines).is_some()
}
