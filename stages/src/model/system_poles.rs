//! Poles of a state-space model, whatever its form.

use afmid_kernels::linear_algebra::eigenvalues;
use afmid_pipeline::StateSpace;
use faer::{Mat, c64};

use afmid_kernels::model::ModelError;

/// Poles of a model: what anybody who has its A finds.
///
/// # Model
/// z with `det(A - zI) = 0`.
/// # Method
/// QR algorithm, without a model of the sections: [`afmid_kernels::modes::poles`] has their standard errors.
/// # Shapes
/// n poles, conjugates next to each other, ascending in `|arg z|`, the upper one of a pair first.
/// # Units
/// The z plane.
/// # Accuracy
/// Rounding times the eigenvalues' condition.
/// # Errors
/// A that is not square or not finite, no convergence.
/// # Source
/// G. Golub and C. Van Loan, Matrix Computations (2013), section 7.5.
pub fn system_poles(model: &StateSpace) -> Result<Vec<c64>, ModelError> {
    let (a, n) = (&model.a, model.order());
    if a.values.len() != n * n {
        return Err(ModelError::Length { what: "A", found: a.values.len(), wanted: n * n });
    }
    if n == 0 {
        return Ok(Vec::new());
    }
    let mut poles = eigenvalues(&Mat::from_fn(n, n, |i, j| a.values[i * n + j]))?;
    poles.sort_by(|x, y| {
        let key = |z: &c64| (z.arg().abs(), z.norm());
        let ((x_angle, x_norm), (y_angle, y_norm)) = (key(x), key(y));
        x_angle.total_cmp(&y_angle).then(x_norm.total_cmp(&y_norm)).then(y.im.total_cmp(&x.im))
    });
    Ok(poles)
}

#[cfg(test)]
mod tests {
    use afmid_pipeline::Matrix;

    use super::*;

    fn model(n: usize, values: &[f64]) -> StateSpace {
        StateSpace { a: Matrix { rows: n, columns: n, values: values.to_vec() }, ..StateSpace::default() }
    }

    #[test]
    fn poles_are_those_of_the_characteristic_polynomial() {
        // z^2 - 2 r cos(w) z + r^2 beside a real pole: known in closed form
        let (r, w) = (0.99_f64, 0.3_f64);
        let a = [2.0 * r * w.cos(), 1.0, 0.0, -r * r, 0.0, 0.0, 0.0, 0.0, 0.5];
        let poles = system_poles(&model(3, &a)).unwrap();
        let known = [c64::new(0.5, 0.0), c64::from_polar(r, w), c64::from_polar(r, -w)];
        for (pole, known) in poles.iter().zip(known) {
            // three states, poles far apart: a few roundings
            assert!((pole - known).norm() < 1e-14, "{poles:?}");
        }
    }

    #[test]
    fn no_states_have_no_poles_and_other_shapes_are_refused() {
        assert!(system_poles(&StateSpace::default()).unwrap().is_empty());
        assert!(system_poles(&model(2, &[1.0, 2.0, 3.0])).is_err());
        assert!(system_poles(&model(1, &[f64::NAN])).is_err());
    }
}
