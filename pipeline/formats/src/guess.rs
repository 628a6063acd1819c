//! What speaks against taking numbers without a unit for seconds.

/// Milliseconds since 1970 are above this, seconds since 1970 far below.
const LEAST_EPOCH_MS: f64 = 1e11;
/// Days since the year 0, as MATLAB counts them, of the years 1889 to 2135.
const MATLAB_DAYS: std::ops::Range<f64> = 690_000.0..780_000.0;
/// Days since 1900, as spreadsheets count them, of the years 1968 to 2064.
const SPREADSHEET_DAYS: std::ops::Range<f64> = 25_000.0..60_000.0;
/// Steps of days that are less than this are 1.7 s and shorter; as seconds they would be 50 kHz and more.
const MOST_DAY_STEP: f64 = 2e-5;

/// Why times in no unit, or in one that is not known, are not taken for seconds, in words that follow their step; none
/// where they are, or where their unit is stated.
pub(crate) fn why_no_seconds(stated_s: Option<f64>, unit: &str, first: f64, step: f64) -> Option<String> {
    if stated_s.is_some() {
        return None;
    }
    if !unit.is_empty() {
        return Some(format!("in «{unit}»"));
    }
    // ticks of a clock, or numbers of samples
    if step.fract() == 0.0 && first.fract() == 0.0 {
        return Some("in whole numbers without a unit".to_owned());
    }
    if first.abs() >= LEAST_EPOCH_MS {
        return Some(format!("from {first:e}, too many for seconds since 1970, without a unit"));
    }
    let days = [(MATLAB_DAYS, "MATLAB"), (SPREADSHEET_DAYS, "spreadsheets")];
    let by = days.into_iter().find(|(range, _)| range.contains(&first) && step < MOST_DAY_STEP);
    by.map(|(_, who)| format!("from {first}, without a unit: days as {who} count them, or seconds"))
}

#[cfg(test)]
mod tests {
    use super::why_no_seconds;

    #[test]
    fn whole_numbers_epochs_and_days_are_no_seconds() {
        let why = |first: f64, step: f64| why_no_seconds(None, "", first, step).unwrap_or_default();
        assert!(why(53_124.0, 10.0).contains("whole numbers"));
        assert!(why(1.622e12 + 0.5, 10.0).contains("1970"));
        assert!(why(738_000.25, 1.0 / 86_400e3).contains("MATLAB"));
        assert!(why(44_000.25, 1.0 / 86_400e3).contains("spreadsheets"));
        for (first, step) in [(0.0, 1e-3), (-0.5, 1e-6), (1.622e9 + 0.25, 0.01), (0.5, 1.0), (30_000.0, 1e-3)] {
            assert_eq!(why(first, step), "", "{first} {step}");
        }
        assert_eq!(why_no_seconds(Some(1.0), "s", 0.0, 1.0), None);
        assert!(why_no_seconds(None, "mm", 0.0, 0.1).is_some_and(|why| why.contains("mm")));
    }
}
