//! The surface-coupled lever against the free one: zeros stay, poles rise.

/// A frequency with its standard error, in hertz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frequency {
    /// The frequency.
    pub value_hz: f64,
    /// Its standard error.
    pub std_hz: f64,
}

/// A zero of the free lever beside the coupled lever's nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroPair {
    /// The free lever's.
    pub free: Frequency,
    /// The coupled lever's; `None`: no zero is left for it.
    pub coupled: Option<Frequency>,
}

impl ZeroPair {
    /// Coupled minus free, relative to free; NaN without a partner.
    pub fn relative_difference(&self) -> f64 {
        self.coupled.map_or(f64::NAN, |coupled| coupled.value_hz / self.free.value_hz - 1.0)
    }

    /// Coupled minus free in combined standard errors; NaN without a partner.
    pub fn combined_errors(&self) -> f64 {
        self.coupled.map_or(f64::NAN, |coupled| {
            (coupled.value_hz - self.free.value_hz) / self.free.std_hz.hypot(coupled.std_hz)
        })
    }
}

/// Pairs each zero of the free lever with a zero of the coupled one, each used once, closest ratios first.
///
/// Model: zeros belong to the sensor, not to the contact; they are the same within errors. Shapes: any numbers of
/// zeros; the result is in the order of `free`. Source: paper, text to Fig. 4.
pub fn compare_zeros(free: &[Frequency], coupled: &[Frequency]) -> Vec<ZeroPair> {
    let mut distances: Vec<(f64, usize, usize)> = Vec::new();
    for (i, f) in free.iter().enumerate() {
        for (j, c) in coupled.iter().enumerate() {
            let distance = (c.value_hz / f.value_hz).ln().abs();
            if distance.is_finite() {
                distances.push((distance, i, j));
            }
        }
    }
    distances.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut pairs: Vec<ZeroPair> = free.iter().map(|&free| ZeroPair { free, coupled: None }).collect();
    let mut used = vec![false; coupled.len()];
    for (_, i, j) in distances {
        if pairs[i].coupled.is_none() && !used[j] {
            pairs[i].coupled = Some(coupled[j]);
            used[j] = true;
        }
    }
    pairs
}

/// A mode of the free lever and where the contact moves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoleShift {
    /// The free lever's.
    pub free: Frequency,
    /// The coupled lever's; `None`: none below the next free mode.
    pub coupled: Option<Frequency>,
}

impl PoleShift {
    /// Coupled minus free in hertz, with its standard error; NaN without a partner.
    pub fn shift_hz(&self) -> (f64, f64) {
        self.coupled.map_or((f64::NAN, f64::NAN), |coupled| {
            (coupled.value_hz - self.free.value_hz, self.free.std_hz.hypot(coupled.std_hz))
        })
    }
}

/// Each free mode with the coupled resonance that it becomes: the highest below the next free mode.
///
/// Model: a spring at the tip raises every pole, none beyond the next zero and so none beyond the next free pole
/// (Rayleigh's interlacing).
/// Shapes: both ascending; the result is in the order of `free`.
pub fn pole_shifts(free: &[Frequency], coupled: &[Frequency]) -> Vec<PoleShift> {
    free.iter()
        .enumerate()
        .map(|(i, &mode)| {
            let next = free.get(i + 1).map_or(f64::INFINITY, |next| next.value_hz);
            let partner = coupled.iter().rfind(|c| c.value_hz >= mode.value_hz && c.value_hz < next);
            PoleShift { free: mode, coupled: partner.copied() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(values: &[f64]) -> Vec<Frequency> {
        values.iter().map(|&value_hz| Frequency { value_hz, std_hz: 3.0 }).collect()
    }

    #[test]
    fn each_zero_finds_its_nearest_once() {
        let pairs = compare_zeros(&at(&[100.0, 200.0, 900.0]), &at(&[205.0, 104.0, 199.0]));
        assert_eq!(pairs[0].coupled.unwrap().value_hz, 104.0);
        assert_eq!(pairs[1].coupled.unwrap().value_hz, 199.0);
        // 4 over 3 sqrt 2
        assert!((pairs[0].combined_errors() - 4.0 / 18.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(pairs[2].coupled.unwrap().value_hz, 205.0);
        assert!(compare_zeros(&at(&[100.0]), &[])[0].combined_errors().is_nan());
    }

    #[test]
    fn poles_rise_at_most_to_the_next_free_one() {
        let shifts = pole_shifts(&at(&[49.0, 270.0, 608.0]), &at(&[49.2, 157.0, 334.0]));
        assert_eq!(shifts[0].shift_hz().0, 108.0);
        assert_eq!(shifts[1].coupled.unwrap().value_hz, 334.0);
        assert!(shifts[2].coupled.is_none() && shifts[2].shift_hz().0.is_nan());
    }
}
