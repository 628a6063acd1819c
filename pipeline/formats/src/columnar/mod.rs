//! Tables that are stored column by column, in groups of rows: what the readers of Parquet and Arrow share.
//!
//! In reading order: numbers of few bits ([`bits`]), packed bytes ([`Codec`], with [`blocks`]), Arrow's descriptions
//! ([`Buffer`], [`arrow_schema`]), the samples of a column ([`Column`]), and the channels of a table ([`Table`]).

pub(crate) mod arrow_schema;
mod bits;
mod blocks;
mod codec;
mod column;
mod flatbuffer;
mod table;

pub(crate) use bits::{bits, truths, varint};
pub(crate) use codec::Codec;
pub(crate) use column::{Groups, Values};
pub(crate) use flatbuffer::Buffer;
pub(crate) use table::{Described, Table};

/// More columns are no recording.
pub(crate) const MOST_COLUMNS: usize = 1 << 16;

/// Groups of columns in groups beyond this are refused.
pub(crate) const DEEPEST: usize = 32;

/// Names of a column and of the groups that it is in: with `MOST_COLUMNS` they bound the memory.
pub(crate) const MOST_PATH_BYTES: usize = 1024;

/// What the numbers of a column are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum What {
    /// Numbers as they are.
    Plain,
    /// Numbers times this: decimal fractions.
    Scaled(f64),
    /// Times of day, in these seconds.
    TimeOfDay(f64),
    /// Moments, as so many parts of a second since 1970, and whether they are in UTC.
    Moments { per_second: i64, utc: bool },
}

impl What {
    /// Decimal fractions with these places behind the point; 18 digits have no more.
    pub(crate) fn decimals(places: i32) -> Self {
        Self::Scaled(10_f64.powi(-places.clamp(-18, 18)))
    }
}
