//! Whether a column of times runs evenly.

use super::column::Column;
use super::number::Printed;
use crate::rate::roundest_step;
use crate::straight::slopes;

/// An even axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Even {
    /// Of the steps that the rounding allows that with the fewest digits, or whose rate has.
    pub(super) step: f64,
    /// Whether the times agree with it only because they are printed to so few places.
    pub(super) rounded: bool,
    /// How far the step may be from the true one, relative.
    pub(super) uncertainty: f64,
}

/// Largest deviation from evenness, in steps: a millionth keeps phase over a million samples.
const TOLERANCE: f64 = 1e-6;
/// Coarsest printing, in steps: a lost sample moves times by a step against each other, their rounding by up to a unit,
/// and a line from which none is off by more than half a unit takes up another one.
const COARSEST: f64 = 0.5;
/// A step that is known better than this keeps the digits that it has.
const KNOWN: f64 = 1e-13;

/// Looks at the column against a straight line of the given step, or of the one its ends give. Errors: why it is not
/// even.
pub(super) fn even(column: &Column, stated_step: Option<f64>) -> Result<Even, String> {
    even_stretch(&column.values, &column.printed, 0, stated_step)
}

/// The same where the times begin again at the given rows (ascending): each stretch by itself, with one step for all.
pub(super) fn even_between(column: &Column, starts: &[usize], stated_step: Option<f64>) -> Result<Even, String> {
    let begins = [0].into_iter().chain(starts.iter().copied());
    let ends = starts.iter().copied().chain([column.values.len()]);
    let stretches = || begins.clone().zip(ends.clone()).filter(|(from, end)| end.saturating_sub(*from) > 1);
    let even = |(from, end): (usize, usize), step: Option<f64>| {
        even_stretch(column.values.get(from..end).unwrap_or_default(), &column.printed, from, step)
    };
    let longest = stretches().max_by_key(|(from, end)| end - from).ok_or("it has no two rows in sequence")?;
    let mut found = even(longest, stated_step)?;
    for stretch in stretches() {
        found.rounded |= even(stretch, Some(found.step))?.rounded;
    }
    Ok(found)
}

