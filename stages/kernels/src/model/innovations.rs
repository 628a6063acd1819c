//! The innovations form as parallel sections: simulation, prediction, transfer function.

use faer::{Mat, c64};

use super::error::ModelError;
use crate::model::parametrisation::{Coefficients, roots, section_order};

/// A section in observer form: `x1+ = -a1 x1 + x2 + b1 u + k1 e`, `x2+ = -a2 x1 + b2 u + k2 e`, output x1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Order: 2, or 1 (then the second entries are zero).
    pub order: usize,
    /// Denominator `z^2 + a1 z + a2` (order 1: `z + a1`).
    pub a: [f64; 2],
    /// Input gains.
    pub b: [f64; 2],
    /// Kalman gains.
    pub k: [f64; 2],
}

impl Section {
    /// `C (zI - A)^-1 B` of this section alone.
    pub fn transfer(&self, z: c64) -> c64 {
        match self.order {
            1 => self.b[0] / (z + self.a[0]),
            _ => (z * self.b[0] + self.b[1]) / self.denominator(z),
        }
    }

    /// `z^2 + a1 z + a2` or `z + a1`.
    pub fn denominator(&self, z: c64) -> c64 {
        match self.order {
            1 => z + self.a[0],
            _ => (z + self.a[0]) * z + self.a[1],
        }
    }

    /// Derivative of [`Section::denominator`] to z.
    pub fn denominator_slope(&self, z: c64) -> c64 {
        if self.order == 1 { c64::new(1.0, 0.0) } else { z * 2.0 + self.a[0] }
    }

    /// Derivative of [`Section::transfer`] to z.
    pub fn transfer_slope(&self, z: c64) -> c64 {
        let d = self.denominator(z);
        match self.order {
            1 => -self.b[0] / (d * d),
            _ => (self.b[0] - self.transfer(z) * (z * 2.0 + self.a[0])) / d,
        }
    }

    /// Its poles: a pair, two real ones or one.
    pub fn poles(&self) -> Vec<c64> {
        roots(self.a, self.order)
    }
}

/// A discrete model in innovations form (Eq. 8), one input, one output, block-diagonal.
///
/// Model: `x(t+Ts) = A x + B u + K e`, `y = C x + D u + e`; A is the direct sum of the sections, `C = [1 0 1 0 ...]`.
/// Shapes: order n, states in the sections' order. Units: those of y over those of u for B and D.
#[derive(Debug, Clone, PartialEq)]
pub struct InnovationsModel {
    /// The sections; all of order 2, but the last of an odd order.
    pub sections: Vec<Section>,
    /// D.
    pub feedthrough: f64,
    /// Ts in seconds.
    pub sample_time_s: f64,
}

/// How a further input enters the same sections.
#[derive(Debug, Clone, PartialEq)]
pub struct InputGains {
    /// Gains of each section, as [`Section::b`].
    pub b: Vec<[f64; 2]>,
    /// D.
    pub feedthrough: f64,
}

impl InnovationsModel {
    /// The model from another input to the same output. Errors: gains for another number of sections.
    pub fn from_input(&self, gains: &InputGains) -> Result<Self, ModelError> {
        if gains.b.len() != self.sections.len() {
            return Err(ModelError::Length { what: "input gains", found: gains.b.len(), wanted: self.sections.len() });
        }
        let sections = self.sections.iter().zip(&gains.b).map(|(section, &b)| Section { b, ..*section }).collect();
        Ok(Self { sections, feedthrough: gains.feedthrough, sample_time_s: self.sample_time_s })
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.sections.iter().map(|section| section.order).sum()
    }

    /// Free parameters of the deterministic part, 2n + 1: all a, all b, D.
    pub fn parameters(&self) -> Vec<f64> {
        let mut values: Vec<f64> = self.sections.iter().flat_map(|s| s.a[..s.order].to_vec()).collect();
        values.extend(self.sections.iter().flat_map(|s| s.b[..s.order].to_vec()));
        values.push(self.feedthrough);
        values
    }

