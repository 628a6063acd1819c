//! NI TDMS, versions 1.0 (4712) and 2.0 (4713): files of LabVIEW, SignalExpress, FlexLogger and DAQmx logging.
//!
//! A file is a row of segments. Each has a lead-in of 28 bytes, metadata (objects, their properties and how their raw
//! data lie) and raw data in one or more chunks; what a segment doesn't say again holds on from the one before.
//! Channels are objects `/'Group'/'Channel'`; here their location is `/Group/Channel` (the quoted path where a name has
//! a slash in it).
//!
//! - Raw data: contiguous, interleaved, DAQmx (format changing and digital line scalers); both byte orders.
//! - `NI_Scale` chains of Linear and Polynomial (and DAQmx scalers below them) are applied; a chain with another scale
//!   type leaves the channel out, with a remark that names the type.
//! - The rate is 1 / `wf_increment`; the start `wf_start_time` + `wf_start_offset`, without it the time stamps of the
//!   Express VIs.
//! - A segment that states another start or increment than its predecessor's samples lead to begins behind a gap.
//! - Text, time stamps and complex numbers are no channels: a remark says so. Extended and fixed point numbers have no
//!   size that the format defines: a file with raw data of these is refused.
//! - A last segment that is cut off gives the whole values that are there. Where channels lie one after the other, they
//!   may then differ in length.
//! - 64-bit whole numbers become float64 (exact to 2^53).
//!
//! Source: National Instruments, "TDMS File Format Internal Structure",
//! ni.com/en/support/documentation/supplemental/07/tdms-file-format-internal-structure.html; the layout of DAQmx
//! indices, where that article is incomplete, as observed in files and described by the open reader npTDMS.

mod bytes;
mod channel;
mod daqmx;
mod decode;
mod extents;
mod index;
mod kind;
mod lead_in;
mod object;
mod plan;
mod property;
mod scale;
mod source;
mod stamp;
mod timing;
mod walk;

use crate::axes::settle;
use crate::pinned::Pinned;
use crate::{Contents, Format, FormatError, Row};
use std::path::Path;

/// The format NI TDMS.
#[derive(Debug, Clone, Copy)]
pub struct Tdms;

impl Format for Tdms {
    const ROW: Row = Row {
        name: "tdms",
        title: "NI TDMS",
        reads: "versions 4712 and 4713, both byte orders, contiguous, interleaved and DAQmx data, linear and \
                polynomial `NI_Scale`, a last segment that is cut off; without a waveform the rate from a property \
                named like one (`SamplingFrequency`); a segment that starts elsewhere than the one before it ends \
                is a gap",
        leaves_out: "other scalings, text, time stamps, complex numbers: left out; extended and fixed point: refused",
        described_by: "NI, \"TDMS File Format Internal Structure\"",
        clock: "`wf_increment`",
        unit: "`unit_string`",
    };

    fn recognises(head: &[u8], _path: &Path) -> bool {
        head.starts_with(lead_in::TAG)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let (pinned, file) = Pinned::open(path)?;
        let recorded = walk::walk(&file, pinned.bytes())?;
        let mut contents = channel::contents(recorded, &pinned);
        settle(&mut contents);
        Ok(contents)
    }
}
