//! The text header: sections of `\key: value` lines.

use crate::FormatError;

use crate::fail;
use crate::opened::Opened;
use crate::text;

/// Headers of real files have 20 to 80 kB; a file whose header does not end within this is something else.
const MOST_BYTES: u64 = 1 << 22;

const END: &[u8] = b"\\*File list end";

/// A section of the header.
#[derive(Debug)]
pub(super) struct Section {
    /// Its name without `\*`.
    pub(super) name: String,
    /// Byte in the file of its name.
    pub(super) at: u64,
    lines: Vec<(String, String)>,
}

/// The header.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) sections: Vec<Section>,
    /// Byte behind the header's last line.
    pub(super) end: u64,
}

/// Major versions whose headers are known: the first with CIAO parameters, and the last that was looked at.
const MAJOR_VERSIONS: std::ops::RangeInclusive<u32> = 4..=10;

/// Whether these are a header's first bytes.
pub(super) fn is_header(head: &[u8]) -> bool {
    head.starts_with(b"\\*File list") || head.starts_with(b"\\*Force file list")
}

impl Section {
    /// The value of a key in any case; `@` parameters are asked for without `@` and group number (`Z scale`).
    pub(super) fn value(&self, key: &str) -> Option<&str> {
        self.lines.iter().find(|(k, _)| k.eq_ignore_ascii_case(key)).map(|(_, v)| v.as_str())
    }

    /// The same as a number.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        text::number(self.value(key)?.split_whitespace().next()?)
    }

    /// The same as a count.
    pub(super) fn integer(&self, key: &str) -> Option<u64> {
        self.value(key)?.split_whitespace().next()?.parse().ok()
    }
}

impl Header {
    /// Reads no more than the header. Errors: it does not begin or end like one.
    pub(super) fn read(file: &Opened) -> Result<Self, FormatError> {
        let mut wanted = 1 << 16;
        loop {
            let bytes = file.head(wanted)?;
            if !is_header(&bytes) {
                return Err(no_header(&bytes));
            }
            if let Some(end) = bytes.windows(END.len()).position(|w| w.eq_ignore_ascii_case(END)) {
                let sections = sections(bytes.get(..end).unwrap_or_default());
                return Ok(Self { sections, end: (end + END.len()) as u64 });
            }
            if wanted >= file.bytes().min(MOST_BYTES) {
                return Err(fail::at(
                    bytes.len() as u64,
                    "found no `\\*File list end` after the header's lines",
                    "the file is cut off or damaged: copy it again from the instrument",
                ));
            }
            wanted *= 4;
        }
    }

    /// All sections of a name.
    pub(super) fn all(&self, name: &str) -> Vec<&Section> {
        self.sections.iter().filter(|s| s.name.eq_ignore_ascii_case(name)).collect()
    }

    /// The first section of a name.
    pub(super) fn section(&self, name: &str) -> Option<&Section> {
        self.sections.iter().find(|s| s.name.eq_ignore_ascii_case(name))
    }

    /// The first value of a key in any section.
    pub(super) fn anywhere(&self, key: &str) -> Option<&str> {
        self.sections.iter().find_map(|s| s.value(key))
    }

    /// Errors: a version whose headers are not known.
    pub(super) fn check_version(&self) -> Result<(), FormatError> {
        let stated = self.anywhere("Version").and_then(|version| version.strip_prefix("0x"));
        let major = stated.and_then(|digits| digits.get(..2)).and_then(|major| major.parse::<u32>().ok());
        if major.is_none_or(|major| MAJOR_VERSIONS.contains(&major)) {
            return Ok(());
        }
        let (first, last) = (MAJOR_VERSIONS.start(), MAJOR_VERSIONS.end());
        let problem =
            format!("not read: this file is of Nanoscope version {}, wanted {first} to {last}", self.version());
        Err(fail::at(0, problem, "convert or export it with the Nanoscope software"))
    }

    /// `8.15 (0x08150308)`: two decimal digits of the major and two of the minor version.
    pub(super) fn version(&self) -> String {
        let stated = self.anywhere("Version").unwrap_or("of unknown version");
        let digits = stated.strip_prefix("0x").and_then(|hex| Some((hex.get(..2)?, hex.get(2..4)?)));
        match digits {
            Some((major, minor)) => format!("{}.{minor} ({})", major.trim_start_matches('0'), text::brief(stated, 20)),
            None => text::brief(stated, 20),
        }
    }

