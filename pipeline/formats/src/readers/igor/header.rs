//! The headers of Igor binary waves: where things are, checked against the file's size.

use crate::FormatError;
use crate::fields::Fields;

use super::kind::{Kind, kind};
use crate::fail;
use crate::number::Order;

/// Bytes of the longest header (version 5).
pub(super) const MOST_BYTES: u64 = 384;

/// Where an optional part lies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Part {
    pub(super) at: u64,
    pub(super) bytes: u64,
}

/// A wave's header, whatever the version.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) version: u16,
    pub(super) order: Order,
    /// 0 in a sound header.
    pub(super) checksum: u16,
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) points: u64,
    /// Sizes of the used dimensions; rows first.
    pub(super) dims: Vec<u64>,
    pub(super) x_step: f64,
    pub(super) x_start: f64,
    pub(super) x_unit: String,
    pub(super) data_unit: String,
    /// Seconds since 1904; 0 if unknown.
    pub(super) created: u32,
    pub(super) data: Part,
    pub(super) formula: Part,
    pub(super) note: Part,
    pub(super) long_data_unit: Part,
    pub(super) long_x_unit: Part,
    pub(super) column_labels: Part,
}

/// Version and byte order: the first word is small in one of them only.
pub(super) fn version(head: &[u8]) -> Option<(u16, Order)> {
    let word = *head.first_chunk::<2>()?;
    [Order::Little, Order::Big]
        .map(|order| (u16::from_le_bytes(order.little(word)), order))
        .into_iter()
        .find(|(version, _)| header_bytes(*version).is_some())
}

/// Sum of the header's words, which the writer makes 0 (TN003); none if this is no header.
///
/// Up to version 3 the header's structure ends in the first four samples or the padding, 16 bytes that are summed with
/// it.
pub(super) fn checksum(head: &[u8]) -> Option<u16> {
    let (version, order) = version(head)?;
    let summed = header_bytes(version)? + if version == 5 { 0 } else { 16 };
    let words = head.get(..summed as usize)?.as_chunks::<2>().0;
    Some(words.iter().fold(0, |sum: u16, word| sum.wrapping_add(u16::from_le_bytes(order.little(*word)))))
}

/// Bytes before the samples: the file's header and the wave's.
fn header_bytes(version: u16) -> Option<u64> {
    Some(file_header_bytes(version)? + wave_header_bytes(version))
}

fn file_header_bytes(version: u16) -> Option<u64> {
    match version {
        1 => Some(8),
        2 => Some(16),
        3 => Some(20),
        5 => Some(64),
        _ => None,
    }
}

fn wave_header_bytes(version: u16) -> u64 {
    if version == 5 { 320 } else { 110 }
}

impl Header {
    /// Reads the header from the file's first bytes. Errors: no wave, cut off, complex, or its parts do not fit each
    /// other.
    pub(super) fn parse(head: &[u8], file_bytes: u64) -> Result<Self, FormatError> {
        let Some((version, order)) = version(head) else { return Err(no_wave(head)) };
        let start = file_header_bytes(version).unwrap_or_default();
        let data_at = start + wave_header_bytes(version);
        if (head.len() as u64) < data_at {
            return Err(fail::truncated("the wave's header", 0, data_at, file_bytes));
        }
        let fields = Fields { bytes: head, order };
        let mut header =
            if version == 5 { Self::version_5(&fields)? } else { Self::version_1_to_3(&fields, version, start)? };
        header.checksum = checksum(head).unwrap_or_default();
        header.check(file_bytes)?;
        Ok(header)
    }

    fn version_1_to_3(f: &Fields<'_>, version: u16, start: u64) -> Result<Self, FormatError> {
        let wave_bytes = f.size("a wave size", 2)?;
        let end = start + wave_bytes;
        let note = Part { at: end, bytes: if version >= 2 { f.size("a note size", 6)? } else { 0 } };
        let formula =
            Part { at: end + note.bytes, bytes: if version == 3 { f.size("a formula size", 10)? } else { 0 } };
        let points = f.size("a number of points", start + 42)?;
        Ok(Self {
            version,
            order: f.order,
            checksum: 0,
            name: f.text(start + 6, 20),
            kind: kind(f.u16(start), start)?,
            points,
            dims: vec![points],
            x_step: f.f64(start + 48),
            x_start: f.f64(start + 56),
            x_unit: f.text(start + 38, 4),
            data_unit: f.text(start + 34, 4),
            created: f.u32(start + 96),
            // 16 bytes of padding follow the samples and are counted
            data: Part { at: start + 110, bytes: wave_bytes.saturating_sub(110 + 16) },
            formula,
            note,
            long_data_unit: Part::default(),
            long_x_unit: Part::default(),
            column_labels: Part::default(),
        })
    }

