//! Plain tables: header, rows of numbers, no rules.

use super::column::{Budget, Column};
use super::kind::Kind;
use super::lines::{Line, Lines};
use super::sniff::{self, Dialect, Sniffed};
use super::stated::Stated;
use super::{channels, header, number};
use crate::fail;
use crate::{Contents, FormatError};
use std::collections::{HashSet, VecDeque};

/// Lines looked at before the first is parsed: headers are shorter.
const LOOKED_AT: usize = 400;
/// And at most so many bytes.
const LOOKED_AT_BYTES: usize = 1 << 20;

/// Reads a table.
pub(super) fn open(lines: &mut Lines) -> Result<Contents, FormatError> {
    let mut head = VecDeque::new();
    let mut bytes = 0;
    while head.len() < LOOKED_AT && bytes < LOOKED_AT_BYTES {
        let Some(line) = lines.next()? else { break };
        bytes += line.text.len();
        head.push_back(line);
    }
    let texts: Vec<&str> = head.iter().map(|line| line.text.as_str()).collect();
    let Some(sniffed) = sniff::sniff(&texts) else {
        let problem = format!("none of the first {} lines is a row of numbers", head.len());
        let help = "wanted: numbers set apart by tabs, commas, semicolons or blanks";
        return Err(fail::at(0, problem, help));
    };
    let above = texts.get(..sniffed.first_row).unwrap_or_default();
    let titles = header::titles(above, &sniffed);
    let mut table = Table::new(&sniffed, lines.file_bytes(), above);
    head.drain(..sniffed.first_row.min(head.len()));
    let mut remarks = Vec::new();
    table.rows(lines, head, &mut remarks)?;
    if sniffed.ambiguous {
        remarks.push("each row is «number,number»: read as two columns, not as one with a decimal comma".to_owned());
    }
    let Dialect { delimiter, decimal } = sniffed.dialect;
    let delimiter = match delimiter {
        '\t' => "tabs",
        ';' => "semicolons",
        ',' => "commas",
        _ => "blanks",
    };
    let count = sniffed.kinds.len();
    let format = format!("table of text, {count} columns set apart by {delimiter}, decimal «{decimal}»");
    let channels = channels::of(table.finish(), titles, &mut remarks);
    Ok(Contents { format, started_at: String::new(), channels, responses: Vec::new(), remarks })
}

/// What all rows hold.
#[derive(Debug)]
pub(super) struct Rows {
    pub(super) columns: Vec<Column>,
    pub(super) stated: Stated,
    /// Rows behind a repeated header: the recording was begun again there.
    pub(super) starts: Vec<usize>,
    /// Number of rows.
    pub(super) count: usize,
}

/// The rows while they are parsed.
#[derive(Debug)]
struct Table<'a> {
    sniffed: &'a Sniffed,
    rows: Rows,
    budget: Budget,
    /// First fields of the header's lines: what begins like one of them is a header once more.
    header: HashSet<String>,
    comments: usize,
    headers: usize,
    first_header: usize,
}

impl<'a> Table<'a> {
    fn new(sniffed: &'a Sniffed, file_bytes: u64, above: &[&str]) -> Self {
        let columns = vec![Column::default(); sniffed.kinds.len()];
        let cells: Vec<Vec<&str>> = above.iter().map(|line| header::cells(line, sniffed)).collect();
        let mut stated = Stated::default();
        for (number, line) in cells.iter().enumerate() {
            stated.read(line, cells.get(number + 1).map(Vec::as_slice).unwrap_or_default(), sniffed.dialect.decimal);
        }
        let first = |line: &Vec<&str>| line.first().map(|field| number::bare(field).to_owned());
        let header = cells.iter().filter_map(first).filter(|field| !field.is_empty()).collect();
        let rows = Rows { columns, stated, starts: Vec::new(), count: 0 };
        Self { sniffed, rows, budget: Budget(file_bytes), header, comments: 0, headers: 0, first_header: 0 }
    }