    /// `03:04:58 PM Thu May 17 2018` as ISO 8601; empty, with a remark, if it is written otherwise.
    pub(super) fn date(&self, remarks: &mut Vec<String>) -> String {
        let Some(stated) = self.anywhere("Date") else { return String::new() };
        iso(stated).unwrap_or_else(|| {
            remarks.push(format!(
                "the date `{}` is none of the form `03:04:58 PM Thu May 17 2018`",
                text::brief(stated, 60)
            ));
            String::new()
        })
    }
}

fn iso(stated: &str) -> Option<String> {
    const MONTHS: [&str; 12] = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
    let words: Vec<&str> = stated.split_whitespace().collect();
    let [clock, half, _, month, day, year] = words.as_slice() else { return None };
    let clock: Vec<u32> = clock.split(':').map(|n| n.parse().ok()).collect::<Option<_>>()?;
    let [hour, minute, second] = clock.as_slice() else { return None };
    let afternoon = match *half {
        "AM" => 0,
        "PM" => 12,
        _ => return None,
    };
    let month = MONTHS.iter().position(|m| m.eq_ignore_ascii_case(month))? + 1;
    let (day, year): (u32, u32) = (day.parse().ok()?, year.parse().ok()?);
    let sound = *hour <= 12 && *minute < 60 && *second < 62 && (1..=31).contains(&day) && year < 10_000;
    sound.then(|| format!("{year:04}-{month:02}-{day:02}T{:02}:{minute:02}:{second:02}", hour % 12 + afternoon))
}

/// The lines, sorted into sections. Lines that are neither are continuations of free texts and of no use here.
fn sections(bytes: &[u8]) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    let mut at = 0;
    for line in bytes.split(|&b| b == b'\n') {
        let here = at;
        at += line.len() as u64 + 1;
        let Some(line) = line.trim_ascii().strip_prefix(b"\\") else { continue };
        let line = text::decode(line);
        if let Some(name) = line.strip_prefix('*') {
            sections.push(Section { name: name.trim().to_owned(), at: here, lines: Vec::new() });
        } else if let (Some(section), Some(pair)) = (sections.last_mut(), key_and_value(&line)) {
            section.lines.push(pair);
        }
    }
    sections
}

/// `@4:Z scale: V ...` gives `Z scale` and `V ...`: the number is that of a group, which the manual says to ignore.
fn key_and_value(line: &str) -> Option<(String, String)> {
    let line = match line.strip_prefix('@') {
        Some(ciao) => match ciao.split_once(':') {
            Some((group, rest)) if group.bytes().all(|b| b.is_ascii_digit()) => rest,
            _ => ciao,
        },
        None => line,
    };
    let (key, value) = line.split_once(':')?;
    Some((key.trim().to_owned(), value.trim().to_owned()))
}

fn no_header(bytes: &[u8]) -> FormatError {
    let found = text::brief(&text::decode(bytes.get(..bytes.len().min(24)).unwrap_or_default()), 24);
    fail::at(
        0,
        format!("found `{found}`, wanted `\\*File list` or `\\*Force file list`"),
        "name a file of Nanoscope version 4.3 or later; convert older ones with the Nanoscope software",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_read_as_twelve_hour_clocks() {
        assert_eq!(iso("03:04:58 PM Thu May 17 2018").as_deref(), Some("2018-05-17T15:04:58"));
        assert_eq!(iso("12:00:01 AM Wed Dec 20 2017").as_deref(), Some("2017-12-20T00:00:01"));
        assert_eq!(iso("12:00:01 PM Wed Dec 20 2017").as_deref(), Some("2017-12-20T12:00:01"));
        assert_eq!(iso("25:00:01 PM Wed Dec 20 2017"), None);
        assert_eq!(iso("yesterday"), None);
    }

    #[test]
    fn group_numbers_are_left_out_of_keys() {
        let pair = |k: &str, v: &str| Some((k.to_owned(), v.to_owned()));
        assert_eq!(key_and_value("@4:Z scale: V 1"), pair("Z scale", "V 1"));
        assert_eq!(key_and_value("@Sens. Zsens: V 2 nm/V"), pair("Sens. Zsens", "V 2 nm/V"));
        assert_eq!(key_and_value("Capture mode : Single"), pair("Capture mode", "Single"));
        assert_eq!(key_and_value("no colon"), None);
    }
}
