//! A file of one array.

use super::array::Named;
use super::dtype::{Field, Part};
use super::header::{self, Header, LEAD_BYTES, MAGIC};
use crate::axes::settle;
use crate::fail;
use crate::grid::Store;
use crate::listing::Listing;
use crate::pinned::{Pinned, read_at};
use crate::{Contents, Format, FormatError, Row};
use std::fs::File;
use std::path::Path;

/// NPY files of versions 1.0 to 3.0.
pub struct Npy;

impl Format for Npy {
    const ROW: Row = Row {
        name: "npy",
        title: "NumPy array",
        reads: "versions 1 to 3, integers, float16 to float64, structured arrays, C and Fortran order",
        leaves_out: "objects, texts, complex numbers",
        described_by: "NumPy, \"NEP 1\" and `numpy.lib.format`",
        clock: "",
        unit: "",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        head.starts_with(MAGIC)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let (pinned, file) = Pinned::open(path)?;
        let header = header_at(&file, 0, pinned.bytes())?;
        let missing = (header.bytes.saturating_add(header.data_bytes)).saturating_sub(pinned.bytes());
        if missing > 0 {
            let problem = format!(
                "an array of shape {:?} has {} bytes, {missing} of them are missing",
                header.shape, header.data_bytes
            );
            return Err(fail::at(header.bytes, problem, fail::COPY_AGAIN));
        }
        if let [Field { what: Part::Complex(..), .. }] = header.fields.as_slice() {
            let help = "save them with their frequencies in one NPZ: numpy.savez(file, frequency=..., response=...)";
            return Err(fail::at(0, "the array holds complex numbers, and no frequencies lie beside it", help));
        }
        if let [field] = header.fields.as_slice()
            && let Some(what) = field.what.no_number()
        {
            let problem =
                format!("the array holds {what}; integers or 16-, 32- or 64-bit floating point numbers were wanted");
            return Err(fail::at(0, problem, "convert it in Python with astype and save it again"));
        }
        let mut listing = Listing::default();
        let behind = pinned.bytes() - header.bytes - header.data_bytes;
        if behind > 0 {
            listing.remark(format!("{behind} bytes behind the array are ignored"));
        }
        Named { name: "array", header: &header, store: Store::File(pinned.clone()), at: 0 }.list(&mut listing)?;
        let (major, minor) = header.version;
        let mut contents = listing.finish(format!("NumPy NPY {major}.{minor}"));
        settle(&mut contents);
        Ok(contents)
    }
}

/// Reads the header of the array that begins at byte `at` of a file and may have `available` bytes.
pub(super) fn header_at(file: &File, at: u64, available: u64) -> Result<Header, FormatError> {
    let mut head = vec![0; available.min(LEAD_BYTES as u64) as usize];
    read_at(file, at, &mut head)?;
    let (version, from, length) = header::lead(&head, available)?;
    let mut dictionary = vec![0; length as usize];
    read_at(file, at + from, &mut dictionary)?;
    Header::of(version, from, &dictionary)
}
