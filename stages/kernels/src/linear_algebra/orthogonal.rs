//! Orthogonal decompositions of dense matrices.
//!
//! Bit-identical on any number of threads: every call names `Par::Seq`, whatever faer's global setting is.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::matmul::matmul;
use faer::linalg::{evd, householder, qr, svd};
use faer::prelude::default;
use faer::{Accum, Conj, Mat, MatMut, MatRef, Par, c64};

use super::error::NoConvergence;

/// Householder QR of a tall matrix, the reflectors kept packed.
#[derive(Debug, Clone)]
pub struct Qr {
    packed: Mat<f64>,
    coefficients: Mat<f64>,
}

impl Qr {
    /// Factors `matrix` (rows >= columns); about `2 rows columns^2` operations.
    pub fn new(mut matrix: Mat<f64>) -> Self {
        let (rows, columns) = matrix.shape();
        let block = qr::no_pivoting::factor::recommended_block_size::<f64>(rows, columns);
        let mut coefficients = Mat::zeros(block, rows.min(columns));
        let scratch = qr::no_pivoting::factor::qr_in_place_scratch::<f64>(rows, columns, block, Par::Seq, default());
        qr::no_pivoting::factor::qr_in_place(
            matrix.as_mut(),
            coefficients.as_mut(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            default(),
        );
        Self { packed: matrix, coefficients }
    }

    /// The upper triangle: `min(rows, columns)` x columns.
    pub fn r(&self) -> Mat<f64> {
        let size = self.packed.nrows().min(self.packed.ncols());
        Mat::from_fn(size, self.packed.ncols(), |i, j| if i <= j { self.packed[(i, j)] } else { 0.0 })
    }

    /// The orthonormal columns: rows x `min(rows, columns)`.
    pub fn q(&self) -> Mat<f64> {
        let size = self.packed.nrows().min(self.packed.ncols());
        let mut q = Mat::from_fn(self.packed.nrows(), size, |i, j| if i == j { 1.0 } else { 0.0 });
        let scratch = householder::apply_block_householder_sequence_on_the_left_in_place_scratch::<f64>(
            self.packed.nrows(),
            self.coefficients.nrows(),
            size,
        );
        householder::apply_block_householder_sequence_on_the_left_in_place_with_conj(
            self.packed.as_ref().get(.., ..size),
            self.coefficients.as_ref(),
            Conj::No,
            q.as_mut(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
        q
    }

    /// Overwrites `other` with `Q^T other`.
    pub fn apply_transpose(&self, other: MatMut<'_, f64>) {
        let size = self.packed.nrows().min(self.packed.ncols());
        let scratch = householder::apply_block_householder_sequence_transpose_on_the_left_in_place_scratch::<f64>(
            self.packed.nrows(),
            self.coefficients.nrows(),
            other.ncols(),
        );
        householder::apply_block_householder_sequence_transpose_on_the_left_in_place_with_conj(
            self.packed.as_ref().get(.., ..size),
            self.coefficients.as_ref(),
            Conj::No,
            other,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
    }
}

/// Thin singular value decomposition `U diag(s) V^T`.
#[derive(Debug, Clone)]
pub struct Svd {
    /// Left singular vectors: rows x `min(rows, columns)`.
    pub u: Mat<f64>,
    /// Singular values, descending.
    pub s: Vec<f64>,
    /// Right singular vectors: columns x `min(rows, columns)`.
    pub v: Mat<f64>,
}

impl Svd {
    /// Decomposes `matrix`. Errors: no convergence (a value that is not finite).
    pub fn new(matrix: &Mat<f64>) -> Result<Self, NoConvergence> {
        let (m, n) = matrix.shape();
        let size = m.min(n);
        let (mut u, mut v, mut s) = (Mat::zeros(m, size), Mat::zeros(n, size), Diag::zeros(size));
        let thin = svd::ComputeSvdVectors::Thin;
        let scratch = svd::svd_scratch::<f64>(m, n, thin, thin, Par::Seq, default());
        svd::svd(
            matrix.as_ref(),
            s.as_mut(),
            Some(u.as_mut()),
            Some(v.as_mut()),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            default(),
        )
        .map_err(|_| NoConvergence("singular value decomposition"))?;
        let s: Vec<f64> = s.column_vector().iter().copied().collect();
        if s.iter().any(|value| !value.is_finite()) {
            return Err(NoConvergence("singular value decomposition"));
        }
        Ok(Self { u, s, v })
    }

    /// `(M^T M)^+` of the decomposed matrix M, directions beyond the first `rank` left out.
    pub fn normal_inverse(&self, rank: usize) -> Mat<f64> {
        let n = self.v.nrows();
        let entry = |i: usize, j: usize| {
            (0..rank).map(|k| self.v[(i, k)] * self.v[(j, k)] / (self.s[k] * self.s[k])).sum::<f64>()
        };
        Mat::from_fn(n, n, entry)
    }

    /// How many singular values exceed `tolerance` times the largest.
    pub fn rank(&self, tolerance: f64) -> usize {
        let limit = tolerance * self.s.first().copied().unwrap_or(0.0);
        self.s.iter().take_while(|&&value| value > limit).count()
    }
}

/// Eigenvalues and orthonormal eigenvectors of a symmetric matrix.
#[derive(Debug, Clone)]
pub struct Symmetric {
    /// Ascending.
    pub values: Vec<f64>,
    /// A column each.
    pub vectors: Mat<f64>,
}

impl Symmetric {
    /// Decomposes `matrix`, of which the lower triangle is read. Errors: no convergence (a value that is not finite).
    pub fn new(matrix: &Mat<f64>) -> Result<Self, NoConvergence> {
        let n = matrix.nrows();
        let (mut values, mut vectors) = (Diag::zeros(n), Mat::zeros(n, n));
        let yes = evd::ComputeEigenvectors::Yes;
        let scratch = evd::self_adjoint_evd_scratch::<f64>(n, yes, Par::Seq, default());
        evd::self_adjoint_evd(
            matrix.as_ref(),
            values.as_mut(),
            Some(vectors.as_mut()),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            default(),
        )
        .map_err(|_| NoConvergence("eigenvalue decomposition"))?;
        let values: Vec<f64> = values.column_vector().iter().copied().collect();
        if values.iter().any(|value| !value.is_finite()) {
            return Err(NoConvergence("eigenvalue decomposition"));
        }
        Ok(Self { values, vectors })
    }
}

/// Eigenvalues of a square real matrix. Errors: no convergence.
pub fn eigenvalues(matrix: &Mat<f64>) -> Result<Vec<c64>, NoConvergence> {
    let n = matrix.nrows();
    if (0..n).any(|j| matrix.col(j).iter().any(|value| !value.is_finite())) {
        return Err(NoConvergence("eigenvalue decomposition"));
    }
    let (mut re, mut im) = (Diag::zeros(n), Diag::zeros(n));
    let no = evd::ComputeEigenvectors::No;
    let scratch = evd::evd_scratch::<f64>(n, no, no, Par::Seq, default());
    evd::evd_real(
        matrix.as_ref(),
        re.as_mut(),
        im.as_mut(),
        None,
        None,
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        default(),
    )
    .map_err(|_| NoConvergence("eigenvalue decomposition"))?;
    Ok(re.column_vector().iter().zip(im.column_vector().iter()).map(|(&re, &im)| c64::new(re, im)).collect())
}

/// Minimum-norm least squares `matrix x ~ rhs` through the singular values above `tolerance` times the largest.
pub fn least_squares(matrix: &Mat<f64>, rhs: &Mat<f64>, tolerance: f64) -> Result<Mat<f64>, NoConvergence> {
    let svd = Svd::new(matrix)?;
    let rank = svd.rank(tolerance);
    let mut projected = product(svd.u.as_ref().get(.., ..rank).transpose(), rhs.as_ref());
    for i in 0..rank {
        projected.row_mut(i).iter_mut().for_each(|value| *value /= svd.s[i]);
    }
    Ok(product(svd.v.as_ref().get(.., ..rank), projected.as_ref()))
}

/// `matrix^-1 rhs` for a square, well-conditioned matrix.
pub fn solve(matrix: Mat<f64>, rhs: &Mat<f64>) -> Mat<f64> {
    let n = matrix.nrows();
    let qr = Qr::new(matrix);
    let (r, mut x) = (qr.r(), rhs.clone());
    qr.apply_transpose(x.as_mut());
    for j in 0..x.ncols() {
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| r[(i, k)] * x[(k, j)]).sum();
            x[(i, j)] = (x[(i, j)] - known) / r[(i, i)];
        }
    }
    x
}

/// `lhs rhs`.
pub fn product(lhs: MatRef<'_, f64>, rhs: MatRef<'_, f64>) -> Mat<f64> {
    let mut out = Mat::zeros(lhs.nrows(), rhs.ncols());
    matmul(out.as_mut(), Accum::Replace, lhs, rhs, 1.0, Par::Seq);
    out
}
