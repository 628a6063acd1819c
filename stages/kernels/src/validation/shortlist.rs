//! Which orders are worth a fit, by the errors of their starts.

use super::residual::{TestResult, input_dependence, whiteness};
use crate::model::ModelError;

/// An order whose start has so many times the least squared error is left out. The start of a subspace estimate is
/// within some per cent of the minimum of its order, unless a mode is missing, which no iteration adds.
const HOPELESS: f64 = 10.0;
/// Squared error of a start, over the output's energy, that tells nothing: a start is not more precise than this, and
/// records without noise would be ranked by rounding.
const ROUNDING: f64 = 1e-12;
/// Delays, beyond the order, over which the errors of an order that suffices depend neither on the inputs nor on
/// themselves.
const DELAYS: usize = 25;
/// Probability below which such a dependence is not by chance: in one of fifty records larger orders are fitted without
/// need.
const BY_CHANCE: f64 = 0.01;

/// What is known of the orders before any is fitted.
pub(super) struct Shortlist {
    /// Squared error of each order's start, from 1 on; NaN where there is none.
    costs: Vec<f64>,
    samples: usize,
    inputs: usize,
}

impl Shortlist {
    /// From the squared errors of the starts, if there are any; inputs one after the other.
    pub fn new(costs: Vec<Option<f64>>, input: &[f64], output: &[f64]) -> Self {
        let least = ROUNDING * output.iter().map(|y| y * y).sum::<f64>();
        let costs = costs.into_iter().map(|cost| cost.map_or(f64::NAN, |cost| cost.max(least))).collect();
        Self { costs, samples: output.len(), inputs: input.len() / output.len().max(1) }
    }

    /// The order whose start has the least Bayesian information criterion; the largest where there are no starts.
    pub fn least_information(&self) -> usize {
        let n = self.samples as f64;
        let bic = |&(order, cost): &(usize, f64)| {
            n * cost.max(f64::MIN_POSITIVE).ln() + (order * (1 + self.inputs)) as f64 * n.ln()
        };
        let known = self.costs.iter().enumerate().map(|(k, cost)| (k + 1, *cost)).filter(|(_, cost)| !cost.is_nan());
        known.min_by(|x, y| bic(x).total_cmp(&bic(y))).map_or(self.costs.len(), |(order, _)| order)
    }

    /// The orders up to `largest` whose fits may be near the best; those without a start among them.
    pub fn up_to(&self, largest: usize) -> Vec<usize> {
        let least = self.costs.iter().copied().fold(f64::INFINITY, f64::min);
        let orders = self.costs.iter().enumerate().map(|(k, cost)| (k + 1, *cost)).take(largest);
        orders.filter(|(_, cost)| cost.is_nan() || *cost <= HOPELESS * least).map(|(order, _)| order).collect()
    }
}

/// Whether a simulation's errors are white and independent of the inputs: no larger order can explain more.
pub(super) fn nothing_left(inputs: &[f64], errors: &[f64], order: usize) -> bool {
    let by_chance = |test: Result<TestResult, ModelError>| test.is_ok_and(|test| test.p_value >= BY_CHANCE);
    let mut inputs = inputs.chunks_exact(errors.len().max(1));
    by_chance(whiteness(errors, DELAYS, 0)) && inputs.all(|u| by_chance(input_dependence(u, errors, DELAYS + order)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    fn shortlist(costs: &[f64]) -> Shortlist {
        Shortlist::new(costs.iter().copied().map(Some).collect(), &[0.0; 1000], &[1.0; 1000])
    }

    #[test]
    fn orders_without_a_mode_and_orders_without_a_gain_are_left_out() {
        // a pair more is worth 4 ln 1000 = 28 of 1000 ln(cost): 2.8 % of the cost
        let own = shortlist(&[300.0, 80.0, 79.0, 4.0, 3.95, 3.92]);
        assert_eq!(own.least_information(), 4);
        assert_eq!((own.up_to(4), own.up_to(6)), (vec![4], vec![4, 5, 6]));
        assert_eq!(shortlist(&[300.0, 80.0, 79.0, 4.0, 3.95, 3.8]).least_information(), 6);
    }

    #[test]
    fn orders_without_a_start_are_fitted_and_rounding_ranks_none() {
        let costs = vec![None, Some(9.0), None, Some(1.0)];
        assert_eq!(Shortlist::new(costs, &[0.0; 1000], &[1.0; 1000]).up_to(4), [1, 2, 3, 4]);
        let none = Shortlist::new(vec![None; 3], &[0.0; 1000], &[1.0; 1000]);
        assert_eq!((none.least_information(), none.up_to(3)), (3, vec![1, 2, 3]));
        let exact = shortlist(&[300.0, 1e-18, 1e-21, 1e-24]);
        assert_eq!((exact.least_information(), exact.up_to(4)), (2, vec![2, 3, 4]));
    }

    /// Of 50 records, those whose errors leave nothing: made of an input and of white noise.
    fn sufficient(errors: impl Fn(&[f64], &[f64]) -> Vec<f64>) -> usize {
        let suffices = |seed: u64| {
            let (u, e) = (white_noise(2000, 1.0, seed), white_noise(2000, 1.0, 1000 + seed));
            nothing_left(&u, &errors(&u, &e), 4)
        };
        (0..50).filter(|seed| suffices(*seed)).count()
    }

    #[test]
    fn errors_of_a_missing_mode_and_of_a_colour_are_not_by_chance() {
        // one in fifty is refused by chance: five or more of fifty in one run of 300
        assert!(sufficient(|_, e| e.to_vec()) > 45);
        // 0.2 of the input is nine standard errors of such a correlation, 0.3 of the sample before twelve
        let missing = sufficient(|u, e| e.iter().zip(u).map(|(e, u)| e + 0.2 * u).collect());
        let coloured = sufficient(|_, e| (1..2000).map(|k| e[k] + 0.3 * e[k - 1]).chain([0.0]).collect());
        assert_eq!((missing, coloured), (0, 0));
    }
}