    /// `C (zI - A)^-1 B + D`.
    pub fn transfer(&self, z: c64) -> c64 {
        self.sections.iter().map(|section| section.transfer(z)).fold(c64::new(self.feedthrough, 0.0), |sum, g| sum + g)
    }

    /// Derivative of [`InnovationsModel::transfer`] to z.
    pub fn transfer_slope(&self, z: c64) -> c64 {
        self.sections.iter().map(|section| section.transfer_slope(z)).fold(c64::new(0.0, 0.0), |sum, g| sum + g)
    }

    /// Derivatives of [`InnovationsModel::transfer`] to [`InnovationsModel::parameters`].
    pub fn transfer_sensitivities(&self, z: c64) -> Vec<c64> {
        let powers =
            |section: &Section| if section.order == 1 { vec![c64::new(1.0, 0.0)] } else { vec![z, c64::new(1.0, 0.0)] };
        let to_a = self.sections.iter().flat_map(|s| {
            let factor = -s.transfer(z) / s.denominator(z);
            powers(s).into_iter().map(move |power| power * factor)
        });
        let to_b = self.sections.iter().flat_map(|s| {
            let d = s.denominator(z);
            powers(s).into_iter().map(move |power| power / d)
        });
        to_a.chain(to_b).chain(std::iter::once(c64::new(1.0, 0.0))).collect()
    }

    /// Derivatives of [`InnovationsModel::transfer_slope`] to [`InnovationsModel::parameters`].
    pub fn transfer_slope_sensitivities(&self, z: c64) -> Vec<c64> {
        let (one, zero) = (c64::new(1.0, 0.0), c64::new(0.0, 0.0));
        // each power of z with its own slope
        let powers =
            |section: &Section| if section.order == 1 { vec![(one, zero)] } else { vec![(z, one), (one, zero)] };
        let to_a = self.sections.iter().flat_map(|s| {
            let (d, slope) = (s.denominator(z), s.denominator_slope(z));
            let (g, dg) = (s.transfer(z), s.transfer_slope(z));
            powers(s).into_iter().map(move |(p, dp)| (g * p * slope / d - dg * p - g * dp) / d)
        });
        let to_b = self.sections.iter().flat_map(|s| {
            let (d, slope) = (s.denominator(z), s.denominator_slope(z));
            powers(s).into_iter().map(move |(p, dp)| (dp - p * slope / d) / d)
        });
        to_a.chain(to_b).chain(std::iter::once(zero)).collect()
    }

