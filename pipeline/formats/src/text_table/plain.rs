//! Plain tables: header, rows of numbers, no rules.

use super::axis;
use super::column::{Budget, Column};
use super::lines::{Line, Lines};
use super::sniff::{self, Dialect, Sniffed};
use super::titles::{self, Title};
use super::{Parsed, number};
use crate::fail;
use crate::{Contents, FormatError, FoundChannel};
use std::collections::VecDeque;
use std::sync::Arc;

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
    let titles = header(texts.get(..sniffed.first_row).unwrap_or_default(), &sniffed);
    head.drain(..sniffed.first_row.min(head.len()));
    let mut remarks = Vec::new();
    let columns = rows(lines, head, &sniffed, &mut remarks)?;
    if sniffed.ambiguous {
        remarks.push("each row is «number,number»: read as two columns, not as one with a decimal comma".to_owned());
    }
    let channels = channels(columns, &titles, &mut remarks);
    let Dialect { delimiter, decimal } = sniffed.dialect;
    let delimiter = match delimiter {
        '\t' => "tabs",
        ';' => "semicolons",
        ',' => "commas",
        _ => "blanks",
    };
    let format = format!("table of text, {} columns set apart by {delimiter}, decimal «{decimal}»", sniffed.columns);
    Ok(Contents { format, started_at: String::new(), channels, remarks })
}

/// Parses all rows.
fn rows(
    lines: &mut Lines,
    mut head: VecDeque<Line>,
    sniffed: &Sniffed,
    remarks: &mut Vec<String>,
) -> Result<Vec<Column>, FormatError> {
    let wanted = sniffed.columns;
    let mut columns = vec![Column::default(); wanted];
    let mut budget = Budget(lines.file_bytes());
    let (mut row, mut comments) = (0, 0_usize);
    while let Some(line) = head.pop_front().map_or_else(|| lines.next(), |line| Ok(Some(line)))? {
        if line.text.trim_matches(|c: char| c.is_whitespace() || c == '\u{1a}').is_empty() {
            continue;
        }
        if sniff::is_comment(&line.text) {
            comments += 1;
            continue;
        }
        let mut fields = sniffed.dialect.fields(&line.text);
        // A delimiter behind the last field.
        while fields.len() > wanted && fields.last().is_some_and(|f| f.trim().is_empty()) {
            fields.pop();
        }
        let last = !line.ended && fields.len() < wanted;
        if last && row > 0 {
            remarks.push(format!("the last line ({}) is cut off: it is left out", line.number));
            break;
        }
        // Fields may be missing at the end where delimiters show which are there.
        let too_few = fields.len() < wanted && sniffed.dialect.delimiter == ' ';
        if fields.len() > wanted || too_few {
            let problem = format!("line {} has {} fields, {wanted} were wanted", line.number, fields.len());
            return Err(fail::at(line.at, problem, "remove what is no row of the table, or split the tables"));
        }
        for (column, field) in columns.iter_mut().zip(fields) {
            column.take(row, field, sniffed.dialect.decimal, &line, &mut budget)?;
        }
        row += 1;
    }
    if comments > 0 {
        remarks.push(format!("{comments} comment lines among the rows are left out"));
    }
    Ok(columns)
}

/// Titles and units from the lines above the first row.
fn header(lines: &[&str], sniffed: &Sniffed) -> Vec<Title> {
    let fitting = |line: &&str| {
        let line = line.trim_start_matches(['#', '%', ' ']);
        header_fields(line, sniffed).filter(|f| f.iter().any(|f| !f.trim().is_empty()))
    };
    let mut rows = lines.iter().rev().filter(|l| !l.trim().is_empty()).map_while(fitting);
    let Some(lowest) = rows.next() else { return vec![Title::default(); sniffed.columns] };
    let units_only = titles::are_units(&lowest);
    let Some(names) = rows.next().filter(|_| units_only) else {
        return lowest.iter().map(|field| titles::split_unit(field)).collect();
    };
    let unit = |field: &String| number::bare(field).trim_matches(['(', ')', '[', ']']).trim().to_owned();
    names
        .iter()
        .zip(&lowest)
        .map(|(name, field)| Title { name: number::bare(name).to_owned(), unit: unit(field) })
        .collect()
}

