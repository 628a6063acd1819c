//! A linear part: a chain of sections of order two with a tap behind every state.

use faer::{Mat, c64};
use serde::{Deserialize, Serialize};

use crate::linear_algebra::{eigenvalues, least_squares};
use crate::model::{Coefficients, roots, section_order, sections_of_roots};

/// A stable rational transfer function in `q^-1`.
///
/// # Model
/// `G = d + sum_i (b_i1 q^-1 + b_i2 q^-2) / (A_1 ... A_i)` with sections `A_i = 1 + a_i1 q^-1 + a_i2 q^-2`: every
/// proper transfer function of these poles, repeated ones included, in coefficients of like size. One coefficient of
/// the numerator is held: the gain belongs to the curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rational {
    order: usize,
    /// `[a1, a2]` each; `a2 = 0` in the last one of an odd order.
    sections: Vec<Coefficients>,
    /// d, then the taps in order: `order + 1`.
    taps: Vec<f64>,
    /// Which of the taps is no parameter.
    held: usize,
}

impl Rational {
    /// What leaves a signal as it is.
    pub fn unit() -> Self {
        Self { order: 0, sections: Vec::new(), taps: vec![1.0], held: 0 }
    }

    /// `q^-(n-k) prod (1 - z q^-1) / prod (1 - p q^-1)` of n poles and k zeros, k at most n; poles outside the unit
    /// circle are reflected. None where there are more zeros than poles, or no finite coefficients.
    pub fn from_roots(poles: &[c64], zeros: &[c64]) -> Option<Self> {
        let order = poles.len();
        let delay = order.checked_sub(zeros.len())?;
        let inside: Vec<c64> = poles.iter().map(|z| if z.norm() > 1.0 { z / z.norm_sqr() } else { *z }).collect();
        let sections = sections_of_roots(&inside);
        let mut wanted = vec![0.0; delay];
        wanted.extend(polynomial(&sections_of_roots(zeros), zeros.len()));
        let mut found = Self { order, sections, taps: vec![0.0; order + 1], held: 0 };
        let basis = Mat::from_fn(order + 1, order + 1, |power, tap| found.tap_polynomial(tap)[power]);
        let taps = least_squares(&basis, &Mat::from_fn(order + 1, 1, |i, _| wanted[i]), 1e-15).ok()?;
        found.taps = (0..=order).map(|i| taps[(i, 0)]).collect();
        found.taps.iter().all(|tap| tap.is_finite()).then_some(found)
    }

    /// Whether it has the coefficients of its order.
    pub(super) fn is_whole(&self) -> bool {
        self.sections.len() == self.order.div_ceil(2) && self.taps.len() == self.order + 1
    }

    /// Number of poles.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Poles in the z plane, a section after the other.
    pub fn poles(&self) -> Vec<c64> {
        let own = |(i, a): (usize, &Coefficients)| roots(*a, section_order(self.order, i));
        self.sections.iter().enumerate().flat_map(own).collect()
    }

    /// Derivatives of [`Rational::poles`] to the parameters of their section: `[dz/da1, dz/da2]` and the first one's
    /// place in [`Rational::parameters`].
    pub(super) fn pole_slopes(&self) -> Vec<(usize, Vec<c64>)> {
        let one = c64::new(1.0, 0.0);
        let own = |(i, a): (usize, &Coefficients)| {
            let order = section_order(self.order, i);
            roots(*a, order)
                .into_iter()
                .map(|z| match order {
                    1 => (2 * i, vec![-one]),
                    _ => (2 * i, vec![-z / (z * 2.0 + a[0]), -one / (z * 2.0 + a[0])]),
                })
                .collect::<Vec<_>>()
        };
        self.sections.iter().enumerate().flat_map(own).collect()
    }

