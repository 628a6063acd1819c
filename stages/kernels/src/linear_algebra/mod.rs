//! Dense real matrices and vectors, always on the calling thread: the same bits on any number of threads.

mod dot;
mod error;
mod gram;
mod hankel;
mod orthogonal;
mod tall;

pub use dot::{dot, dot_in_lanes};
pub use error::NoConvergence;
pub(crate) use gram::{combined, cross_of, gram, gram_of};
pub use hankel::{hankel_products, hankel_row_sums, remaining_row_space};
pub use orthogonal::{Qr, Svd, Symmetric, cholesky, eigenvalues, least_squares, product, solve};
pub use tall::TallQr;
