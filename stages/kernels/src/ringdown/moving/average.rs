//! Values averaged over models that are nearly as good.

use std::f64::consts::TAU;

use crate::ringdown::Estimate;
use crate::ringdown::moving::alternatives::Search;
use crate::ringdown::moving::dense::Square;
use crate::ringdown::moving::model::Mode;
use crate::ringdown::moving::result::LocalPole;
use crate::ringdown::moving::search::Fit;
use crate::ringdown::moving::select::neighbours;

/// Difference of BIC to the best within which other models widen the errors.
const WITHIN_BIC: f64 = 12.0;

/// A model among others.
pub(crate) struct Weighed {
    weight: f64,
    fit: Fit,
    covariance: Square,
}

impl Search<'_> {
    /// The model and its neighbours, with weights `exp(-BIC / 2)`.
    pub(crate) fn models(&self, found: Fit) -> Vec<Weighed> {
        let own = self.bic(&found);
        let price = (self.problem.data.records.iter().map(|r| r.rows).sum::<usize>().max(2) as f64).ln();
        let near = neighbours(&self.problem, &found, WITHIN_BIC + price);
        let mut models: Vec<(f64, Fit)> = vec![(own, found)];
        for fit in near {
            let bic = self.bic(&fit);
            let same = |other: &(f64, Fit)| {
                let laws = |m: &Mode| (m.damping.terms.clone(), m.frequency.terms.clone());
                other.1.modes.iter().zip(&fit.modes).all(|(a, b)| laws(a) == laws(b))
            };
            if bic < own + WITHIN_BIC && !models.iter().any(same) {
                models.push((bic, fit));
            }
        }
        let least = models.iter().map(|m| m.0).fold(f64::INFINITY, f64::min);
        let weighed = |(bic, fit): (f64, Fit)| {
            Some(Weighed { weight: (-0.5 * (bic - least)).exp(), covariance: fit.covariance()?, fit })
        };
        models.into_iter().filter_map(weighed).collect()
    }
}

/// Frequency and damping ratio of a mode at a relative amplitude, averaged over the models: variances and the scatter
/// of the values. Source: K. P. Burnham, D. R. Anderson, Model Selection and Multimodel Inference (2002), 4.3.
pub(crate) fn averaged(models: &[Weighed], number: usize, carrier: f64, factor: f64, a: f64) -> (Estimate, Estimate) {
    let of = |model: &Weighed| {
        let mode = &model.fit.modes[number];
        let base = model.fit.base(number) + mode.laws_at();
        let size = mode.damping.terms.len() + mode.frequency.terms.len();
        let mut block = Square::zeros(size);
        for i in 0..size {
            (0..size).for_each(|j| *block.at_mut(i, j) = factor * model.covariance.at(base + i, base + j));
        }
        let local = LocalPole::at(mode, a);
        (model.weight, local.frequency_hz(&block), local.damping_ratio(&block))
    };
    // models that differ in another mode alone are not counted: they are the same here
    let laws = |model: &Weighed| {
        let mode = &model.fit.modes[number];
        (mode.damping.terms.clone(), mode.frequency.terms.clone())
    };
    let chosen = models.first().map(laws);
    let counts = |(n, model): &(usize, &Weighed)| *n == 0 || Some(laws(model)) != chosen;
    let finite = |e: &Estimate| e.value.is_finite() && e.std.is_finite();
    let all = models.iter().enumerate().filter(counts).map(|(_, m)| of(m));
    let all: Vec<(f64, Estimate, Estimate)> = all.filter(|m| finite(&m.1) && finite(&m.2)).collect();
    let total: f64 = all.iter().map(|m| m.0).sum();
    let mean = |pick: &dyn Fn(&(f64, Estimate, Estimate)) -> Estimate| {
        let value = all.iter().map(|m| m.0 * pick(m).value).sum::<f64>() / total;
        let square = |m: &(f64, Estimate, Estimate)| m.0 * (pick(m).std.powi(2) + (pick(m).value - value).powi(2));
        Estimate { value, std: (all.iter().map(square).sum::<f64>() / total).sqrt() }
    };
    if all.is_empty() {
        // the information is singular: nothing is known
        let unknown = Estimate { value: carrier / TAU, std: carrier / TAU };
        return (unknown, Estimate { value: 0.5, std: 1.0 });
    }
    (mean(&|m| m.1), mean(&|m| m.2))
}
