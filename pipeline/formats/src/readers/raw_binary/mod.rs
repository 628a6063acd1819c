//! Files of samples without any header that says what they are.
//!
//! Source: none, there is no format: the user says what the file is. Nothing is recognised by looking.
//!
//! Interleaved channels lie as rows: one sample of each, then the next of each. Else the channels lie one behind the
//! other, each as long as the others. Locations are `/channel[0]`, `/channel[1]`, ...
//!
//! An incomplete last row of interleaved channels (or last sample of a single one) is left out with a remark, because a
//! recording that was interrupted ends like this. For channels one behind the other it is an error: where each of them
//! begins follows from the file's size, so nothing would be right.
//!
//! Nor do they state a rate or a unit: both are left open.
//!
//! The wrong byte order is found by looking at the samples, see [`RawBinary::open`].

mod order;
mod roughness;

use crate::fail;
use crate::grid::{Grid, Store};
use crate::number::Number;
use crate::pinned::Pinned;
use crate::{Contents, FormatError, FoundChannel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// Descriptions of more take more memory than any recorder's channels are worth; a mistyped number is likelier.
const MOST_CHANNELS: usize = 4096;

/// Type of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SampleType {
    /// Signed bytes.
    #[serde(rename = "int8")]
    I8,
    /// Unsigned bytes.
    #[serde(rename = "uint8")]
    U8,
    /// Signed 16-bit integers.
    #[serde(rename = "int16")]
    I16,
    /// Unsigned 16-bit integers.
    #[serde(rename = "uint16")]
    U16,
    /// Signed 32-bit integers.
    #[serde(rename = "int32")]
    I32,
    /// Unsigned 32-bit integers.
    #[serde(rename = "uint32")]
    U32,
    /// IEEE single precision.
    #[serde(rename = "float32")]
    F32,
    /// IEEE double precision.
    #[serde(rename = "float64")]
    F64,
}

/// What the user says about a file without a header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawBinary {
    /// Type of the samples. Default: int16.
    pub sample: SampleType,
    /// Whether the byte of the highest value comes first. Default: false; the wrong order is noticed in smooth signals.
    pub big_endian: bool,
    /// Bytes before the first sample. Default: 0.
    pub header_bytes: u64,
    /// Number of channels, 1 to 4096. Default: 1.
    pub channels: usize,
    /// Whether the file holds a sample of each channel, then the next of each (else one channel behind the other).
    /// Default: true.
    pub interleaved: bool,
    /// value = stored * scale_factor + add_offset; finite and not 0. Default: 1.
    pub scale_factor: f64,
    /// See `scale_factor`; finite. Default: 0.
    pub add_offset: f64,
}

impl Default for RawBinary {
    fn default() -> Self {
        Self {
            sample: SampleType::I16,
            big_endian: false,
            header_bytes: 0,
            channels: 1,
            interleaved: true,
            scale_factor: 1.0,
            add_offset: 0.0,
        }
    }
}

impl RawBinary {
    /// Opens a file and checks that it can be what was said: that it has samples, and that they are not much smoother
    /// in the other byte order. White noise, which is equally rough in both, and channels of a constant are given the
    /// benefit of the doubt. Errors: a value out of its range; no such file; no whole row of samples; the other byte
    /// order is the right one.
    pub fn open(&self, path: &Path) -> Result<Contents, FormatError> {
        self.check()?;
        let (pinned, _) = Pinned::open(path)?;
        let mut remarks = Vec::new();
        let grids = self.grids(&pinned, &mut remarks)?;
        order::check(&grids)?;
        let channels = grids.into_iter().enumerate().map(|(number, grid)| self.channel(number, grid)).collect();
        let order = if self.big_endian { "big" } else { "little" };
        let format = format!("raw binary, {}, {order}-endian", self.number().name());
        Ok(Contents { format, started_at: String::new(), channels, responses: Vec::new(), remarks })
    }

    /// The values alone, before any file is opened. Errors: one is out of its range.
    pub fn check(&self) -> Result<(), FormatError> {
        let wrong = |problem: String| Err(fail::plain(problem, "correct it in the description of the file"));
        if !(1..=MOST_CHANNELS).contains(&self.channels) {
            return wrong(format!("channels is {}, 1 to {MOST_CHANNELS} were wanted", self.channels));
        }
        if !self.scale_factor.is_finite() || self.scale_factor == 0.0 {
            return wrong(format!("scale_factor is {}, a number other than 0 was wanted", self.scale_factor));
        }
        if !self.add_offset.is_finite() {
            return wrong(format!("add_offset is {}, a number was wanted", self.add_offset));
        }
        Ok(())
    }

    fn number(&self) -> Number {
        match self.sample {
            SampleType::I8 => Number::I8,
            SampleType::U8 => Number::U8,
            SampleType::I16 => Number::I16,
            SampleType::U16 => Number::U16,
            SampleType::I32 => Number::I32,
            SampleType::U32 => Number::U32,
            SampleType::F32 => Number::F32,
            SampleType::F64 => Number::F64,
        }
    }

    /// Where each channel's samples are.
    fn grids(&self, file: &Pinned, remarks: &mut Vec<String>) -> Result<Vec<Grid>, FormatError> {
        let size = self.number().bytes();
        let row = size * self.channels as u64;
        let data = file.bytes().saturating_sub(self.header_bytes);
        let (rows, rest) = (data / row, data % row);
        if rows == 0 {
            let problem = format!(
                "{data} bytes behind a header of {}, at least {row} were wanted: {} samples of {size} bytes",
                self.header_bytes, self.channels
            );
            return Err(fail::at(self.header_bytes.min(file.bytes()), problem, CORRECT));
        }
        if rest > 0 {
            let samples = format!("{data} bytes of data are {rows} rows of {row} bytes and {rest} bytes");
            if !self.interleaved && self.channels > 1 {
                let problem =
                    format!("{samples}, a whole number of rows was wanted: each channel begins where it says");
                return Err(fail::at(file.bytes() - rest, problem, CORRECT));
            }
            // A recorder stops between samples, unless its disk is full.
            let doubt = if rest % size == 0 { "" } else { "; not even a whole number of samples: " };
            let help = if rest % size == 0 { "" } else { CORRECT };
            remarks.push(format!("{samples}: the incomplete last row is left out{doubt}{help}"));
        }
        let samples = usize::try_from(rows)
            .map_err(|_| fail::plain(format!("{rows} rows are more than this machine can count"), ""))?;
        let (step, distance) = if self.interleaved { (row, size) } else { (size, rows * size) };
        let grid = |channel| Grid {
            store: Store::File(file.clone()),
            first: self.header_bytes + channel * distance,
            step,
            samples,
            number: self.number(),
            big_endian: self.big_endian,
        };
        Ok((0..self.channels as u64).map(grid).collect())
    }

    fn channel(&self, number: usize, grid: Grid) -> FoundChannel {
        let (samples, stored_as) = (grid.samples, grid.number.name());
        FoundChannel {
            long_name: format!("channel {number} of {}", self.channels),
            scale_factor: self.scale_factor,
            add_offset: self.add_offset,
            ..FoundChannel::new(format!("/channel[{number}]"), samples, stored_as, Arc::new(grid))
        }
    }
}

const CORRECT: &str = "check header_bytes, sample and channels";
