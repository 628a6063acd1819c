//! How the numbers of a point lie in the data of 58b.

use super::header::Header;

/// Bytes of the numbers of a point: abscissa first, then one ordinate, or real and imaginary part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// 0 where the abscissa is even and not stored.
    pub(super) abscissa: u64,
    pub(super) ordinate: u64,
    parts: u64,
}

impl Layout {
    /// The layouts of a header, the standard's first: its uneven abscissa has single precision, some writers make it as
    /// wide as the ordinate. The package pyuff writes double precision throughout, whatever type it states.
    pub(super) fn of(header: &Header) -> Vec<Self> {
        let parts = header.numbers() as u64;
        let layout = |abscissa: u64, ordinate| {
            let abscissa = if header.even { 0 } else { abscissa };
            Self { abscissa, ordinate, parts }
        };
        let standard = layout(4, if header.double { 8 } else { 4 });
        let doubles = layout(8, 8);
        if standard == doubles { vec![standard] } else { vec![standard, doubles] }
    }

    /// The layout of a header whose points take so many bytes, or that many and less than one point of padding.
    pub(super) fn fitting(header: &Header, bytes: u64) -> Option<Self> {
        let layouts = Self::of(header);
        let exact = layouts.iter().find(|layout| layout.bytes(header.points) == Some(bytes));
        let padded = layouts.iter().find(|layout| {
            let padding = layout.bytes(header.points).and_then(|wanted| bytes.checked_sub(wanted));
            padding.is_some_and(|padding| padding < layout.point())
        });
        exact.or(padded).copied()
    }

    /// Bytes of a point.
    pub(super) fn point(self) -> u64 {
        self.abscissa + self.parts * self.ordinate
    }

    /// Bytes of so many points; none if no file holds them.
    pub(super) fn bytes(self, points: u64) -> Option<u64> {
        points.checked_mul(self.point())
    }

    /// Whether the ordinates are in double precision.
    pub(super) fn is_double(self) -> bool {
        self.ordinate == 8
    }
}
