//! Waveform audio (WAV): what sound cards, portable recorders and many vibration loggers write.
//!
//! - RIFF, RIFX (big-endian), RF64 and BW64 (sizes of 64 bits in the chunk `ds64`).
//! - Pulse code modulation of 8 to 64 bits and IEEE float of 32 and 64 bits, said by the format tag or, in the
//!   extensible form, by its GUID. Compressed samples are refused.
//! - A channel per track: `/channel[0]`, `/channel[1]`, ...
//! - Integers are scaled so that full scale is 1 (8-bit ones are unsigned, 128 is zero); the file states no unit.
//! - Samples of 24 bits at the lower end of words of 32 are recognised (`alignment`), and said.
//! - The data may end early: a recorder that lost its power did not write the chunk's size, or wrote more than there is.
//!   What is there is read, up to the last whole frame.
//!
//! The crate `hound` is not used: it decodes one sample after the other from a reader that it owns, so that each stretch
//! would be read from the file's beginning, and it refuses RIFX, RF64, float64 and files that end early. A test compares
//! with it.
//!
//! Source: Microsoft and IBM, "Multimedia Programming Interface and Data Specifications 1.0" (RIFF); Microsoft,
//! "Multiple Channel Audio Data and WAVE Files" (WAVE_FORMAT_EXTENSIBLE); EBU Tech 3306 (RF64).

mod alignment;
mod chunks;
mod coding;

use std::path::Path;
use std::sync::Arc;

use crate::grid::{Grid, Store};
use crate::opened::Opened;
use crate::{Contents, Format, FormatError, FoundChannel, Row, fail};
use chunks::Chunks;
use coding::Coding;

/// WAV files.
#[derive(Debug, Clone, Copy)]
pub struct Wav;

impl Format for Wav {
    const ROW: Row = Row {
        name: "wav",
        title: "Waveform audio",
        reads: "RIFF, RIFX, RF64, BW64; 8 to 64-bit integers as fractions of full scale, float32, float64, the \
                extensible form; 24 bits at either end of 32; files that end early",
        leaves_out: "compressed samples (A-law, ADPCM, MPEG)",
        described_by: "Microsoft and IBM, \"Multimedia Programming Interface and Data Specifications 1.0\"; EBU \
                       Tech 3306",
        clock: "samples per second",
        unit: "",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        chunks::kind_of(head).is_some()
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let mut remarks = Vec::new();
        let chunks = Chunks::read(&file, &mut remarks)?;
        let mut coding = Coding::of(&chunks)?;
        let frames = chunks.data_bytes / coding.frame_bytes;
        let rest = chunks.data_bytes % coding.frame_bytes;
        if rest > 0 {
            remarks.push(format!("the last {rest} bytes are no whole frame of {} bytes: left out", coding.frame_bytes));
        }
        let samples = usize::try_from(frames).unwrap_or(0);
        if samples == 0 {
            let problem =
                format!("found {} bytes of data, wanted a frame of {}", chunks.data_bytes, coding.frame_bytes);
            return Err(fail::at(chunks.data_from, problem, fail::COPY_AGAIN));
        }
        let beside = Grid {
            store: Store::File(file.pinned().clone()),
            first: chunks.data_from,
            step: coding.number.bytes(),
            samples: samples.saturating_mul(usize::from(coding.channels)),
            number: coding.number,
            big_endian: chunks.big_endian,
        };
        let bits = alignment::full_scale_bits(&coding, &beside, &mut remarks)?;
        coding.scale_to(bits);
        if !coding.number.is_float() {
            remarks.push("the samples are fractions of full scale: the file states no unit".to_owned());
        }
        let sample_rate_hz = coding.sample_rate_hz(&mut remarks);
        let channel = |number: u64| {
            let grid = Grid {
                store: Store::File(file.pinned().clone()),
                first: chunks.data_from + number * coding.number.bytes(),
                step: coding.frame_bytes,
                samples,
                number: coding.number,
                big_endian: chunks.big_endian,
            };
            FoundChannel {
                long_name: format!("channel {number} of {}", coding.channels),
                sample_rate_hz,
                scale_factor: coding.scale_factor,
                add_offset: coding.add_offset,
                ..FoundChannel::new(format!("/channel[{number}]"), samples, coding.number.name(), Arc::new(grid))
            }
        };
        let channels = (0..u64::from(coding.channels)).map(channel).collect();
        let order = if chunks.big_endian { ", big-endian" } else { "" };
        let format = format!("WAV ({}), {}{order}", chunks.kind, coding.number.name());
        Ok(Contents { format, started_at: String::new(), channels, responses: Vec::new(), remarks })
    }
}
