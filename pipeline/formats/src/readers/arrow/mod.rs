//! Tables of Apache Arrow, saved by its protocol for processes (IPC): files of Feather 2, and streams.
//!
//! - Columns of numbers are channels and columns of moments axes by the same rules as those of Parquet, with which this
//!   reader shares all that follows the description: what is a channel, units, rates, beginnings.
//! - A file ends with a list of its record batches. One without it, which was not finished, and a stream are read from
//!   the front, as far as they are whole.
//! - Plain, or with each buffer packed with LZ4 (frames) or Zstandard. Of plain buffers no more than what is wanted is
//!   read; of a column of packed ones the batch that was unpacked last is kept.
//! - The first version of Feather, which pandas wrote until 2020, is another format and refused.
//!
//! Source: Apache Arrow, "Arrow columnar format" (<https://arrow.apache.org/docs/format/Columnar.html>), "File.fbs",
//! "Message.fbs", "Schema.fbs".

mod batch;
mod buffers;
mod layout;
mod message;
mod stored;

use std::path::Path;

use crate::budget::most_inflated;
use crate::columnar::Table;
use crate::opened::Opened;
use crate::{Contents, Format, FormatError, Row, fail};
use buffers::Buffers;
use stored::{FEATHER_1, MAGIC, Stored};

/// Files and streams of Arrow.
#[derive(Debug, Clone, Copy)]
pub struct Arrow;

impl Format for Arrow {
    const ROW: Row = Row {
        name: "arrow",
        title: "Apache Arrow or Feather 2",
        reads: "files and streams (`.arrow`, `.feather`, `.ipc`, `.arrows`): as Parquet; plain, LZ4, Zstandard; files \
                that were not finished, as far as they are whole",
        leaves_out: "lists, texts, dates, entries of dictionaries; Feather 1 and big-endian tables: refused",
        described_by: "Apache Arrow, \"Arrow columnar format\"",
        clock: "columns of moments and of times; texts of the table named `fs`, `dt`, ...",
        unit: "the metadata `unit` or `units` of a field",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        head.starts_with(MAGIC) || head.starts_with(FEATHER_1) || message::begins_stream(head)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let stored = Stored::read(&file)?;
        if stored.schema.big_endian {
            let problem = "the numbers are stored in big-endian order, wanted little-endian";
            return Err(fail::plain(
                problem,
                "save the table again on the machine that reads it, with `pyarrow.feather`",
            ));
        }
        let leaves =
            layout::leaves(&stored.schema.fields).map_err(|problem| stored::damaged(stored.schema_at, &problem))?;
        let mut parts = vec![Vec::new(); leaves.len()];
        for batch in &stored.batches {
            batch::add_parts(batch, &leaves, &mut parts)?;
        }
        let mut table = Table::new(most_inflated(file.bytes()));
        for (leaf, parts) in leaves.iter().zip(parts) {
            table.column(leaf.described(&parts), |location| Buffers {
                file: file.pinned().clone(),
                location: location.to_owned(),
                number_bytes: leaf.number_bytes(),
                bits: leaf.bits(),
                parts,
            })?;
        }
        stored.remarks.into_iter().for_each(|remark| table.remark(remark));
        table.rate(&stored.schema.texts);
        Ok(table.finish(stored.format))
    }
}
