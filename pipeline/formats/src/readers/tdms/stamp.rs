//! Time stamps: seconds since the beginning of 1904, UTC, and a fraction in 2^-64 s.

use crate::calendar::{DAYS_1904_TO_1970, date_of};

/// A time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Stamp {
    pub(super) seconds: i64,
    pub(super) fraction: u64,
}

const NANO: u128 = 1_000_000_000;

impl Stamp {
    /// Zero stands for "not known": relative time.
    pub(super) fn is_known(self) -> bool {
        self.seconds != 0 || self.fraction != 0
    }

    /// Seconds from `other` to this one.
    pub(super) fn seconds_since(self, other: Self) -> f64 {
        const FRACTIONS_PER_SECOND: f64 = 18_446_744_073_709_551_616.0;
        // In whole fractions, so that two times of this century keep their nanoseconds.
        self.fractions().saturating_sub(other.fractions()) as f64 / FRACTIONS_PER_SECOND
    }

    fn fractions(self) -> i128 {
        (i128::from(self.seconds) << 64) | i128::from(self.fraction)
    }

    /// Later by `seconds`; unchanged if those are no number or beyond the range.
    pub(super) fn later_by(self, seconds: f64) -> Self {
        let whole = seconds.floor();
        // 1e12 s are 30 000 years: beyond it the property is not an offset.
        if !whole.is_finite() || whole.abs() > 1e12 {
            return self;
        }
        let added = ((seconds - whole) * 18_446_744_073_709_551_616.0) as u64;
        let (fraction, carried) = self.fraction.overflowing_add(added);
        Self { seconds: self.seconds.saturating_add(whole as i64).saturating_add(i64::from(carried)), fraction }
    }

    /// ISO 8601 in UTC, to the nanosecond, without trailing zeros; nothing outside the years 1 to 9999.
    pub(super) fn iso(self) -> Option<String> {
        let nano = ((u128::from(self.fraction) * NANO + (1 << 63)) >> 64).min(NANO - 1);
        let (days, second) = (self.seconds.div_euclid(86_400), self.seconds.rem_euclid(86_400));
        let (year, month, day) = date_of(days.checked_sub(DAYS_1904_TO_1970)?)?;
        let fraction = match nano {
            0 => String::new(),
            nano => format!(".{nano:09}").trim_end_matches('0').to_owned(),
        };
        let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
        Some(format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}{fraction}Z"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn iso(seconds: i64, fraction: u64) -> Option<String> {
        Stamp { seconds, fraction }.iso()
    }

    #[test]
    fn stamps_print_as_iso_8601() {
        assert_eq!(iso(0, 0).as_deref(), Some("1904-01-01T00:00:00Z"));
        // npTDMS: TdmsTimestamp(3624995089, 7444837212136407040) is 2018-11-13T23:04:49.403585.
        assert_eq!(iso(3_624_995_089, 7_444_837_212_136_407_040).as_deref(), Some("2018-11-13T23:04:49.403585434Z"));
        // Python: datetime(1904, 1, 1) + timedelta(seconds=3034713599) is a leap day's last second.
        assert_eq!(iso(3_034_713_599, 1 << 63).as_deref(), Some("2000-02-29T23:59:59.5Z"));
        assert_eq!(iso(i64::MAX, 0), None);
        assert_eq!(iso(i64::MIN, u64::MAX), None);
    }

    #[test]
    fn offsets_carry_into_the_seconds() {
        let noon = Stamp { seconds: 10, fraction: 3 << 62 };
        assert_eq!(noon.later_by(0.5), Stamp { seconds: 11, fraction: 1 << 62 });
        assert_eq!(noon.later_by(-0.5), Stamp { seconds: 10, fraction: 1 << 62 });
        assert_eq!(noon.later_by(f64::NAN), noon);
        // Further apart than the range: no overflow.
        let (first, last) = (Stamp { seconds: i64::MIN, fraction: 0 }, Stamp { seconds: i64::MAX, fraction: u64::MAX });
        assert!(last.seconds_since(first) > 9e18 && first.seconds_since(last) < -9e18);
        // 0.5 s is a power of two: exact.
        assert_eq!(noon.later_by(0.5).seconds_since(noon), 0.5);
    }
}
