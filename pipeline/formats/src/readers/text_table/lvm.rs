//! LVM: sections of columns, each behind a header of its own (or, without multiple headings, behind the first one's).

use super::column::{Budget, Column};
use super::lines::{Line, Lines};
use super::lvm_header::{FileHeader, Tags, file_header, moment, section_header};
use super::lvm_join::Joined;
use super::number;
use crate::fail;
use crate::{Contents, FormatError};

/// Title of columns of X values.
pub(super) const X: &str = "X_Value";
const COMMENT: &str = "Comment";

/// A section's columns.
#[derive(Debug)]
pub(super) struct Section {
    pub(super) tags: Tags,
    pub(super) titles: Vec<String>,
    pub(super) columns: Vec<Column>,
    /// Whether it has no header of its own.
    pub(super) continued: bool,
    /// Line of its first row.
    pub(super) line: usize,
}

/// Reads an LVM file.
pub(super) fn open(lines: &mut Lines) -> Result<Contents, FormatError> {
    let mut remarks = Vec::new();
    let file = file_header(lines, &mut remarks)?;
    let mut budget = Budget(lines.file_bytes());
    let mut joined = Joined::default();
    let mut started_at = moment_of(&file.tags, 1);
    let mut latest: Option<(Tags, Vec<String>)> = None;
    let mut comments = 0;
    while let Some(line) = skip_blank(lines, file.separator)? {
        let goes_on = latest.clone().filter(|_| is_row(&line, &file));
        let continued = goes_on.is_some();
        let (tags, titles) = match goes_on {
            Some(before) => before,
            None => heading(lines, &file, &line, &mut remarks)?,
        };
        if latest.is_none() {
            let channel = titles.iter().position(|t| t != X).unwrap_or(1).max(1);
            started_at = moment_of(&tags, channel).or(started_at);
        }
        let columns = rows(lines, &file, &titles, &mut budget, &mut comments)?;
        let section = Section { tags: tags.clone(), titles: titles.clone(), columns, continued, line: line.number };
        latest = Some((tags, titles));
        joined.add(section, &file, &mut remarks);
    }
    if latest.is_none() {
        return Err(fail::at(
            lines.file_bytes(),
            "the file ends behind its header, rows were wanted",
            fail::COPY_AGAIN,
        ));
    }
    if comments > 0 {
        remarks.push(format!("{comments} rows have comments, which are left out"));
    }
    let format = format!("LabVIEW measurement (LVM {})", file.version);
    Ok(Contents {
        format,
        started_at: started_at.unwrap_or_default(),
        channels: joined.channels(&mut remarks),
        responses: Vec::new(),
        remarks,
    })
}

fn moment_of(tags: &Tags, column: usize) -> Option<String> {
    Some(moment(tags.field("Date", column)?, tags.field("Time", column)?)?.0)
}

/// The first line that is not blank, which stays the next one.
fn skip_blank(lines: &mut Lines, separator: char) -> Result<Option<Line>, FormatError> {
    while let Some(line) = lines.peek()?.cloned() {
        if !line.text.chars().all(|c| c == separator || c.is_whitespace()) {
            return Ok(Some(line));
        }
        lines.next()?;
    }
    Ok(None)
}

/// Tags and titles of a section that begins with `line`.
fn heading(
    lines: &mut Lines,
    file: &FileHeader,
    line: &Line,
    remarks: &mut Vec<String>,
) -> Result<(Tags, Vec<String>), FormatError> {
    let tags = if line.text.starts_with(X) { Tags::default() } else { section_header(lines, file, remarks)? };
    let Some(titles) = lines.next()? else {
        return Err(fail::at(line.at, "the section has no row of titles", fail::COPY_AGAIN));
    };
    let fields: Vec<String> = titles.text.split(file.separator).map(|t| t.trim().to_owned()).collect();
    if fields.first().is_none_or(|f| f != X) {
        let problem = format!("line {} does not begin with «{X}», a row of titles was wanted", titles.number);
        return Err(fail::at(titles.at, problem, fail::COPY_AGAIN));
    }
    Ok((tags, fields))
}

/// Whether a line goes on with the section before it.
fn is_row(line: &Line, file: &FileHeader) -> bool {
    let mut fields = line.text.split(file.separator);
    fields.find(|f| !f.trim().is_empty()).is_some_and(|f| number::parse(f, file.decimal).is_some())
}

/// Reads rows up to a blank line, a header or the file's end.
fn rows(
    lines: &mut Lines,
    file: &FileHeader,
    titles: &[String],
    budget: &mut Budget,
    comments: &mut usize,
) -> Result<Vec<Column>, FormatError> {
    let comment = titles.iter().position(|t| t == COMMENT).filter(|at| at + 1 == titles.len());
    let mut columns = vec![Column::default(); comment.unwrap_or(titles.len())];
    let mut row = 0;
    while let Some(line) = lines.peek()? {
        let starts_header = line.text.starts_with("***") || line.text.starts_with("Channels");
        // A row of empty fields has at least two separators; what follows a section has at most one.
        let blank = line.text.trim().is_empty() && line.text.matches(file.separator).count() <= 1;
        if starts_header || (blank && (row > 0 || line.text.is_empty())) {
            break;
        }
        let Some(line) = lines.next()? else { break };
        let fields = || line.text.split(file.separator);
        for (column, field) in columns.iter_mut().zip(fields()) {
            column.take(row, field, file.decimal, &line, budget)?;
        }
        *comments += usize::from(fields().skip(columns.len()).any(|f| !f.trim().is_empty()));
        row += 1;
    }
    Ok(columns)
}
