//! The fit under one noise model.

use faer::Mat;

use super::estimate::RingdownVerdict;
use super::limits::hold;
use super::modal_form::{EventParameters, Exponential};
use super::noise::RingdownNoise;
use super::normal::{EventBlock, Freedom, blocks};
use super::projected::{Projected, Whitened};
use super::records::Records;
use super::search::{Point, assembled, search};
use crate::linear_algebra::symmetric_inverse;
use crate::model::ModelError;

/// Outer rounds: each takes the basis to the present poles.
const ROUNDS: usize = 12;
/// Standard errors that count as arrived.
pub(super) const ARRIVED: f64 = 1e-3;
/// Those where only the size of what is left is asked for: the cost is right to a tenth.
pub(super) const NEARLY: f64 = 0.3;
/// Standard errors that a round may go, over those that count as arrived, for the basis to be good to them.
const BY_ROUND: f64 = 1e3;
/// At most: a step of ten standard errors is right to the third order.
const MOST_BY_ROUND: f64 = 10.0;

/// A fit under one noise model.
pub(super) struct Fitted {
    pub data: Projected,
    pub reference: Vec<Exponential>,
    pub blocks: Vec<EventBlock>,
    pub covariance: Mat<f64>,
    pub verdict: RingdownVerdict,
    pub events: Vec<EventParameters>,
}

impl Fitted {
    pub(super) fn of(
        records: &Records<'_>,
        noise: &RingdownNoise,
        point: &mut Point,
        freedom: &Freedom,
        arrived: f64,
    ) -> Result<Self, ModelError> {
        let whitened = Whitened::of(records, noise);
        let mut verdict = RingdownVerdict { converged: false, distance: f64::INFINITY, steps: 0 };
        for round in 0..ROUNDS {
            let reference = point.exponentials.clone();
            let data = whitened.projected(&reference);
            let before = freedom.values(&point.exponentials);
            let found = search(&data, &reference, point, freedom, arrived);
            verdict.steps += found.steps;
            let parts = blocks(&data, &reference, &point.exponentials, &point.events, freedom, 0.0);
            let values = freedom.values(&point.exponentials);
            let (mut information, _) = assembled(&parts, freedom, &values);
            // how far this round went: the basis is exact to the third order of it
            let moved: Vec<f64> = freedom.shared.iter().map(|&i| values[i] - before[i]).collect();
            let distance = (0..moved.len())
                .map(|i| (0..moved.len()).map(|j| moved[i] * information[(i, j)] * moved[j]).sum::<f64>())
                .sum::<f64>()
                .max(0.0)
                .sqrt();
            verdict.distance = found.distance;
            verdict.converged = distance < (BY_ROUND * arrived).min(MOST_BY_ROUND) && found.distance < arrived;
            if verdict.converged || round + 1 == ROUNDS {
                // what sits on a bound is not known to be there: the others' errors are those beside it
                let edges = freedom.edges(&values);
                (0..edges.len()).filter(|&k| edges[k] != 0).for_each(|k| hold(&mut information, k));
                let covariance = symmetric_inverse(&information);
                if (0..moved.len()).any(|i| !covariance[(i, i)].is_finite()) {
                    return Err(ModelError::Degenerate("no finite covariance"));
                }
                let events = point.events.clone();
                return Ok(Self { data, reference, blocks: parts, covariance, verdict, events });
            }
        }
        Err(ModelError::Degenerate("no round was made"))
    }

    /// The same fit under `excess` times the white noise's variance.
    pub(super) fn rescale(&mut self, excess: f64) {
        let grow = |matrix: &Mat<f64>, factor: f64| {
            Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| factor * matrix[(i, j)])
        };
        self.covariance = grow(&self.covariance, excess);
        self.data.rest.iter_mut().for_each(|rest| *rest /= excess);
        for block in &mut self.blocks {
            block.cost /= excess;
            block.information = grow(&block.information, 1.0 / excess);
            let part = &mut block.eliminated;
            part.own_inverse = grow(&part.own_inverse, excess);
            part.score.iter_mut().for_each(|score| *score /= excess);
        }
    }

    pub(super) fn used(&self, freedom: &Freedom) -> usize {
        freedom.shared.len() + self.blocks.len() * freedom.own.len()
    }

    /// Whitened energy that each event leaves.
    pub(super) fn energies(&self) -> Vec<f64> {
        self.blocks.iter().zip(&self.data.rest).map(|(block, rest)| block.cost + rest).collect()
    }

    pub(super) fn chi_square(&self) -> f64 {
        self.blocks.iter().map(|block| block.cost).sum::<f64>() + self.data.rest.iter().sum::<f64>()
    }
}
