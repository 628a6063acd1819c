//! Eigensystem realization: poles from the shift invariance of a free decay.

use crate::linear_algebra::Svd;
use faer::Mat;

use super::past_future::Subspace;
use crate::model::{ModelError, finite};

impl Subspace {
    /// The column space of a free decay's Hankel matrix.
    ///
    /// # Model
    /// `y(t) = C A^t x0 + noise`, no input: a sum of damped exponentials. A rest that stays (an offset) is one more pole,
    /// at one.
    /// # Method
    /// Singular values of the Hankel matrix of `block_rows` rows; the strongest left vectors span the observability matrix;
    /// A by shift invariance.
    /// # Shapes
    /// y: N samples; singular values: at most `block_rows`.
    /// # Units
    /// Poles in the z plane.
    /// # Accuracy
    /// Exact without noise. With white noise above the Cramer-Rao bound, the less the more rows up to a third of N; damping
    /// is biased upwards by the noise's own energy. Start values.
    /// # Errors
    /// Values that are not finite, fewer than 2 `block_rows` samples, no convergence.
    /// # Source
    /// J. Juang and R. Pappa, J. Guidance 8 (1985) 620; S. Kung, 12th Asilomar Conf. (1978) 705.
    ///
    /// `block_rows`: at least 2.
    pub fn of_decay(decay: &[f64], block_rows: usize) -> Result<Self, ModelError> {
        if block_rows < 2 {
            return Err(ModelError::Parameter { name: "block_rows", found: block_rows as f64, wanted: "at least 2" });
        }
        if decay.len() < 2 * block_rows {
            return Err(ModelError::TooShort { found: decay.len(), wanted: 2 * block_rows });
        }
        finite("output", decay)?;
        let windows = decay.len() - block_rows + 1;
        let hankel = Mat::from_fn(windows, block_rows, |t, j| decay[t + j]);
        let svd = Svd::new(&hankel)?;
        Ok(Self { left: svd.v, singular_values: svd.s })
    }
}
