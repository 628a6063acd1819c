//! Why a decomposition has no result.

/// An iteration did not come to its end, as with a value that is not finite. Holds its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the {0} did not converge")]
pub struct NoConvergence(pub &'static str);
