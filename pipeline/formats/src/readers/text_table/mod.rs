//! Tables of text: LabVIEW measurement files (LVM) and plain CSV, TSV, DAT, TXT.
//!
//! A channel per column; its location is the column's title (`column_3` without one, `Title[2]` for the second of that
//! title).
//! The text is parsed once, line by line, when the file is opened, and kept as float64.
//! Empty fields and fields that are no number are NaN where a number follows in their column, with a remark that counts
//! them; at a column's end they are no samples.
//!
//! Tables that are packed with gzip are inflated while they are parsed.
//!
//! **LVM**: sections begin with a header that ends in `***End_of_Header***`. Columns of the same title, unit and
//! `Delta_X` are joined over the sections; a section begins behind a gap unless its start (`Date`, `Time`, `X0`)
//! follows from the one before. The rate is 1 / `Delta_X` as long as the X column, if there is one, agrees. An X column
//! that does not run evenly is a channel of its own.
//!
//! **Plain**: the delimiter (tab, semicolon, comma, blanks) and the decimal sign are those that make most fields
//! numbers. Most lines say what a row has in each column (a number, a date or time of day, text, nothing); the first
//! line that has the same begins the rows, and what is above it is the header. A line among the rows that begins like a
//! line of the header, or has words and no number where rows have numbers, is no row: the header of a recording that
//! was begun again, and a gap unless the times go on evenly.
//! Titles and units (`Deflection (V)`, `[V]`, `Weg / m`, `C1 in V`, or a row of units or of their names) come from the
//! lines above the numbers, comments (`#`, `%`) included. Units by their SI names (`Volt`) are given as symbols.
//! A column titled as time, or a first column in a unit of time, that runs evenly gives the sample rate and is no
//! channel; otherwise it is one and there is no rate. An interval or a rate that the header states by a key (`Sample
//! Interval`, `Increment`, `delta t`, `tInc`, `Sampling Frequency`) is taken where the times agree with it or there
//! are none; a first column that counts by 1 is no channel then. If times and header disagree there is no rate.
//! Evenly: there is a straight line from which no time deviates by more than a hundredth of a step and half a unit of
//! the last place it is printed to (or of single precision, if all are numbers of it), where that unit is at most half a
//! step. Of the rates of such lines that with the fewest digits is given. Where times jump is a gap.
//! Of several columns of times each gives rate and start to the columns that its name says (`Time A` to `A`), else to
//! those between it and the next one. Whole numbers without a unit count and give no rate.
//! Where no column of times in numbers and no header gives a rate, a column of times of day does (`12:00:01.250`,
//! `2020-01-01T12:00:01Z`): seconds since its first.
//! A column of one number beside columns of more, and numbers behind words in front of the rows (a header beside them,
//! as Tektronix writes it), are no channels.
//!
//! Source: National Instruments, "Specification for the LabVIEW Measurement File (.lvm)", ni.com/tutorial/4139/en.

mod channels;
mod clocks;
mod column;
mod header;
mod kind;
mod lines;
mod lvm;
mod lvm_header;
mod lvm_join;
mod number;
mod packed;
mod plain;
mod sniff;
mod stamps;
mod stated;
mod titles;
mod units;

use crate::pinned::{Pinned, stretch_of};
use crate::{Contents, Format, FormatError, Raw, Row, Source};
use std::path::Path;

/// The formats LVM and plain tables.
#[derive(Debug, Clone, Copy)]
pub struct TextTable;

const LVM_BEGINS: &[u8] = b"LabVIEW Measurement";
/// Names of files that may be tables; other text is not guessed to be one.
const EXTENSIONS: [&str; 6] = ["csv", "tsv", "dat", "txt", "asc", "lvm"];

impl Format for TextTable {
    const ROW: Row = Row {
        name: "text",
        title: "LabVIEW LVM or a table of text",
        reads: "LVM sections; tables with tabs, commas, semicolons or blanks, either decimal sign, UTF-8, Latin-1 \
                or UTF-16, titles and units above the numbers, headers of oscilloscopes (Keysight, Rigol, Rohde & \
                Schwarz, Siglent, Tektronix), of CASSY and of LabVIEW; an even column of times or an interval in \
                the header gives the rate; a header among the rows is a gap unless the times go on; empty fields \
                are NaN",
        leaves_out: "rows of unequal length; binary",
        described_by: "NI, \"Specification for the LabVIEW Measurement File\"",
        clock: "columns of times; interval or rate in the header",
        unit: "titles; a row of units",
    };

    fn recognises(head: &[u8], path: &Path) -> bool {
        if head.strip_prefix(lines::BYTE_ORDER_MARK).unwrap_or(head).starts_with(LVM_BEGINS) {
            return true;
        }
        if let Some((head, path)) = packed::head(head, path) {
            return Self::recognises(&head, &path);
        }
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        // Universal files are tables of numbers too, between lines of their own.
        let universal = head.trim_ascii_start().starts_with(b"-1\n") || head.trim_ascii_start().starts_with(b"-1\r");
        EXTENSIONS.contains(&extension.as_str()) && !universal && sniff::looks_like_a_table(head)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let (pinned, file) = Pinned::open(path)?;
        let mut lines = lines::Lines::open(file, pinned.bytes())?;
        let is_lvm = lines.peek()?.is_some_and(|line| line.text.as_bytes().starts_with(LVM_BEGINS));
        if is_lvm { lvm::open(&mut lines) } else { plain::open(&mut lines) }
    }
}

/// A parsed column.
#[derive(Debug)]
struct Parsed(Vec<f64>);

impl Source for Parsed {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        stretch_of(&self.0, start, count)
    }

    fn kept_bytes(&self) -> u64 {
        8 * self.0.len() as u64
    }
}
