//! The modal model and its columns.

use faer::c64;

use super::FrfQuantity;

/// Poles, residues and residual terms of all responses.
#[derive(Debug, Clone, PartialEq)]
pub struct FrfModel {
    /// Upper poles of the modes, ascending, then those that stand for what lies beyond the band, and real ones; rad/s.
    pub poles: Vec<c64>,
    /// Responses x poles: `A` in `A / (i w - s)` of a receptance; real for a real pole.
    pub residues: Vec<Vec<c64>>,
    /// What modes below the band leave in each response.
    pub lower: Vec<f64>,
    /// What modes above the band leave in each response.
    pub upper: Vec<f64>,
    /// What the responses are.
    pub quantity: FrfQuantity,
    /// Decay that an exponential window added, 1/s.
    pub added_decay_per_s: f64,
}

impl FrfModel {
    /// The model's response at a frequency (Eq. 1 of the module). Shapes: a value per response.
    pub fn at(&self, frequency_hz: f64) -> Vec<c64> {
        let p = c64::new(self.added_decay_per_s, std::f64::consts::TAU * frequency_hz);
        let factor = p.powi(self.quantity.power());
        let modal = |row: &[c64]| row.iter().zip(&self.poles).map(|(a, s)| fraction(*a, *s, p)).sum::<c64>();
        let rest = |r: usize| (p * p).inv() * self.lower[r] + self.upper[r];
        self.residues.iter().enumerate().map(|(r, row)| factor * (modal(row) + rest(r))).collect()
    }

    /// One response over all frequencies.
    pub fn response(&self, number: usize, frequency_hz: &[f64]) -> Vec<c64> {
        frequency_hz.iter().filter_map(|f| self.at(*f).get(number).copied()).collect()
    }
}

/// `A / (p - s)`, with its conjugate for a pair.
fn fraction(a: c64, s: c64, p: c64) -> c64 {
    let own = a / (p - s);
    if s.im > 0.0 { own + a.conj() / (p - s.conj()) } else { own }
}

/// Real columns that a pole has: of its residue, and as many of its own derivative.
pub(super) fn width(s: c64) -> usize {
    if s.im > 0.0 { 2 } else { 1 }
}

/// Functions of a pole at `p`, `1/(p-s)` to the `power`: of a pair those of the residue's real and imaginary part.
pub(super) fn functions(s: c64, p: c64, power: i32) -> Vec<c64> {
    let upper = (p - s).inv().powi(power);
    if s.im <= 0.0 {
        return vec![upper];
    }
    let lower = (p - s.conj()).inv().powi(power);
    vec![upper + lower, c64::new(0.0, 1.0) * (upper - lower)]
}

/// The residue times a change of the pole, in the columns of the derivative: rows are the pole's real parameters.
pub(super) fn turned(s: c64, residue: &[f64]) -> Vec<Vec<f64>> {
    match residue {
        [a, b] if s.im > 0.0 => vec![vec![*a, *b], vec![-b, *a]],
        _ => vec![residue.to_vec()],
    }
}

/// Poles moved by a step of their real parameters.
pub(super) fn moved(poles: &[c64], step: &[f64]) -> Vec<c64> {
    let mut rest = step.iter().copied();
    let mut next = || rest.next().unwrap_or(0.0);
    poles
        .iter()
        .map(|s| {
            let re = s.re + next();
            if s.im > 0.0 { c64::new(re, s.im + next()) } else { c64::new(re, 0.0) }
        })
        .collect()
}
