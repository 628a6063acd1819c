//! Igor's dates: seconds since 1904-01-01, local time of the machine that wrote them.

/// Days from 1904-01-01 to 1970-01-01.
const DAYS_1904_TO_1970: i64 = 24_107;

/// ISO 8601 to the second, without a zone, for the file states none; none for 0 ("not set") and what is no date.
pub(super) fn iso(seconds: f64) -> Option<String> {
    // the upper bound is what Igor's 32-bit fields can hold
    if !(seconds >= 1.0 && seconds <= f64::from(u32::MAX)) {
        return None;
    }
    let seconds = seconds as i64;
    let (year, month, day) = civil(seconds / 86_400 - DAYS_1904_TO_1970);
    let s = seconds % 86_400;
    Some(format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60))
}

/// Year, month and day of a count of days since 1970-01-01, in the Gregorian calendar.
fn civil(days: i64) -> (i64, i64, i64) {
    // counted from 0000-03-01, so that the leap day is the last of a year
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    (era * 400 + year_of_era + i64::from(month <= 2), month, day)
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
