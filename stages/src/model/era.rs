//! The stage `model.era`.

use afmid_pipeline::{Context, Example, Faults, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::pem::PAIR;
use super::realised::{MODEL, Realised, SUMMARY};
use crate::artifacts::{DataSet, Pair, PairSeries};
use afmid_kernels::subspace::Subspace;
use afmid_kernels::validation::largest_gap;

/// Estimates a state-space model from the free decay at the end of a record: eigensystem realization.
///
/// Model: where the force no longer changes, y(t) = C A^t x0 about a rest; before, x(t+Ts) = A x + B u, y = C x + D u.
/// Method: the decay begins where the force last changes; its mean over the last tenth is the rest. Singular value
/// decomposition of its Hankel matrix, A by shift invariance; B, D, initial state, offset and drift by least squares of
/// the simulation over the whole record. Unstable poles are reflected.
/// Shapes: as `model.pem`.
/// Units: those of the pair.
/// Accuracy: exact without noise; with white noise above the bound, the less the more rows up to a third of the decay.
/// Damping is biased by the noise: a start value, or a check of `model.pem`.
/// Errors: a decay shorter than twice the block rows, values that are missing or not finite, a response that is
/// constant.
/// Source: J. Juang and R. Pappa, J. Guidance 8 (1985) 620.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EraEstimate {
    /// Number of states; 0: at the largest gap between the decay's singular values, up to 40. Why: as in the paper.
    #[schemars(range(min = 0, max = 40))]
    pub order: usize,
    /// Which data: `all`, `identification` or `verification`.
    pub set: DataSet,
    /// Rows of the Hankel matrix, more than the order. Why: many average the noise, a third of the decay is best.
    #[schemars(range(min = 2, max = 1000))]
    pub block_rows: usize,
    /// Seconds of the decay left out at its beginning.
    #[schemars(range(min = 0.0))]
    pub skip_s: f64,
    /// Estimate a constant offset of the response.
    pub offset: bool,
    /// Estimate a linear drift of the response. Why: averaged records wander.
    pub drift: bool,
}

impl Default for EraEstimate {
    fn default() -> Self {
        Self { order: 11, set: DataSet::All, block_rows: 300, skip_s: 0.0, offset: true, drift: true }
    }
}

impl Stage for EraEstimate {
    const SPEC: Spec = Spec {
        name: "model.era",
        version: 6,
        summary: "estimates a state-space model from a free decay: eigensystem realization",
        inputs: &[PAIR.spec()],
        outputs: &[MODEL.spec(), SUMMARY.spec()],
        source: "J. Juang and R. Pappa, J. Guidance 8 (1985) 620",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (rows, least) = (self.block_rows, (self.order + 1).max(2));
        faults.require(rows >= least, || format!("`block_rows` is {rows}, wanted {least} to 1000"));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let series = Pair::new(inputs.get(&PAIR)?).series(self.set, 0)?;
        let decay = free_decay(&series, self.skip_s);
        let era = Subspace::of_decay(&decay, self.block_rows).map_err(|error| {
            StageError::from_error(error)
                .help("fewer `block_rows`, or a record that goes on longer after the force's last change")
        })?;
        let gap = largest_gap(era.singular_values(), 40.min(self.block_rows - 1));
        let order = if self.order == 0 { gap } else { self.order };
        let poles = era.poles(order).map_err(StageError::from_error)?;
        let realised = Realised {
            set: self.set,
            first: 0,
            offset: self.offset,
            drift: self.drift,
            singular_values: era.singular_values(),
            choice: None,
            gap: Some(gap),
        };
        realised.ports(&poles, &series, cx)
    }

    fn examples() -> Vec<Example> {
        super::example::era()
    }
}

/// The response after the last change of any input, `skip_s` later, about its rest.
pub(super) fn free_decay(series: &PairSeries, skip_s: f64) -> Vec<f64> {
    let samples = series.output.len();
    let last_change = |u: &[f64]| (1..u.len()).rev().find(|&k| u[k] != u[k - 1]).unwrap_or(0);
    let begin = series.input.chunks_exact(samples).map(last_change).max().unwrap_or(0);
    let begin = begin.saturating_add((skip_s * series.rate).ceil() as usize).min(samples);
    let decay = &series.output[begin..];
    let tail = &decay[decay.len() - decay.len() / 10..];
    let rest = if tail.is_empty() { 0.0 } else { tail.iter().sum::<f64>() / tail.len() as f64 };
    decay.iter().map(|y| y - rest).collect()
}
