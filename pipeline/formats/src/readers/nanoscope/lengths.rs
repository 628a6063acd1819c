//! How many samples each part of a curve has, checked against the length of the data.

use crate::FormatError;

use super::header::{Header, Section};
use crate::fail;

/// Samples of a curve's parts, in the order in which they are stored, and bytes per sample.
#[derive(Debug, PartialEq)]
pub(super) struct Lengths {
    pub(super) extend: u64,
    pub(super) retract: u64,
    pub(super) hold: u64,
    pub(super) sample_bytes: u64,
}

impl Lengths {
    fn samples(&self) -> Option<u64> {
        self.extend.checked_add(self.retract)?.checked_add(self.hold)
    }

    /// Bytes of one curve; none if that is nothing or more than any file has.
    fn bytes(&self) -> Option<u64> {
        self.samples()?.checked_mul(self.sample_bytes).filter(|&b| b > 0)
    }

    /// The stated lengths that the data have. Errors: none has; several curves.
    pub(super) fn of(list: &Section, force: Option<&Section>, header: &Header) -> Result<Self, FormatError> {
        let data_bytes = list.integer("Data length").unwrap_or_default();
        let stated = list.integer("Bytes/pixel").unwrap_or(2);
        // Gwyddion's authors found that this key need not be the width of the samples: the data's length decides
        let widths: &[u64] = if stated == 2 { &[2, 4] } else { &[4] };
        if !matches!(stated, 2 | 4) {
            return Err(fail::at(
                list.at,
                format!("found {stated} bytes per pixel, wanted 2 or 4"),
                "the header is damaged: copy the file again from the instrument",
            ));
        }
        let hold = force.and_then(|f| f.integer("Hold Samples")).unwrap_or(0);
        let candidates: Vec<Self> = [Some(list), force]
            .into_iter()
            .flatten()
            .filter_map(|s| s.value("Samps/line"))
            .flat_map(parts)
            .flat_map(|(extend, retract)| [hold, 0].map(|hold| (extend, retract, hold)))
            .flat_map(|(extend, retract, hold)| {
                widths.iter().map(move |&sample_bytes| Self { extend, retract, hold, sample_bytes })
            })
            .collect();
        let several = candidates.iter().find_map(|c| {
            c.bytes().filter(|&b| data_bytes > b && data_bytes.is_multiple_of(b)).map(|b| data_bytes / b)
        });
        if let Some(fits) = candidates.into_iter().find(|c| c.bytes() == Some(data_bytes)) {
            return Ok(fits);
        }
        Err(match several {
            Some(curves) => fail::at(
                list.at,
                format!("found {curves} curves in one list (a force volume), wanted a single force curve"),
                "export the curves of interest one by one from the Nanoscope software",
            ),
            None => fail::at(
                list.at,
                format!(
                    "found {data_bytes} bytes of samples, which no curve of `Samps/line: {}` has",
                    list.value("Samps/line").or_else(|| header.anywhere("Samps/line")).unwrap_or("?")
                ),
                "the header is damaged: copy the file again from the instrument",
            ),
        })
    }
}

/// `512 512` gives both parts; a single number is that of each, or of the only one.
fn parts(value: &str) -> Vec<(u64, u64)> {
    let numbers: Vec<u64> = value.split_whitespace().map_while(|n| n.parse().ok()).collect();
    match numbers.as_slice() {
        [extend, retract, ..] => vec![(*extend, *retract)],
        [both] => vec![(*both, *both), (*both, 0)],
        [] => Vec::new(),
    }
}
