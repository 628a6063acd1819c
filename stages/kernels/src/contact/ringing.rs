//! A measured ringing: poles, and residues where they are known.

use faer::{Mat, c64};

use super::coupled::CoupledPoles;
use super::lever::FreeLever;
use crate::model::ModelError;
use crate::ringdown::Ringdown;
use crate::ringdown::internals::{pole_of, slopes};

/// Oscillating poles of a lever with their residues, `y(t) = sum Re(rho_j exp(s_j t))`.
///
/// Amplitude and onset of a ringing are its events' own. One residue is their reference: it is given, without error,
/// and the others are relative to it, as in a joint fit.
#[derive(Debug, Clone)]
pub struct Ringing {
    /// Upper poles of pairs, rad/s.
    pub poles: Vec<c64>,
    /// Residues, V; none where only poles are known.
    pub residues: Option<Vec<c64>>,
    /// Covariance, for each pole in turn of real and imaginary part of pole and, where there are residues, of residue.
    pub covariance: Mat<f64>,
    /// Real poles of the detector.
    pub real_poles: usize,
}

impl Ringing {
    /// The oscillating part of a joint fit, with its part of one of its covariances.
    pub fn of(fit: &Ringdown, covariance: &Mat<f64>) -> Self {
        let (mut rows, mut first) = (Vec::new(), 0);
        for exponential in &fit.exponentials {
            if exponential.oscillates() {
                rows.extend(first..first + 4);
            }
            first += exponential.parameters();
        }
        let ringing = || fit.exponentials.iter().filter(|e| e.oscillates());
        Self {
            poles: ringing().map(|e| e.pole).collect(),
            residues: Some(ringing().map(|e| e.residue).collect()),
            covariance: Mat::from_fn(rows.len(), rows.len(), |i, j| covariance[(rows[i], rows[j])]),
            real_poles: fit.exponentials.len() - ringing().count(),
        }
    }

    /// The modes of a free lever, their errors independent.
    pub fn of_modes(lever: &FreeLever) -> Self {
        let count = 2 * lever.modes.len();
        let mut covariance = Mat::zeros(count, count);
        let mut poles = Vec::new();
        for (i, mode) in lever.modes.iter().enumerate() {
            let tau = std::f64::consts::TAU;
            let pole = pole_of(tau * mode.frequency_hz.value, mode.quality_factor.value);
            let std = [tau * mode.frequency_hz.std, mode.quality_factor.std];
            let by = slopes(pole);
            for a in 0..2 {
                for b in 0..2 {
                    covariance[(2 * i + a, 2 * i + b)] = (0..2).map(|p| by[p][a] * by[p][b] * std[p] * std[p]).sum();
                }
            }
            poles.push(pole);
        }
        Self { poles, residues: None, covariance, real_poles: 0 }
    }

    /// The same without residues.
    pub fn poles_only(&self) -> Self {
        let width = self.width();
        let rows: Vec<usize> = (0..self.poles.len()).flat_map(|j| [width * j, width * j + 1]).collect();
        Self {
            poles: self.poles.clone(),
            residues: None,
            covariance: Mat::from_fn(rows.len(), rows.len(), |i, j| self.covariance[(rows[i], rows[j])]),
            real_poles: self.real_poles,
        }
    }

    /// Poles and their covariance.
    pub fn coupled_poles(&self) -> CoupledPoles {
        let Self { poles, covariance, .. } = self.poles_only();
        CoupledPoles { poles, covariance }
    }

    /// Numbers per pole.
    pub(super) fn width(&self) -> usize {
        if self.residues.is_some() { 4 } else { 2 }
    }

    /// All numbers, in the order of the covariance.
    pub(super) fn numbers(&self) -> Vec<f64> {
        let residue = |j: usize| self.residues.as_ref().map(|all| all[j]);
        (0..self.poles.len())
            .flat_map(|j| std::iter::once(self.poles[j]).chain(residue(j)))
            .flat_map(|value| [value.re, value.im])
            .collect()
    }

    /// The mode whose residue is the reference; none without residues.
    pub fn reference(&self) -> Option<usize> {
        self.residues.as_ref()?;
        (0..self.poles.len()).find(|j| self.covariance[(4 * j + 2, 4 * j + 2)] == 0.0)
    }

    /// Shapes, finite numbers, variances. Errors: what is wrong of that.
    pub(super) fn check(&self, what: &'static str) -> Result<(), ModelError> {
        let count = self.width() * self.poles.len();
        if count == 0 {
            return Err(ModelError::Parameter { name: "number of poles", found: 0.0, wanted: "at least 1" });
        }
        if self.residues.as_ref().is_some_and(|all| all.len() != self.poles.len())
            || self.covariance.shape() != (count, count)
        {
            let found = self.covariance.nrows() as f64;
            return Err(ModelError::Parameter {
                name: "rows of a ringing's covariance",
                found,
                wanted: "two for each pole and two for each residue",
            });
        }
        if let Some(index) = self.numbers().iter().position(|v| !v.is_finite()) {
            return Err(ModelError::NotFinite { what, index });
        }
        if let Some(pole) = self.poles.iter().find(|pole| pole.im <= 0.0 || pole.re >= 0.0) {
            return Err(ModelError::Parameter {
                name: "imaginary part of a pole",
                found: pole.im,
                wanted: "above 0: the upper one of a pair, decaying",
            });
        }
        for i in 0..count {
            if !(self.covariance[(i, i)] >= 0.0 && (0..count).all(|j| self.covariance[(i, j)].is_finite())) {
                return Err(ModelError::Parameter {
                    name: "variance of a pole or residue",
                    found: self.covariance[(i, i)],
                    wanted: "0 or more and finite, like all of its covariances",
                });
            }
        }
        Ok(())
    }
}
