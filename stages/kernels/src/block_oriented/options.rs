//! What is fitted, and what may be wrong with it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::model::Structure;
use crate::model::{ModelError, finite};

/// Which models are tried, and how far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct BlockOptions {
    /// Structures that are tried; the best of them is the result.
    pub structures: Vec<Structure>,
    /// Poles of both linear parts together. Why: two parts of third order, which all but resonant chains stay below.
    #[schemars(range(min = 1, max = 20))]
    pub order: usize,
    /// Knots of the curve in the search. Why: ten tell the divisions apart; more need longer records.
    #[schemars(range(min = 4, max = 100))]
    pub knots: usize,
    /// Knots of the curve in the end, at most: one more between any two is tried as long as Schwarz's criterion falls.
    /// Why: 40 follow a kink to some thousandths of the range. `knots` or less: never.
    #[schemars(range(min = 0, max = 200))]
    pub most_knots: usize,
    /// Samples at the beginning that are simulated and not scored. Why: nothing is known of what was put in before
    /// them; longer than the slowest decay, or 0 for a system that was at rest.
    pub transient: usize,
    /// Splits that are refined on a part of the record. Why: a cheap score ranks the right one among the
    /// first ten.
    #[schemars(range(min = 1, max = 1000))]
    pub starts: usize,
    /// Most steps of the last refinement. Why: ten to thirty are usual.
    #[schemars(range(min = 1, max = 10_000))]
    pub max_iterations: usize,
}

impl Default for BlockOptions {
    fn default() -> Self {
        let structures = Structure::ALL.to_vec();
        Self { structures, order: 6, knots: 10, most_knots: 40, transient: 0, starts: 16, max_iterations: 60 }
    }
}

/// Why no model was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BlockError {
    /// The data, a parameter or the linear start.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Too few samples to score.
    #[error("{found} samples after the transient, wanted at least {wanted} for this order and these knots")]
    TooShort {
        /// Samples that are scored.
        found: usize,
        /// Samples needed.
        wanted: usize,
    },
    /// The input does not vary.
    #[error("the input is constant: it excites nothing")]
    ConstantInput,
    /// No split gave a finite model.
    #[error("no division of the poles between the two parts has a finite, stable model: another order may do")]
    NoModel,
}

/// Checks data and options. Errors: lengths, values, parameters.
pub(super) fn checked(u: &[f64], y: &[f64], options: &BlockOptions) -> Result<(), BlockError> {
    if u.len() != y.len() {
        return Err(ModelError::Length { what: "input", found: u.len(), wanted: y.len() }.into());
    }
    finite("input", u)?;
    finite("output", y)?;
    let range = |name, found: usize, ok: bool, wanted| {
        if ok { Ok(()) } else { Err(ModelError::Parameter { name, found: found as f64, wanted }) }
    };
    range("structures", options.structures.len(), !options.structures.is_empty(), "at least one")?;
    range("order", options.order, (1..=20).contains(&options.order), "1 to 20")?;
    let chain = options.order > 1 || options.structures.iter().any(|s| *s != Structure::WienerHammerstein);
    range("order", options.order, chain, "at least 2 for two linear parts")?;
    range("knots", options.knots, (4..=100).contains(&options.knots), "4 to 100")?;
    range("most_knots", options.most_knots, options.most_knots <= 200, "at most 200")?;
    range("starts", options.starts, options.starts >= 1, "at least 1")?;
    range("max_iterations", options.max_iterations, options.max_iterations >= 1, "at least 1")?;
    // ten samples for each parameter
    let wanted = 10 * (2 * options.order + options.knots) + 100;
    let found = y.len().saturating_sub(options.transient);
    if found < wanted {
        return Err(BlockError::TooShort { found, wanted });
    }
    let constant = |signal: &[f64]| signal.windows(2).all(|pair| pair[0] == pair[1]);
    if constant(&u[options.transient..]) {
        return Err(BlockError::ConstantInput);
    }
    if constant(&y[options.transient..]) {
        return Err(ModelError::ConstantOutput.into());
    }
    Ok(())
}
