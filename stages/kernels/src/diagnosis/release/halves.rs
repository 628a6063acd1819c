//! What a model gains on events that did not determine it.

use rayon::prelude::*;

use super::joint::{JointFit, Search, fit, fit_within};
use super::problem::Problem;
use super::residuals::{common, residuals};
use super::state::Hold;
use super::subset::Subset;
use crate::diagnosis::verdict::Gain;

/// Trial steps of a half, which begins where the whole ended.
const HALF: usize = 8;

/// Two halves of the events, each fitted alone and judged on the other.
pub(super) struct Halves<'a>([Subset<'a>; 2]);

pub(super) struct HeldOut {
    pub log_likelihood: f64,
    rms: [f64; 2],
    events: usize,
}

impl HeldOut {
    pub fn report(&self) -> Gain {
        Gain {
            rms_before: Some(self.rms[0]),
            rms_after: Some(self.rms[1]),
            unit: "V".into(),
            log_likelihood: Some(self.log_likelihood),
            held_out: format!("{} events, each judged by a fit to the other half", self.events),
        }
    }
}

impl<'a> Halves<'a> {
    pub fn of(whole: &'a Problem<'a>, base: &JointFit) -> Self {
        let count = base.state.events.len();
        Self([0, 1].map(|half| Subset::of(whole, (0..count).filter(|i| i % 2 == half).collect())))
    }

    /// Fits `fitted`'s model to one half, then the other half's own parameters under it.
    fn judged(&self, fitted: &JointFit, half: usize) -> Option<(f64, Vec<f64>)> {
        let [one, other] = [&self.0[half], &self.0[1 - half]];
        let (state, starts) = one.state(&fitted.state, &fitted.starts);
        let trained = fit_within(&one.problem(), state, starts, Hold::Nothing, Search::new(HALF)).ok()?;
        let (mut state, starts) = other.state(&fitted.state, &fitted.starts);
        state.lever = trained.state.lever;
        state.hypotheses = trained.state.hypotheses;
        let problem = other.problem();
        let judged = fit(&problem, state, starts, Hold::Shared).ok()?;
        let residuals = residuals(&problem, &judged.state, &judged.starts);
        Some((judged.costs.iter().sum(), common(&judged.state, &residuals)))
    }

    /// Gain of the log likelihood on held-out events, and the rms of their common residual where the models differ.
    pub fn gain(&self, base: &JointFit, extended: &JointFit) -> HeldOut {
        let count = base.state.events.len();
        let mut out = HeldOut { log_likelihood: 0.0, rms: [0.0; 2], events: count };
        let mut weight = 0.0;
        if self.0[1].is_empty() {
            return HeldOut { log_likelihood: f64::NEG_INFINITY, ..out };
        }
        let judged: Option<Vec<(f64, Vec<f64>)>> = [(base, 0), (extended, 0), (base, 1), (extended, 1)]
            .into_par_iter()
            .map(|(fitted, half)| self.judged(fitted, half))
            .collect();
        let Some(judged) = judged else {
            return HeldOut { log_likelihood: f64::NEG_INFINITY, ..out };
        };
        for (half, pair) in judged.chunks(2).enumerate() {
            let [before, after] = pair else { continue };
            out.log_likelihood += 0.5 * (before.0 - after.0);
            // of a sum weighted to unit variance: back to volts of one event
            let scale = (self.0[1 - half].count() as f64).sqrt();
            let differs: Vec<f64> = before.1.iter().zip(&after.1).map(|(b, a)| (b - a).abs()).collect();
            let limit = 0.1 * differs.iter().copied().fold(0.0, f64::max);
            for ((b, a), d) in before.1.iter().zip(&after.1).zip(&differs) {
                if *d >= limit {
                    out.rms[0] += (b / scale).powi(2);
                    out.rms[1] += (a / scale).powi(2);
                    weight += 1.0;
                }
            }
        }
        out.rms = out.rms.map(|sum| (sum / f64::max(weight, 1.0)).sqrt());
        out
    }
}
