//! Universal File Format: dataset 58 (functions at nodal degrees of freedom) as text and 58b, the same with binary
//! data.
//!
//! - Real functions, single or double precision, are channels: the location is the response's name (`Mic 01`) or node
//!   and direction (`12+X`), with `[2]` for the second of a name.
//! - An even abscissa that is time gives the sample rate. Over another quantity (a spectrum over frequency) there is
//!   none: a remark states the abscissa. The step is printed with six digits: of the rates that it allows, that with
//!   the fewest digits is taken.
//! - An uneven abscissa is a channel of its own, `…/abscissa`; then there is no rate, and a remark. Times that run evenly
//!   to within their printing give the rate instead, from all of them.
//! - Complex frequency responses and transmissibilities (functions 4 and 5) are listed as such, with node and direction
//!   of response and reference; they are no channels.
//! - Other complex functions and other datasets are left out: a remark says so.
//! - The data of 58b are read as they are asked for; text is parsed on the first read and kept.
//! - The number of data bytes that 58b states is wrong in files of the Python package pyuff where values are complex or
//!   the abscissa is uneven: type, spacing and number of points give it as well. Where the dataset ends there and not
//!   behind the number stated, a remark says so.
//!
//! Source: Structural Dynamics Research Corporation, "Universal Dataset Number 58" and University of Cincinnati SDRL,
//! "The Binary 58 Universal File Format", www.sdrl.uc.edu/sdrl/referenceinfo/universalfileformats.

mod fixed;
mod function;
mod header;
mod layout;
mod samples;
mod scan;

use crate::pinned::Pinned;
use crate::{Contents, Format, FormatError, Row};
use std::path::Path;

/// The format UFF 58 and 58b.
#[derive(Debug, Clone, Copy)]
pub struct Uff;

impl Format for Uff {
    const ROW: Row = Row {
        name: "uff",
        title: "Universal File Format 58",
        reads: "58 and 58b: real functions, single and double precision, text and binary; texts in UTF-8 or \
                Latin-1; complex frequency responses and transmissibilities for `io.frf`",
        leaves_out: "other complex functions and other datasets: left out",
        described_by: "University of Cincinnati SDRL, \"Universal File Formats\"",
        clock: "abscissa spacing; stored times",
        unit: "ordinate's unit",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        let mut lines = head.split(|&b| b == b'\n').skip_while(|line| line.trim_ascii().is_empty());
        let delimiter = lines.next().is_some_and(|line| line.trim_ascii() == scan::DELIMITER);
        let number = lines.next().map(|line| fixed::text(line, 0, 6).parse::<u32>().is_ok());
        delimiter && number == Some(true)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let (pinned, file) = Pinned::open(path)?;
        let scanned = scan::scan(file, pinned.bytes())?;
        Ok(function::contents(scanned, &pinned))
    }
}