    /// `(A, B, C, K)` in full.
    pub fn matrices(&self) -> (Mat<f64>, Vec<f64>, Vec<f64>, Vec<f64>) {
        let n = self.order();
        let (mut a, mut b, mut c, mut k) = (Mat::zeros(n, n), vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut first = 0;
        for section in &self.sections {
            c[first] = 1.0;
            for j in 0..section.order {
                a[(first + j, first)] = -section.a[j];
                b[first + j] = section.b[j];
                k[first + j] = section.k[j];
            }
            if section.order == 2 {
                a[(first, first + 1)] = 1.0;
            }
            first += section.order;
        }
        (a, b, c, k)
    }

    /// The model of these matrices, in the layout of [`InnovationsModel::matrices`]. Errors: shapes, or another
    /// structure of A or C.
    pub fn from_matrices(
        a: &Mat<f64>,
        b: &[f64],
        k: &[f64],
        feedthrough: f64,
        sample_time_s: f64,
    ) -> Result<Self, ModelError> {
        let n = b.len();
        if a.shape() != (n, n) || k.len() != n {
            return Err(ModelError::Length { what: "B or K", found: k.len().min(n), wanted: a.nrows() });
        }
        let sections = (0..n.div_ceil(2))
            .map(|i| {
                let (order, first) = (section_order(n, i), 2 * i);
                let pick = |values: &dyn Fn(usize) -> f64| [values(0), if order == 2 { values(1) } else { 0.0 }];
                Section {
                    order,
                    a: pick(&|j| -a[(first + j, first)]),
                    b: pick(&|j| b[first + j]),
                    k: pick(&|j| k[first + j]),
                }
            })
            .collect();
        let model = Self { sections, feedthrough, sample_time_s };
        if model.matrices().0 != *a {
            return Err(ModelError::Degenerate("the state matrix is not a direct sum of sections in observer form"));
        }
        Ok(model)
    }

    /// Response to u from the initial state x0, without noise: N samples.
    pub fn simulate(&self, u: &[f64], x0: &[f64]) -> Result<Vec<f64>, ModelError> {
        self.run(u, None, x0)
    }

    /// One-step predictions of y (offset and slope already removed) from u and the past of y: N samples.
    pub fn predict(&self, u: &[f64], y: &[f64], x0: &[f64]) -> Result<Vec<f64>, ModelError> {
        if y.len() != u.len() {
            return Err(ModelError::Length { what: "input", found: u.len(), wanted: y.len() });
        }
        self.run(u, Some(y), x0)
    }

    fn run(&self, u: &[f64], y: Option<&[f64]>, x0: &[f64]) -> Result<Vec<f64>, ModelError> {
        if x0.len() != self.order() {
            return Err(ModelError::Length { what: "initial state", found: x0.len(), wanted: self.order() });
        }
        let mut state: Vec<[f64; 2]> = x0.chunks(2).map(|x| [x[0], x.get(1).copied().unwrap_or(0.0)]).collect();
        Ok(u.iter()
            .enumerate()
            .map(|(t, &u)| {
                let output = state.iter().map(|x| x[0]).sum::<f64>() + self.feedthrough * u;
                let e = y.map_or(0.0, |y| y[t] - output);
                for (x, s) in state.iter_mut().zip(&self.sections) {
                    let next = -s.a[0] * x[0] + x[1] + s.b[0] * u + s.k[0] * e;
                    *x = [next, -s.a[1] * x[0] + s.b[1] * u + s.k[1] * e];
                }
                output
            })
            .collect())
    }
}

/// Kalman gains from predictor poles: partial fractions of `prod c_i / prod a_i - 1`.
///
/// Method: `k_i = prod_l c_l / prod_(l /= i) a_l` modulo `a_i`, in the ring of polynomials modulo `a_i`: exact for
/// real, complex and double poles within a section. Errors: two sections share a pole.
pub(crate) fn kalman_gains(order: usize, a: &[Coefficients], c: &[Coefficients]) -> Result<Vec<[f64; 2]>, ModelError> {
    (0..a.len())
        .map(|i| {
            let ring = Ring { a: a[i], order: section_order(order, i) };
            let mut gain = ring.one();
            for l in 0..a.len() {
                let factor = section_order(order, l);
                gain = ring.times(gain, ring.reduce(c[l], factor));
                if l != i {
                    gain = ring.times(gain, ring.inverse(ring.reduce(a[l], factor))?);
                }
            }
            let gain = if ring.order == 1 { [gain[1], 0.0] } else { gain };
            if gain.iter().all(|value| value.is_finite()) { Ok(gain) } else { Err(SHARED_POLE) }
        })
        .collect()
}

const SHARED_POLE: ModelError = ModelError::Degenerate("two sections share a pole: lower the order");

/// Polynomials `alpha z + beta` modulo `z^2 + a1 z + a2` (order 1: numbers, at `z = -a1`).
struct Ring {
    a: Coefficients,
    order: usize,
}

impl Ring {
    fn one(&self) -> [f64; 2] {
        [0.0, 1.0]
    }

    /// A monic polynomial of order 1 or 2, reduced.
    fn reduce(&self, p: Coefficients, order: usize) -> [f64; 2] {
        match (self.order, order) {
            (1, 1) => [0.0, p[0] - self.a[0]],
            (1, _) => [0.0, (self.a[0] - p[0]) * self.a[0] + p[1]],
            (_, 1) => [1.0, p[0]],
            _ => [p[0] - self.a[0], p[1] - self.a[1]],
        }
    }

    fn times(&self, x: [f64; 2], y: [f64; 2]) -> [f64; 2] {
        let square = x[0] * y[0];
        [x[0] * y[1] + x[1] * y[0] - self.a[0] * square, x[1] * y[1] - self.a[1] * square]
    }

