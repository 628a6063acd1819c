//! Igor's dates: seconds since 1904-01-01, local time of the machine that wrote them.

use crate::calendar::{DAYS_1904_TO_1970, date_of};

/// ISO 8601 to the second, without a zone, for the file states none; none for 0 ("not set") and what is no date.
pub(super) fn iso(seconds: f64) -> Option<String> {
    // the upper bound is what Igor's 32-bit fields can hold
    if !(seconds >= 1.0 && seconds <= f64::from(u32::MAX)) {
        return None;
    }
    let seconds = seconds as i64;
    let (year, month, day) = date_of(seconds / 86_400 - DAYS_1904_TO_1970)?;
    let s = seconds % 86_400;
    Some(format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_pythons_datetime() {
        // datetime(1904, 1, 1) + timedelta(seconds=...)
        assert_eq!(iso(3_563_961_474.0).as_deref(), Some("2016-12-07T13:17:54"));
        assert_eq!(iso(3_001_252_180.0).as_deref(), Some("1999-02-07T17:09:40"));
        assert_eq!(iso(5_097_600.0).as_deref(), Some("1904-02-29T00:00:00"));
        assert_eq!(iso(0.0), None);
        assert_eq!(iso(f64::NAN), None);
    }
}
