//! The order of a model, found from the data.

use rayon::prelude::*;

use super::fit::{Nuisances, simulate_held_out};
use super::shortlist::{Shortlist, nothing_left};
use crate::model::{InnovationsModel, InputGains, ModelError};
use crate::monitor::Monitor;
use crate::pem::{Experiment, Identified, NoiseModel, Orders, PemOptions, identify};
use crate::subspace::Subspace;

/// What an order's model made of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderCandidate {
    /// The order.
    pub order: usize,
    /// `N ln(mean square of e) + k ln N` of the whole training record; NaN where no model could be had, and where the
    /// last third decides, so that nobody needs it.
    pub bic: f64,
    /// FIT % of the simulation of the record's last third, by a model of its first two thirds; NaN where this cannot be
    /// judged, and of orders that are not fitted.
    pub held_out_percent: f64,
}

/// The order found, and what was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderChoice {
    /// The order.
    pub order: usize,
    /// The order at the largest gap between consecutive singular values (by ratio), for comparison.
    pub gap: usize,
    /// All orders that were tried.
    pub candidates: Vec<OrderCandidate>,
}

/// Iterations for each candidate: enough to rank orders.
const ITERATIONS: usize = 12;
/// Parts of the last third whose errors say how sure its fit is.
const BLOCKS: usize = 10;

/// Chooses an order of 1 to `most` from training data alone.
///
/// # Model
/// That of [`identify`] with `options`, its order replaced.
/// # Method
/// Orders are fitted to the first two thirds and simulated over the last: the smallest order whose squared error is
/// within one standard error (over ten blocks) of the least. Where the last third has no input of its own (a release),
/// the least Bayesian information criterion instead.
///
/// Not all orders are fitted. The poles of a subspace estimate with the linear part by least squares give each order's
/// squared error on the first two thirds before any iteration. An order with ten times the least is left out. So are
/// those above the order of the least information criterion, where this one's errors are white and do not depend on the
/// input: nothing is left that a larger order could explain.
/// # Accuracy
/// Of 480 simulated records (one to five modes, 300 to 8000 samples, noise of 2 to 30 %) the true order in 231 of 240
/// where noise is white, less in 6; in 134 of 240 where it is coloured, less in 5. If all orders are fitted these are
/// 171, 2, 132 and 6. No more than the data need, not the truth.
/// # Errors
/// No order can be fitted; cancelled by the monitor.
/// # Source
/// L. Ljung, System Identification (1999), section 16.4; G. Schwarz, Ann. Stat. 6 (1978) 461.
pub fn choose_order(
    experiment: Experiment<'_>,
    sample_time_s: f64,
    most: usize,
    options: &PemOptions,
    monitor: &dyn Monitor,
) -> Result<OrderChoice, ModelError> {
    let parts = Parts::of(experiment);
    let judged = match &parts {
        Some(parts) => parts.judged(sample_time_s, most, options, monitor)?,
        None => Vec::new(),
    };
    let held_out = smallest_within_error(&judged);
    let candidates: Vec<OrderCandidate> = match held_out {
        Some(_) => judged.into_iter().map(|(candidate, _)| candidate).collect(),
        None => each((1..=most).collect(), monitor, |order| {
            let fit = identify(&[experiment], sample_time_s, &ranking(options, order));
            let bic = fit.map_or(f64::NAN, |fit| bic(&fit, options.noise));
            OrderCandidate { order, bic, held_out_percent: f64::NAN }
        })?,
    };
    let rows = options.block_rows.min(experiment.output.len() / 3);
    let gap = Subspace::new(experiment.input, experiment.output, rows)
        .map(|subspace| largest_gap(subspace.singular_values(), most))
        .unwrap_or(0);
    let by_bic = candidates.iter().filter(|c| !c.bic.is_nan()).min_by(|x, y| x.bic.total_cmp(&y.bic));
    let order = held_out
        .or(by_bic.map(|c| c.order))
        .ok_or(ModelError::Degenerate("no order could be fitted: the record may be too short for `block_rows`"))?;
    Ok(OrderChoice { order, gap, candidates })
}

