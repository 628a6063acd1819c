//! What a motion and an input could still explain, whatever the cause.

use std::sync::Arc;

use rayon::prelude::*;

use super::data::Bench;
use super::fit::{Blocks, Cholesky, Fit, Moments, dot, paired};
use super::limited_rates::limited;
use super::score_test::{first_channel, peaks};
use crate::effects::{Effects, Intersample, ModalForce, Passage, PowerLaw, Quantity, StaticMap};

/// Share of a residual that something systematic makes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Root mean square of the part that can be predicted on folds that were held out, over that of the rest.
    pub ratio: f64,
    /// The prediction's gain, block by block, over its standard error.
    pub significance: f64,
}

/// Block-wise standard errors beyond which a misfit is one: one chance in six hundred.
const SIGNIFICANT: f64 = 3.0;

impl Misfit {
    /// From losses on what was held out, block by block, without and with what predicts.
    pub(super) fn between(without: &[f64], with: &[f64]) -> Self {
        let differences: Vec<f64> = without.iter().zip(with).map(|(a, b)| a - b).collect();
        let (gain, floor) = (differences.iter().sum::<f64>(), with.iter().sum::<f64>());
        let ratio = if gain > 0.0 && floor > 0.0 { (gain / floor).sqrt() } else { 0.0 };
        Self { ratio, significance: paired(&differences) }
    }

    /// Whether it is more than chance.
    pub fn is_significant(&self) -> bool {
        self.significance > SIGNIFICANT
    }

    /// Whether it is more than chance and more than is tolerated.
    pub fn is_systematic(&self, tolerated: f64) -> bool {
        self.ratio > tolerated && self.is_significant()
    }

    /// Share of the squared residual.
    pub fn share(&self) -> f64 {
        let square = self.ratio * self.ratio;
        square / (1.0 + square)
    }
}

/// Highest degree of the polynomials in deflection and rate.
const DEGREE: usize = 5;
/// A force or signal of this size: small enough to be linear.
const SMALL: f64 = 1e-6;
/// Of the Gram matrix scaled to a unit diagonal: the directions overlap, the small ones are noise.
pub(super) const RIDGE: f64 = 1e-6;

/// How much of a fit's residual a library of general terms predicts.
///
/// # Method
/// Regression, by folds of blocks, on what any smooth force or sensor would do to first order: all monomials up to
/// degree five of deflection and rate, their absolute values and signs, once as forces through the oscillator and once
/// directly; limited rates of what is seen; powers of the input; another course of the input between samples; slow
/// polynomials in time and the residual's largest lines. Noise that does not depend on the motion cannot be predicted, so
/// that no noise model is needed.
/// # Source
/// T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2nd ed., 2009, section 7.10.
pub(super) fn misfit(bench: &Bench, fit: &Fit, blocks: &Blocks) -> Misfit {
    let moments = Moments::new(&general(bench, fit), &clean(bench, fit), blocks);
    let own = fit.moments(bench, blocks).held_out(0.0);
    let after = moments.held_out(RIDGE);
    Misfit::between(&own, &after)
}

/// What a fit's parameters and the library together leave of its residual: the nearest to pure noise that can be had
/// without a noise model.
pub(super) struct Floor {
    /// Sample by sample.
    pub residual: Vec<f64>,
    /// Its variance, the directions that were taken out counted.
    pub mean_square: f64,
}

impl Floor {
    pub fn new(bench: &Bench, fit: &Fit, blocks: &Blocks) -> Self {
        let columns = general(bench, fit);
        let mut residual = clean(bench, fit);
        let moments = Moments::new(&columns, &residual, blocks);
        let weights = Cholesky::new(&moments.total_curvature(|_| true), RIDGE).solve(&moments.total_score(|_| true));
        for (column, weight) in columns.iter().zip(&weights) {
            residual.iter_mut().zip(column).for_each(|(r, c)| *r -= weight * c);
        }
        let free = bench.count.saturating_sub(columns.len()).max(1);
        let mean_square = dot(&residual, &residual) / free as f64;
        Self { residual, mean_square }
    }
}

