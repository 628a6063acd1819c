//! Binary waveforms of Keysight and Agilent oscilloscopes (`AG`) and of Rigol's (`RG`): `.bin`.
//!
//! - A header of the file; then for each waveform a header and one buffer or more, each with a header of its own. Sizes
//!   have 32 bits; from Rigol's version 03 on those of the file and of buffers have 64. Sizes of headers are those that
//!   they state.
//! - Buffers of float32 are values in the waveform's unit; of logic waveforms they are bytes, one bit a line.
//! - A channel per waveform, named after its label: `/CH1`, or `/waveform` without one. Peak detection has two buffers:
//!   `/CH1/maximum` and `/CH1/minimum`. Segments of one label are one channel with a gap in front of each.
//! - The rate is 1 / X increment if the unit of x is the second.
//! - Histograms, counts and lists of times are left out.
//!
//! Source: Agilent, "InfiniiVision 3000 X-Series Oscilloscopes User's Guide", "Binary Data (.bin) Format"; Rigol,
//! "MSO5000 User Guide", which takes it over. That version 03 has sizes of 64 bits was found by looking at files of
//! DHO800 oscilloscopes.

mod channels;
mod waveform;

use std::path::Path;

use crate::fields::Fields;
use crate::number::Order;
use crate::opened::Opened;
use crate::{Contents, Format, FormatError, Row, fail};
use waveform::Waveform;

/// Keysight, Agilent and Rigol binary waveforms.
#[derive(Debug, Clone, Copy)]
pub struct Keysight;

/// More waveforms than this are no recording.
const MOST_WAVEFORMS: u32 = 1 << 16;

impl Format for Keysight {
    const ROW: Row = Row {
        name: "keysight",
        title: "Keysight or Rigol binary waveform",
        reads: "`.bin` (`AG10`, `RG01`, `RG03`): float32 and logic; segments of one label are one channel with \
                gaps; peak detection is two",
        leaves_out: "counts, times, histograms: left out",
        described_by: "Agilent, \"InfiniiVision 3000 X-Series User's Guide\"",
        clock: "x increment",
        unit: "y unit",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        let Some([a, b, c, d]) = head.first_chunk::<4>() else { return false };
        matches!([*a, *b], [b'A', b'G'] | [b'R', b'G'])
            && c.is_ascii_digit()
            && d.is_ascii_digit()
            && shape(head).is_some()
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let head = file.head(20)?;
        let Some((wide, from)) = shape(&head) else {
            let problem = "found no header of a binary waveform («AG10», «RG01»), wanted one";
            return Err(fail::at(0, problem, fail::COPY_AGAIN));
        };
        let count = Fields { bytes: &head, order: Order::Little }.u32(from - 4);
        if count > MOST_WAVEFORMS {
            let problem = format!("found {count} waveforms, wanted at most {MOST_WAVEFORMS}");
            return Err(fail::at(from - 4, problem, fail::COPY_AGAIN));
        }
        let mut waveforms = Vec::new();
        let mut at = from;
        for _ in 0..count {
            let waveform = Waveform::read(&file, at, wide)?;
            at = waveform.end;
            waveforms.push(waveform);
        }
        let mut remarks = Vec::new();
        let maker = if head.starts_with(b"AG") { "Keysight or Agilent" } else { "Rigol" };
        let version = String::from_utf8_lossy(head.get(2..4).unwrap_or_default()).into_owned();
        let started_at = waveforms.iter().find_map(|w| w.started_at.clone()).unwrap_or_default();
        let channels = channels::of(&file, waveforms, &mut remarks);
        Ok(Contents {
            format: format!("{maker} binary waveform, version {version}"),
            started_at,
            channels,
            responses: Vec::new(),
            remarks,
        })
    }
}

/// Whether sizes have 64 bits, and the byte of the first waveform: its header begins with its own size, 140 bytes or
/// somewhat more. None if neither is so.
fn shape(head: &[u8]) -> Option<(bool, u64)> {
    let fields = Fields { bytes: head, order: Order::Little };
    let fits = |from: u64| head.len() as u64 >= from + 4 && waveform::is_header_size(fields.u32(from));
    let empty = |from: u64| head.len() as u64 == from && fields.u32(from - 4) == 0;
    [(false, 12), (true, 16)].into_iter().find(|(_, from)| fits(*from) || empty(*from))
}