/// What `of` makes of the orders. Errors: cancelled by the monitor.
fn each<T: Send>(
    orders: Vec<usize>,
    monitor: &dyn Monitor,
    of: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, ModelError> {
    monitor.expect(orders.len());
    let watched = |order| {
        if monitor.is_cancelled() {
            return Err(ModelError::Cancelled);
        }
        let result = of(order);
        monitor.tick();
        Ok(result)
    };
    orders.into_par_iter().map(watched).collect()
}

/// The options of a fit that is to be ranked.
fn ranking(options: &PemOptions, order: usize) -> PemOptions {
    let max_iterations = ITERATIONS.min(options.max_iterations);
    PemOptions { order, block_rows: options.block_rows.max(order + 1), max_iterations, ..options.clone() }
}

/// First two thirds and the rest, inputs one after the other.
struct Parts {
    first: (Vec<f64>, Vec<f64>),
    rest: (Vec<f64>, Vec<f64>),
}

impl Parts {
    /// `None` where the rest has no input of its own, or lacks outputs.
    fn of(experiment: Experiment<'_>) -> Option<Self> {
        let samples = experiment.output.len();
        let cut = 2 * samples / 3;
        let part = |from: usize, to: usize| {
            let inputs = experiment.input.chunks_exact(samples).flat_map(|u| u[from..to].to_vec()).collect();
            (inputs, experiment.output[from..to].to_vec())
        };
        let parts = Self { first: part(0, cut), rest: part(cut, samples) };
        let moves = parts.rest.0.windows(2).any(|pair| pair[0] != pair[1]);
        let complete = experiment.output.iter().all(|y| y.is_finite());
        (moves && complete).then_some(parts)
    }

    /// Candidates of the orders 1 to `most` and the squared errors of their simulations of the rest by block; no blocks
    /// where an order is not judged.
    fn judged(
        &self,
        sample_time_s: f64,
        most: usize,
        options: &PemOptions,
        monitor: &dyn Monitor,
    ) -> Result<Vec<(OrderCandidate, Vec<f64>)>, ModelError> {
        let rows = |order: usize| options.block_rows.max(order + 1).min(self.first.1.len() / 5).max(order + 1);
        let fit = |order| PemOptions { block_rows: rows(order), ..ranking(options, order) };
        let first = Experiment { input: &self.first.0, output: &self.first.1 };
        let unjudged = |order| (OrderCandidate { order, bic: f64::NAN, held_out_percent: f64::NAN }, Vec::new());
        let mut candidates: Vec<_> = (1..=most).map(unjudged).collect();
        let Ok(orders) = Orders::new(first, sample_time_s, (1..=most).map(fit).collect()) else {
            return Ok(candidates);
        };
        let promising = self.promising(&orders, most);
        let simulated = each(promising.clone(), monitor, |order| {
            let model = orders.model(order - 1).ok()?;
            self.simulated(&model.model, &model.further_inputs, options)
        })?;
        for (order, simulated) in promising.into_iter().zip(simulated) {
            if let (Some(candidate), Some((held_out_percent, blocks))) = (candidates.get_mut(order - 1), simulated) {
                *candidate = (OrderCandidate { held_out_percent, ..candidate.0 }, blocks);
            }
        }
        Ok(candidates)
    }

    /// The orders whose fits may be the choice, by their starts.
    fn promising(&self, orders: &Orders, most: usize) -> Vec<usize> {
        let (input, output) = &self.first;
        let costs = (1..=most).into_par_iter().map(|order| orders.cost_of_start(order - 1).ok()).collect();
        let shortlist = Shortlist::new(costs, input, output);
        let enough = shortlist.least_information();
        let errors = orders.errors_of_start(enough - 1);
        let suffices = errors.is_ok_and(|errors| nothing_left(input, &errors, enough));
        shortlist.up_to(if suffices { enough } else { most })
    }

    /// FIT % of a model's simulation of the rest, and its squared errors by block.
    fn simulated(
        &self,
        model: &InnovationsModel,
        further: &[InputGains],
        options: &PemOptions,
    ) -> Option<(f64, Vec<f64>)> {
        let (input, output) = (&self.rest.0, &self.rest.1);
        let nuisances = Nuisances { offset: options.offset, slope: options.drift };
        let simulation = simulate_held_out(model, further, input, output, nuisances).ok()?;
        let errors: Vec<f64> = simulation.response.iter().zip(output).map(|(x, y)| (x - y).powi(2)).collect();
        let size = errors.len().div_ceil(BLOCKS).max(1);
        Some((simulation.fit_percent, errors.chunks(size).map(|block| block.iter().sum()).collect()))
    }
}

fn bic(fit: &Identified, noise: NoiseModel) -> f64 {
    let present: Vec<f64> = fit.residuals.iter().flatten().copied().filter(|e| e.is_finite()).collect();
    let (n, order) = (present.len() as f64, fit.model.order());
    let noise = match noise {
        NoiseModel::White | NoiseModel::Coloured => 0,
        NoiseModel::Thermal => order.div_ceil(2),
        NoiseModel::Free => order,
    };
    let count = fit.covariance.nrows() + noise;
    let mean = present.iter().map(|e| e * e).sum::<f64>() / n;
    n * mean.max(f64::MIN_POSITIVE).ln() + count as f64 * n.ln()
}

/// The smallest order that is no worse than the best by more than one standard error of their difference.
fn smallest_within_error(candidates: &[(OrderCandidate, Vec<f64>)]) -> Option<usize> {
    let total = |blocks: &[f64]| blocks.iter().sum::<f64>();
    let judged = || candidates.iter().filter(|(_, blocks)| !blocks.is_empty());
    let (_, best) = judged().min_by(|(_, x), (_, y)| total(x).total_cmp(&total(y)))?;
    let within = |blocks: &[f64]| {
        let differences: Vec<f64> = blocks.iter().zip(best).map(|(x, y)| x - y).collect();
        let count = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / count;
        let spread = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        mean <= (spread / count).sqrt()
    };
    judged().find(|(_, blocks)| within(blocks)).map(|(candidate, _)| candidate.order)
}

/// Where the ratio of consecutive singular values is largest, 1 to `most`.
pub fn largest_gap(singular_values: &[f64], most: usize) -> usize {
    let floor = 1e-15 * singular_values.first().copied().unwrap_or(0.0);
    let ratio = |n: usize| singular_values[n - 1] / singular_values[n].max(floor).max(f64::MIN_POSITIVE);
    (1..singular_values.len().min(most + 1)).max_by(|&x, &y| ratio(x).total_cmp(&ratio(y))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unwatched;
    use crate::fixture::white_noise;
    use crate::model::{InnovationsModel, Section};

    /// The response of two resonances to an input.
    fn response(u: &[f64]) -> Vec<f64> {
        let section = |a: [f64; 2], b: [f64; 2]| Section { order: 2, a, b, k: [0.0; 2] };
        let truth = InnovationsModel {
            sections: vec![section([-1.7, 0.9], [0.3, 0.1]), section([-0.5, 0.85], [0.4, -0.2])],
            feedthrough: 0.1,
            sample_time_s: 1.0,
        };
        truth.simulate(u, &[0.0; 4]).unwrap()
    }

    #[test]
    fn the_order_of_two_resonances_is_found() {
        let options = PemOptions { block_rows: 15, noise: NoiseModel::White, drift: false, ..PemOptions::default() };
        let found: Vec<usize> = (0..20)
            .map(|seed| {
                let (u, e) = (white_noise(450, 1.0, seed), white_noise(450, 0.05, 1000 + seed));
                let y: Vec<f64> = response(&u).iter().zip(&e).map(|(y, e)| y + e).collect();
                choose_order(Experiment { input: &u, output: &y }, 1.0, 7, &options, &Unwatched).unwrap().order
            })
            .collect();
        // never too low: an order less leaves a resonance out; a one-standard-error rule errs upwards in one of six
        assert!(found.iter().all(|order| *order >= 4), "{found:?}");
        assert!(found.iter().filter(|order| **order == 4).count() >= 12, "{found:?}");
    }

    #[test]
    fn orders_that_cannot_be_the_choice_are_not_fitted() {
        let (u, e) = (white_noise(900, 1.0, 1), white_noise(900, 0.05, 2));
        let clean = response(&u);
        let coloured = |k: usize| e[k] + 0.8 * if k > 0 { e[k - 1] } else { 0.0 };
        let options = PemOptions { block_rows: 15, starts: 8, drift: false, ..PemOptions::default() };
        let judged = |noise, y: Vec<f64>| {
            let options = PemOptions { noise, ..options.clone() };
            let choice = choose_order(Experiment { input: &u, output: &y }, 1.0, 7, &options, &Unwatched).unwrap();
            let fitted = choice.candidates.iter().filter(|c| !c.held_out_percent.is_nan()).map(|c| c.order);
            (choice.order, fitted.collect::<Vec<usize>>())
        };
        let white = clean.iter().zip(&e).map(|(y, e)| y + e).collect();
        assert_eq!(judged(NoiseModel::White, white), (4, vec![4]));
        // errors of a colour prove nothing: all orders that have both resonances are fitted
        let (_, fitted) =
            judged(NoiseModel::Coloured, clean.iter().enumerate().map(|(k, y)| y + coloured(k)).collect());
        assert_eq!(fitted, [4, 5, 6, 7]);
    }

    #[test]
    fn a_release_is_judged_by_information_alone() {
        let u: Vec<f64> = (0..600).map(|k| if k < 100 { 1.0 } else { 0.0 }).collect();
        let section = Section { order: 2, a: [-1.9, 0.97], b: [0.05, 0.02], k: [0.0; 2] };
        let truth = InnovationsModel { sections: vec![section], feedthrough: 0.0, sample_time_s: 1.0 };
        let e = white_noise(600, 0.01, 5);
        let y: Vec<f64> = truth.simulate(&u, &[1.0, -0.97]).unwrap().iter().zip(&e).map(|(y, e)| y + e).collect();
        let options = PemOptions { block_rows: 20, noise: NoiseModel::White, ..PemOptions::default() };
        let choice = choose_order(Experiment { input: &u, output: &y }, 1.0, 6, &options, &Unwatched).unwrap();
        assert_eq!((choice.order, choice.gap), (2, 2));
        assert!(choice.candidates.iter().all(|c| c.held_out_percent.is_nan() && c.bic.is_finite()));
    }
}
