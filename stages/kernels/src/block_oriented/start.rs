//! The best linear approximation: poles and zeros to divide.

use faer::c64;

use super::model::{BlockModel, deviation};
use super::options::BlockOptions;
use super::rational::Rational;
use super::screening::{Candidate, Stretch};
use crate::model::ModelError;
use crate::model::transmission_zeros;
use crate::pem::{Experiment, NoiseModel, PemOptions, identify};

/// Zeros beyond this radius are delays.
const FAR: f64 = 20.0;
/// A pole and a zero that change the output by less than this share of what the linear model leaves cancel: without
/// them that grows by a thousandth.
const CANCELS: f64 = 0.05;

/// Pairs of a block-oriented model that change its linear parts' response by less than this share are not divided
/// again.
const WEAK: f64 = 0.01;

/// Poles or zeros that stay together: a real one, or a conjugate pair.
pub(super) type Group = Vec<c64>;

/// A linear model to divide.
pub(super) struct Linear {
    pub poles: Vec<Group>,
    pub zeros: Vec<Group>,
    /// What it leaves of each sample of the output.
    pub residual: Vec<f64>,
}

impl Linear {
    /// The same without poles and zeros that cancel; none where none do. A slow pair that only follows the distortion
    /// takes the place of a pole; one that is weak in the linear model may be a part's own: both are to be tried.
    pub fn without_cancelling(&self, u: &[f64], y: &[f64]) -> Option<Self> {
        let limit = CANCELS * deviation(&self.residual) / deviation(y);
        let (poles, zeros) = without_cancelling(u, &self.poles.concat(), &self.zeros.concat(), limit);
        let fewer = poles.len() < self.poles.len();
        fewer.then(|| Self { poles, zeros, residual: self.residual.clone() })
    }
}

/// Fits the linear model of least output error. Errors: no finite fit.
pub(super) fn linear(u: &[f64], y: &[f64], options: &BlockOptions) -> Result<Linear, ModelError> {
    let n = options.order;
    let block_rows = (y.len() / 50).clamp(n + 2, PemOptions::default().block_rows.max(2 * n));
    let settings = PemOptions { order: n, block_rows, noise: NoiseModel::White, drift: false, ..PemOptions::default() };
    let fit = identify(&[Experiment { input: u, output: y }], 1.0, &settings)?;
    let residual: Vec<f64> = fit.residuals.into_iter().flatten().collect();
    let poles: Vec<c64> = fit.model.sections.iter().flat_map(|section| section.poles()).collect();
    let mut zeros = transmission_zeros(&fit.model)?;
    zeros.retain(|zero| zero.norm() < FAR);
    zeros.truncate(n);
    Ok(Linear { poles: grouped(&poles), zeros: grouped(&zeros), residual })
}

/// The linear model of a block-oriented one's poles and zeros, which the curve's distortion no longer blurs; the
/// residual stays.
pub(super) fn linear_of(model: &BlockModel, u: &[f64], known: &Linear) -> Linear {
    let parts = [&model.first, &model.second];
    let poles: Vec<c64> = parts.iter().flat_map(|part| part.poles()).collect();
    let mut zeros: Vec<c64> = parts.iter().flat_map(|part| part.zeros()).collect();
    zeros.retain(|zero| zero.norm() < FAR);
    let (poles, zeros) = without_cancelling(u, &poles, &zeros, WEAK);
    Linear { poles, zeros, residual: known.residual.clone() }
}

