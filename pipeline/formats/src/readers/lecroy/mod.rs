//! LeCroy waveforms: `.trc`.
//!
//! - A descriptor of 346 bytes (`WAVEDESC`, template `LECROY_2_x`), often behind the block header `#9000...` of a
//!   remote command; then arrays, of which the first of samples is read: int8 or int16 in either byte order,
//!   value = code * VERTICAL_GAIN - VERTICAL_OFFSET.
//! - One channel, named after the trace's source: `/C1`, `/F2`, or `/trace` if it is not stated.
//! - A sequence is one channel with a gap in front of each further segment.
//! - The rate is 1 / HORIZ_INTERVAL if the horizontal unit is the second.
//! - Second arrays (minima and maxima, imaginary parts) are left out, complex and histogram records refused.
//!
//! Source: LeCroy, "Remote Control Manual", appendix "Waveform template" (LECROY_2_2, LECROY_2_3).

mod descriptor;

use std::path::Path;
use std::sync::Arc;

use crate::grid::{Grid, Store};
use crate::opened::Opened;
use crate::{Contents, Format, FormatError, FoundChannel, Row, fail};
use descriptor::{Descriptor, NAME};

/// LeCroy waveforms.
#[derive(Debug, Clone, Copy)]
pub struct LeCroy;

/// Where the descriptor may begin: behind a command's name and its block header.
const LATEST_BEGIN: usize = 64;

impl Format for LeCroy {
    const ROW: Row = Row {
        name: "lecroy",
        title: "LeCroy waveform",
        reads: "`.trc` of templates LECROY_2_x, bytes and words, either byte order; a sequence has a gap in front \
                of each segment",
        leaves_out: "complex and histogram records: refused; second arrays: left out",
        described_by: "LeCroy, \"Remote Control Manual\", waveform template",
        clock: "`HORIZ_INTERVAL`",
        unit: "`VERTUNIT`",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        begin(head).is_some()
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let head = file.head((LATEST_BEGIN + NAME.len()) as u64)?;
        let Some(begin) = begin(&head) else {
            let problem = format!("found no «WAVEDESC» in the first {LATEST_BEGIN} bytes, wanted a LeCroy waveform");
            return Err(fail::at(0, problem, fail::COPY_AGAIN));
        };
        let mut remarks = Vec::new();
        let about = Descriptor::read(&file, begin)?;
        let samples = about.samples(&file)?;
        let mut gaps = about.segment_starts(samples);
        gaps.retain(|gap| *gap < samples);
        let grid = Grid {
            store: Store::File(file.pinned().clone()),
            first: about.samples_from,
            step: about.number.bytes(),
            samples,
            number: about.number,
            big_endian: about.big_endian,
        };
        about.remarks(gaps.len(), &mut remarks);
        let channel = FoundChannel {
            unit: about.unit.clone(),
            long_name: about.long_name(),
            sample_rate_hz: about.rate_hz(&mut remarks),
            scale_factor: about.gain,
            add_offset: -about.offset,
            gaps,
            ..FoundChannel::new(about.location(), samples, about.number.name(), Arc::new(grid))
        };
        let order = if about.big_endian { "big" } else { "little" };
        let format = format!("LeCroy waveform, template {}, {order}-endian", about.template);
        Ok(Contents {
            format,
            started_at: about.started_at.clone(),
            channels: vec![channel],
            responses: Vec::new(),
            remarks,
        })
    }
}

/// Byte of the descriptor: at the beginning, or behind a block header `#9000001350`.
fn begin(head: &[u8]) -> Option<u64> {
    let head = head.get(..head.len().min(LATEST_BEGIN + NAME.len()))?;
    let at = head.windows(NAME.len()).position(|window| window == NAME)?;
    let before = head.get(..at)?;
    let text = before.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ');
    let block = before.is_empty() || before.contains(&b'#');
    (text && block).then_some(at as u64)
}
