//! How far two lists of numbers are apart.

/// How far two lists of numbers are apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers {
    /// How many differ in any bit.
    pub differing: usize,
    /// How many there are.
    pub of: usize,
    /// Largest difference; infinite where one is known and the other not (NaN).
    pub largest: f64,
    /// Largest difference relative to the larger of its own two magnitudes.
    pub relative: f64,
    /// Largest magnitude in either list.
    pub scale: f64,
    /// Largest difference in standard errors of the first list; none if no number that differs has one.
    pub in_errors: Option<f64>,
    /// Where the largest difference is: an index, or a path in a document.
    pub at: String,
}

impl Numbers {
    pub(super) fn new(differing: usize, of: usize) -> Self {
        let at = String::new();
        Self { differing, of, largest: 0.0, relative: 0.0, scale: 0.0, in_errors: None, at }
    }

    /// Takes a pair into account.
    pub(super) fn add(&mut self, x: f64, y: f64, error: Option<f64>, at: impl FnOnce() -> String) {
        let finite = |value: f64| if value.is_finite() { value.abs() } else { 0.0 };
        let larger = finite(x).max(finite(y));
        self.scale = self.scale.max(larger);
        let difference = distance(x, y);
        if self.at.is_empty() && x.to_bits() != y.to_bits() || difference > self.largest {
            self.at = at();
        }
        if difference == 0.0 {
            return;
        }
        self.largest = self.largest.max(difference);
        self.relative = self.relative.max(if difference.is_finite() { difference / larger } else { difference });
        let ratio = error.filter(|error| *error > 0.0 && error.is_finite()).map(|error| difference / error);
        self.in_errors = match (self.in_errors, ratio) {
            (Some(have), Some(ratio)) => Some(have.max(ratio)),
            (have, ratio) => have.or(ratio),
        };
    }

    /// Largest difference relative to the largest magnitude of all: what rounding leaves of numbers that are
    /// differences of large ones does not count more than it does for those.
    pub fn relative_to_scale(&self) -> f64 {
        match (self.largest, self.scale) {
            (0.0, _) => 0.0,
            (largest, scale) if largest.is_finite() && scale > 0.0 => largest / scale,
            _ => f64::INFINITY,
        }
    }
}

/// Two unknown numbers are equal, an unknown and a known one infinitely far apart.
fn distance(x: f64, y: f64) -> f64 {
    match (x.is_nan(), y.is_nan()) {
        (true, true) => 0.0,
        _ if x == y => 0.0,
        (false, false) if x.is_finite() && y.is_finite() => (x - y).abs(),
        _ => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_difference_is_given_in_every_measure() {
        let mut numbers = Numbers::new(2, 3);
        numbers.add(100.0, 101.0, Some(2.0), || "[0]".to_owned());
        numbers.add(1.0, 1.5, Some(0.1), || "[1]".to_owned());
        numbers.add(f64::NAN, f64::NAN, None, || "[2]".to_owned());
        assert_eq!((numbers.largest, numbers.scale, numbers.at.as_str()), (1.0, 101.0, "[0]"));
        assert_eq!((numbers.relative, numbers.in_errors), (0.5 / 1.5, Some(5.0)));
        assert_eq!(numbers.relative_to_scale(), 1.0 / 101.0);
    }

    #[test]
    fn an_unknown_number_is_infinitely_far_from_a_known_one() {
        let mut numbers = Numbers::new(1, 2);
        numbers.add(3.0, 3.0, None, || "[0]".to_owned());
        numbers.add(f64::NAN, 1.0, Some(1.0), || "[1]".to_owned());
        assert_eq!(
            (numbers.largest, numbers.relative_to_scale(), numbers.at.as_str()),
            (f64::INFINITY, f64::INFINITY, "[1]")
        );
        let mut zeros = Numbers::new(1, 1);
        zeros.add(0.0, -0.0, None, || "[0]".to_owned());
        assert_eq!((zeros.largest, zeros.relative_to_scale(), zeros.at.as_str()), (0.0, 0.0, "[0]"));
    }
}
