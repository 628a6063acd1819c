//! Days and dates in the Gregorian calendar.

/// Days from 1904-01-01, where LabVIEW and Igor begin to count, to 1970-01-01: 66 years, 17 of them leap years.
pub(crate) const DAYS_1904_TO_1970: i64 = 66 * 365 + 17;

/// Days from 0000-03-01 to 1970-01-01: years begin in March while counting, so that the leap day is the last of a year.
const DAYS_0000_TO_1970: i64 = 719_468;

/// Year, month and day of a day counted from 1970-01-01; none outside the years 1 to 9999.
pub(crate) fn date_of(days: i64) -> Option<(i64, i64, i64)> {
    let days = days.checked_add(DAYS_0000_TO_1970)?;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = era * 400 + year_of_era + i64::from(month <= 2);
    (1..=9999).contains(&year).then_some((year, month, day))
}

/// Days from 1970-01-01 to a date of the years 1 to 9999.
pub(crate) fn days_to(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + (153 * month + 2) / 5 + day
        - DAYS_0000_TO_1970
        - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_and_dates_are_each_others_inverse() {
        for days in (-700_000..2_900_000).step_by(13) {
            let Some((year, month, day)) = date_of(days) else { panic!("no date at {days}") };
            assert_eq!(days_to(year, month, day), days);
        }
        assert_eq!(date_of(0), Some((1970, 1, 1)));
        assert_eq!(date_of(-DAYS_1904_TO_1970), Some((1904, 1, 1)));
        assert_eq!(date_of(i64::MAX), None);
    }
}
