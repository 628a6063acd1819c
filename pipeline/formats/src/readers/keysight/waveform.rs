//! A waveform of a Keysight or Rigol file: its header and its buffers.

use crate::fields::Fields;
use crate::number::Order;
use crate::opened::Opened;
use crate::rate::{of_step, shortest};
use crate::text::brief;
use crate::{FormatError, fail};

/// Bytes of a header that are read: up to the segment's number.
const HEADER_BYTES: u64 = 140;
/// Headers are not longer than this.
const LONGEST_HEADER: u32 = 4096;
/// Peak detection has two buffers, logic waveforms have few.
const MOST_BUFFERS: u32 = 64;

const UNITS: [&str; 7] = ["", "V", "s", "", "A", "dB", "Hz"];
const SECOND: u32 = 2;

/// A waveform.
#[derive(Debug)]
pub(super) struct Waveform {
    pub(super) kind: u32,
    /// Points of each buffer; 0 if it is not stated.
    pub(super) points: u32,
    pub(super) label: String,
    pub(super) frame: String,
    pub(super) unit: &'static str,
    pub(super) rate_hz: Option<f64>,
    /// From sample to sample along the axis, in its unit.
    pub(super) step: f64,
    pub(super) started_at: Option<String>,
    /// 0 if it is no segment.
    pub(super) segment: u32,
    pub(super) buffers: Vec<Buffer>,
    /// Byte behind it.
    pub(super) end: u64,
}

/// A buffer of samples that lies within the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Buffer {
    pub(super) kind: u16,
    pub(super) bytes_per_point: u16,
    pub(super) from: u64,
    pub(super) bytes: u64,
}

/// Whether a waveform's header may have this size.
pub(super) fn is_header_size(bytes: u32) -> bool {
    (HEADER_BYTES as u32..=LONGEST_HEADER).contains(&bytes)
}

impl Waveform {
    /// Reads the headers of the waveform at byte `at`. Errors: the file ends within it; sizes that cannot be.
    pub(super) fn read(file: &Opened, at: u64, wide: bool) -> Result<Self, FormatError> {
        let bytes = file.read("the header of a waveform", at, HEADER_BYTES)?;
        let fields = Fields { bytes: &bytes, order: Order::Little };
        let size = fields.u32(0);
        if !is_header_size(size) {
            let problem =
                format!("found a waveform's header of {size} bytes, wanted {HEADER_BYTES} to {LONGEST_HEADER}");
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
        let count = fields.u32(8);
        if count > MOST_BUFFERS {
            let problem = format!("found {count} buffers in a waveform, wanted at most {MOST_BUFFERS}");
            return Err(fail::at(at + 8, problem, fail::COPY_AGAIN));
        }
        let mut end = at + u64::from(size);
        let mut buffers = Vec::new();
        for _ in 0..count {
            let (buffer, behind) = buffer(file, end, wide)?;
            buffers.push(buffer);
            end = behind;
        }
        let step = fields.f64(32);
        let in_seconds = fields.u32(48) == SECOND && step.is_finite() && step > 0.0;
        let unit = UNITS.get(fields.u32(52) as usize).copied().unwrap_or_default();
        Ok(Self {
            kind: fields.u32(4),
            points: fields.u32(12),
            label: fields.text(112, 16),
            frame: fields.text(88, 24),
            unit,
            rate_hz: in_seconds.then(|| of_step(shortest(step))),
            step,
            started_at: moment(&fields.text(56, 16), &fields.text(72, 16)),
            segment: fields.u32(136),
            buffers,
            end,
        })
    }

    /// What it is, for people.
    pub(super) fn long_name(&self) -> String {
        let kind = match self.kind {
            2 => "peak detect",
            3 => "average",
            6 => "logic",
            _ => "",
        };
        [kind, &brief(&self.frame, 24)].into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join(", ")
    }
}

/// The buffer whose header is at byte `at`, and the byte behind it.
fn buffer(file: &Opened, at: u64, wide: bool) -> Result<(Buffer, u64), FormatError> {
    let least = if wide { 16 } else { 12 };
    let bytes = file.read("the header of a buffer", at, least)?;
    let fields = Fields { bytes: &bytes, order: Order::Little };
    let size = fields.u32(0);
    if !(least as u32..=LONGEST_HEADER).contains(&size) {
        let problem = format!("found a buffer's header of {size} bytes, wanted {least} to {LONGEST_HEADER}");
        return Err(fail::at(at, problem, fail::COPY_AGAIN));
    }
    let from = at + u64::from(size);
    let bytes = if wide { fields.u64(8) } else { u64::from(fields.u32(8)) };
    let end = from.checked_add(bytes).filter(|end| *end <= file.bytes());
    let end = end.ok_or_else(|| fail::truncated("samples", from, bytes, file.bytes()))?;
    Ok((Buffer { kind: fields.u16(4), bytes_per_point: fields.u16(6), from, bytes }, end))
}

/// `2020-11-22` or `22 NOV 2020`, and `19:02:34`, as ISO 8601.
fn moment(date: &str, time: &str) -> Option<String> {
    const MONTHS: [&str; 12] = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];
    let parts: Vec<&str> = date.split(['-', ' ', '/']).filter(|part| !part.is_empty()).collect();
    let &[first, second, third] = parts.as_slice() else { return None };
    let month = MONTHS.iter().position(|month| second.eq_ignore_ascii_case(month)).map(|number| number as u32 + 1);
    let (year, month, day) = match month {
        Some(month) => (third.parse().ok()?, month, first.parse().ok()?),
        None => (first.parse().ok()?, second.parse().ok()?, third.parse().ok()?),
    };
    let mut clock = time.split(':').map(|part| part.parse::<u32>().ok());
    let (hour, minute, seconds) = (clock.next()??, clock.next()??, clock.next().flatten().unwrap_or(0));
    let date: (u32, u32, u32) = (year, month, day);
    let valid = (1970..=9999).contains(&date.0) && (1..=12).contains(&date.1) && (1..=31).contains(&date.2);
    (valid && hour < 24 && minute < 60 && seconds < 61)
        .then(|| format!("{:04}-{:02}-{:02}T{hour:02}:{minute:02}:{seconds:02}", date.0, date.1, date.2))
}

#[cfg(test)]
mod tests {
    use super::moment;

    #[test]
    fn dates_of_both_makers_become_iso_8601() {
        assert_eq!(moment("2025-8-26", "8:49:9").as_deref(), Some("2025-08-26T08:49:09"));
        assert_eq!(moment("22 NOV 2020", "19:02:34").as_deref(), Some("2020-11-22T19:02:34"));
        for (date, time) in [("", ""), ("2020-13-01", "1:1:1"), ("2020-01-01", "25:00:00")] {
            assert_eq!(moment(date, time), None);
        }
    }
}
