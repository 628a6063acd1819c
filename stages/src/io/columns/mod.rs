//! Input and output from the columns of a measured table: text (CSV, DAT, LVM) or MATLAB version 5.

mod example;
mod lvm;
mod mat;
mod selection;
mod series;
mod stage;
mod stretch;
mod table;
#[cfg(test)]
mod tests;
mod text;

pub use mat::read_mat;
pub use selection::Column;
pub use stage::Columns;
pub use stretch::{Removal, Stretch, Trend, halves};
pub use table::{ColumnError, ColumnTable, NamedColumn, Text, read_columns};
pub use text::{Separator, read_text};
