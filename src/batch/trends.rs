//! How frequencies, quality factors and spring constants change over the years.

use afmid_pipeline::Table;

use super::ledger::Entry;

/// A straight line through values with errors over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// Data sets that it goes through.
    pub count: usize,
    /// Value in the middle of the times (their weighted mean) and its standard error.
    pub value: (f64, f64),
    /// Change per year and its standard error, by the values' own errors.
    pub per_year: (f64, f64),
    /// Chi square over its degrees of freedom: far above 1, the values scatter more than their errors say.
    pub reduced_chi_square: f64,
    /// The middle of the times, years.
    pub middle_years: f64,
}

/// Largest ratio of frequencies of one mode: the modes of a lever are further apart.
const SAME_MODE: f64 = 1.25;
/// Seconds of a Julian year.
const YEAR_S: f64 = 365.25 * 86400.0;

/// Weighted regression; none with fewer than three points, or all at one time. Points are (years, value, standard
/// error).
///
/// Source: P. R. Bevington, D. K. Robinson, Data Reduction and Error Analysis, 3rd ed. 2003, section 6.3.
pub fn trend(points: &[(f64, f64, f64)]) -> Option<Trend> {
    let sound = |p: &&(f64, f64, f64)| p.0.is_finite() && p.1.is_finite() && p.2.is_finite() && p.2 > 0.0;
    let points: Vec<_> = points.iter().filter(sound).collect();
    if points.len() < 3 {
        return None;
    }
    let weight = |p: &(f64, f64, f64)| 1.0 / (p.2 * p.2);
    let total: f64 = points.iter().map(|p| weight(p)).sum();
    let mean = |of: &dyn Fn(&(f64, f64, f64)) -> f64| points.iter().map(|p| weight(p) * of(p)).sum::<f64>() / total;
    let (t, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let spread: f64 = points.iter().map(|p| weight(p) * (p.0 - t).powi(2)).sum();
    if spread <= 0.0 {
        return None;
    }
    let slope = points.iter().map(|p| weight(p) * (p.0 - t) * (p.1 - y)).sum::<f64>() / spread;
    let chi: f64 = points.iter().map(|p| weight(p) * (p.1 - y - slope * (p.0 - t)).powi(2)).sum();
    Some(Trend {
        count: points.len(),
        value: (y, total.recip().sqrt()),
        per_year: (slope, spread.recip().sqrt()),
        reduced_chi_square: chi / (points.len() - 2) as f64,
        middle_years: t,
    })
}

/// How far a value lies from the line through all others, in standard deviations of such a distance, which widen as the
/// others scatter; NaN where they are too few for a line. An outlier does not widen its own.
///
/// Source: R. D. Cook, S. Weisberg, Residuals and Influence in Regression, 1982, section 2.2 (externally studentised
/// residuals).
fn off(points: &[(f64, f64, f64)], index: usize) -> f64 {
    let Some(&(years, value, std)) = points.get(index) else { return f64::NAN };
    let others = [&points[..index], &points[index + 1..]].concat();
    trend(&others).map_or(f64::NAN, |line| {
        let after = years - line.middle_years;
        let expected = line.value.0 + line.per_year.0 * after;
        let variance = std.powi(2) + line.value.1.powi(2) + (line.per_year.1 * after).powi(2);
        (value - expected) / (variance * line.reduced_chi_square.max(1.0)).sqrt()
    })
}

/// One value of one data set, over time.
struct Seen<'a> {
    data_set: &'a str,
    years: f64,
    value: f64,
    std: f64,
    /// See [`off`].
    off: f64,
}

/// A quantity with all its values, and the line through them if there is one.
struct Quantity<'a> {
    name: String,
    unit: &'static str,
    seen: Vec<Seen<'a>>,
    trend: Option<Trend>,
}

