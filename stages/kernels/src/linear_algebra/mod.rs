//! Dense real matrices and vectors, always on the calling thread: the same bits on any number of threads.

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
pub use positive::{cholesky, definite_inverse, symmetric_inverse};
pub use tall::TallQr;