    fn version_5(f: &Fields<'_>) -> Result<Self, FormatError> {
        let wave_bytes = f.size("a wave size", 4)?;
        // the parts follow each other in this order: samples, formula, note, data unit, 4 dimension units, 4 sets of
        // labels
        let mut end = 64 + wave_bytes;
        let mut next = |what, at| {
            let part = Part { at: end, bytes: f.size(what, at)? };
            end += part.bytes;
            Ok(part)
        };
        let formula = next("a formula size", 8)?;
        let note = next("a note size", 12)?;
        let long_data_unit = next("a data unit's size", 16)?;
        let long_x_unit = next("an x unit's size", 20)?;
        for at in [24, 28, 32, 36] {
            next("a unit's or label's size", at)?;
        }
        let column_labels = next("a column label size", 40)?;
        let dims = [132, 136, 140, 144].map(|at| f.size("a dimension", at));
        let dims = dims.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().take_while(|&n| n > 0).collect();
        Ok(Self {
            version: 5,
            order: f.order,
            checksum: 0,
            name: f.text(92, 32),
            kind: kind(f.u16(80), 80)?,
            points: f.size("a number of points", 76)?,
            dims,
            x_step: f.f64(148),
            x_start: f.f64(180),
            x_unit: f.text(216, 4),
            data_unit: f.text(212, 4),
            created: f.u32(68),
            data: Part { at: 384, bytes: wave_bytes.saturating_sub(320) },
            formula,
            note,
            long_data_unit,
            long_x_unit,
            column_labels,
        })
    }

    /// Whether a formula stands for samples that were not saved (TN003 on version 3).
    pub(super) fn unsaved(&self) -> bool {
        self.points > 0 && self.formula.bytes > 0 && self.data.bytes == 0
    }

    /// Errors: samples that the header counts are not in the file.
    fn check(&self, file_bytes: u64) -> Result<(), FormatError> {
        let Kind::Numbers(code) = self.kind else { return Ok(()) };
        // no dimension in use: a wave of zero points
        let one = u64::from(!self.dims.is_empty());
        if self.dims.iter().try_fold(one, |product, &n| product.checked_mul(n)) != Some(self.points) {
            return Err(fail::at(
                if self.version == 5 { 132 } else { 0 },
                format!("found dimensions {:?}, wanted a product of {} points", self.dims, self.points),
                "the header is damaged: copy or export the wave again",
            ));
        }
        // cannot overflow: points < 2^31
        let wanted = self.points * code.bytes();
        if self.unsaved() {
            return Ok(());
        }
        if wanted > self.data.bytes {
            return Err(fail::at(
                if self.version == 5 { 4 } else { 2 },
                format!(
                    "found room for {} bytes of samples, wanted {wanted} for {} points of {}",
                    self.data.bytes,
                    self.points,
                    code.name()
                ),
                "the header is damaged: copy or export the wave again",
            ));
        }
        if wanted < self.data.bytes {
            return Err(fail::at(
                if self.version == 5 { 4 } else { 2 },
                format!(
                    "found {} bytes of samples, wanted {wanted} for {} points of {}",
                    self.data.bytes,
                    self.points,
                    code.name()
                ),
                "the header is damaged: copy or export the wave again",
            ));
        }
        if self.data.at + wanted > file_bytes {
            return Err(fail::truncated("samples", self.data.at, wanted, file_bytes));
        }
        Ok(())
    }
}

fn no_wave(head: &[u8]) -> FormatError {
    let found =
        head.first_chunk::<2>().map_or("an empty file".to_owned(), |w| format!("{:#06x}", u16::from_le_bytes(*w)));
    fail::at(
        0,
        format!("found {found} as first word, wanted version 1, 2, 3 or 5 of an Igor binary wave in either byte order"),
        "save the wave from Igor Pro with Data > Save Waves > Save Igor Binary",
    )
}
