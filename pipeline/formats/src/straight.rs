//! Whether rounded numbers lie on a straight line.

/// A line over the row number from which each value is off by no more than its rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slopes {
    /// Smallest and largest slope of such a line.
    pub(crate) least: f64,
    pub(crate) largest: f64,
}

/// Steps of the search at most: each is a slope between two of the values, far fewer are needed.
const STEPS: usize = 200;

/// The slopes of all lines from which value k is off by at most `half(k)`. None: there is no such line.
///
/// With y the values and h their rounding, a line of slope s exists if
/// g(s) = max(y_k - h_k - k s) - min(y_k + h_k - k s) is not positive. g is convex and piecewise linear, so that Newton's
/// method from outside ends in its zero after finitely many steps, each O(values).
pub(crate) fn slopes(values: &[f64], half: impl Fn(usize) -> f64) -> Option<Slopes> {
    let last = values.len().checked_sub(1).filter(|last| *last > 0)?;
    let rise = values.get(last)? - values.first()?;
    let both = half(last) + half(0);
    let least = zero(values, &half, (rise - both) / last as f64, -1.0)?;
    let largest = zero(values, &half, (rise + both) / last as f64, 1.0)?;
    Some(Slopes { least: least.min(largest), largest: largest.max(least) })
}

/// The zero of g next to `slope`, which lies outside of the zeros in the direction of `side`.
fn zero(values: &[f64], half: &impl Fn(usize) -> f64, mut slope: f64, side: f64) -> Option<f64> {
    for _ in 0..STEPS {
        let (mut above, mut below) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
        for (row, value) in values.iter().enumerate() {
            let (rest, half) = (value - row as f64 * slope, half(row));
            if rest.is_nan() {
                return None;
            }
            if rest - half > above.0 {
                above = (rest - half, row);
            }
            if rest + half < below.0 {
                below = (rest + half, row);
            }
        }
        let gap = above.0 - below.0;
        if gap <= 0.0 {
            return Some(slope);
        }
        let steepness = below.1 as f64 - above.1 as f64;
        if steepness * side <= 0.0 {
            return None;
        }
        let next = slope - gap / steepness;
        if next == slope {
            return Some(slope);
        }
        slope = next;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(step: f64, unit: f64, rows: usize) -> (Vec<f64>, Vec<f64>) {
        let times = (0..rows).map(|k| (k as f64 * step / unit).round() * unit).collect();
        // float64's own rounding on top
        (times, vec![unit / 2.0 + 1e-12; rows])
    }

    #[test]
    fn rounded_lines_have_slopes_around_the_true_one_and_others_none() {
        for (step, unit) in [(1.0 / 2560.0, 1e-4), (1.0 / 51_200.0, 1e-6), (0.0123, 1e-3)] {
            let (times, half) = rounded(step, unit, 3000);
            let found = slopes(&times, |k| half[k]).unwrap();
            assert!(found.least <= step && step <= found.largest, "{found:?} {step}");
            // both ends may be off by half a unit
            assert!(found.largest - found.least <= 2.0 * unit / 2999.0);
            let mut lost = times.clone();
            lost.remove(1700);
            assert_eq!(slopes(&lost, |k| half[k]), None);
            let mut late = times;
            late[1200] += 1.1 * unit;
            assert_eq!(slopes(&late, |k| half[k]), None);
        }
    }

    #[test]
    fn the_slopes_are_those_of_trying_all_pairs() {
        let (times, half) = rounded(0.377, 0.1, 40);
        let (mut least, mut largest) = (f64::NEG_INFINITY, f64::INFINITY);
        for i in 0..40 {
            for j in i + 1..40 {
                let (rise, both) = (times[j] - times[i], half[i] + half[j]);
                least = least.max((rise - both) / (j - i) as f64);
                largest = largest.min((rise + both) / (j - i) as f64);
            }
        }
        let found = slopes(&times, |k| half[k]).unwrap();
        assert!((found.least - least).abs() < 1e-12 && (found.largest - largest).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn too_few_values_and_missing_ones_are_no_line() {
        assert_eq!(slopes(&[], |_| 0.1), None);
        assert_eq!(slopes(&[1.0], |_| 0.1), None);
        assert_eq!(slopes(&[1.0, f64::NAN, 3.0], |_| 0.1), None);
    }
}