/// A header line's fields, if they are as many as the columns.
fn header_fields(line: &str, sniffed: &Sniffed) -> Option<Vec<String>> {
    let owned = |fields: Vec<&str>| -> Vec<String> { fields.into_iter().map(str::to_owned).collect() };
    // Rows may end with a delimiter where the titles don't, and the other way round.
    let fitted = |mut fields: Vec<String>| {
        if fields.len() == sniffed.columns + 1 && fields.last().is_some_and(|f| f.trim().is_empty()) {
            fields.pop();
        }
        let delimiter_behind_rows = sniffed.ends_with_delimiter && fields.len() + 1 == sniffed.columns;
        if delimiter_behind_rows {
            fields.push(String::new());
        }
        (fields.len() == sniffed.columns).then_some(fields)
    };
    let tries = [
        owned(sniffed.dialect.fields(line)),
        owned(line.split('\t').collect()),
        owned(line.split("  ").map(str::trim).filter(|f| !f.is_empty()).collect()),
        with_brackets_joined(line),
    ];
    tries.into_iter().find_map(fitted)
}

/// Words, each with the bracket behind it: `Time (s) Deflection (V)` are two.
fn with_brackets_joined(line: &str) -> Vec<String> {
    let mut fields: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        match fields.last_mut().filter(|_| word.starts_with(['(', '['])) {
            Some(before) => {
                before.push(' ');
                before.push_str(word);
            }
            None => fields.push(word.to_owned()),
        }
    }
    fields
}

/// Channels of the columns, with the rate of the time column among them.
fn channels(columns: Vec<Column>, titles: &[Title], remarks: &mut Vec<String>) -> Vec<FoundChannel> {
    let names: Vec<&str> = titles.iter().map(|t| t.name.as_str()).collect();
    let locations = titles::locations(&names);
    let time = titles.iter().position(titles::is_time).filter(|_| columns.len() > 1);
    let timed = time.and_then(|at| Some((at, columns.get(at)?, titles.get(at)?, locations.get(at)?)));
    let rate = timed.and_then(|(_, column, title, location)| rate(column, title, location, remarks));
    if let (None, Some(first), Some(location)) =
        (time, columns.first().filter(|_| columns.len() > 1), locations.first())
        && let Ok(even) = axis::even(first, None)
    {
        let step = even.step;
        remarks
            .push(format!("{location} rises evenly by {step:e}: title it «Time (s)» if it is time, to give the rate"));
    }
    let mut channels = Vec::new();
    for (number, ((column, title), location)) in columns.into_iter().zip(titles).zip(locations).enumerate() {
        if rate.is_some() && time == Some(number) {
            continue;
        }
        if column.values.is_empty() {
            // Nothing at all behind a last delimiter is no column.
            if number + 1 == titles.len() && title.name.is_empty() && column.no_numbers == 0 {
                continue;
            }
            let text = if column.no_numbers > 0 { "text, no numbers" } else { "empty" };
            remarks.push(format!("{location} is {text}: it is left out"));
            continue;
        }
        remarks.extend(column.remark(&location));
        channels.push(FoundChannel {
            location,
            samples: column.values.len(),
            unit: title.unit.clone(),
            long_name: title.name.clone(),
            sample_rate_hz: rate,
            scale_factor: 1.0,
            add_offset: 0.0,
            fill_code: None,
            gaps: Vec::new(),
            stored_as: "text",
            source: Arc::new(Parsed(column.values)),
        });
    }
    channels
}

/// The rate a column of times gives.
fn rate(column: &Column, title: &Title, location: &str, remarks: &mut Vec<String>) -> Option<f64> {
    let unit_s = match title.unit.as_str() {
        "" => Some(1.0),
        unit => titles::seconds(unit),
    };
    let Some(unit_s) = unit_s else {
        remarks.push(format!("{location} is in «{}», no unit of time that is known: no sample rate", title.unit));
        return None;
    };
    match axis::even(column, None) {
        Ok(even) => {
            let unit = if title.unit.is_empty() { " (no unit: taken as seconds)" } else { "" };
            let first = column.values.first().copied().unwrap_or(0.0);
            remarks
                .push(format!("{location}{unit} runs evenly from {first}: given as the sample rate, not as a channel"));
            if even.rounded {
                let relative = even.uncertainty;
                remarks.push(format!("{location} is rounded: the sample rate is known to {relative:.1e} of itself"));
            }
            Some(axis::rate_hz(even.step * unit_s))
        }
        Err(why) => {
            remarks.push(format!("{location} gives no sample rate: {why}"));
            None
        }
    }
}
