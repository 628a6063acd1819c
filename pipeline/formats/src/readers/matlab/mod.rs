//! MATLAB's MAT-files of versions 4, 5, 6 and 7.
//!
//! Source: "MAT-File Format", The MathWorks (matfile_format.pdf,
//! <https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf>):
//! level 4 in its appendix, level 5 (that versions 6 and 7 extend by Unicode text and compressed variables) in its
//! body. What it leaves out (functions, opaque objects, the unnamed workspace at the end) follows the notes in scipy's
//! `scipy.io.matlab`.
//!
//! A vector is one channel. Of a matrix every column is one (time runs downwards, as for `plot` and `filter`) except if
//! it has at most 16 rows and at least 16 times as many columns: then every row. Of arrays of more dimensions the first
//! axis that is longer than 1 is time. Locations are as MATLAB counts, from 1: `/x`, column 2 `/x[2]`, `/x[2,3]`, field
//! `/s.f`, `/s(2).f` of an array of structs, `/c{2}` of a cell array. Single numbers are remarks, as are texts; the
//! sampling rate comes from a single number with a usual name (`fs`, `dt`, `Tinterval`, ...) in the same struct or,
//! failing that, around it, as the instant of the first sample does (`t0`, `t_start`, ...); or from an array of times (`t`, `time`, an `xData` beside `yData`) that runs evenly. Texts beside
//! an array (`units`, `names{1}`, `acc_units`) are units and long names of its channels where no other array can be meant.
//!
//! A compressed variable of at most 64 MiB is inflated to its end when the file is opened, so that damage shows, and
//! once more and kept when one of its channels is read; a longer one is inflated by stream. All of a file may come to
//! 64 MiB, or to 32 times the file.
//!
//! Version 7.3 is HDF5: it is recognised here so that it can be said, so ask an HDF5 reader before this one.

mod class;
mod element;
mod level4;
mod level5;
mod matrix;
mod nested;
mod stream;
mod text;

use crate::axes::settle;
use crate::fail;
use crate::pinned::{Pinned, read_at};
use crate::{Contents, Format, FormatError, Row};
use std::path::Path;

/// MAT-files of versions 4 to 7.
pub struct Mat;

impl Format for Mat {
    const ROW: Row = Row {
        name: "mat",
        title: "MATLAB 4 to 7",
        reads: "vectors, columns of arrays, inside structs and cells, compressed or not, both byte orders; complex \
                arrays for `io.frf`",
        leaves_out: "sparse, text, objects: left out; damaged or mangled files: refused",
        described_by: "MathWorks, \"MAT-File Format\"",
        clock: "arrays of times; numbers named `fs`, `dt`, `Tinterval`, `t0`, ...",
        unit: "texts named `units`",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        level5::recognises(head) || level4::recognises(head)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let (pinned, file) = Pinned::open(path)?;
        let mut head = vec![0; pinned.bytes().min(520) as usize];
        read_at(&file, 0, &mut head)?;
        let mut contents = if level5::recognises(&head) {
            level5::open(&pinned, &head)?
        } else if level4::recognises(&head) {
            level4::open(&pinned, file)?
        } else {
            return Err(fail::at(
                0,
                "neither the 128 bytes that MATLAB 5 to 7 begin a file with nor a variable of MATLAB 4",
                "this is no MAT-file, or a damaged one",
            ));
        };
        settle(&mut contents);
        Ok(contents)
    }
}
