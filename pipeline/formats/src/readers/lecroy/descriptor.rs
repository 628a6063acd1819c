//! The descriptor of a LeCroy waveform.

use crate::fields::Fields;
use crate::number::{Number, Order};
use crate::opened::Opened;
use crate::rate::{of_step, shortest};
use crate::text::brief;
use crate::{FormatError, fail};

/// What a descriptor begins with.
pub(super) const NAME: &[u8] = b"WAVEDESC";

/// Bytes that all templates of version 2 have.
const BYTES: u64 = 346;

const COMPLEX: u16 = 5;
const HISTOGRAM: u16 = 2;

/// What is used of it.
#[derive(Debug)]
pub(super) struct Descriptor {
    pub(super) template: String,
    pub(super) big_endian: bool,
    pub(super) number: Number,
    /// Byte of the first sample.
    pub(super) samples_from: u64,
    /// Bytes of the first array of samples, as stated.
    array_bytes: u64,
    other_array_bytes: u64,
    /// Number of samples, as stated; 0 if it is not.
    count: u64,
    segments: u64,
    /// Unit for one code.
    pub(super) gain: f64,
    pub(super) offset: f64,
    interval_s: f64,
    horizontal_unit: String,
    pub(super) unit: String,
    instrument: String,
    label: String,
    source: u16,
    record_type: u16,
    pub(super) started_at: String,
}

impl Descriptor {
    /// Reads the descriptor at byte `begin`. Errors: it is cut off; a layout that is not of version 2; no samples that
    /// are a signal's.
    pub(super) fn read(file: &Opened, begin: u64) -> Result<Self, FormatError> {
        let bytes = file.read("the descriptor", begin, BYTES)?;
        // The first word that tells the order is 1 or 0 itself: in the wrong order it is 256.
        let order =
            if (Fields { bytes: &bytes, order: Order::Little }).u16(34) == 1 { Order::Little } else { Order::Big };
        let fields = Fields { bytes: &bytes, order };
        let wrong = |at: u64, problem: String| Err(fail::at(begin + at, problem, fail::COPY_AGAIN));
        let template = fields.text(16, 16);
        if !template.starts_with("LECROY_2_") {
            let problem = format!(
                "not read: this waveform has the template «{}», wanted LECROY_2_3 or an earlier 2",
                brief(&template, 16)
            );
            let help = "save it again with newer software of the maker, as binary of template 2, or as text";
            return Err(fail::at(begin + 16, problem, help));
        }
        let byte_order = fields.u16(34);
        if byte_order != u16::from(order == Order::Little) {
            return wrong(34, format!("found the byte order {byte_order}, wanted 0 (big-endian) or 1 (little-endian)"));
        }
        let number = match fields.u16(32) {
            0 => Number::I8,
            1 => Number::I16,
            other => return wrong(32, format!("found samples of kind {other}, wanted 0 (bytes) or 1 (words)")),
        };
        let record_type = fields.u16(316);
        if matches!(record_type, COMPLEX | HISTOGRAM) {
            let what = if record_type == COMPLEX { "complex numbers" } else { "a histogram" };
            let problem = format!("found {what}, wanted samples of a signal");
            return Err(fail::at(begin + 316, problem, "save the trace of the channel itself"));
        }
        let mut samples_from = begin;
        // the blocks in front of the samples, in their order: descriptor, text, reserved, times of segments
        for at in [36, 40, 44, 48, 52, 56] {
            samples_from = samples_from.saturating_add(fields.size("a block", at)?);
        }
        if fields.size("a descriptor", 36)? < BYTES {
            return wrong(36, format!("found a descriptor of {} bytes, wanted {BYTES}", fields.u32(36)));
        }
        let (gain, offset) = (f64::from(fields.f32(156)), f64::from(fields.f32(160)));
        if !gain.is_finite() || gain == 0.0 || !offset.is_finite() {
            return wrong(
                156,
                format!("found the gain {gain} and the offset {offset}, wanted numbers, the first not 0"),
            );
        }
        Ok(Self {
            template,
            big_endian: order == Order::Big,
            number,
            samples_from,
            array_bytes: fields.size("an array of samples", 60)?,
            other_array_bytes: u64::from(fields.u32(64)),
            count: fields.size("a number of samples", 116)?,
            segments: fields.size("a number of segments", 144)?,
            gain,
            offset,
            interval_s: f64::from(fields.f32(176)),
            horizontal_unit: fields.text(244, 48),
            unit: fields.text(196, 48),
            instrument: fields.text(76, 16),
            label: fields.text(96, 16),
            source: fields.u16(344),
            record_type,
            started_at: moment(&fields),
        })
    }

