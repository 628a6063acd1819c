//! Words and texts at fixed places of a header.

use crate::FormatError;

use crate::fail;
use crate::number::Order;
use crate::text;

/// Fields at fixed places; absent ones read as 0, for the length was checked before.
pub(crate) struct Fields<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) order: Order,
}

impl Fields<'_> {
    fn word<const N: usize>(&self, at: u64) -> [u8; N] {
        let at = at as usize;
        let word = self.bytes.get(at..).and_then(|b| b.first_chunk::<N>()).copied().unwrap_or([0; N]);
        self.order.little(word)
    }

    pub(crate) fn u16(&self, at: u64) -> u16 {
        u16::from_le_bytes(self.word(at))
    }

    pub(crate) fn u32(&self, at: u64) -> u32 {
        u32::from_le_bytes(self.word(at))
    }

    pub(crate) fn u64(&self, at: u64) -> u64 {
        u64::from_le_bytes(self.word(at))
    }

    pub(crate) fn u8(&self, at: u64) -> u8 {
        u8::from_le_bytes(self.word(at))
    }

    pub(crate) fn f32(&self, at: u64) -> f32 {
        f32::from_le_bytes(self.word(at))
    }

    pub(crate) fn f64(&self, at: u64) -> f64 {
        f64::from_le_bytes(self.word(at))
    }

    pub(crate) fn text(&self, at: u64, bytes: usize) -> String {
        text::field(self.bytes.get(at as usize..).and_then(|b| b.get(..bytes)).unwrap_or_default())
    }

    /// A count or size, which the format keeps signed. Errors: it is negative.
    pub(crate) fn size(&self, what: &str, at: u64) -> Result<u64, FormatError> {
        let value = self.u32(at) as i32;
        u64::try_from(value).map_err(|_| {
            fail::at(
                at,
                format!("found {what} of {value}, wanted 0 or more"),
                "the header is damaged: copy or export the file again",
            )
        })
    }
}
