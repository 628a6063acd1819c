//! The description of every format that a recording may have.

use afmid_formats::{Row, formats};

use super::how::{HDF5, NATIVE, RAW};

const NATIVE_ROW: Row = Row {
    name: NATIVE,
    title: "native record",
    reads: "HDF5 with the file attribute `sample_rate_hz`, a dataset per channel (int8 to int32, float32, float64; plain, \
            gzip, shuffle)",
    leaves_out: "other filters, 64-bit integers, two dimensions: `format = \"hdf5\"` reads the latter two",
    described_by: "README, \"Recordings\"; CF conventions 8.1",
    clock: "attribute `sample_rate_hz`",
    unit: "attribute `units`",
};

const HDF5_ROW: Row = Row {
    name: HDF5,
    title: "HDF5 of any layout",
    reads: "G-mode, USID, NSID, MATLAB 7.3, PyTables, pandas (fixed and table), JPK's `encoder.scaling`: datasets of one \
            dimension and rows of two-dimensional ones (columns, if these are at most 16 and 16 times as long, or as long \
            as the times beside them), columns of tables of records, groups at any depth",
    leaves_out: "three and more dimensions, complex, text, structs, references, records in two byte orders; the unit of \
                 whole numbers without a scale, links to other files; no rate is taken from USID's ancillary datasets: \
                 give it",
    described_by: "HDF5 File Format Specification 3; pycroscopy's USID and NSID data models",
    clock: "arrays of times; numbers and attributes named `sample_rate_hz`, `sampling_rate`, `fs`, `dt`, \
            `IO_rate_[Hz]`, ...",
    unit: "attributes `units`, `unit`",
};

const RAW_ROW: Row = Row {
    name: RAW,
    title: "raw binary",
    reads: "8 to 32-bit integers, float32, float64, either byte order, interleaved or one channel behind the other, as the \
            table `raw` says",
    leaves_out: "the wrong byte order, where the samples show it",
    described_by: "the user",
    clock: "",
    unit: "",
};

/// The description of each format, in the order in which they are asked: HDF5, those of [`formats`], files without a header.
pub fn rows() -> impl Iterator<Item = Row> {
    [NATIVE_ROW, HDF5_ROW].into_iter().chain(formats().iter().map(|known| known.row)).chain([RAW_ROW])
}
