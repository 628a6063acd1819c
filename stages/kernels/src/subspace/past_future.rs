//! Subspace identification: poles from the column space of a block Hankel matrix.

use crate::linear_algebra::{
    Svd, TallQr, eigenvalues, hankel_products, hankel_row_sums, least_squares, product, remaining_row_space,
};
use faer::{Mat, c64};

use crate::model::{ModelError, finite};

/// The dominant column space of the output's Hankel matrix, the input's row space removed.
///
/// # Model
/// `x(t+1) = A x(t) + B u(t)`, `y(t) = C x(t) + D u(t) + v(t)`, v white; an offset of y is allowed.
/// # Method
/// MOESP: `Y_f` (block rows x windows) is projected onto the orthogonal complement of the row space of `[1; U_f]`, by
/// their products where these keep enough digits, by QR elsewhere; the left singular vectors of what remains span the
/// observability matrix, and A follows from its shift invariance. A released ramp does not excite persistently: only
/// the directions that `U_f` really spans are removed, and the free decay, which remains, carries A.
/// # Shapes
/// u, y: N samples; several inputs one after the other, a multiple of N; singular values: `block_rows`.
/// # Units
/// Poles in the z plane.
/// # Accuracy
/// Consistent for white v as N grows; a few standard errors of the prediction error estimate on averaged releases:
/// start values.
/// # Errors
/// Unequal lengths, samples that are not finite, fewer than `3 block_rows` samples, a decomposition without
/// convergence.
/// # Source
/// M. Verhaegen and P. Dewilde, Int. J. Control 56 (1992) 1187; L. Ljung, System Identification (1999), section 10.6.
#[derive(Debug, Clone)]
pub struct Subspace {
    pub(super) left: Mat<f64>,
    pub(super) singular_values: Vec<f64>,
}

/// Energy of an input direction, as a share of the strongest, below which it counts as not excited: well above a Gram
/// matrix's rounding.
const INPUT_TOLERANCE: f64 = 1e-12;

impl Subspace {
    /// Builds the projected Hankel matrix with `block_rows` rows (at least 2) and decomposes it.
    pub fn new(u: &[f64], y: &[f64], block_rows: usize) -> Result<Self, ModelError> {
        if !u.len().is_multiple_of(y.len().max(1)) || u.len() < y.len() {
            return Err(ModelError::Length { what: "input", found: u.len(), wanted: y.len() });
        }
        if block_rows < 2 {
            return Err(ModelError::Parameter { name: "block_rows", found: block_rows as f64, wanted: "at least 2" });
        }
        if y.len() < 3 * block_rows {
            return Err(ModelError::TooShort { found: y.len(), wanted: 3 * block_rows });
        }
        finite("input", u)?;
        finite("output", y)?;
        if u.len() == y.len() {
            let u = scaled(u);
            let axes = Svd::new(&gram(&u, block_rows))?;
            if let Some((left, singular_values)) =
                remaining_row_space(&u, y, block_rows, (&axes, axes.rank(INPUT_TOLERANCE)))
            {
                return Ok(Self { left, singular_values });
            }
        }
        Self::by_rotation(u, y, block_rows)
    }

    /// The same by QR of the stacked matrices: exact to rounding whatever the noise.
    fn by_rotation(u: &[f64], y: &[f64], block_rows: usize) -> Result<Self, ModelError> {
        let windows = y.len() - block_rows + 1;
        let basis = input_basis(u, y.len(), block_rows)?;
        let removed = basis.ncols();
        let mut stacked = Mat::zeros(windows, removed + block_rows);
        stacked.as_mut().get_mut(.., ..removed).copy_from(&basis);
        for j in 0..block_rows {
            stacked.col_mut(removed + j).iter_mut().zip(&y[j..]).for_each(|(h, y)| *h = *y);
        }
        let r = TallQr::triangle(stacked.as_ref());
        let size = r.nrows().min(removed + block_rows);
        let remaining = r.as_ref().get(removed..size, removed..).transpose().to_owned();
        let svd = Svd::new(&remaining)?;
        Ok(Self { left: svd.u, singular_values: svd.s })
    }

    /// Singular values, descending (CVA: canonical correlations): their fall shows the order.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// Largest order that shift invariance can give.
    pub fn max_order(&self) -> usize {
        self.left.nrows().saturating_sub(1).min(self.left.ncols())
    }

    /// Poles of the model of order `order` (1 to [`Subspace::max_order`]); they need not be stable.
    pub fn poles(&self, order: usize) -> Result<Vec<c64>, ModelError> {
        shift_invariant_poles(&self.left, order)
    }
}

/// Poles from the first `order` columns of a basis of the observability matrix. Errors: order 0, or no fewer columns or
/// rows than that.
pub(super) fn shift_invariant_poles(basis: &Mat<f64>, order: usize) -> Result<Vec<c64>, ModelError> {
    let rows = basis.nrows();
    if order == 0 || order >= rows || order > basis.ncols() {
        return Err(ModelError::Parameter { name: "order", found: order as f64, wanted: "1 to block rows - 1" });
    }
    let upper = basis.as_ref().get(..rows - 1, ..order).to_owned();
    let lower = basis.as_ref().get(1.., ..order).to_owned();
    Ok(eigenvalues(&least_squares(&upper, &lower, f64::EPSILON)?)?)
}

