//! Transmission zeros of a discrete model.

use crate::linear_algebra::{eigenvalues, least_squares};
use faer::{Mat, c64};

use super::error::ModelError;
use super::innovations::InnovationsModel;

/// Where the pencil is inverted: real, outside the unit circle, so neither pole nor (nearly ever) zero.
const SHIFT: f64 = 1.25;
/// Zeros beyond this radius are the feedthrough's rounding, not the system's.
const LARGEST: f64 = 1e6;

/// Finite invariant zeros of `(A, B, C, D)`.
///
/// # Model
/// z with `det [A - zI, B; C, D] = 0`.
/// # Method
/// The pencil `M - z N` is inverted at a shift: eigenvalues `1 / (z - shift)` of `(M - shift N)^-1 N`, so a vanishing D
/// needs no special case (infinite zeros become 0). Each zero is then polished by Newton's method on `G(z) / G'(z)`.
/// # Shapes
/// At most n zeros, conjugates exact and together, the upper one first.
/// # Units
/// The z plane.
/// # Accuracy
/// Rounding, for zeros that are apart from each other and from poles.
/// # Errors
/// The system is identically zero, or no convergence.
/// # Source
/// A. Emami-Naeini and P. Van Dooren, Automatica 18 (1982) 415.
pub fn transmission_zeros(model: &InnovationsModel) -> Result<Vec<c64>, ModelError> {
    let n = model.order();
    let (a, b, c, _) = model.matrices();
    let shifted = Mat::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
        (true, true) => a[(i, j)] - if i == j { SHIFT } else { 0.0 },
        (true, false) => b[i],
        (false, true) => c[j],
        (false, false) => model.feedthrough,
    });
    let right = Mat::from_fn(n + 1, n, |i, j| if i == j { 1.0 } else { 0.0 });
    let solved = least_squares(&shifted, &right, f64::EPSILON)?;
    let inverted = eigenvalues(&solved.as_ref().get(..n, ..).to_owned())?;
    let mut zeros = Vec::new();
    for value in inverted.into_iter().filter(|value| value.norm() > 1.0 / LARGEST && value.im <= 0.0) {
        // 1 / (z - shift) has the opposite imaginary sign
        let zero = polished(model, SHIFT + value.inv());
        if value.im < 0.0 {
            zeros.extend([zero, zero.conj()]);
        } else {
            zeros.push(zero);
        }
    }
    Ok(zeros)
}

/// Newton's method while it reduces `|G|`; a conjugate pair stays a pair.
fn polished(model: &InnovationsModel, start: c64) -> c64 {
    let mut zero = start;
    let mut level = model.transfer(zero).norm();
    for _ in 0..8 {
        let next = zero - model.transfer(zero) / model.transfer_slope(zero);
        let trial = model.transfer(next).norm();
        if trial.is_nan() || trial >= level || (start.im > 0.0) != (next.im > 0.0) {
            break;
        }
        (zero, level) = (next, trial);
    }
    zero
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::innovations::Section;

    fn model(feedthrough: f64) -> InnovationsModel {
        let section = |a: [f64; 2], b: [f64; 2]| Section { order: 2, a, b, k: [0.0; 2] };
        let last = Section { order: 1, a: [-0.3, 0.0], b: [0.05, 0.0], k: [0.0; 2] };
        let sections = vec![section([-1.9, 0.95], [0.01, 0.02]), section([-1.2, 0.9], [-0.03, 0.01]), last];
        InnovationsModel { sections, feedthrough, sample_time_s: 1.0 }
    }

    #[test]
    fn the_transfer_function_vanishes_at_its_zeros() {
        for (feedthrough, count) in [(0.1, 5), (0.0, 4)] {
            let model = model(feedthrough);
            let zeros = transmission_zeros(&model).unwrap();
            assert_eq!(zeros.len(), count, "{zeros:?}");
            for zero in &zeros {
                // rounding, against terms of order one tenth
                assert!(model.transfer(*zero).norm() < 1e-13, "{zero}");
                assert!(zero.im == 0.0 || zeros.iter().any(|other| *other == zero.conj()));
            }
        }
    }

    #[test]
    fn a_single_section_has_the_zero_of_its_numerator() {
        let section = Section { order: 2, a: [-1.0, 0.5], b: [2.0, -1.0], k: [0.0; 2] };
        let zeros =
            transmission_zeros(&InnovationsModel { sections: vec![section], feedthrough: 0.0, sample_time_s: 1.0 });
        assert!((zeros.unwrap()[0].re - 0.5).abs() < 1e-14);
    }
}