    /// Number of samples. Errors: none are stated; the file ends before the last.
    pub(super) fn samples(&self, file: &Opened) -> Result<usize, FormatError> {
        let size = self.number.bytes();
        let end = self.samples_from.saturating_add(self.array_bytes);
        if end > file.bytes() {
            return Err(fail::truncated("samples", self.samples_from, self.array_bytes, file.bytes()));
        }
        let stated = self.count.saturating_mul(size);
        if stated > self.array_bytes || (self.number == Number::I8 && self.array_bytes == 2 * stated && stated > 0) {
            let problem = format!(
                "found {} samples of {size} bytes in an array of {} bytes, wanted as many as it holds",
                self.count, self.array_bytes
            );
            return Err(fail::at(self.samples_from.min(file.bytes()), problem, fail::COPY_AGAIN));
        }
        // The count leaves out what was sent to fill up a block.
        let samples = (self.array_bytes / size).min(if self.count == 0 { u64::MAX } else { self.count });
        let samples = usize::try_from(samples).unwrap_or(0);
        if samples == 0 {
            return Err(fail::at(
                self.samples_from.min(file.bytes()),
                "found no samples, wanted one",
                fail::COPY_AGAIN,
            ));
        }
        Ok(samples)
    }

    /// First samples of the segments of a sequence but the first.
    pub(super) fn segment_starts(&self, samples: usize) -> Vec<usize> {
        let segments = usize::try_from(self.segments).unwrap_or(0);
        if segments < 2 || !samples.is_multiple_of(segments) {
            return Vec::new();
        }
        let each = samples / segments;
        (1..segments).map(|segment| segment * each).collect()
    }

    pub(super) fn remarks(&self, gaps: usize, remarks: &mut Vec<String>) {
        if self.segments > 1 && gaps + 1 == self.segments as usize {
            remarks.push(format!("a sequence of {} segments: when each began is left out", self.segments));
        } else if self.segments > 1 {
            remarks
                .push(format!("{} segments are stated, which do not divide the samples: read as one", self.segments));
        }
        if self.other_array_bytes > 0 {
            remarks.push(format!("a second array of {} bytes is left out", self.other_array_bytes));
        }
        if !matches!(self.record_type, 0 | 7 | 8) {
            remarks.push(format!("the record is of type {} (0 is a single sweep)", self.record_type));
        }
    }

    /// Samples per second, if the axis is time.
    pub(super) fn rate_hz(&self, remarks: &mut Vec<String>) -> Option<f64> {
        let is_time = self.horizontal_unit.eq_ignore_ascii_case("s");
        if is_time && self.interval_s.is_finite() && self.interval_s > 0.0 {
            return Some(of_step(shortest(self.interval_s)));
        }
        let (step, unit) = (self.interval_s, brief(&self.horizontal_unit, 20));
        remarks.push(format!("no sample rate: the axis has steps of {step} «{unit}», wanted a step in s"));
        None
    }

    pub(super) fn location(&self) -> String {
        // 0 to 3 are the inputs; 9 says that the source is unknown
        if self.source < 9 { format!("/C{}", self.source + 1) } else { "/trace".to_owned() }
    }

    pub(super) fn long_name(&self) -> String {
        [self.label.as_str(), self.instrument.as_str()]
            .into_iter()
            .filter(|t| !t.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }
}

/// The time of the trigger as ISO 8601; empty if there is none.
fn moment(fields: &Fields) -> String {
    let (seconds, minute, hour) = (fields.f64(296), fields.u8(304), fields.u8(305));
    let (day, month, year) = (fields.u8(306), fields.u8(307), fields.u16(308));
    let valid = (1..=31).contains(&day) && (1..=12).contains(&month) && (1970..=9999).contains(&year);
    let valid = valid && hour < 24 && minute < 60 && (0.0..61.0).contains(&seconds);
    if !valid {
        return String::new();
    }
    let seconds = format!("{seconds:09.6}");
    format!(
        "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{}",
        seconds.trim_end_matches('0').trim_end_matches('.')
    )
}
