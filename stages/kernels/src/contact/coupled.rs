//! Poles of the lever on a contact.

use faer::{Mat, c64};

use super::law::ContactLaw;
use super::lever::FreeLever;
use crate::ringdown::Ringdown;

/// Measured poles of the coupled lever, the upper ones of pairs.
#[derive(Debug, Clone)]
pub struct CoupledPoles {
    /// The poles, rad/s.
    pub poles: Vec<c64>,
    /// Their covariance, rad^2/s^2: real and imaginary part of each in turn.
    pub covariance: Mat<f64>,
}

impl CoupledPoles {
    /// Poles whose real and imaginary parts all have the same standard error and no correlation.
    pub fn independent(poles: &[c64], std: f64) -> Self {
        let n = 2 * poles.len();
        let covariance = Mat::from_fn(n, n, |i, j| if i == j { std * std } else { 0.0 });
        Self { poles: poles.to_vec(), covariance }
    }

    /// The oscillating poles of a joint fit, with their part of one of its covariances.
    pub fn of(fit: &Ringdown, covariance: &Mat<f64>) -> Self {
        let (mut poles, mut rows, mut first) = (Vec::new(), Vec::new(), 0);
        for exponential in &fit.exponentials {
            if exponential.oscillates() {
                poles.push(exponential.pole);
                rows.extend([first, first + 1]);
            }
            first += exponential.parameters();
        }
        let covariance = Mat::from_fn(rows.len(), rows.len(), |i, j| covariance[(rows[i], rows[j])]);
        Self { poles, covariance }
    }
}

/// Rounds of the iteration: it is cubic, ten do from a start that is right to a tenth.
const ROUNDS: usize = 100;
/// Steps below this share of the root are rounding.
const ROUNDING: f64 = 1e-13;
/// A root found to this share is one: rounding of the sums where a contact moves a pole by little.
const FOUND: f64 = 1e-9;

/// Poles of the lever with a contact at its tip, one from each start; `[k_c, eta]` (N/m, N s/m) is a contact too.
///
/// # Model
/// `1 + kappa(s) G(s) = 0`, exact for a modal lever with a linear contact at the tip.
/// # Method
/// Newton's method on the polynomial that this is the quotient of, in product form, the roots found by the other starts
/// and all conjugates divided out, all at once (Ehrlich and Aberth): distinct starts end in distinct roots. None
/// without convergence, or where a root does not oscillate. About `20 M N` operations a round for M starts and N modes.
/// # Source
/// O. Aberth, Math. Comp. 27 (1973) 339.
pub fn coupled_poles(lever: &FreeLever, contact: impl Into<ContactLaw>, start: &[c64]) -> Option<Vec<c64>> {
    let law = contact.into();
    let mut roots = start.to_vec();
    let mut last = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut largest: f64 = 0.0;
        for j in 0..roots.len() {
            let s = roots[j];
            let step = newton_step(lever, law, &roots, j);
            if !(step.re.is_finite() && step.im.is_finite()) {
                return None;
            }
            roots[j] = s - step;
            largest = largest.max(step.norm() / s.norm());
        }
        if largest < ROUNDING || (largest < FOUND && largest >= last) {
            return roots.iter().all(|s| s.im > 0.0).then_some(roots);
        }
        last = largest;
    }
    None
}

fn newton_step(lever: &FreeLever, law: ContactLaw, roots: &[c64], j: usize) -> c64 {
    let s = roots[j];
    let g = lever.compliance(s);
    let kappa = law.at(s);
    let f = kappa * g.value + 1.0;
    let slope = law.slope(s) * g.value + kappa * g.by_s + f * lever.denominators_slope(s);
    let one = c64::new(1.0, 0.0);
    let others = roots.iter().enumerate().fold(one / (s - s.conj()), |sum, (i, &other)| {
        if i == j { sum } else { sum + one / (s - other) + one / (s - other.conj()) }
    });
    f / (slope - f * others)
}
