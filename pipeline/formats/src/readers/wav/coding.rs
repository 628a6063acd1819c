//! How the samples of a WAV file are coded: its chunk `fmt `.

use super::chunks::Chunks;
use crate::fields::Fields;
use crate::number::{Number, Order};
use crate::{FormatError, fail};

/// Tag of the extensible form: a GUID says the coding.
const EXTENSIBLE: u16 = 0xFFFE;
const PULSE_CODE: u16 = 1;
const FLOAT: u16 = 3;

/// The part of the GUIDs behind the tag, which is their first word.
const GUID_REST: [u8; 14] = [0, 0, 0, 0, 0x10, 0, 0x80, 0, 0, 0xAA, 0, 0x38, 0x9B, 0x71];

/// More channels are no recording.
const MOST_CHANNELS: u16 = 4096;

/// How samples are coded.
#[derive(Debug)]
pub(super) struct Coding {
    pub(super) number: Number,
    pub(super) channels: u16,
    /// 0 if it is not stated.
    pub(super) rate_hz: u32,
    /// 0 if it is not stated.
    byte_rate: u32,
    /// Bytes from a sample to the next one of its channel.
    pub(super) frame_bytes: u64,
    /// Bits of the container of a sample.
    pub(super) bits: u16,
    /// Bits of it that are in use, as stated by the extensible form; else all.
    pub(super) valid_bits: u16,
    /// 1 is full scale.
    pub(super) scale_factor: f64,
    pub(super) add_offset: f64,
}

impl Coding {
    /// Errors: compressed samples; a description that contradicts itself.
    pub(super) fn of(chunks: &Chunks) -> Result<Self, FormatError> {
        let order = if chunks.big_endian { Order::Big } else { Order::Little };
        let fields = Fields { bytes: &chunks.format, order };
        let wrong = |problem: String| Err(fail::at(chunks.format_from, problem, fail::COPY_AGAIN));
        if chunks.format.len() < 16 {
            return wrong(format!("found a description of {} bytes, wanted 16 and more", chunks.format.len()));
        }
        let (tag, channels, rate_hz) = (fields.u16(0), fields.u16(2), fields.u32(4));
        let (frame_bytes, bits) = (u64::from(fields.u16(12)), fields.u16(14));
        let stated = if tag == EXTENSIBLE && chunks.format.len() >= 20 { fields.u16(18) } else { 0 };
        let valid_bits = if stated == 0 { bits } else { stated };
        let tag = if tag == EXTENSIBLE { inner_tag(&chunks.format, &fields).unwrap_or(tag) } else { tag };
        let Some(number) = number(tag, bits) else {
            let problem = format!("found samples of {bits} bits, {}; wanted plain integers or floats", name_of(tag));
            return Err(fail::at(chunks.format_from, problem, "save it as 16, 24 or 32 bits without compression"));
        };
        if !(1..=MOST_CHANNELS).contains(&channels) {
            return wrong(format!("found {channels} channels, wanted 1 to {MOST_CHANNELS}"));
        }
        let wanted = u64::from(channels) * number.bytes();
        if frame_bytes != wanted {
            let samples = format!("{channels} samples of {} bytes", number.bytes());
            return wrong(format!("found frames of {frame_bytes} bytes, wanted {wanted}: {samples}"));
        }
        if valid_bits > bits {
            return wrong(format!("found {valid_bits} valid bits in samples of {bits}, wanted at most as many"));
        }
        let mut coding = Self {
            number,
            channels,
            rate_hz,
            byte_rate: fields.u32(8),
            frame_bytes,
            bits,
            valid_bits,
            scale_factor: 1.0,
            add_offset: 0.0,
        };
        coding.scale_to(bits);
        Ok(coding)
    }

    /// Samples per second; none, with a remark, if they are not stated or bytes per second state others.
    pub(super) fn sample_rate_hz(&self, remarks: &mut Vec<String>) -> Option<f64> {
        if self.rate_hz == 0 {
            remarks.push("no sample rate: the header says 0, wanted a number above 0".to_owned());
            return None;
        }
        let wanted = u64::from(self.rate_hz) * self.frame_bytes;
        if self.byte_rate != 0 && wanted != u64::from(self.byte_rate) {
            remarks.push(format!(
                "no sample rate: the header says {} frames of {} bytes and {} bytes per second, wanted {wanted}",
                self.rate_hz, self.frame_bytes, self.byte_rate
            ));
            return None;
        }
        Some(f64::from(self.rate_hz))
    }

    /// Takes the full scale of so many bits for 1.
    pub(super) fn scale_to(&mut self, bits: u16) {
        let full_scale = 2_f64.powi(i32::from(bits) - 1);
        (self.scale_factor, self.add_offset) = match self.number {
            Number::F32 | Number::F64 => (1.0, 0.0),
            Number::U8 => (1.0 / 128.0, -1.0),
            _ => (full_scale.recip(), 0.0),
        };
    }
}

/// The tag in the GUID of the extensible form.
fn inner_tag(format: &[u8], fields: &Fields) -> Option<u16> {
    (format.get(26..40)? == GUID_REST.as_slice()).then(|| fields.u16(24))
}

fn number(tag: u16, bits: u16) -> Option<Number> {
    Some(match (tag, bits) {
        (PULSE_CODE, 8) => Number::U8,
        (PULSE_CODE, 16) => Number::I16,
        (PULSE_CODE, 24) => Number::I24,
        (PULSE_CODE, 32) => Number::I32,
        (PULSE_CODE, 64) => Number::I64,
        (FLOAT, 32) => Number::F32,
        (FLOAT, 64) => Number::F64,
        _ => return None,
    })
}

fn name_of(tag: u16) -> String {
    let name = match tag {
        PULSE_CODE => "pulse code modulation",
        FLOAT => "floats",
        2 => "Microsoft ADPCM",
        6 => "A-law",
        7 => "mu-law",
        0x11 => "IMA ADPCM",
        0x55 => "MPEG layer 3",
        EXTENSIBLE => "a coding by a GUID that is not known",
        _ => return format!("coded by the unknown format tag {tag}"),
    };
    name.to_owned()
}
