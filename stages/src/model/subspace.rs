//! The stage `model.subspace`.

use afmid_pipeline::{Context, Example, Faults, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::excitation::{require_a_change, require_more_than_a_sine};
use super::order::Order;
use super::pem::PAIR;
use super::realised::{MODEL, Realised, SUMMARY};
use crate::artifacts::{DataSet, Pair, PairSeries};
use crate::watched::Watched;
use afmid_kernels::pem::{Experiment, NoiseModel, PemOptions};
use afmid_kernels::subspace::{Subspace, Weight};
use afmid_kernels::validation::{OrderChoice, choose_order};

/// Estimates a state-space model from the column space of Hankel matrices, without iteration.
///
/// Model: x(t+Ts) = A x + B u + K e, y = C x + D u + e + offset + drift; K is not estimated.
/// Method: A by shift invariance of the observability matrix: past inputs and outputs predict the future, weighted as
/// N4SID, MOESP or CVA do; or, for inputs that do not excite (a release), the future's own Hankel matrix with the
/// input's directions removed. B, D, initial state, offset and drift by least squares of the simulation. Unstable poles
/// are reflected.
/// Shapes: as `model.pem`; `force` over `input` and time gives several inputs.
/// Units: those of the pair.
/// Accuracy: consistent, but not efficient: above the errors of `model.pem`, without its iterations. The covariance
/// takes the poles' errors as those of output error at this point.
/// Errors: too few samples for the block rows, values that are missing or not finite, a response that is constant, an
/// input that is one sine, of which nothing else shows in the output.
/// Source: P. Van Overschee and B. De Moor, Subspace Identification for Linear Systems, 1996; M. Verhaegen and P.
/// Dewilde, Int. J. Control 56 (1992) 1187.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SubspaceEstimate {
    /// Number of states, 1 to 40, or `auto`: as in `model.pem`, by output error. Why: as in the paper.
    pub order: Order,
    /// Largest order that `auto` tries. Why: each may take a fit.
    #[schemars(range(min = 1, max = 40))]
    pub max_order: usize,
    /// Which data: `all`, `identification` or `verification`.
    pub set: DataSet,
    /// Weight: `n4sid`, `moesp`, `cva`, or `release` (no instruments, for inputs that do not excite). Why: as the
    /// events here are.
    pub weight: Weight,
    /// Rows of each Hankel matrix, more than the order and at most 1000. Why: a period of the slowest mode or more; few
    /// blur close poles, many take noise along.
    pub block_rows: usize,
    /// Estimate a constant offset of the response.
    pub offset: bool,
    /// Estimate a linear drift of the response. Why: averaged records wander.
    pub drift: bool,
}

impl Default for SubspaceEstimate {
    fn default() -> Self {
        Self {
            order: Order::Fixed(11),
            max_order: 16,
            set: DataSet::All,
            weight: Weight::Release,
            block_rows: 60,
            offset: true,
            drift: true,
        }
    }
}

impl Stage for SubspaceEstimate {
    const SPEC: Spec = Spec {
        name: "model.subspace",
        version: 9,
        summary: "estimates a state-space model by subspace methods: N4SID, MOESP, CVA weights",
        inputs: &[PAIR.spec()],
        outputs: &[MODEL.spec(), SUMMARY.spec()],
        source: "Van Overschee and De Moor 1996; Verhaegen and Dewilde, Int. J. Control 56 (1992) 1187",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (rows, least) = (self.block_rows, self.order.largest(self.max_order) + 1);
        faults.require(rows >= least, || format!("`block_rows` is {rows}, wanted {least} to 1000"));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let series = Pair::new(inputs.get(&PAIR)?).series(self.set, 0)?;
        // of events the input may be over before the first sample that is fitted
        if self.weight != Weight::Release {
            require_a_change(&series.input)?;
        }
        require_more_than_a_sine(&series.input, &series.output, series.rate)?;
        let choice = match self.order {
            Order::Fixed(_) => None,
            Order::Auto => Some(self.choose(&series, cx)?),
        };
        let order = choice.as_ref().map_or(self.order.largest(0), |choice| choice.order);
        let (u, y, rows) = (&series.input, &series.output, self.block_rows);
        let estimate = Subspace::with_instruments(u, y, rows, self.weight).map_err(StageError::from_error)?;
        let poles = estimate.poles(order).map_err(StageError::from_error)?;
        let realised = Realised {
            set: self.set,
            first: 0,
            offset: self.offset,
            drift: self.drift,
            singular_values: estimate.singular_values(),
            choice: choice.as_ref(),
            gap: choice.as_ref().map(|choice| choice.gap),
        };
        realised.ports(&poles, &series, cx)
    }

    fn examples() -> Vec<Example> {
        super::example::subspace()
    }
}

impl SubspaceEstimate {
    fn choose(&self, series: &PairSeries, cx: &Context) -> Result<OrderChoice, StageError> {
        let options = PemOptions {
            block_rows: self.block_rows,
            noise: NoiseModel::White,
            offset: self.offset,
            drift: self.drift,
            ..PemOptions::default()
        };
        let experiment = Experiment { input: &series.input, output: &series.output };
        choose_order(experiment, 1.0 / series.rate, self.max_order, &options, &Watched(cx))
            .map_err(StageError::from_error)
    }
}