/// Frequencies, quality factors and spring constants of all data sets that say when they were recorded.
///
/// Modes are matched by frequency: those of the set with most modes (the first of them by name) are the reference, and
/// a mode of another set is the reference's nearest, if it is within a quarter of it and no nearer one is.
fn quantities<'a>(entries: &'a [Entry]) -> Vec<Quantity<'a>> {
    let timed: Vec<(f64, &'a Entry)> = entries.iter().filter_map(|entry| Some((years(entry)?, entry))).collect();
    let quantity = |name: String, unit: &'static str, of: &dyn Fn(&Entry) -> Option<(f64, f64)>| {
        let known = timed.iter().filter_map(|&(years, entry)| Some((entry, years, of(entry)?)));
        let known: Vec<(&'a Entry, f64, (f64, f64))> = known.collect();
        let points: Vec<(f64, f64, f64)> = known.iter().map(|&(_, years, (value, std))| (years, value, std)).collect();
        let one = |(index, &(entry, years, (value, std))): (usize, &(&'a Entry, f64, (f64, f64)))| Seen {
            data_set: &entry.name,
            years,
            value,
            std,
            off: off(&points, index),
        };
        Quantity { name, unit, seen: known.iter().enumerate().map(one).collect(), trend: trend(&points) }
    };
    let mut all = Vec::new();
    for (number, reference) in (1..).zip(reference(entries)) {
        let mode = |entry: &Entry, value: fn(&super::harvest::ModeFound) -> Option<(f64, f64)>| {
            nearest_mode(entry, reference).and_then(value)
        };
        let frequency = |entry: &Entry| mode(entry, |mode| mode.frequency_hz.zip(mode.frequency_std_hz));
        let quality = |entry: &Entry| mode(entry, |mode| mode.quality_factor.zip(mode.quality_factor_std));
        all.push(quantity(format!("frequency {number}"), "Hz", &frequency));
        all.push(quantity(format!("quality factor {number}"), "1", &quality));
    }
    let stiffness = |entry: &Entry| entry.found.stiffness_n_per_m.zip(entry.found.stiffness_std_n_per_m);
    all.push(quantity("stiffness".to_owned(), "N/m", &stiffness));
    all
}

/// The trends of a batch as a table, a row per quantity.
pub fn table(entries: &[Entry]) -> Table {
    let quantities = quantities(entries);
    let rows: Vec<(&Quantity<'_>, Trend)> = quantities.iter().filter_map(|q| Some((q, q.trend?))).collect();
    let real = |of: fn(&Trend) -> f64| rows.iter().map(|(_, trend)| of(trend)).collect::<Vec<f64>>();
    Table::new()
        .with(
            "quantity",
            "",
            "what, with the mode's number",
            rows.iter().map(|row| row.0.name.clone()).collect::<Vec<_>>(),
        )
        .with("unit", "", "its unit", rows.iter().map(|row| row.0.unit.to_owned()).collect::<Vec<_>>())
        .with("sets", "1", "data sets", rows.iter().map(|row| row.1.count as i64).collect::<Vec<_>>())
        .with("value", "", "at the middle of the times", real(|t| t.value.0))
        .with("value_std", "", "its standard error", real(|t| t.value.1))
        .with("per_year", "", "change per year", real(|t| t.per_year.0))
        .with("per_year_std", "", "its standard error", real(|t| t.per_year.1))
        .with("reduced_chi_square", "1", "scatter over what the errors say", real(|t| t.reduced_chi_square))
}

/// Every value of every quantity over time, with its distance from the line through the others (see [`off`]).
pub fn values(entries: &[Entry]) -> Table {
    let quantities = quantities(entries);
    let rows: Vec<(&Quantity<'_>, &Seen<'_>)> =
        quantities.iter().flat_map(|q| q.seen.iter().map(move |s| (q, s))).collect();
    let real = |of: fn(&Seen<'_>) -> f64| rows.iter().map(|(_, seen)| of(seen)).collect::<Vec<f64>>();
    Table::new()
        .with(
            "quantity",
            "",
            "what, with the mode's number",
            rows.iter().map(|row| row.0.name.clone()).collect::<Vec<_>>(),
        )
        .with("unit", "", "its unit", rows.iter().map(|row| row.0.unit.to_owned()).collect::<Vec<_>>())
        .with("data_set", "", "its name", rows.iter().map(|row| row.1.data_set.to_owned()).collect::<Vec<_>>())
        .with("year", "1", "when, in years of 365.25 days, 1970 the first", real(|seen| 1970.0 + seen.years))
        .with("value", "", "the value", real(|seen| seen.value))
        .with("std", "", "its standard error", real(|seen| seen.std))
        .with("off", "1", "distance from the line of the others in standard deviations", real(|seen| seen.off))
}

/// Years since 1970.
fn years(entry: &Entry) -> Option<f64> {
    let text = entry.found.started_at.as_deref()?;
    // without a zone: taken as UTC
    let stamp = text.parse::<jiff::Timestamp>().ok().or_else(|| {
        let civil: jiff::civil::DateTime = text.parse().ok()?;
        jiff::tz::Offset::UTC.to_timestamp(civil).ok()
    })?;
    Some(stamp.as_second() as f64 / YEAR_S)
}

/// Frequencies of the set with most modes.
fn reference(entries: &[Entry]) -> Vec<f64> {
    let frequencies =
        |entry: &Entry| entry.found.modes.iter().filter_map(|mode| mode.frequency_hz).collect::<Vec<f64>>();
    entries.iter().map(frequencies).fold(Vec::new(), |most, own| if own.len() > most.len() { own } else { most })
}

fn nearest_mode(entry: &Entry, reference: f64) -> Option<&super::harvest::ModeFound> {
    let distance = |mode: &super::harvest::ModeFound| {
        mode.frequency_hz.filter(|f| *f > 0.0).map_or(f64::INFINITY, |f| (f / reference).ln().abs())
    };
    let nearest = entry.found.modes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (distance(nearest) < SAME_MODE.ln()).then_some(nearest)
}

#[cfg(test)]
mod tests {
    use super::super::harvest::{Harvest, ModeFound};
    use super::*;

    #[test]
    fn a_line_is_found_with_its_error() {
        let points: Vec<(f64, f64, f64)> = (0..5).map(|i| (f64::from(i), 10.0 + 2.0 * f64::from(i), 0.5)).collect();
        let found = trend(&points).unwrap();
        // sums of squares of -2..2: 10; the rest is rounding
        assert!((found.per_year.0 - 2.0).abs() < 1e-12 && (found.per_year.1 - 0.5 / 10f64.sqrt()).abs() < 1e-12);
        assert!((found.value.0 - 14.0).abs() < 1e-12 && (found.value.1 - 0.5 / 5f64.sqrt()).abs() < 1e-12);
        assert!(found.reduced_chi_square < 1e-20);
        assert!(trend(&points[..2]).is_none());
        assert!(trend(&[(1.0, 2.0, 0.1); 4]).is_none(), "all at one time");
    }

    #[test]
    fn modes_are_matched_by_frequency_and_times_read_without_zones() {
        let entry = |name: &str, year: &str, frequencies: &[f64]| {
            let mode =
                |&f: &f64| ModeFound { frequency_hz: Some(f), frequency_std_hz: Some(1.0), ..ModeFound::default() };
            let modes = frequencies.iter().map(mode).collect();
            Entry::done(name, "k".into(), Harvest { started_at: Some(year.into()), modes, ..Harvest::default() })
        };
        let entries = [
            entry("a", "2005-01-01T00:00:00Z", &[46000.0, 290000.0]),
            entry("b", "2006-01-01T00:00:00", &[290010.0]),
            entry("c", "2007-01-01T00:00:00Z", &[46020.0, 290020.0]),
            entry("d", "", &[46020.0]),
        ];
        let table = table(&entries);
        assert_eq!(table.text("quantity").unwrap(), ["frequency 2"]);
        assert_eq!(table.integer("sets").unwrap(), [3]);
        // 20 Hz in two years of 365 days
        assert!((table.real("per_year").unwrap()[0] - 10.0).abs() < 0.02);
        let values = values(&entries);
        // two of mode 1, three of mode 2; the last set says not when
        assert_eq!(values.text("data_set").unwrap(), ["a", "c", "a", "b", "c"]);
        let (off, years) = (values.real("off").unwrap(), values.real("year").unwrap());
        assert!(off.iter().all(|off| off.is_nan()), "two others make no line: {off:?}");
        assert!((years[0] - 2005.0).abs() < 0.01, "{years:?}");
    }

    #[test]
    fn an_outlier_is_far_off_the_line_that_the_others_make() {
        let line = |i: u32| (f64::from(i), 100.0 + f64::from(i), 1.0);
        let mut points: Vec<(f64, f64, f64)> = (0..40).map(line).collect();
        for wrong in [20, 39] {
            points[wrong].1 += 30.0;
            let off: Vec<f64> = (0..40).map(|index| off(&points, index)).collect();
            // 30 errors, less what the line itself is uncertain by at its end
            assert!(off[wrong] > 25.0 && off.iter().filter(|off| off.abs() > 1.5).count() == 1, "{off:?}");
            points[wrong].1 -= 30.0;
        }
    }
}
