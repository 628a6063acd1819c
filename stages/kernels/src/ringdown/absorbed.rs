//! What a fit takes of the noise with it: the restricted likelihood's correction.

use super::fitted::Fitted;
use super::modal_form::{Exponential, columns, weights};
use super::normal::Freedom;
use super::records::Records;
use crate::linear_algebra::cholesky;
use crate::signal::{RealTransform, summed_periodograms};

impl Fitted {
    /// Mean tapered periodogram of what the fit has absorbed of the noise, per event.
    pub(super) fn absorbed(
        &self,
        exponentials: &[Exponential],
        freedom: &Freedom,
        records: &Records<'_>,
        taper: &[f64],
    ) -> Vec<f64> {
        let count = self.events.len();
        // an event of mean amplitude stands for all: the absorbed part depends on it through its square
        let amplitude = (self.events.iter().map(|e| e.amplitude * e.amplitude).sum::<f64>() / count as f64).sqrt();
        let typical = self
            .events
            .iter()
            .enumerate()
            .min_by(|a, b| (a.1.amplitude.abs() - amplitude).abs().total_cmp(&(b.1.amplitude.abs() - amplitude).abs()))
            .map_or(0, |(i, _)| i);
        let block = &self.blocks[typical];
        let mut w = weights(&self.reference, exponentials, &self.events[typical]);
        freedom.turn(&mut w.shared, exponentials);
        let width = w.value.len();
        let mut directions: Vec<Vec<f64>> = Vec::new();
        let shared_root = cholesky(&self.covariance);
        for j in 0..freedom.shared.len() {
            let mut direction = vec![0.0; width];
            for (i, &parameter) in freedom.shared.iter().enumerate().skip(j) {
                let factor = shared_root[(i, j)];
                for (c, (direction, shared)) in direction.iter_mut().zip(&w.shared[parameter]).enumerate() {
                    let own: f64 = freedom
                        .own
                        .iter()
                        .enumerate()
                        .map(|(k, &o)| w.own[o][c] * block.eliminated.coupling[(k, i)])
                        .sum();
                    *direction += factor * (shared - own);
                }
            }
            directions.push(direction);
        }
        let own_root = cholesky(&block.eliminated.own_inverse);
        for j in 0..freedom.own.len() {
            let mut direction = vec![0.0; width];
            for (i, &o) in freedom.own.iter().enumerate().skip(j) {
                (0..width).for_each(|c| direction[c] += own_root[(i, j)] * w.own[o][c]);
            }
            directions.push(direction);
        }
        let basis = columns(&self.reference, records.interval_s, taper.len());
        let signals: Vec<Vec<f64>> = directions
            .iter()
            .map(|direction| {
                let mut signal = vec![0.0; taper.len()];
                for (column, factor) in basis.iter().zip(direction) {
                    signal.iter_mut().zip(column).for_each(|(s, c)| *s += factor * c);
                }
                records.gaps.apply(typical, &mut signal, taper);
                signal
            })
            .collect();
        summed_periodograms(&RealTransform::new(taper.len()), &signals, taper)
    }
}
