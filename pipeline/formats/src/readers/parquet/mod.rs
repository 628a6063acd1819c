//! Tables of Apache Parquet: what pandas, Polars, DuckDB and data bases save.
//!
//! - Every column of numbers is a channel: integers, half to double precision, truths, decimal fractions of up to 18
//!   digits, columns in structs (`/outer.inner`). Missing values are NaN. Lists and texts are remarks.
//! - A column of moments is an axis: seconds since its first moment, which is when the recording began. Moments count
//!   whole parts of a second, so that the differences are exact; as seconds since 1970 they would be rounded.
//! - A column of time differences (Arrow) is an axis of times.
//! - The index that pandas saves as `__index_level_0__` is `/index`, an axis.
//! - Units from the metadata of a field, `unit` or `units`, which Arrow keeps in a text of the file. Rates from texts
//!   of the file that are named like one (`sample_rate_hz`, `fs`, `dt`, ...), else from columns of times.
//! - Checksums of pages are verified where there are some.
//! - Unpacked or with Snappy, gzip, LZ4 (raw); coded plainly, by a dictionary, as differences, in split streams.
//!
//! The crate `parquet`, with which tables are written, is not used to read: it reserves memory for as many items as a
//! damaged description claims, which ends the program, and it stops by panics where pages are not as described.
//! Everything here is bounded by the bytes that are there and by the budget of inflated data.
//!
//! Source: Apache Parquet, "File format" (<https://parquet.apache.org/docs/file-format>) and "parquet.thrift".

mod arrow_schema;
mod codes;
mod column;
mod compact;
mod footer;
mod inflate;
mod pages;

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

use crate::axes::settle;
use crate::budget::most_inflated;
use crate::calendar::date_of;
use crate::opened::Opened;
use crate::rate::{Clue, agreed_rate};
use crate::{Contents, Format, FormatError, FoundChannel, Number, Row};
use column::Column;
use footer::{Footer, MAGIC, What};

/// More remarks are only counted.
const MOST_REMARKS: usize = 200;

/// What pandas calls an index without a name.
const INDEX: &str = "__index_level_0__";

/// Parquet files.
#[derive(Debug, Clone, Copy)]
pub struct Parquet;

impl Format for Parquet {
    const ROW: Row = Row {
        name: "parquet",
        title: "Apache Parquet",
        reads: "integers, float16 to float64, truths, decimals, in structs too; missing ones as NaN; Snappy, gzip, LZ4",
        leaves_out: "lists, texts, dates; Zstandard and Brotli; encrypted files",
        described_by: "Apache Parquet, \"File format\"; Apache Arrow, \"Schema.fbs\"",
        clock: "columns of moments and of times; texts of the file named `fs`, `dt`, ...",
        unit: "the metadata `unit` or `units` of a field",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        head.starts_with(MAGIC)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let footer = Footer::read(&file)?;
        let mut found = Found::new(&file);
        let units = footer.texts.iter().find(|(name, _)| name == arrow_schema::KEY);
        found.units = units.map(|(_, text)| arrow_schema::units(text).into_iter().collect()).unwrap_or_default();
        for (column, chunks) in footer.columns.iter().zip(footer.chunks) {
            found.column(column, chunks, footer.rows)?;
        }
        found.rate(&footer.texts);
        Ok(found.finish())
    }
}

/// Whether metadata of this name state a unit.
fn names_unit(name: &str) -> bool {
    matches!(name, "unit" | "units")
}

/// What is found of a file.
#[derive(Debug)]
struct Found<'a> {
    file: &'a Opened,
    /// Bytes that the samples may still come to.
    left: u64,
    /// Units by the names of columns.
    units: HashMap<String, arrow_schema::Unit>,
    /// How often each location is wanted.
    locations: HashMap<String, usize>,
    channels: Vec<FoundChannel>,
    started_at: String,
    remarks: Vec<String>,
    unsaid: usize,
}

impl<'a> Found<'a> {
    fn new(file: &'a Opened) -> Self {
        Self {
            file,
            left: most_inflated(file.bytes()),
            units: HashMap::new(),
            locations: HashMap::new(),
            channels: Vec::new(),
            started_at: String::new(),
            remarks: Vec::new(),
            unsaid: 0,
        }
    }

    fn remark(&mut self, text: String) {
        if self.remarks.len() < MOST_REMARKS {
            self.remarks.push(text);
        } else {
            self.unsaid += 1;
        }
    }

