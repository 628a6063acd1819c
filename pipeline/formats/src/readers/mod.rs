//! The readers: a folder each, and the list of them in the order in which they are asked.
//!
//! A new format is a folder here, a line among the modules and one in the list `FORMATS`; its description for people and
//! programs ([`Row`]) stands in its folder. A fuzz corpus (`fuzz/corpus/NAME`) is asked for by a test.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::{Contents, Format, FormatError, Row, fail};

pub mod arrow;
pub mod igor;
pub mod jpk;
pub mod keysight;
pub mod lecroy;
pub mod matlab;
pub mod nanoscope;
pub mod netcdf;
pub mod numpy;
pub mod parquet;
pub mod raw_binary;
pub mod tdms;
pub mod tektronix;
pub mod text_table;
pub mod uff;
pub mod wav;

/// First bytes of a file that a format may look at.
pub const HEAD_BYTES: usize = 4096;

/// A format as the registry knows it.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Its description.
    pub row: Row,
    recognises: fn(&[u8], &Path) -> bool,
    open: fn(&Path) -> Result<Contents, FormatError>,
}

impl Known {
    const fn of<F: Format>() -> Self {
        Self { row: F::ROW, recognises: F::recognises, open: F::open }
    }

    /// Whether first bytes and name say that a file is of this format.
    pub fn recognises(&self, head: &[u8], path: &Path) -> bool {
        (self.recognises)(head, path)
    }

    /// Opens a file as of this format, whatever it is. Errors: as [`Format::open`], with the file's name.
    pub fn open(&self, path: &Path) -> Result<Contents, FormatError> {
        (self.open)(path).map_err(|error| error.in_file(path))
    }
}

/// Marks at a file's beginning come first, in any order; MATLAB 4 has no mark but a plausible header; tables of text
/// are what is left.
const FORMATS: &[Known] = &[
    Known::of::<tdms::Tdms>(),
    Known::of::<numpy::Npy>(),
    Known::of::<numpy::Npz>(),
    Known::of::<parquet::Parquet>(),
    Known::of::<arrow::Arrow>(),
    Known::of::<jpk::JpkForce>(),
    Known::of::<nanoscope::Nanoscope>(),
    Known::of::<wav::Wav>(),
    Known::of::<lecroy::LeCroy>(),
    Known::of::<keysight::Keysight>(),
    Known::of::<tektronix::TektronixIsf>(),
    Known::of::<netcdf::NetCdf>(),
    Known::of::<uff::Uff>(),
    Known::of::<matlab::Mat>(),
    Known::of::<igor::IgorWave>(),
    Known::of::<text_table::TextTable>(),
];

/// All formats, in the order in which they are asked. Files without a header ([`raw_binary::RawBinary`]) are recognised by
/// nobody.
pub fn formats() -> &'static [Known] {
    FORMATS
}

/// The first format that knows a file by its beginning and its name; none if nobody does.
pub fn recognise(head: &[u8], path: &Path) -> Option<&'static Known> {
    FORMATS.iter().find(|known| known.recognises(head, path))
}

/// A file's first bytes. Errors: it cannot be read, or is no regular file.
pub fn head_of(path: &Path) -> Result<Vec<u8>, FormatError> {
    let (pinned, file) = crate::pinned::Pinned::open(path).map_err(|error| error.in_file(path))?;
    let mut head = Vec::with_capacity(pinned.bytes().min(HEAD_BYTES as u64) as usize);
    let cannot = |error| fail::plain(format!("the file cannot be read: {error}"), "check the disk").in_file(path);
    File::take(file, HEAD_BYTES as u64).read_to_end(&mut head).map_err(cannot)?;
    Ok(head)
}