    /// Parses all rows.
    fn rows(
        &mut self,
        lines: &mut Lines,
        mut head: VecDeque<Line>,
        remarks: &mut Vec<String>,
    ) -> Result<(), FormatError> {
        let wanted = self.sniffed.kinds.len();
        let dialect = self.sniffed.dialect;
        let mut begins_again = false;
        while let Some(line) = head.pop_front().map_or_else(|| lines.next(), |line| Ok(Some(line)))? {
            if line.text.trim_matches(|c: char| c.is_whitespace() || c == '\u{1a}').is_empty() {
                continue;
            }
            if sniff::is_comment(&line.text) {
                self.comments += 1;
                continue;
            }
            let mut fields = dialect.fields(&line.text);
            // A delimiter behind the last field.
            while fields.len() > wanted && fields.last().is_some_and(|f| f.trim().is_empty()) {
                fields.pop();
            }
            let last = !line.ended && fields.len() < wanted;
            if last && self.rows.count > 0 {
                remarks.push(format!("the last line ({}) is cut off: it is left out", line.number));
                break;
            }
            if self.is_header(&fields) {
                self.rows.stated.read(&header::cells(&line.text, self.sniffed), &[], dialect.decimal);
                self.first_header = if self.headers == 0 { line.number } else { self.first_header };
                self.headers += 1;
                begins_again = self.rows.count > 0;
                continue;
            }
            // Fields may be missing at the end where delimiters show which are there.
            let too_few = fields.len() < wanted && dialect.delimiter == ' ';
            if fields.len() > wanted || too_few {
                let problem = format!("line {} has {} fields, {wanted} were wanted", line.number, fields.len());
                return Err(fail::at(line.at, problem, "remove what is no row of the table, or split the tables"));
            }
            if std::mem::take(&mut begins_again) {
                self.rows.starts.push(self.rows.count);
            }
            self.row(&fields, &line)?;
        }
        if self.comments > 0 {
            remarks.push(format!("{} comment lines among the rows are left out", self.comments));
        }
        if self.headers > 0 {
            let (count, first) = (self.headers, self.first_header);
            remarks.push(format!("{count} lines among the rows are no rows and left out (the first is line {first})"));
        }
        Ok(())
    }

    /// Whether a line behind the first row is no row: it begins like a line of the header, or it has text and no number
    /// where rows have numbers.
    fn is_header(&self, fields: &[&str]) -> bool {
        let kind = |field: &&str| Kind::of(field, self.sniffed.dialect.decimal);
        let lead = self.sniffed.leading;
        let first = fields.get(lead).map(kind);
        let as_many = fields.len() == self.sniffed.kinds.len();
        if as_many && first == Some(Kind::Number) {
            let found = || fields.iter().map(kind).collect::<Vec<Kind>>();
            return lead > 0 && sniff::is_labelled(&found(), &self.sniffed.kinds, lead);
        }
        let first_is_text = first == Some(Kind::Text);
        let repeated = || fields.first().is_some_and(|field| self.header.contains(number::bare(field)));
        let is_number_column = |(_, wanted): &(&&str, &Kind)| **wanted == Kind::Number;
        let found = || fields.iter().zip(&self.sniffed.kinds).filter(is_number_column).map(|(field, _)| kind(field));
        let no_numbers = || !found().any(|kind| kind == Kind::Number);
        let any_text = || found().any(|kind| kind == Kind::Text);
        // A line of another width that begins with a word is no row, whatever else it has.
        (any_text() && no_numbers()) || (first_is_text && (!as_many || repeated()))
    }

    fn row(&mut self, fields: &[&str], line: &Line) -> Result<(), FormatError> {
        let decimal = self.sniffed.dialect.decimal;
        if matches!(self.sniffed.kinds.first(), Some(Kind::Text | Kind::Empty)) {
            // A header beside the rows: `Sample Interval,4E-7,,-0.00122,0.12` (Tektronix TDS).
            self.rows.stated.read(fields, &[], decimal);
        }
        let has_text = self.sniffed.kinds.iter().any(|kind| matches!(kind, Kind::Text | Kind::Empty));
        let mut behind_text = false;
        for (column, field) in self.rows.columns.iter_mut().zip(fields) {
            let before = column.numbers();
            column.take(self.rows.count, field, decimal, line, &mut self.budget)?;
            if behind_text && column.numbers() > before {
                column.labelled += 1;
            }
            behind_text = has_text && Kind::of(field, decimal) == Kind::Text;
        }
        self.rows.count += 1;
        Ok(())
    }

    fn finish(self) -> Rows {
        self.rows
    }
}