    /// Coefficients of the numerator in `q^-1`, `order + 1`.
    pub fn numerator(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.order + 1];
        for (tap, value) in self.taps.iter().enumerate() {
            sum.iter_mut().zip(self.tap_polynomial(tap)).for_each(|(sum, own)| *sum += value * own);
        }
        sum
    }

    /// Coefficients of the denominator in `q^-1`, `order + 1`, the first one 1.
    pub fn denominator(&self) -> Vec<f64> {
        polynomial(&self.sections, self.order)
    }

    /// Finite zeros in the z plane; none where the eigenvalues do not converge.
    pub fn zeros(&self) -> Vec<c64> {
        let b = self.numerator();
        let largest = b.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
        let kept: Vec<f64> = b.into_iter().skip_while(|b| b.abs() <= 1e-9 * largest).collect();
        let n = kept.len().saturating_sub(1);
        let companion = Mat::from_fn(n, n, |i, j| match i {
            0 => -kept[j + 1] / kept[0],
            _ => f64::from(u8::from(i == j + 1)),
        });
        if n == 0 { Vec::new() } else { eigenvalues(&companion).unwrap_or_default() }
    }

    /// `G(z)`.
    pub fn transfer(&self, z: c64) -> c64 {
        let inverse = z.inv();
        let at = |b: Vec<f64>| b.iter().rev().fold(c64::new(0.0, 0.0), |sum, b| sum * inverse + *b);
        at(self.numerator()) / at(self.denominator())
    }

    /// Response to `u`, from rest.
    pub fn filter(&self, u: &[f64]) -> Vec<f64> {
        let mut states = vec![[0.0; 2]; self.sections.len()];
        let direct = self.taps[0];
        let taps: Vec<[f64; 2]> = self.taps[1..].chunks(2).map(pair).collect();
        let step = |u: &f64| {
            let (mut input, mut output) = (*u, direct * u);
            for ((state, a), b) in states.iter_mut().zip(&self.sections).zip(&taps) {
                output += b[0] * state[0] + b[1] * state[1];
                input = (input - a[1] * state[1]) - a[0] * state[0];
                *state = [input, state[0]];
            }
            output
        };
        u.iter().map(step).collect()
    }

    /// Denominator coefficients of all sections, then the taps but the held one: `2 order`.
    pub fn parameters(&self) -> Vec<f64> {
        let a = self.sections.iter().flat_map(|a| a.iter().copied()).take(self.order);
        let free = self.taps.iter().enumerate().filter(|(i, _)| *i != self.held).map(|(_, tap)| *tap);
        a.chain(free).collect()
    }

    /// The same part with other parameters; those that are missing stay.
    pub fn at(&self, parameters: &[f64]) -> Self {
        let mut moved = self.clone();
        let mut values = parameters.iter();
        let a = moved.sections.iter_mut().flatten().take(self.order);
        let free = moved.taps.iter_mut().enumerate().filter(|(i, _)| *i != self.held).map(|(_, tap)| tap);
        a.chain(free).zip(&mut values).for_each(|(own, value)| *own = *value);
        moved
    }

    /// Whether all poles lie inside the unit circle.
    pub fn is_stable(&self) -> bool {
        self.sections.iter().all(|a| a[1].abs() < 1.0 && a[0].abs() < 1.0 + a[1])
    }

    /// Response to `u` and its derivatives to the parameters, in their order.
    pub(super) fn sensitivities(&self, u: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let n = u.len();
        let mut states = Vec::with_capacity(self.sections.len());
        let mut signal = u.to_vec();
        for a in &self.sections {
            all_pole(*a, &mut signal);
            states.push(signal.clone());
        }
        // what the sections from i on add to the output, then its derivative to a_i
        let mut behind = vec![0.0; n];
        let mut to_a = Vec::with_capacity(self.order);
        let taps: Vec<[f64; 2]> = self.taps[1..].chunks(2).map(pair).collect();
        for (i, state) in states.iter().enumerate().rev() {
            let [b1, b2] = taps[i];
            behind.iter_mut().skip(1).zip(state).for_each(|(sum, v)| *sum += b1 * v);
            behind.iter_mut().skip(2).zip(state).for_each(|(sum, v)| *sum += b2 * v);
            let mut slope: Vec<f64> = behind.iter().map(|v| -v).collect();
            all_pole(self.sections[i], &mut slope);
            (1..=section_order(self.order, i)).rev().for_each(|lag| to_a.push(delayed(&slope, lag)));
        }
        to_a.reverse();
        let mut to_taps = vec![u.to_vec()];
        for (i, state) in states.iter().enumerate() {
            (1..=section_order(self.order, i)).for_each(|lag| to_taps.push(delayed(state, lag)));
        }
        to_taps.remove(self.held);
        to_a.extend(to_taps);
        behind.iter_mut().zip(u).for_each(|(sum, u)| *sum += self.taps[0] * u);
        (behind, to_a)
    }

    /// The same part with `factor` times its gain.
    pub(super) fn scaled(mut self, factor: f64) -> Self {
        self.taps.iter_mut().for_each(|tap| *tap *= factor);
        self
    }

    /// The same part with the tap held that contributes most to the response to `u`: it does not pass through zero.
    pub(super) fn holding_largest(mut self, u: &[f64]) -> Self {
        let energy = |signal: &[f64]| signal.iter().map(|v| v * v).sum::<f64>();
        let mut signal = u.to_vec();
        let mut sizes = vec![energy(u)];
        for (i, a) in self.sections.iter().enumerate() {
            all_pole(*a, &mut signal);
            sizes.extend(std::iter::repeat_n(energy(&signal), section_order(self.order, i)));
        }
        let size = |i: &usize| sizes[*i] * self.taps[*i] * self.taps[*i];
        self.held = (0..=self.order).max_by(|i, j| size(i).total_cmp(&size(j))).unwrap_or(0);
        self
    }

    /// Numerator that tap alone gives, over the whole denominator.
    fn tap_polynomial(&self, tap: usize) -> Vec<f64> {
        let (lag, behind) = match tap {
            0 => (0, 0),
            _ => (1 + (tap - 1) % 2, (tap - 1) / 2 + 1),
        };
        let rest = self.sections.get(behind..).unwrap_or_default();
        let mut found = vec![0.0; lag];
        found.extend(polynomial(rest, self.order.saturating_sub(2 * behind)));
        found.resize(self.order + 1, 0.0);
        found
    }
}

fn pair(taps: &[f64]) -> [f64; 2] {
    [taps.first().copied().unwrap_or(0.0), taps.get(1).copied().unwrap_or(0.0)]
}

/// Product of sections in `q^-1`, of this degree.
fn polynomial(sections: &[Coefficients], degree: usize) -> Vec<f64> {
    let mut product = vec![1.0];
    for a in sections {
        let mut next = vec![0.0; product.len() + 2];
        for (i, p) in product.iter().enumerate() {
            [1.0, a[0], a[1]].iter().enumerate().for_each(|(k, a)| next[i + k] += p * a);
        }
        product = next;
    }
    product.resize(degree + 1, 0.0);
    product
}

fn all_pole(a: Coefficients, signal: &mut [f64]) {
    let mut past = [0.0; 2];
    for value in signal {
        *value = (*value - a[1] * past[1]) - a[0] * past[0];
        past = [*value, past[0]];
    }
}

fn delayed(signal: &[f64], lag: usize) -> Vec<f64> {
    let kept = signal.len().saturating_sub(lag);
    let mut later = vec![0.0; signal.len() - kept];
    later.extend_from_slice(&signal[..kept]);
    later
}
