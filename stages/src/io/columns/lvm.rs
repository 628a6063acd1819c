//! The header of LabVIEW measurement files.

use super::table::ColumnError;
use super::text::Separator;

/// What the header of an LVM file says.
pub(super) struct LvmHeader {
    /// Lines up to the last mark of its end.
    pub lines: usize,
    pub separator: Separator,
    /// `Delta_X`, where it is one for all columns that hold samples, and X is time.
    pub interval_s: Option<f64>,
}

const FIRST: &str = "LabVIEW Measurement";
const END: &str = "***End_of_Header***";

impl LvmHeader {
    /// The header, if the file has one. Errors: it does not end.
    pub fn find(lines: &[(usize, &str)]) -> Result<Option<Self>, ColumnError> {
        if !lines.first().is_some_and(|(_, line)| line.starts_with(FIRST)) {
            return Ok(None);
        }
        let mut marks = lines.iter().enumerate().filter(|(_, (_, line))| line.trim().starts_with(END)).map(|(i, _)| i);
        let first = marks.next().ok_or(ColumnError::EndlessHeader)?;
        // the head of the file, then that of the first segment; a later one stands among numbers and is an error there
        let end = marks.next().filter(|second| !holds_numbers(&lines[first + 1..*second])).unwrap_or(first);
        let head = &lines[..=end];
        let entry = |name: &str| {
            head.iter().find_map(|(_, line)| {
                let mut entries = line.split(['\t', ',']).map(str::trim);
                (entries.next() == Some(name)).then(|| line[name.len()..].trim_matches(['\t', ' ', '\r']).to_owned())
            })
        };
        let separator = if entry("Separator").as_deref() == Some("Comma") { Separator::Comma } else { Separator::Tab };
        let interval_s = entry("Delta_X").and_then(|text| common_interval(&text, entry("Samples").as_deref()));
        Ok(Some(Self { lines: end + 1, separator, interval_s }))
    }
}

fn holds_numbers(lines: &[(usize, &str)]) -> bool {
    lines.iter().any(|(_, line)| {
        let mut entries = line.split_whitespace();
        entries.next().is_some_and(|first| first.replace(',', ".").parse::<f64>().is_ok())
    })
}

/// The one interval of all channels that hold samples.
fn common_interval(text: &str, samples: Option<&str>) -> Option<f64> {
    let numbers = |text: &str| -> Vec<f64> {
        text.split('\t')
            .filter(|entry| !entry.trim().is_empty())
            .filter_map(|entry| entry.trim().replace(',', ".").parse().ok())
            .collect()
    };
    let intervals = numbers(text);
    let samples = samples.map(numbers).unwrap_or_default();
    let mut used =
        intervals.iter().enumerate().filter(|(i, _)| samples.get(*i).is_none_or(|count| *count > 0.0)).map(|(_, x)| *x);
    let first = used.next()?;
    (first > 0.0 && used.all(|other| other == first)).then_some(first)
}
