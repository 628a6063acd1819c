//! Headers of an LVM file: tags and what they say, up to `***End_of_Header***`.

use super::lines::{Line, Lines};
use super::number;
use crate::FormatError;
use crate::calendar::days_to;
use crate::fail;
use std::collections::HashMap;

const END: &str = "***End_of_Header***";
const SPECIAL: &str = "***Start_Special***";
const END_OF_SPECIAL: &str = "***End_Special***";

/// What holds for the whole file.
#[derive(Debug, Clone)]
pub(super) struct FileHeader {
    pub(super) separator: char,
    pub(super) decimal: char,
    /// Whether there are columns of X values.
    pub(super) has_x: bool,
    pub(super) version: String,
    pub(super) tags: Tags,
}

/// Tags and their fields, the tag included, so that a field has its column's number.
#[derive(Debug, Clone, Default)]
pub(super) struct Tags(HashMap<String, Vec<String>>);

impl Tags {
    pub(super) fn field(&self, tag: &str, column: usize) -> Option<&str> {
        self.0.get(tag)?.get(column).map(|f| f.trim()).filter(|f| !f.is_empty())
    }

    pub(super) fn number(&self, tag: &str, column: usize, decimal: char) -> Option<f64> {
        number::parse(self.field(tag, column)?, decimal).filter(|n| n.is_finite())
    }
}

/// Reads the file's header.
pub(super) fn file_header(lines: &mut Lines, remarks: &mut Vec<String>) -> Result<FileHeader, FormatError> {
    let first = lines.next()?;
    let at = first.map_or(0, |line| line.at + line.text.len() as u64);
    // Until the separator is known, tags end at the first that could be it.
    let mut separator = '\t';
    let is_separator = |line: &Line| line.text.strip_prefix("Separator").and_then(|rest| rest.chars().next());
    let mut tags = Tags::default();
    loop {
        let Some(line) = lines.next()? else { return Err(no_end(at)) };
        if let Some(found) = is_separator(&line) {
            separator = found;
        }
        if !take(lines, line, separator, &mut tags, remarks)? {
            break;
        }
    }
    let decimal = tags.field("Decimal_Separator", 1).and_then(|f| f.chars().next()).unwrap_or('.');
    if !matches!(decimal, '.' | ',') {
        let problem = format!("Decimal_Separator is «{decimal}», «.» or «,» was wanted");
        return Err(fail::at(at, problem, fail::COPY_AGAIN));
    }
    let has_x = tags.field("X_Columns", 1) != Some("No");
    let version = tags.field("Writer_Version", 1).unwrap_or("unknown version").to_owned();
    Ok(FileHeader { separator, decimal, has_x, version, tags })
}

/// Reads a section's header, if the next line begins one.
pub(super) fn section_header(
    lines: &mut Lines,
    file: &FileHeader,
    remarks: &mut Vec<String>,
) -> Result<Tags, FormatError> {
    let mut tags = Tags::default();
    let at = lines.peek()?.map_or(0, |line| line.at);
    while let Some(line) = lines.next()? {
        if !take(lines, line, file.separator, &mut tags, remarks)? {
            return Ok(tags);
        }
    }
    Err(no_end(at))
}

/// Takes a header line. False at the header's end.
fn take(
    lines: &mut Lines,
    line: Line,
    separator: char,
    tags: &mut Tags,
    remarks: &mut Vec<String>,
) -> Result<bool, FormatError> {
    if line.text.starts_with(END) {
        return Ok(false);
    }
    if line.text.starts_with(SPECIAL) {
        remarks.push(format!("the special block in line {} is left out", line.number));
        while let Some(inside) = lines.next()? {
            if inside.text.starts_with(END_OF_SPECIAL) {
                return Ok(true);
            }
        }
        return Err(fail::at(line.at, format!("no {END_OF_SPECIAL} behind {SPECIAL}"), fail::COPY_AGAIN));
    }
    let fields: Vec<String> = line.text.split(separator).map(str::to_owned).collect();
    if let Some(tag) = fields.first().map(|t| t.trim().to_owned()).filter(|t| !t.is_empty()) {
        tags.0.insert(tag, fields);
    }
    Ok(true)
}

fn no_end(at: u64) -> FormatError {
    fail::at(at, format!("a header begins here that does not end, {END} was wanted"), fail::COPY_AGAIN)
}

/// A date `2016/08/23` and a time `10:45:47.035`: ISO 8601 (no zone: the file has none), whole seconds since 1970 and
/// the rest.
pub(super) fn moment(date: &str, time: &str) -> Option<(String, i64, f64)> {
    let mut parts = date.split(['/', '-', '.']).map(|p| p.parse::<i64>().ok());
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    let mut parts = time.split(':');
    let (hour, minute) = (parts.next()?.parse::<i64>().ok()?, parts.next()?.parse::<i64>().ok()?);
    let seconds = parts.next()?.replacen(',', ".", 1);
    let (whole, fraction) = seconds.split_once('.').unwrap_or((&seconds, ""));
    let second = whole.parse::<i64>().ok()?;
    let valid = (1..=9999).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    let valid = valid && (0..24).contains(&hour) && (0..60).contains(&minute) && (0..=60).contains(&second);
    if !valid || !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    // More digits than nanoseconds come from float64, not from a clock.
    let digits = fraction.get(..9).unwrap_or(fraction).trim_end_matches('0');
    let dot = if digits.is_empty() { "" } else { "." };
    let iso = format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}{dot}{digits}");
    let rest = format!("0.{fraction}").parse().unwrap_or(0.0);
    Some((iso, days_to(year, month, day) * 86_400 + hour * 3600 + minute * 60 + second, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_count_seconds() {
        // Python: calendar.timegm((2016, 8, 23, 10, 45, 47)) is 1471949147.
        let (iso, seconds, rest) = moment("2016/08/23", "10:45:47,0352557312499836422").unwrap();
        assert_eq!((iso.as_str(), seconds), ("2016-08-23T10:45:47.035255731", 1_471_949_147));
        assert_eq!(rest, 0.035_255_731_249_983_64);
        // timegm((2000, 2, 29, 0, 0, 0)) is 951782400.
        assert_eq!(moment("2000/02/29", "00:00:00").map(|m| m.1), Some(951_782_400));
        assert_eq!(moment("2016/13/01", "00:00:00"), None);
        assert_eq!(moment("today", "noon"), None);
    }
}
