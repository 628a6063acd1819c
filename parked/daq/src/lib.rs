//! Readers of what data acquisition programs write: NI TDMS, LabVIEW LVM and other tables of text, Universal File Format.

mod fail;
mod pinned;
pub mod tdms;
pub mod text_table;
pub mod uff;