/// The candidate without the pole and zero of one part that cancel best, if they change the response of this part by
/// less than a tenth.
pub(super) fn without_weakest(candidate: &Candidate, stretch: Stretch<'_>) -> Option<Candidate> {
    let weaker = |part: &Rational, input: &[f64]| {
        let (mut poles, mut zeros) = (grouped(&part.poles()), grouped(&part.zeros()));
        let (pole, zero) = cancelling(input, &poles, &zeros, 0.1)?;
        let change = change(input, &poles, &zeros, (pole, zero))?;
        poles.remove(pole);
        zeros.remove(zero);
        Some((change, Rational::from_roots(&poles.concat(), &zeros.concat())?))
    };
    let model = &candidate.model;
    let (first, second) = (weaker(&model.first, stretch.u), weaker(&model.second, &model.intermediate(stretch.u).1));
    let change = |found: &Option<(f64, Rational)>| found.as_ref().map_or(f64::INFINITY, |(change, _)| *change);
    let of_first = change(&first) < change(&second);
    let next = match (of_first, first, second) {
        (true, Some((_, part)), _) => BlockModel { first: part, ..model.clone() },
        (false, _, Some((_, part))) => BlockModel { second: part, ..model.clone() },
        _ => return None,
    };
    Candidate { model: next, ..candidate.clone() }.with_knots(model.curve.values().len(), stretch)
}

/// Groups of poles and zeros, less those whose removal changes the response by less than the share `limit`.
fn without_cancelling(u: &[f64], poles: &[c64], zeros: &[c64], limit: f64) -> (Vec<Group>, Vec<Group>) {
    let (mut poles, mut zeros) = (grouped(poles), grouped(zeros));
    while let Some((pole, zero)) = cancelling(u, &poles, &zeros, limit) {
        poles.remove(pole);
        zeros.remove(zero);
    }
    (poles, zeros)
}

fn grouped(roots: &[c64]) -> Vec<Group> {
    let own = |z: &c64| match z.im {
        0.0 => Some(vec![*z]),
        im if im > 0.0 => Some(vec![*z, z.conj()]),
        _ => None,
    };
    roots.iter().filter_map(own).collect()
}

/// The pole and the zero whose removal changes the response to `u` least, if by less than the share `limit`.
fn cancelling(u: &[f64], poles: &[Group], zeros: &[Group], limit: f64) -> Option<(usize, usize)> {
    let total: usize = poles.iter().map(Vec::len).sum();
    let mut found: Option<(f64, usize, usize)> = None;
    for (i, pole) in poles.iter().enumerate().filter(|(_, pole)| pole.len() < total) {
        let nearest = |zero: &Group| zero.iter().map(|z| (z - pole[0]).norm()).fold(f64::INFINITY, f64::min);
        let alike = zeros.iter().enumerate().filter(|(_, zero)| zero.len() == pole.len());
        let Some((k, _)) = alike.min_by(|a, b| nearest(a.1).total_cmp(&nearest(b.1))) else { continue };
        if let Some(change) = change(u, poles, zeros, (i, k))
            && change < limit
            && found.is_none_or(|(least, ..)| change < least)
        {
            found = Some((change, i, k));
        }
    }
    found.map(|(_, pole, zero)| (pole, zero))
}

/// Share of the response that is left of it when the response without the pole and the zero, times a gain, is taken
/// off.
fn change(u: &[f64], poles: &[Group], zeros: &[Group], without: (usize, usize)) -> Option<f64> {
    let flat = |groups: &[Group], left_out: Option<usize>| -> Vec<c64> {
        groups.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).flat_map(|(_, g)| g.clone()).collect()
    };
    let whole = Rational::from_roots(&flat(poles, None), &flat(zeros, None))?.filter(u);
    let part = Rational::from_roots(&flat(poles, Some(without.0)), &flat(zeros, Some(without.1)))?.filter(u);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (a, b) = (mean(&whole), mean(&part));
    let product =
        |x: &[f64], x0: f64, z: &[f64], z0: f64| -> f64 { x.iter().zip(z).map(|(x, z)| (x - x0) * (z - z0)).sum() };
    let (ww, wp, pp) = (product(&whole, a, &whole, a), product(&whole, a, &part, b), product(&part, b, &part, b));
    let share = (1.0 - wp * wp / (ww * pp)).max(0.0).sqrt();
    share.is_finite().then_some(share)
}