/// Columns that span the rows of `[1; U_f]`, from the eigenvectors of their Gram matrix: windows x rank.
pub(crate) fn input_basis(u: &[f64], samples: usize, block_rows: usize) -> Result<Mat<f64>, ModelError> {
    let windows = samples - block_rows + 1;
    if u.len() > samples {
        return several_inputs_basis(u, samples, block_rows);
    }
    let scaled = scaled(u);
    let column = |j: usize, t: usize| if j == 0 { 1.0 } else { scaled[t + j - 1] };
    let gram = gram(&scaled, block_rows);
    let svd = Svd::new(&gram)?;
    let rank = svd.rank(INPUT_TOLERANCE);
    let stacked = Mat::from_fn(windows, block_rows + 1, |t, j| column(j, t));
    let mut basis = product(stacked.as_ref(), svd.u.as_ref().get(.., ..rank));
    for k in 0..rank {
        let norm = svd.s[k].sqrt();
        basis.col_mut(k).iter_mut().for_each(|value| *value /= norm);
    }
    Ok(basis)
}

/// The same of several inputs, each scaled to a peak of one, by QR and singular values.
fn several_inputs_basis(u: &[f64], samples: usize, block_rows: usize) -> Result<Mat<f64>, ModelError> {
    let windows = samples - block_rows + 1;
    let mut stacked = Mat::zeros(windows, 1 + u.len() / samples * block_rows);
    stacked.col_mut(0).iter_mut().for_each(|one| *one = 1.0);
    for (i, u) in u.chunks_exact(samples).enumerate() {
        let u = scaled(u);
        for j in 0..block_rows {
            let column = stacked.col_mut(1 + i * block_rows + j);
            column.iter_mut().zip(&u[j..]).for_each(|(h, u)| *h = *u);
        }
    }
    let svd = Svd::new(&stacked)?;
    // energies are squares of singular values
    Ok(svd.u.get(.., ..svd.rank(INPUT_TOLERANCE.sqrt())).to_owned())
}

/// A signal over its peak.
pub(super) fn scaled(signal: &[f64]) -> Vec<f64> {
    let peak = signal.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
    let level = if peak > 0.0 { peak } else { 1.0 };
    signal.iter().map(|x| x / level).collect()
}

/// `[1; U_f] [1; U_f]^T`.
fn gram(u: &[f64], block_rows: usize) -> Mat<f64> {
    let (own, ones) = (hankel_products(u, u, block_rows), hankel_row_sums(u, block_rows));
    Mat::from_fn(block_rows + 1, block_rows + 1, |i, j| match (i, j) {
        (0, 0) => (u.len() - block_rows + 1) as f64,
        (0, k) | (k, 0) => ones[k - 1],
        _ => own[(i - 1, j - 1)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};

    fn loaded(samples: usize) -> Vec<f64> {
        (0..samples).map(|k| if k <= 600 { -0.8 - 1e-5 * k as f64 } else { 0.0 }).collect()
    }

    #[test]
    fn a_noise_free_release_gives_its_poles() {
        let lever = Lever::paper();
        let y: Vec<f64> = lever.release(4096, 600.3, -0.8).iter().map(|y| y + 0.01).collect();
        let subspace = Subspace::new(&loaded(4096), &y, 60).unwrap();
        let found = subspace.poles(11).unwrap();
        for pole in &lever.poles()[..8] {
            let z = (pole / lever.sample_rate_hz).exp();
            let nearest = found.iter().map(|w| (w - z).norm()).fold(f64::MAX, f64::min);
            // the load's ramp is not in this closed form: 1e-5 of the load per sample
            assert!(nearest < 1e-4, "{z}: {nearest}");
        }
        let s = subspace.singular_values();
        assert!(s.len() == 60 && s.windows(2).all(|pair| pair[0] >= pair[1]));
        // eleven states: the weakest stand three decades above rounding, measured against the load
        assert!(s[11] < 1e-8 * s[0] && s[10] > 1e-7 * s[0], "{:?}", &s[..12]);
    }

    #[test]
    fn products_give_what_rotations_give() {
        let mut y = Lever::paper().release(4096, 600.3, -0.8);
        y.iter_mut().zip(white_noise(4096, 0.25e-3, 3)).for_each(|(y, e)| *y += e);
        let u = loaded(4096);
        let axes = Svd::new(&gram(&scaled(&u), 60)).unwrap();
        let (_, fast) = remaining_row_space(&scaled(&u), &y, 60, (&axes, axes.rank(INPUT_TOLERANCE))).unwrap();
        let slow = Subspace::by_rotation(&u, &y, 60).unwrap();
        for (x, y) in fast.iter().zip(slow.singular_values()) {
            assert!((x / y - 1.0).abs() < 1e-4, "{x} {y}"); // the weakest is clear of rounding by 1e4 in its square
        }
    }

    #[test]
    fn unusable_data_is_refused() {
        let y = white_noise(400, 1.0, 1);
        assert!(Subspace::new(&y, &y[1..], 60).is_err() && Subspace::new(&y, &y, 1).is_err());
        assert!(Subspace::new(&y[..100], &y[..100], 60).is_err());
        let subspace = Subspace::new(&vec![0.0; 400], &y, 60).unwrap();
        assert!(subspace.poles(0).is_err() && subspace.poles(60).is_err());
        assert_eq!(subspace.poles(59).unwrap().len(), 59);
    }
}