/// The step of times of which only the values are known: rounded to as many digits as the shortest number has that is
/// read as the value. Errors: why they do not run evenly.
pub fn even_step(times: &[f64]) -> Result<f64, String> {
    let mut printed = Printed::default();
    times.iter().for_each(|time| printed.see(&time.to_string()));
    even_stretch(times, &printed, 0, None).map(|even| even.step)
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
    if let Some(missing) = times.iter().position(|time| time.is_nan()) {
        return Err(format!("row {} has no time", row + missing + 1));
    }
    let off = |row: usize, time: f64| (time - (first + row as f64 * step)).abs();
    // float64's own rounding, of both times.
    let own = |time: f64| 4.0 * f64::EPSILON * time.abs().max(first.abs());
    let exact = times.iter().enumerate().all(|(row, &time)| off(row, time) <= TOLERANCE * step + own(time));
    let unit = |time: f64| printed.unit_of(time) + own(time);
    let coarsest = unit(first).max(unit(last));
    if exact && (stated_step.is_some() || coarsest > COARSEST * step || coarsest < KNOWN * steps * step) {
        return Ok(Even { step, rounded: false, uncertainty: 0.0 });
    }
    if coarsest > COARSEST * step {
        return Err(format!("it is printed too coarsely, to {coarsest:.1e} at steps of {step:.1e}, to tell"));
    }
    let half = |unit: f64, time: f64| 0.5 * unit + own(time);
    let as_printed: Vec<f64> = times.iter().map(|&time| half(unit(time), time)).collect();
    // numbers of single precision in the digits of double
    let single_unit = |time: f64| f64::from(f32::EPSILON) * time.abs();
    let single = || {
        let fine = single_unit(first).max(single_unit(last)) <= COARSEST * step;
        fine && times.iter().all(|&time| f64::from(time as f32) == time)
    };
    let as_single = || times.iter().map(|&time| half(single_unit(time), time)).collect::<Vec<f64>>();
    let found = slopes(times, &as_printed).or_else(|| single().then(|| slopes(times, &as_single())).flatten());
    let stated = |least: f64, largest: f64| {
        let slack = TOLERANCE * step / steps;
        stated_step.is_none_or(|step| (least - slack..=largest + slack).contains(&step))
    };
    match found {
        Some(found) if stated(found.least, found.largest) => {
            let middle = f64::midpoint(found.least, found.largest);
            let uncertainty = 0.5 * (found.largest - found.least) / middle;
            let step = stated_step.unwrap_or_else(|| roundest_step(middle, uncertainty));
            Ok(Even { step, rounded: !exact, uncertainty })
        }
        _ if exact => Ok(Even { step, rounded: false, uncertainty: 0.0 }),
        _ => {
            let offs = || times.iter().enumerate().map(|(row, &time)| (row, off(row, time)));
            let beyond =
                offs().find(|(row, off)| *off > TOLERANCE * step + unit(times.get(*row).copied().unwrap_or(last)));
            let worst = || offs().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
            let (number, off) = beyond.unwrap_or_else(worst);
            Err(format!("row {} is {:.3e} steps off", row + number + 1, off / step))
        }
    }
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

    fn printed(times: impl Iterator<Item = String>) -> Column {
        let texts: Vec<String> = times.collect();
        column(&texts.iter().map(String::as_str).collect::<Vec<&str>>())
    }

    /// As `%.{digits}g` prints it: so many significant digits.
    fn significant(time: f64, digits: usize) -> String {
        format!("{:.*e}", digits - 1, time).parse::<f64>().unwrap().to_string()
    }

    #[test]
    fn the_rate_of_rounded_times_is_the_round_one_that_the_rounding_allows() {
        let even_rate = |column: &Column| of_step(even(column, None).unwrap().step);
        for rate in [2560.0, 4096.0, 5000.0, 25_600.0, 44_100.0, 51_200.0, 48_828.125] {
            for digits in [7, 8, 9, 12, 17] {
                let times = (0..20_000).map(|k| f64::from(k) / rate);
                let column = printed(times.map(|time| significant(time, digits)));
                if column.printed.unit_of(20_000.0 / rate) < COARSEST / rate {
                    assert_eq!(even_rate(&column), rate, "{digits} digits");
                }
            }
        }
        // 0.26 steps
        assert_eq!(even_rate(&printed((0..3840).map(|k| format!("{:.4}", f64::from(k) / 2560.0)))), 2560.0);
        // a step that is round itself
        assert_eq!(even_rate(&printed((0..3840).map(|k| format!("{:.4}", f64::from(k) * 3e-4)))), of_step(3e-4));
        // single precision in the digits of double
        let single = printed((0..20_000).map(|k| f64::from((f64::from(k) / 2560.0) as f32).to_string()));
        assert_eq!(even_rate(&single), 2560.0);
    }

    #[test]
    fn jitter_and_lost_samples_beyond_the_rounding_are_refused() {
        for decimals in [4, 5, 6, 9] {
            let all = || (0..5000).map(|k| f64::from(k) / 2560.0);
            let print = |time: f64| format!("{time:.decimals$}");
            assert!(even(&printed(all().map(print)), None).is_ok());
            let lost = all().enumerate().filter(|(k, _)| *k != 3100).map(|(_, time)| print(time));
            assert!(even(&printed(lost), None).unwrap_err().contains("steps off"));
            let unit = 0.1_f64.powi(i32::try_from(decimals).unwrap());
            let jitter = all().enumerate().map(|(k, time)| print(time + 2.2 * unit * f64::from(k % 7 == 3)));
            assert!(even(&printed(jitter), None).is_err());
        }
        // 2.56 steps: nothing would show that a sample is lost
        let coarse = printed((0..5000).map(|k| format!("{:.3}", f64::from(k) / 2560.0)));
        assert!(even(&coarse, None).unwrap_err().contains("too coarsely"));
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
