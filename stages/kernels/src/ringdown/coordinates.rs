//! The coordinates that the search moves in: a pole's real and imaginary part, or angular frequency and quality factor
//! where something is known of one.

use faer::{Mat, c64};

use super::modal_form::{Exponential, from_shared, shared};
use super::normal::Freedom;

/// The pole of `abs(s) = w` and quality factor `q`; not finite for `q < 1/2`.
pub fn pole_of(w: f64, q: f64) -> c64 {
    c64::new(-0.5 * w / q, w * (1.0 - 0.25 / (q * q)).sqrt())
}

/// d Re, d Im by w, then by q.
pub fn slopes(pole: c64) -> [[f64; 2]; 2] {
    let w = pole.norm();
    let q = -0.5 * w / pole.re;
    let c = (1.0 - 0.25 / (q * q)).sqrt();
    [[-0.5 / q, c], [0.5 * w / (q * q), 0.25 * w / (q * q * q * c)]]
}

impl Freedom {
    /// The shared parameters in the search's coordinates.
    pub fn values(&self, exponentials: &[Exponential]) -> Vec<f64> {
        let mut values = shared(exponentials);
        for (first, place) in self.resonances(exponentials) {
            let pole = exponentials[place].pole;
            (values[first], values[first + 1]) = (pole.norm(), -0.5 * pole.norm() / pole.re);
        }
        values
    }

    /// The inverse of [`Self::values`].
    pub fn exponentials(&self, like: &[Exponential], values: &[f64]) -> Vec<Exponential> {
        let mut all = from_shared(like, values);
        for (first, place) in self.resonances(like) {
            all[place].pole = pole_of(values[first], values[first + 1]);
        }
        all
    }

    /// Derivatives by real and imaginary part of the poles to derivatives by the search's coordinates.
    pub fn turn(&self, derivatives: &mut [Vec<f64>], exponentials: &[Exponential]) {
        for (first, place) in self.resonances(exponentials) {
            let by = slopes(exponentials[place].pole);
            let (re, im) = (derivatives[first].clone(), derivatives[first + 1].clone());
            for (target, [a, b]) in derivatives[first..first + 2].iter_mut().zip(by) {
                target.iter_mut().zip(re.iter().zip(&im)).for_each(|(t, (re, im))| *t = a * re + b * im);
            }
        }
    }

    /// A covariance of the search's coordinates to that of real and imaginary parts.
    pub fn of_parts(&self, covariance: Mat<f64>, exponentials: &[Exponential]) -> Mat<f64> {
        let mut covariance = covariance;
        for (first, place) in self.resonances(exponentials) {
            let by = slopes(exponentials[place].pole);
            for transposed in [false, true] {
                for i in 0..covariance.nrows() {
                    let at = |k: usize| if transposed { (i, first + k) } else { (first + k, i) };
                    let old = [covariance[at(0)], covariance[at(1)]];
                    (0..2).for_each(|part| covariance[at(part)] = by[0][part] * old[0] + by[1][part] * old[1]);
                }
            }
        }
        covariance
    }

    /// First parameter and place of the exponentials that are given by frequency and quality factor.
    fn resonances(&self, exponentials: &[Exponential]) -> Vec<(usize, usize)> {
        let mut first = 0;
        let mut found = Vec::new();
        for (place, e) in exponentials.iter().enumerate() {
            if self.resonance.get(place).copied().unwrap_or(false) {
                found.push((first, place));
            }
            first += e.parameters();
        }
        found
    }
}