    fn inverse(&self, x: [f64; 2]) -> Result<[f64; 2], ModelError> {
        let norm = if self.order == 1 {
            return if x[1] == 0.0 { Err(SHARED_POLE) } else { Ok([0.0, 1.0 / x[1]]) };
        } else {
            x[1] * x[1] - self.a[0] * x[0] * x[1] + self.a[1] * x[0] * x[0]
        };
        if norm == 0.0 { Err(SHARED_POLE) } else { Ok([-x[0] / norm, (x[1] - self.a[0] * x[0]) / norm]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> InnovationsModel {
        let section = |a: [f64; 2], b: [f64; 2]| Section { order: 2, a, b, k: [0.1, -0.05] };
        let last = Section { order: 1, a: [-0.3, 0.0], b: [0.05, 0.0], k: [0.02, 0.0] };
        InnovationsModel {
            sections: vec![section([-1.9, 0.95], [0.01, 0.02]), last],
            feedthrough: 0.1,
            sample_time_s: 1.0,
        }
    }

    #[test]
    fn matrices_and_back_is_the_identity() {
        let (a, b, _, k) = model().matrices();
        assert_eq!(InnovationsModel::from_matrices(&a, &b, &k, 0.1, 1.0).unwrap(), model());
        let mut other = a.clone();
        other[(0, 2)] = 0.5;
        assert!(InnovationsModel::from_matrices(&other, &b, &k, 0.1, 1.0).is_err());
        assert!(InnovationsModel::from_matrices(&a, &b[..2], &k, 0.1, 1.0).is_err());
    }

    #[test]
    fn a_sine_comes_out_as_the_transfer_function_says() {
        let w = 0.3_f64;
        let u: Vec<f64> = (0..4000).map(|t| (w * t as f64).cos()).collect();
        let y = model().simulate(&u, &[0.0; 3]).unwrap();
        let g = model().transfer(c64::cis(w));
        for (t, y) in y.iter().enumerate().skip(3900) {
            let expected = (g * c64::cis(w * t as f64)).re;
            // transients decay by 0.975 per sample: gone after 4000
            assert!((y - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn prediction_of_a_simulation_is_the_simulation() {
        let u: Vec<f64> = (0..100).map(|t| f64::from(t % 7)).collect();
        let y = model().simulate(&u, &[0.3, 0.1, -0.2]).unwrap();
        assert_eq!(model().predict(&u, &y, &[0.3, 0.1, -0.2]).unwrap(), y);
        assert!(model().simulate(&u, &[0.0; 2]).is_err() && model().predict(&u, &y[1..], &[0.0; 3]).is_err());
    }

    #[test]
    fn gains_are_the_partial_fractions_of_the_noise_model() {
        let (a, c) = ([[-1.9, 0.95], [-0.7, 0.1], [-0.3, 0.0]], [[-1.5, 0.7], [0.2, 0.05], [0.4, 0.0]]);
        let k = kalman_gains(5, &a, &c).unwrap();
        let polynomial = |s: [f64; 2], z: c64, first: bool| if first { z + s[0] } else { (z + s[0]) * z + s[1] };
        for z in [c64::new(1.3, 0.4), c64::new(-0.8, 0.9), c64::new(0.0, 2.0)] {
            let whole =
                |s: &[[f64; 2]; 3]| polynomial(s[0], z, false) * polynomial(s[1], z, false) * polynomial(s[2], z, true);
            let parts = (z * k[0][0] + k[0][1]) / polynomial(a[0], z, false)
                + (z * k[1][0] + k[1][1]) / polynomial(a[1], z, false)
                + k[2][0] / polynomial(a[2], z, true);
            assert!((whole(&c) / whole(&a) - 1.0 - parts).norm() < 1e-13); // rounding
        }
        assert!(kalman_gains(5, &[a[0], [-0.7, 0.12], [-0.3, 0.0]], &c).is_err()); // 0.3 and 0.4: shared
    }
}
