//! Bruker (Veeco, Digital Instruments) Nanoscope force curves: `.000`, `.001`, `.spm`.
//!
//! Source: Bruker, *NanoScope Software 8.10 User Guide* (CIAO parameters: hard value, hard scale, soft scale), as
//! excerpted in <https://github.com/kogens/spmpy>; order of the samples in a force curve from Gwyddion's reader
//! (`nanoscope.c`), and the real curve's height sensor agrees. `Hold Time` and samples of 4 bytes have not been checked
//! against a file.
//!
//! - A text header of sections (`\*Ciao force image list`) with `\key: value` lines; samples after it, little-endian
//!   int16 or int32.
//! - One channel per force image list and part of the ramp: `/DeflectionError/extend`, `/DeflectionError/retract` and,
//!   if the tip was held, `/DeflectionError/hold`. The name is the header's internal one of the image data.
//! - A curve is stored as extend, retract, hold, and extend begins at the turning point. All channels are given in the
//!   order in which they were recorded, so extend is turned round.
//! - Values are in the unit of the hard scale (V): code times V/LSB. The soft scale (`Sens. DeflSens`, nm/V) is
//!   remarked.
//! - A ramp forth and back takes 1/`Scan rate`; it is shared out by the forward and reverse velocity, which gives each
//!   part's sample rate.
//! - Images and force volumes are refused, as are headers without data.

mod curve;
mod header;
mod lengths;
mod scale;

use std::path::Path;

use crate::{Contents, Format, FormatError, Row};

use crate::fail;
use crate::opened::Opened;
use header::{Header, Section};

/// Nanoscope force curves.
pub struct Nanoscope;

impl Format for Nanoscope {
    const ROW: Row = Row {
        name: "nanoscope",
        title: "Bruker Nanoscope force curve",
        reads: "force curves; extend is turned round so that time runs forward; volts by the hard scale",
        leaves_out: "images, force volumes, headers without data",
        described_by: "Bruker, \"NanoScope 8.10 User Guide\"; the order by Gwyddion's reader",
        clock: "scan rate and number of points",
        unit: "of the hard scale",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        header::is_header(head)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let header = Header::read(&file)?;
        header.check_version()?;
        let lists = header.all("Ciao force image list");
        check_data_present(&header, file.bytes())?;
        if lists.is_empty() {
            return Err(refuse_images(&header));
        }
        let mut remarks = Vec::new();
        let images = header.all("Ciao image list").len();
        if images > 0 {
            remarks.push(format!("left out {images} images: line after line of a scan, no transients"));
        }
        let mut channels = Vec::new();
        for list in lists {
            curve::channels(&file, &header, list, &mut channels, &mut remarks)?;
        }
        Ok(Contents {
            format: format!("Bruker Nanoscope {}, force curve", header.version()),
            started_at: header.date(&mut remarks),
            channels,
            responses: Vec::new(),
            remarks,
        })
    }
}

/// Errors: every list's samples would begin at or after the end of the file.
fn check_data_present(header: &Header, file_bytes: u64) -> Result<(), FormatError> {
    let data = |s: &&Section| s.integer("Data offset").is_some();
    let mut lists = header.sections.iter().filter(|s| s.name.ends_with("image list")).filter(data).peekable();
    let Some(first) = lists.peek() else { return Ok(()) };
    let (at, from) = (first.at, first.integer("Data offset").unwrap_or_default());
    if lists.any(|s| s.integer("Data offset").is_some_and(|from| from < file_bytes)) {
        return Ok(());
    }
    Err(fail::at(
        at,
        format!("found a header only: its samples would begin at byte {from}, but the file ends at byte {file_bytes}"),
        "the data were stripped or not copied: get the whole file",
    ))
}

/// Why images are not read.
fn refuse_images(header: &Header) -> FormatError {
    let images = header.all("Ciao image list");
    let help = "export the force curves, or open a file of raw or high-speed data capture (HSDC)";
    let Some(image) = images.first() else {
        let names: Vec<_> = header.sections.iter().map(|s| s.name.as_str()).take(20).collect();
        return fail::at(0, format!("found the sections {names:?}, wanted a Ciao force image list"), help);
    };
    let of = |key| image.value(key).or_else(|| header.anywhere(key)).unwrap_or("?");
    fail::at(
        image.at,
        format!(
            "found {} images of {} samples a line at {} lines per second, wanted force curves: pixels are averages \
             along a scan, no transients",
            images.len(),
            of("Samps/line"),
            of("Scan rate")
        ),
        help,
    )
}