    /// Lists a column. Errors: its first moments are damaged.
    fn column(&mut self, about: &footer::Column, chunks: Vec<footer::Chunk>, rows: u64) -> Result<(), FormatError> {
        let name = about.path.join(".");
        let called = if name == INDEX { "index" } else { name.as_str() };
        let location = self.unique(&format!("/{}", called.escape_debug()));
        if about.repeated {
            self.remark(format!("{location} holds lists, no channel"));
            return Ok(());
        }
        let (number, what) = match &about.kind {
            Ok(kind) => *kind,
            Err(what) => {
                self.remark(format!("{location} holds {what}, no channel"));
                return Ok(());
            }
        };
        if let Some(codec) = chunks.iter().find_map(|chunk| chunk.codec.err()) {
            self.remark(format!("{location} is left out: it is packed with {codec}, wanted Snappy, gzip or LZ4"));
            return Ok(());
        }
        // what is read has up to 8 bytes a number
        let (Some(left), Ok(samples)) =
            (rows.checked_mul(8).and_then(|bytes| self.left.checked_sub(bytes)), usize::try_from(rows))
        else {
            self.remark(format!("{location} is left out: its {rows} rows are more than a file of this size may have"));
            return Ok(());
        };
        self.left = left;
        if number.may_be_rounded() && matches!(what, What::Plain | What::Scaled(_)) {
            self.remark(format!("{location}: 64-bit integers beyond 2^53 are rounded to float64"));
        }
        let own = chunks.iter().find_map(|chunk| chunk.unit.clone());
        let of_field = self.units.get(&name);
        let of_duration = number == Number::I64 && of_field.is_some_and(|unit| unit.of_duration);
        let unit = own.or_else(|| of_field.map(|unit| unit.unit.clone())).unwrap_or_default();
        let mut column = Column {
            file: self.file.pinned().clone(),
            name: location.clone(),
            number,
            what,
            optional: about.optional,
            chunks,
            samples,
            origin: 0,
            kept: Mutex::new(None),
        };
        let (scale_factor, unit) = match what {
            What::Plain => (1.0, unit),
            What::Scaled(factor) => (factor, unit),
            What::TimeOfDay(seconds) => (seconds, "s".to_owned()),
            What::Moments { per_second, utc } => {
                self.begin(&mut column, per_second, utc)?;
                (1.0 / per_second as f64, "s".to_owned())
            }
        };
        self.channels.push(FoundChannel {
            unit,
            scale_factor,
            is_axis: of_duration || matches!(what, What::Moments { .. }),
            ..FoundChannel::new(location, samples, number.name(), Arc::new(column))
        });
        Ok(())
    }

    /// Counts moments from the first. Errors: damaged.
    fn begin(&mut self, column: &mut Column, per_second: i64, utc: bool) -> Result<(), FormatError> {
        let Some(first) = column.first_moment()? else { return Ok(()) };
        column.origin = first;
        if self.started_at.is_empty() {
            self.started_at = moment(first, per_second, utc).unwrap_or_default();
        }
        Ok(())
    }

    /// The location itself, or with a number if it is taken.
    fn unique(&mut self, asked: &str) -> String {
        let mut location = asked.to_owned();
        loop {
            let wanted = self.locations.entry(location.clone()).or_default();
            *wanted += 1;
            if *wanted == 1 {
                return location;
            }
            location = format!("{asked}#{wanted}");
        }
    }

    /// The rate that texts of the file state.
    fn rate(&mut self, texts: &[(String, String)]) {
        let clue = |(name, text): &(String, String)| Clue::of_text(name, name, text);
        let clues: Vec<Clue> = texts.iter().filter_map(clue).collect();
        if clues.is_empty() {
            return;
        }
        let (rate, remark) = agreed_rate(&clues);
        remark.into_iter().for_each(|remark| self.remark(remark));
        for channel in &mut self.channels {
            channel.sample_rate_hz = rate.filter(|_| !channel.is_axis);
        }
    }

    fn finish(mut self) -> Contents {
        if self.channels.is_empty() {
            self.remark("the table has no column of numbers".to_owned());
        }
        if self.unsaid > 0 {
            self.remarks.push(format!("{} more remarks of this kind", self.unsaid));
        }
        let mut contents = Contents {
            format: "Apache Parquet".to_owned(),
            started_at: self.started_at,
            channels: self.channels,
            responses: Vec::new(),
            remarks: self.remarks,
        };
        settle(&mut contents);
        contents
    }
}

/// A moment in ISO 8601; none outside the years 1 to 9999.
fn moment(parts: i64, per_second: i64, utc: bool) -> Option<String> {
    let (seconds, part) = (parts.div_euclid(per_second), parts.rem_euclid(per_second));
    let (year, month, day) = date_of(seconds.div_euclid(86_400))?;
    let s = seconds.rem_euclid(86_400);
    let digits = per_second.ilog10() as usize;
    let fraction = if part == 0 { String::new() } else { format!(".{part:0digits$}") };
    let zone = if utc { "Z" } else { "" };
    Some(format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}{fraction}{zone}", s / 3600, s / 60 % 60, s % 60))
}
