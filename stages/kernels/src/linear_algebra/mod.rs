//! Dense real matrices and vectors, always on the calling thread: the same bits on any number of threads.
//!
//! ```
//! use afmid_kernels::Mat;
//! use afmid_kernels::linear_algebra::{least_squares, product, symmetric_inverse};
//! // a line through 100 points with noise of variance 0.005
//! let line = Mat::from_fn(100, 2, |k, j| if j == 0 { 1.0 } else { k as f64 });
//! let y = Mat::from_fn(100, 1, |k, _| 2.0 + 0.3 * k as f64 + 0.1 * ((k * k) as f64).sin());
//! let found = least_squares(&line, &y, 1e-12)?;
//! // its covariance: the noise's variance times the inverse of the normal matrix
//! let normal = product(line.transpose(), line.as_ref());
//! let std = (0.005 * symmetric_inverse(&normal)[(1, 1)]).sqrt();
//! assert!((found[(1, 0)] - 0.3).abs() < 3.0 * std && std < 3e-4);
//! # Ok::<(), afmid_kernels::linear_algebra::NoConvergence>(())
//! ```

mod dot;
mod elimination;
mod error;
mod gram;
mod hankel;
mod orthogonal;
mod positive;
mod tall;

pub use dot::{dot, dot_in_lanes};
pub use elimination::Eliminated;
pub use error::NoConvergence;
pub(crate) use gram::{combined, cross_of, gram, gram_of};
pub use hankel::{hankel_products, hankel_row_sums, remaining_row_space};
pub use orthogonal::{Qr, Svd, Symmetric, eigenvalues, least_squares, product, solve};
pub(crate) use positive::clear_factor;
pub use positive::{cholesky, definite_inverse, symmetric_inverse};
pub use tall::TallQr;
