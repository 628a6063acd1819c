//! How the future is weighted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the future is weighted before its singular values are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    /// What the past predicts of it, as it is: the oblique projection.
    N4sid,
    /// The future input's directions removed on the right: the orthogonal projection.
    Moesp,
    /// Also scaled by the future output's covariance: canonical variates, least variance for white inputs.
    Cva,
    /// The future itself, without instruments: for inputs that do not excite, such as releases.
    Release,
}
