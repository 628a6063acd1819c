//! All formats, in the order in which they are asked.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::igor::IgorWave;
use crate::jpk::JpkForce;
use crate::keysight::Keysight;
use crate::lecroy::LeCroy;
use crate::matlab::Mat;
use crate::nanoscope::Nanoscope;
use crate::numpy::{Npy, Npz};
use crate::tdms::Tdms;
use crate::tektronix::TektronixIsf;
use crate::text_table::TextTable;
use crate::uff::Uff;
use crate::wav::Wav;
use crate::{Contents, Format, FormatError, fail};

/// First bytes of a file that a format may look at.
pub const HEAD_BYTES: usize = 4096;

/// A format as the registry knows it.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// How it is asked for: `tdms`.
    pub name: &'static str,
    /// What it is, for people.
    pub title: &'static str,
    recognises: fn(&[u8], &Path) -> bool,
    open: fn(&Path) -> Result<Contents, FormatError>,
}

impl Known {
    const fn of<F: Format>(name: &'static str, title: &'static str) -> Self {
        Self { name, title, recognises: F::recognises, open: F::open }
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
    Known::of::<Tdms>("tdms", "NI TDMS"),
    Known::of::<Npy>("npy", "NumPy array"),
    Known::of::<Npz>("npz", "NumPy archive"),
    Known::of::<JpkForce>("jpk", "JPK force curves and maps"),
    Known::of::<Nanoscope>("nanoscope", "Bruker Nanoscope force curve"),
    Known::of::<Wav>("wav", "Waveform audio"),
    Known::of::<LeCroy>("lecroy", "LeCroy waveform"),
    Known::of::<Keysight>("keysight", "Keysight or Rigol binary waveform"),
    Known::of::<TektronixIsf>("isf", "Tektronix waveform"),
    Known::of::<Uff>("uff", "Universal File Format 58"),
    Known::of::<Mat>("mat", "MATLAB 4 to 7"),
    Known::of::<IgorWave>("ibw", "Igor binary wave"),
    Known::of::<TextTable>("text", "LabVIEW LVM or a table of text"),
];

/// All formats, in the order in which they are asked. Files without a header ([`crate::RawBinary`]) are recognised by
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
