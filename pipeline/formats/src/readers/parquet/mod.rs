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
//! - Unpacked or with Snappy, gzip, Brotli, Zstandard, LZ4 (raw); coded plainly, by a dictionary, as differences, in
//!   split streams.
//!
//! The crate `parquet`, with which tables are written, is not used to read: it reserves memory for as many items as a
//! damaged description claims, which ends the program, and it stops by panics where pages are not as described.
//! Everything here is bounded by the bytes that are there and by the budget of inflated data.
//!
//! Source: Apache Parquet, "File format" (<https://parquet.apache.org/docs/file-format>) and "parquet.thrift".

mod chunks;
mod codes;
mod compact;
mod footer;
mod pages;

use std::collections::HashMap;
use std::path::Path;

use crate::budget::most_inflated;
use crate::columnar::arrow_schema::{self, Unit};
use crate::columnar::{Described, Table};
use crate::opened::Opened;
use crate::{Contents, Format, FormatError, Row};
use chunks::Chunks;
use footer::{Chunk, Column, Footer, MAGIC};

/// Parquet files.
#[derive(Debug, Clone, Copy)]
pub struct Parquet;

impl Format for Parquet {
    const ROW: Row = Row {
        name: "parquet",
        title: "Apache Parquet",
        reads: "integers, float16 to float64, truths, decimals, in structs too; missing ones as NaN; Snappy, \
                gzip, Brotli, Zstandard, LZ4",
        leaves_out: "lists, texts, dates; LZO, LZ4 in Hadoop's frames; encrypted files",
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
        let mut table = Table::new(most_inflated(file.bytes()));
        let described = footer.texts.iter().find(|(name, _)| name == arrow_schema::KEY);
        let units = described.map(|(_, text)| arrow_schema::units(text).into_iter().collect()).unwrap_or_default();
        for (column, chunks) in footer.columns.iter().zip(footer.chunks) {
            table.column(described_by(column, &chunks, &units), |location| Chunks {
                file: file.pinned().clone(),
                location: location.to_owned(),
                optional: column.optional,
                number: column.kind.as_ref().map_or(crate::Number::U8, |(number, _)| *number),
                chunks,
            })?;
        }
        table.rate(&footer.texts);
        Ok(table.finish("Apache Parquet"))
    }
}

/// What a file says of a column; `units` are those that Arrow keeps, by the names of columns.
fn described_by(column: &Column, chunks: &[Chunk], units: &HashMap<String, Unit>) -> Described {
    let name = column.path.join(".");
    let packed = chunks.iter().find_map(|chunk| chunk.codec.err());
    let left_out =
        packed.map(|codec| format!("it is packed with {codec}, wanted Snappy, gzip, Brotli, Zstandard or LZ4"));
    let own = chunks.iter().find_map(|chunk| chunk.unit.clone());
    let of_field = units.get(&name);
    let of_duration = of_field.is_some_and(|unit| unit.of_duration);
    let unit = own.or_else(|| of_field.map(|unit| unit.unit.clone())).map(|unit| Unit { unit, of_duration });
    let kind = if column.repeated { Err("lists".to_owned()) } else { column.kind.clone() };
    let rows = chunks.iter().map(|chunk| chunk.rows).collect();
    Described { name, kind, left_out, may_miss: column.optional > 0, unit, rows }
}
