//! Columns from text: CSV, DAT and what else has numbers in lines; LabVIEW's LVM with its header.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lvm::LvmHeader;
use super::table::{ColumnError, ColumnTable, NamedColumn, Text};

/// What separates columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Separator {
    /// The first that the first line of numbers has: semicolon, comma, else white space.
    Auto,
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// A tab; two in a row leave an entry empty.
    Tab,
    /// Any number of spaces and tabs.
    Whitespace,
}

/// Reads lines of numbers.
///
/// # Method
/// Lines that begin with `#`, `%` or `//` and empty ones are passed over. Data begin at the first line whose first
/// entry is a number; the line before them, if it has as many entries, is the header. Empty entries, `NaN`, `NA` and
/// `null` are missing; a decimal comma is read wherever it does not separate columns. A file that begins with `LabVIEW
/// Measurement` is read by its own header.
/// # Errors
/// No numbers; text in the midst of them; an LVM header without end. Text within a column is kept: an error only to
/// those who want that column.
pub fn read_text(bytes: &[u8], separator: Separator) -> Result<ColumnTable, ColumnError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let lines: Vec<(usize, &str)> = text.lines().enumerate().map(|(i, line)| (i + 1, line)).collect();
    let lvm = LvmHeader::find(&lines)?;
    let (lines, separator) = match &lvm {
        Some(header) => (lines.get(header.lines..).unwrap_or(&[]), header.separator),
        None => (lines.as_slice(), separator),
    };
    let mut table = rows(lines, separator, lvm.is_some())?;
    table.interval_s = lvm.and_then(|header| header.interval_s);
    Ok(table)
}

fn rows(lines: &[(usize, &str)], separator: Separator, first_may_be_empty: bool) -> Result<ColumnTable, ColumnError> {
    let comment = |line: &str| ["#", "%", "//"].iter().any(|mark| line.starts_with(mark));
    let mut rest = lines.iter().filter(|(_, line)| !line.trim().is_empty() && !comment(line.trim_start()));
    let (mut header, mut table) = (None, None);
    for &(number, line) in rest.by_ref() {
        let separator = resolved(separator, line);
        let entries = split(line, separator);
        let wanted = if first_may_be_empty { entries.iter().find(|entry| !entry.is_empty()) } else { entries.first() };
        if wanted.is_some_and(|entry| number_of(entry, separator).is_some()) {
            let mut begun = Growing { separator, columns: vec![NamedColumn::default(); entries.len()], rows: 0 };
            begun.push(number, &entries);
            begun.name(header, line);
            table = Some(begun);
            break;
        }
        header = Some(line);
    }
    let mut table = table.ok_or(ColumnError::NoNumbers)?;
    for &(number, line) in rest {
        let entries = split(line, table.separator);
        let is_text =
            |entry: &&&str| !entry.is_empty() && !missing(entry) && number_of(entry, table.separator).is_none();
        let filled = entries.iter().filter(|entry| !entry.is_empty()).count();
        if entries.iter().filter(is_text).count() == filled {
            let found = line.chars().take(40).collect();
            // a line of markers for missing values alone is still data
            if entries.iter().any(|entry| is_text(&entry)) {
                return Err(ColumnError::TextAmongNumbers { line: number, found, rows: table.rows });
            }
        }
        table.push(number, &entries);
    }
    Ok(ColumnTable { columns: table.columns, ..ColumnTable::default() })
}

struct Growing {
    separator: Separator,
    columns: Vec<NamedColumn>,
    rows: usize,
}

impl Growing {
    /// Adds a row; a row with more entries begins new columns, missing so far.
    fn push(&mut self, line: usize, entries: &[&str]) {
        while self.columns.len() < entries.len() {
            self.columns.push(NamedColumn { values: vec![f64::NAN; self.rows], ..NamedColumn::default() });
        }
        for (i, column) in self.columns.iter_mut().enumerate() {
            let entry = entries.get(i).copied().unwrap_or("");
            let value = number_of(entry, self.separator);
            if value.is_none() && !missing(entry) && column.text.is_none() {
                column.text = Some(Text { line, found: entry.to_owned() });
            }
            column.values.push(value.unwrap_or(f64::NAN));
        }
        self.rows += 1;
    }

    /// Names from the header line, if it has an entry for every column.
    fn name(&mut self, header: Option<&str>, first_row: &str) {
        let Some(header) = header else { return };
        let mut names = split(header, self.separator);
        // names of several words: tabs separate them, white space does not
        if self.separator == Separator::Whitespace && names.len() != self.columns.len() {
            names = if first_row.contains('\t') { split(header, Separator::Tab) } else { Vec::new() };
        }
        if names.len() >= self.columns.len() {
            for (column, name) in self.columns.iter_mut().zip(&names) {
                column.name = (*name).to_owned();
            }
            // columns that only later rows fill
            let values = || vec![f64::NAN; self.rows];
            let more: Vec<NamedColumn> = names[self.columns.len()..]
                .iter()
                .map(|name| NamedColumn { name: (*name).to_owned(), values: values(), text: None })
                .collect();
            self.columns.extend(more);
        }
    }
}

fn resolved(separator: Separator, line: &str) -> Separator {
    match separator {
        Separator::Auto if line.contains(';') => Separator::Semicolon,
        Separator::Auto if line.contains(',') && !decimal_commas(line) => Separator::Comma,
        Separator::Auto => Separator::Whitespace,
        given => given,
    }
}

/// Whether every comma stands between digits while white space separates: `0,914 1,2047`.
fn decimal_commas(line: &str) -> bool {
    let entries: Vec<&str> = line.split_whitespace().collect();
    entries.len() > 1 && entries.iter().all(|entry| number_of(entry, Separator::Whitespace).is_some())
}

fn split(line: &str, separator: Separator) -> Vec<&str> {
    let by = |mark: char| line.trim_end_matches(['\r', '\n']).split(mark).map(clean).collect();
    match separator {
        Separator::Comma => by(','),
        Separator::Semicolon => by(';'),
        Separator::Tab => by('\t'),
        Separator::Whitespace | Separator::Auto => line.split_whitespace().map(clean).collect(),
    }
}

fn clean(entry: &str) -> &str {
    entry.trim().trim_matches('"').trim()
}

fn missing(entry: &str) -> bool {
    entry.is_empty() || ["nan", "na", "n/a", "null", "-"].contains(&entry.to_ascii_lowercase().as_str())
}

/// The finite number that an entry is.
fn number_of(entry: &str, separator: Separator) -> Option<f64> {
    let value: f64 = match entry.matches(',').count() {
        1 if separator != Separator::Comma => entry.replace(',', ".").parse().ok()?,
        _ => entry.parse().ok()?,
    };
    value.is_finite().then_some(value)
}
