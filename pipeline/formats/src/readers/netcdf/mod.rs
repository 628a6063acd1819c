//! Classic netCDF: `.nc`, `.cdf` of versions CDF-1, CDF-2 (offsets of 64 bits) and CDF-5 (sizes of 64 bits).
//!
//! - A header of dimensions, attributes and variables; then the numbers, big-endian. Variables along the unlimited
//!   dimension lie interleaved, a slab of each in every record.
//! - A variable of one dimension is a channel, `/y`; one of several has a channel for each lane along its dimension of
//!   time: `/y[0]`, `/y[1]`, ... That is the dimension whose coordinate variable holds times, else the unlimited one, else
//!   as for NumPy's arrays ([`crate::Lanes`]).
//! - Attributes: `units`, `long_name` or `standard_name`, `scale_factor`, `add_offset`, `_FillValue` or `missing_value`,
//!   `_Unsigned`. Numbers that were never written have netCDF's own fill value, which is taken for floats and integers of
//!   32 bits.
//! - A variable that is named like its dimension is that dimension's axis; times give the rate of what lies along them.
//!   Numbers that are named like a rate give it too: attributes of the file or of a variable, variables of one number.
//! - Characters are left out. Version 4 is HDF5 and not read here.
//!
//! Source: Unidata, "NetCDF Classic Format Specification" (NetCDF User's Guide, appendix "File Format Specifications");
//! fill values and `_Unsigned`: the same guide, appendix "Attribute Conventions".

mod attributes;
mod channels;
mod cursor;
mod header;
mod kind;
mod layout;

use std::path::Path;

use crate::opened::Opened;
use crate::{Contents, Format, FormatError, Row};

/// Classic netCDF files.
#[derive(Debug, Clone, Copy)]
pub struct NetCdf;

impl Format for NetCdf {
    const ROW: Row = Row {
        name: "netcdf",
        title: "netCDF, classic",
        reads: "CDF-1, CDF-2, CDF-5: variables of numbers, records, lanes of more dimensions; scale, offset, fill \
                value, `_Unsigned`; coordinate variables are axes",
        leaves_out: "characters: left out; netCDF-4 is HDF5",
        described_by: "Unidata, \"NetCDF Classic Format Specification\"",
        clock: "coordinate variables of times; numbers named `fs`, `dt`, ...",
        unit: "`units`",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        matches!(head, [b'C', b'D', b'F', 1 | 2 | 5, ..])
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let file = Opened::new(path)?;
        let header = header::Header::of(&file)?;
        channels::contents(&file, &header)
    }
}
