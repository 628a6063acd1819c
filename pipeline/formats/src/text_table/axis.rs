//! Whether a column of times runs evenly.

use super::column::Column;
use super::number::Printed;

/// An even axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Even {
    pub(super) step: f64,
    /// Whether the times agree with it only because they are printed to so few places.
    pub(super) rounded: bool,
    /// How far the step may be from the true one, relative.
    pub(super) uncertainty: f64,
}

/// Largest deviation from evenness, in steps: a millionth keeps phase over a million samples.
const TOLERANCE: f64 = 1e-6;
/// Coarsest printing, in steps, that still shows a lost sample beyond doubt.
const COARSEST: f64 = 0.25;

/// Looks at the column against a straight line of the given step, or of the one its ends give. Errors: why it is not
/// even.
pub(super) fn even(column: &Column, stated_step: Option<f64>) -> Result<Even, String> {
    even_stretch(&column.values, &column.printed, 0, stated_step)
}

/// The same where the times begin again at the given rows (ascending): each stretch by itself, with one step for all.
pub(super) fn even_between(column: &Column, starts: &[usize], stated_step: Option<f64>) -> Result<Even, String> {
    let ends = starts.iter().copied().chain([column.values.len()]);
    let mut found: Option<Even> = None;
    let mut from = 0;
    for end in ends {
        let stretch = column.values.get(from..end).unwrap_or_default();
        // the first stretch that is long enough gives the step of those that follow
        let step = stated_step.or(found.map(|even| even.step));
        if stretch.len() > 1 {
            let even = even_stretch(stretch, &column.printed, from, step)?;
            found = Some(found.map_or(even, |before| Even { rounded: before.rounded || even.rounded, ..before }));
        }
        from = end;
    }
    found.ok_or_else(|| "it has no two rows in sequence".to_owned())
}

/// Whether times that are printed too coarsely to show a step agree with a step that is stated elsewhere.
pub(super) fn agrees(column: &Column, step: f64) -> bool {
    let Some(&first) = column.values.first() else { return false };
    let unit = |time: f64| column.printed.unit_of(time) + 4.0 * f64::EPSILON * time.abs().max(first.abs());
    let off = |(row, &time): (usize, &f64)| (time - (first + row as f64 * step)).abs() <= TOLERANCE * step + unit(time);
    let moved = column.values.iter().any(|time| *time != first);
    moved && column.values.iter().enumerate().all(off)
}

fn even_stretch(times: &[f64], printed: &Printed, row: usize, stated_step: Option<f64>) -> Result<Even, String> {
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Err("it is empty".to_owned()) };
    if times.len() < 3 && stated_step.is_none() {
        return Err("it has fewer than 3 rows".to_owned());
    }
    let steps = times.len().saturating_sub(1).max(1) as f64;
    let step = stated_step.unwrap_or((last - first) / steps);
    if !(step.is_finite() && step > 0.0) {
        return Err("it does not rise".to_owned());
    }
    let off = |row: usize, time: f64| (time - (first + row as f64 * step)).abs();
    // float64's own rounding, of both times.
    let own = |time: f64| 4.0 * f64::EPSILON * time.abs().max(first.abs());
    let exact = |(row, &time): (usize, &f64)| off(row, time) <= TOLERANCE * step + own(time);
    if times.iter().enumerate().all(exact) {
        return Ok(Even { step, rounded: false, uncertainty: 0.0 });
    }
    let mut worst_unit = 0.0_f64;
    for (number, &time) in times.iter().enumerate() {
        // One unit: half for this time's rounding, half for the first one's.
        let unit = printed.unit_of(time) + own(time);
        worst_unit = worst_unit.max(unit);
        if unit > COARSEST * step {
            return Err(format!("it is printed too coarsely (in row {}, to {unit:.1e}) to tell", row + number + 1));
        }
        let off = off(number, time);
        // A missing time (NaN) has no deviation.
        if off.is_nan() || off > TOLERANCE * step + unit {
            return Err(format!("row {} is {:.3e} steps off", row + number + 1, off / step));
        }
    }
    Ok(Even { step, rounded: true, uncertainty: worst_unit / (steps * step) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rate::of_step;

    fn column(texts: &[&str]) -> Column {
        let mut column = Column::default();
        for text in texts {
            column.printed.see(text);
            column.values.push(text.parse().unwrap());
        }
        column
    }

    #[test]
    fn an_even_axis_has_its_step() {
        let even = even(&column(&["0.0", "0.1", "0.2", "0.3"]), None).unwrap();
        assert_eq!(of_step(even.step), 10.0);
        assert!(!even.rounded);
    }

    #[test]
    fn rounded_times_are_even_and_say_so() {
        // 1 / 51200 s to six places.
        let even = even(&column(&["0.000000", "0.000020", "0.000039", "0.000059", "0.000078"]), None).unwrap();
        assert!(even.rounded);
        // Half a unit at either end of four steps.
        assert!((even.step - 1.0 / 51200.0).abs() <= 1e-6 / 4.0);
    }

    #[test]
    fn lost_samples_and_coarse_printing_are_not_even() {
        assert!(even(&column(&["0.0000", "0.1000", "0.2000", "0.4000"]), None).is_err());
        assert!(even(&column(&["1", "2", "4"]), None).is_err());
        assert!(even(&column(&["1.0", "1.0", "1.0"]), None).is_err());
        assert!(even(&column(&["0.00", "0.01", "0.01", "0.02"]), None).is_err());
        assert!(even(&column(&[]), None).is_err());
    }
}