/// What a fit leaves, beyond what the stretches' own numbers can make.
fn clean(bench: &Bench, fit: &Fit) -> Vec<f64> {
    let mut left = fit.residual.clone();
    fit.own.take_out(&mut left, &bench.layout);
    left
}

/// A fit's own sensitivities and the library's columns.
fn general(bench: &Bench, fit: &Fit) -> Vec<Vec<f64>> {
    let mut columns = fit.sensitivities.clone();
    let mut others = library(bench, fit);
    others.par_iter_mut().for_each(|column| {
        fit.own.take_out(column, &bench.layout);
    });
    columns.extend(others);
    columns
}

/// A product of quantities of one motion, or another function of (deflection, rate / omega).
#[derive(Clone)]
enum Term {
    Product(Vec<Quantity>),
    Sign,
}

impl Term {
    /// Its value at a motion.
    fn at(&self, [q, p]: [f64; 2]) -> f64 {
        match self {
            Self::Sign => (p / 0.02).tanh(),
            Self::Product(factors) => factors.iter().map(|quantity| quantity.of([q, p])).product(),
        }
    }

    /// The force that it is on a mode.
    fn force(&self, mode: usize) -> ModalForce {
        match self {
            Self::Product(factors) => {
                let factors: Vec<(Quantity, usize)> = factors.iter().map(|of| (*of, mode)).collect();
                ModalForce::Power(PowerLaw::new(mode, -SMALL, &factors))
            }
            Self::Sign => ModalForce::law(move |motion, acceleration| {
                if let (Some(a), Some(v), Some(w)) =
                    (acceleration.get_mut(mode), motion.velocity.get(mode), motion.omega.get(mode))
                {
                    *a += SMALL * w * w * (v / w / 0.02).tanh();
                }
            }),
        }
    }
}

/// Functions of deflection and rate / omega, each near 1 at the largest motion; fewer where many modes have them.
fn terms(modes: usize) -> Vec<Term> {
    use Quantity::{Amplitude, Deflection, Distance, Rate, Speed};
    let mut terms: Vec<Term> =
        [vec![Distance], vec![Speed], vec![], vec![Amplitude, Rate], vec![Amplitude, Deflection]]
            .map(Term::Product)
            .to_vec();
    terms.push(Term::Sign);
    for degree in 2..=if modes > 1 { DEGREE - 2 } else { DEGREE } {
        for rates in 0..=degree {
            terms.push(Term::Product([vec![Deflection; degree - rates], vec![Rate; rates]].concat()));
        }
    }
    terms
}

fn library(bench: &Bench, fit: &Fit) -> Vec<Vec<f64>> {
    let model = &fit.model;
    let effects = model.effects();
    let modes = model.dynamics.modes();
    let fill = |mut column: Vec<f64>| {
        column.iter_mut().zip(&bench.output).filter(|(_, y)| !y.is_finite()).for_each(|(value, _)| *value = 0.0);
        column
    };
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut changed: Vec<Effects> = Vec::new();
    let motion = bench.motion(model);
    for mode in 0..modes {
        let direct = terms(modes).into_iter().map(|term| fill(seen(bench, &motion, mode, &term)));
        columns.extend(direct);
        changed.extend(terms(modes).iter().map(|term| with_forces(&effects, [term.force(mode)])));
        for other in (0..modes).filter(|other| *other != mode) {
            let forces = couplings(mode, other).into_iter().map(|laws| laws.into_iter().map(ModalForce::Power));
            changed.extend(forces.map(|forces| with_forces(&effects, forces)));
        }
    }
    if bench.driven {
        changed.extend((2..=5).map(|power| with_input(&effects, Arc::new(move |u: f64| u.powi(power)))));
        changed.push(with_input(&effects, Arc::new(f64::abs)));
        changed.push(with_input(&effects, Arc::new(|u: f64| (u / 0.05).tanh())));
        for kind in [Intersample::Held, Intersample::Linear, Intersample::BandLimited] {
            changed.push(Effects { intersample: Some(kind), ..effects.clone() });
        }
    }
    changed.extend(limited(bench, fit, &effects, SMALL));
    let moved = bench.simulate_each(&changed.iter().map(|effects| (model, effects)).collect::<Vec<_>>());
    let change = |moved: &Vec<f64>| fill(moved.iter().zip(&fit.simulated).map(|(a, b)| (a - b) / SMALL).collect());
    let through: Vec<Vec<f64>> = moved.par_iter().map(change).collect();
    columns.extend(through.into_iter().filter(|column| column.iter().all(|value| value.is_finite())));
    columns.extend(slow(bench, fit).into_iter().map(fill));
    columns
}

