//! Tektronix waveforms with a preamble: `.isf`.
//!
//! - Text `:WFMPRE:BYT_NR 2;...;:CURVE #520000` in its long or short form (`:WFMP:BYT_N 2`, `:CURV #`), then codes:
//!   value = (code - YOFF) * YMULT + YZERO, in YUNIT.
//! - Codes are signed (`RI`) or unsigned (`RP`) integers of 1, 2 or 4 bytes or floats (`FP`) of 4, either byte order; or
//!   numbers as text (`ENCDG ASC`).
//! - One channel, named after the source in WFID: `/Ch1`. An envelope (`PT_FMT ENV`) has two: `/Ch1/minimum` and
//!   `/Ch1/maximum`.
//! - The rate is 1 / XINCR if XUNIT is the second; that of an envelope's pairs is half of it.
//!
//! Source: Tektronix, "MSO4000B and DPO4000B Series Programmer Manual", `WFMOutpre?`, `CURVe?`; the FAQ "What is the
//! format of the ISF file".

mod preamble;

use std::path::Path;
use std::sync::Arc;

use crate::grid::{Grid, Store};
use crate::opened::Opened;
use crate::pinned::stretch_of;
use crate::rate::of_step;
use crate::{Contents, Format, FormatError, FoundChannel, Raw, Row, Source, fail};
use preamble::{Data, Preamble};

/// Tektronix waveforms with a preamble.
#[derive(Debug, Clone, Copy)]
pub struct TektronixIsf;

impl Format for TektronixIsf {
    const ROW: Row = Row {
        name: "isf",
        title: "Tektronix waveform",
        reads: "`.isf`: integers of 1, 2 and 4 bytes, float32, text, either byte order; an envelope is two channels",
        leaves_out: "`.wfm`",
        described_by: "Tektronix, \"MSO4000B and DPO4000B Programmer Manual\", `WFMOutpre?`",
        clock: "`XINcr`, `XUNit`",
        unit: "`YUNit`",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        preamble::is_begin(head)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let preamble = Preamble::read(&file)?;
        let mut remarks = Vec::new();
        let lanes: u64 = if preamble.envelope { 2 } else { 1 };
        let (sources, samples, stored_as): (Vec<Arc<dyn Source>>, usize, &str) = match preamble
            .data(&file, &mut remarks)?
        {
            Data::Codes { number, big_endian, from, count } => {
                let samples = (count / lanes) as usize;
                let lane = |lane: u64| -> Arc<dyn Source> {
                    Arc::new(Grid {
                        store: Store::File(file.pinned().clone()),
                        first: from + lane * number.bytes(),
                        step: lanes * number.bytes(),
                        samples,
                        number,
                        big_endian,
                    })
                };
                ((0..lanes).map(lane).collect(), samples, number.name())
            }
            Data::Text(codes) => {
                let lane = |lane| codes.iter().copied().skip(lane).step_by(lanes as usize);
                let samples = codes.len() / lanes as usize;
                let source =
                    |first: u64| -> Arc<dyn Source> { Arc::new(Kept(lane(first as usize).take(samples).collect())) };
                ((0..lanes).map(source).collect(), samples, "text")
            }
        };
        if samples == 0 {
            return Err(fail::at(preamble.curve_at, "found no samples, wanted one", fail::COPY_AGAIN));
        }
        let rate_hz = preamble.step_s(&mut remarks).map(|step| of_step(step * lanes as f64));
        let (scale_factor, add_offset) = preamble.scale()?;
        let ends = if preamble.envelope { ["/minimum", "/maximum"].as_slice() } else { &[""] };
        let channel = |(end, source): (&&str, Arc<dyn Source>)| FoundChannel {
            unit: preamble.unit(),
            long_name: preamble.description.clone(),
            sample_rate_hz: rate_hz,
            scale_factor,
            add_offset,
            ..FoundChannel::new(format!("/{}{end}", preamble.source()), samples, stored_as, source)
        };
        let channels = ends.iter().zip(sources).map(channel).collect();
        Ok(Contents {
            format: "Tektronix waveform (ISF)".to_owned(),
            started_at: String::new(),
            channels,
            responses: Vec::new(),
            remarks,
        })
    }
}

/// Codes that were text.
#[derive(Debug)]
struct Kept(Vec<f64>);

impl Source for Kept {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        stretch_of(&self.0, start, count)
    }

    fn kept_bytes(&self) -> u64 {
        8 * self.0.len() as u64
    }
}
