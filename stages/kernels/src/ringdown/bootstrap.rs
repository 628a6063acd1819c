//! Bootstrap over events.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::fitted::Fitted;
use super::modal_form::shared;
use super::normal::Freedom;
use super::options::RingdownOptions;
use super::search::{Point, search};

/// Standard errors that count as arrived, of a scatter of one standard error.
const BOOTSTRAP_ARRIVED: f64 = 1e-2;

/// Shared parameters of fits to events drawn with replacement, noise model and weights held.
///
/// Method: compressed events are drawn, not records, so that a draw costs a few steps of the search. Source: B. Efron,
/// Ann. Stat. 7 (1979) 1.
pub(super) fn bootstrap(fitted: &Fitted, point: &Point, freedom: &Freedom, options: &RingdownOptions) -> Vec<Vec<f64>> {
    let count = point.events.len();
    let draw = |number: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(options.bootstrap_seed);
        rng.set_stream(number as u64);
        let chosen: Vec<usize> = (0..count).map(|_| rng.random_range(0..count)).collect();
        let data = fitted.data.chosen(&chosen);
        let mut drawn = Point {
            exponentials: point.exponentials.clone(),
            events: chosen.iter().map(|&i| point.events[i]).collect(),
        };
        search(&data, &fitted.reference, &mut drawn, freedom, BOOTSTRAP_ARRIVED);
        shared(&drawn.exponentials)
    };
    (0..options.bootstrap_draws).into_par_iter().map(draw).collect()
}
