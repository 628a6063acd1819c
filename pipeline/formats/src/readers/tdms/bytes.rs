//! A cursor over metadata that knows the byte order and where in the file it stands.

use crate::FormatError;
use crate::fail;
use crate::number::Order;

/// Metadata bytes and the place in them.
#[derive(Debug)]
pub(super) struct Bytes<'a> {
    rest: &'a [u8],
    /// Byte in the file of the first of `rest`.
    at: u64,
    order: Order,
}

impl<'a> Bytes<'a> {
    pub(super) fn new(all: &'a [u8], at: u64, order: Order) -> Self {
        Self { rest: all, at, order }
    }

    /// Byte in the file that is read next.
    pub(super) fn at(&self) -> u64 {
        self.at
    }

    pub(super) fn order(&self) -> Order {
        self.order
    }

    /// The next `count` bytes, which hold `what`.
    pub(super) fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], FormatError> {
        let Some((taken, rest)) = self.rest.split_at_checked(count) else {
            let left = self.rest.len();
            let problem = format!("{what} needs {count} bytes, the segment's metadata has {left} left");
            return Err(fail::at(self.at, problem, fail::COPY_AGAIN));
        };
        self.rest = rest;
        self.at += count as u64;
        Ok(taken)
    }

    /// The next `N` bytes, least significant first.
    pub(super) fn number<const N: usize>(&mut self, what: &str) -> Result<[u8; N], FormatError> {
        let mut number = [0; N];
        number.copy_from_slice(self.take(N, what)?);
        Ok(self.order.little(number))
    }

    pub(super) fn u8(&mut self, what: &str) -> Result<u8, FormatError> {
        self.number::<1>(what).map(|[byte]| byte)
    }

    pub(super) fn u32(&mut self, what: &str) -> Result<u32, FormatError> {
        self.number(what).map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self, what: &str) -> Result<u64, FormatError> {
        self.number(what).map(u64::from_le_bytes)
    }

    /// A length in 32 bits and that many bytes of UTF-8; bytes that are none become U+FFFD.
    pub(super) fn text(&mut self, what: &str) -> Result<String, FormatError> {
        let length = self.u32(what)? as usize;
        Ok(String::from_utf8_lossy(self.take(length, what)?).into_owned())
    }
}
