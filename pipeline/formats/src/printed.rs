//! How finely numbers are printed.

/// How finely the numbers of a column are printed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Printed {
    /// Most digits behind the decimal sign (the exponent taken in).
    decimals: i32,
    /// Most digits from the first that is not 0.
    significant: i32,
}

impl Printed {
    /// Of numbers of which only the values are known: each in the fewest digits that are read as it.
    pub(crate) fn of(numbers: &[f64]) -> Self {
        let mut printed = Self::default();
        numbers.iter().for_each(|number| printed.see(&number.to_string()));
        printed
    }

    pub(crate) fn see(&mut self, field: &str) {
        let field = field.trim_matches([' ', '"', '\t']);
        let (mantissa, exponent) = field.split_once(['e', 'E']).unwrap_or((field, "0"));
        // Digits of a mantissa: no line is long enough for more than i32 holds.
        let behind = mantissa.split_once(['.', ',']).map_or(0, |(_, behind)| behind.len()) as i32;
        let digits = mantissa.chars().filter(char::is_ascii_digit).skip_while(|&c| c == '0').count() as i32;
        let exponent: i32 = exponent.parse().unwrap_or(0);
        self.decimals = self.decimals.max(behind.saturating_sub(exponent));
        self.significant = self.significant.max(digits);
    }

    /// One unit of the last place `value` is printed to: fixed places or fixed digits, whichever is coarser.
    pub(crate) fn unit_of(&self, value: f64) -> f64 {
        let fixed = 10_f64.powi(-self.decimals);
        let magnitude = value.abs().log10().floor();
        if !magnitude.is_finite() {
            return fixed;
        }
        fixed.max(10_f64.powi((magnitude as i32).saturating_add(1).saturating_sub(self.significant)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_place_is_that_of_fixed_places_or_digits() {
        let mut fixed = Printed::default();
        ["0.000250", "12.500000"].iter().for_each(|t| fixed.see(t));
        // powi and a literal may differ in the last bit.
        assert!((fixed.unit_of(12.5) / 1e-6 - 1.0).abs() < 1e-12);
        let mut digits = Printed::default();
        ["1.953125E-5", "2"].iter().for_each(|t| digits.see(t));
        assert!((digits.unit_of(2.0) / 1e-6 - 1.0).abs() < 1e-12);
    }
}
