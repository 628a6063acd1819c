//! A table of named columns, and the file that it comes from.

use super::mat::read_mat;
use super::text::{Separator, read_text};

/// Columns of equal length, NaN where a sample is missing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColumnTable {
    /// The columns, in the file's order.
    pub columns: Vec<NamedColumn>,
    /// What the file holds besides and cannot be read as columns (structs, texts), by name.
    pub others: Vec<String>,
    /// Sample interval, where the file's header states one, the same for all columns.
    pub interval_s: Option<f64>,
}

/// A column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NamedColumn {
    /// Name in the header, or of the variable; empty if it has none.
    pub name: String,
    /// Its values; NaN where there is none.
    pub values: Vec<f64>,
    /// The first entry that is text, if any.
    pub text: Option<Text>,
}

/// An entry that is no number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// Line in the file, from 1.
    pub line: usize,
    /// What stands there.
    pub found: String,
}

/// Why a file cannot be read as columns.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ColumnError {
    /// No line of numbers.
    #[error("no line begins with a number; wanted columns of numbers, with a header or without")]
    NoNumbers,
    /// A header within the data.
    #[error("line {line} is `{found}`, after {rows} rows of numbers; wanted one table: cut the file there")]
    TextAmongNumbers {
        /// Line in the file, from 1.
        line: usize,
        /// What it begins with.
        found: String,
        /// Rows before it.
        rows: usize,
    },
    /// An LVM header that does not end.
    #[error("the LabVIEW header has no `***End_of_Header***`: the file is cut short")]
    EndlessHeader,
    /// MATLAB 7.3.
    #[error("a MATLAB 7.3 file, which is HDF5; wanted version 5 to 7: save it in MATLAB with `-v7`")]
    Hdf5,
    /// MATLAB 4, or no MATLAB file.
    #[error("no MATLAB 5 header (MATLAB 4 has none); wanted version 5 to 7: save it in MATLAB with `-v7`")]
    NotMat5,
    /// A MATLAB file that breaks off or contradicts itself.
    #[error("damaged at byte {at}: {what}")]
    Damaged {
        /// Byte in the file, or in the unpacked variable.
        at: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// A MATLAB file without numbers in columns.
    #[error("no real matrix of numbers; there is: {0}")]
    NoMatrix(String),
}

/// Reads a file's bytes as columns: MATLAB by its name's end `mat`, text otherwise.
///
/// # Method
/// Text: see [`read_text`]; MATLAB: see [`read_mat`]. The table is held whole.
/// # Errors
/// What the two give.
pub fn read_columns(name: &str, bytes: &[u8], separator: Separator) -> Result<ColumnTable, ColumnError> {
    if name.to_ascii_lowercase().ends_with(".mat") { read_mat(bytes) } else { read_text(bytes, separator) }
}