/// A term of one mode's motion, in the first channel.
fn seen(bench: &Bench, motion: &[Vec<Vec<[f64; 2]>>], mode: usize, term: &Term) -> Vec<f64> {
    let mut column = vec![0.0; bench.output.len()];
    for (e, states) in motion.iter().enumerate() {
        let Some(states) = states.get(mode) else { continue };
        let place = bench.layout.part(e, 0, 0, bench.layout.samples(e));
        column[place].iter_mut().zip(states).for_each(|(to, state)| *to = term.at(*state));
    }
    column
}

fn with_forces(effects: &Effects, forces: impl IntoIterator<Item = ModalForce>) -> Effects {
    let mut effects = effects.clone();
    effects.modal_force.extend(forces);
    effects
}

/// Forces on a mode by products of its and another's deflection and rate / omega, each a sum of powers.
fn couplings(mode: usize, other: usize) -> Vec<Vec<PowerLaw>> {
    use Quantity::{Deflection as Q, Rate as P};
    let one = |factors: &[(Quantity, usize)]| PowerLaw::new(mode, -SMALL, factors);
    let mut forces: Vec<Vec<PowerLaw>> = Vec::new();
    for own in [Q, P] {
        forces.extend([Q, P].map(|of| vec![one(&[(own, mode), (of, other)])]));
    }
    forces.extend([[Q, Q], [Q, P], [P, P]].map(|of| vec![one(&of.map(|of| (of, other)))]));
    // its own times the square of the other's amplitude
    forces.extend([Q, P].map(|own| [Q, P].map(|of| one(&[(own, mode), (of, other), (of, other)])).to_vec()));
    forces
}

fn with_input(effects: &Effects, map: StaticMap) -> Effects {
    let mut effects = effects.clone();
    effects.input.push(Passage::map(move |u| u + SMALL * map(u)));
    effects
}

/// Polynomials in time of each stretch's first channel, and cosine and sine of the residual's largest line.
fn slow(bench: &Bench, fit: &Fit) -> Vec<Vec<f64>> {
    let layout = &bench.layout;
    let over = |value: &dyn Fn(usize, f64) -> f64| {
        let mut column = vec![0.0; bench.output.len()];
        for e in 0..layout.stretches() {
            let n = layout.samples(e);
            let time = |k: usize| 2.0 * (k as f64 + 0.5) / n as f64 - 1.0;
            let place = layout.part(e, 0, 0, n);
            column[place].iter_mut().enumerate().for_each(|(k, to)| *to = value(k, time(k)));
        }
        column
    };
    let mut columns: Vec<Vec<f64>> = (1..=4).map(|power| over(&|_, time: f64| time.powi(power))).collect();
    for frequency_hz in peaks(first_channel(bench, &fit.residual), bench.interval_s).into_iter().take(1) {
        let angle = 2.0 * std::f64::consts::PI * frequency_hz * bench.interval_s;
        columns.push(over(&|k, _| (angle * k as f64).cos()));
        columns.push(over(&|k, _| (angle * k as f64).sin()));
    }
    columns
}
