//! Igor binary waves, `.ibw`: one numeric array with its scaling, units, labels and note.
//!
//! Source: WaveMetrics, *Technical Note #003: Igor Binary Format*, as the reader igor2 quotes it (`binarywave.py`,
//! <https://github.com/AFM-analysis/igor2>); what the checksum covers up to version 3, and Asylum Research's note keys,
//! were learnt from files. Type codes of 64-bit integers and of reference waves have not been checked against a file.
//!
//! - Versions 1, 2, 3 and 5 in both byte orders, every real numeric type. Complex waves are refused; text,
//!   wave-reference and folder waves are remarked, as is a wave whose samples were not saved because a formula gives
//!   them.
//! - Arrays are stored column by column and rows are time: one channel per column. A column with a label is located by
//!   it (`/Defl`), others by the wave's name (`/wave0`) and, if there are several columns, an index from 0 that counts
//!   columns, then layers, then chunks (`/wave0[2]`).
//! - The row scaling gives the sample rate if its unit is a time. Asylum Research's note gives it (`NumPtsPerSec`), and
//!   the unit of columns of known names, where the header has none.
//! - Packed experiments, `.pxp`, are refused: they hold many waves, histories and windows.

mod channels;
mod clock;
mod header;
mod kind;
mod note;

use std::path::Path;

use crate::{Contents, Format, FormatError, Row};

use crate::fail;
use crate::opened::Opened;
use crate::text;
use header::Header;
use kind::Kind;
use note::Note;

/// Igor binary waves.
pub struct IgorWave;

impl Format for IgorWave {
    const ROW: Row = Row {
        name: "ibw",
        title: "Igor binary wave",
        reads: "versions 1, 2, 3 and 5, both byte orders, columns with their labels; Asylum's note",
        leaves_out: "text waves and waves without data: left out; complex waves, packed experiments: refused",
        described_by: "WaveMetrics, \"Technical Note 003\"",
        clock: "scaling of the x axis; Asylum's note",
        unit: "data units",
    };

    fn recognises(head: &[u8], path: &Path) -> bool {
        match text::extension(path).as_str() {
            "pxp" | "pxt" => true,
            "ibw" | "bwav" => header::version(head).is_some(),
            _ => header::checksum(head) == Some(0),
        }
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let head = file.head(header::MOST_BYTES)?;
        if matches!(text::extension(path).as_str(), "pxp" | "pxt") && header::checksum(&head) != Some(0) {
            return Err(packed_experiment());
        }
        let header = Header::parse(&head, file.bytes())?;
        let mut remarks = Vec::new();
        if header.checksum != 0 {
            remarks.push(format!(
                "the header's checksum is {} instead of 0: it may be damaged, compare the channel's values with what \
                 you expect",
                header.checksum
            ));
        }
        let note = Note::read(&file, &header, &mut remarks);
        let channels = match header.kind {
            Kind::Numbers(code) => channels::of(&file, &header, code, &note, &mut remarks)?,
            Kind::Other(what) => {
                remarks.push(format!("wave `{}` is a {what}, no channel of numbers", header.name));
                Vec::new()
            }
        };
        Ok(Contents {
            format: format!("Igor binary wave {}, {}", header.version, header.order.name()),
            started_at: started_at(&header, &note, &mut remarks),
            channels,
            responses: Vec::new(),
            remarks,
        })
    }
}

/// Asylum's note knows when the curve was acquired; the wave's own date is when it was made, perhaps on export.
fn started_at(header: &Header, note: &Note, remarks: &mut Vec<String>) -> String {
    let created = clock::iso(f64::from(header.created));
    let Some(acquired) = note.number("Seconds").and_then(clock::iso) else { return created.unwrap_or_default() };
    if let Some(created) = created.filter(|c| c.get(..10) != acquired.get(..10)) {
        remarks.push(format!(
            "the wave was created at {created}; the note's `Seconds` says it was recorded at {acquired}"
        ));
    }
    acquired
}

/// Why packed experiments are not read, and what to do instead.
fn packed_experiment() -> FormatError {
    fail::at(
        0,
        "found an Igor packed experiment, wanted a single binary wave",
        "open it in Igor Pro and export each wave: Data > Save Waves > Save Igor Binary (or `Save/C wave0` on the \
         command line), then name the .ibw file",
    )
}
