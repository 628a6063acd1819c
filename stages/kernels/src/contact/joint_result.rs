//! From the minimum to what is handed out.

use faer::{Mat, c64};

use super::estimate::{PoleContact, single_poles, whitened};
use super::joint::LawChoice;
use super::joint_model::JointModel;
use super::law::ContactLaw;
use super::least_squares::Minimum;
use super::lever::FreeLever;
use super::quantities::Quantity;
use crate::ringdown::internals::mode;
use crate::ringdown::{Estimate, ModeEstimate};
use crate::statistics::chi_square_tail;

/// One contact resonance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactResonance {
    /// As the coupled ringing alone has it.
    pub measured: ModeEstimate,
    /// As everything together has it.
    pub estimated: ModeEstimate,
    /// What this pole says alone, with the estimated tip shares taken as exact, and what it and its residue count in
    /// the estimate.
    pub alone: PoleContact,
}

/// Whether residues are those of a step at the tip, through the free lever's zeros and detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidueTest {
    /// What residues add to chi square.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// Probability of more.
    pub p_value: f64,
    /// Whether they were used.
    pub used: bool,
}

/// Standard errors of the contact stiffness by origin, N/m; their squares sum to that of the whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBudget {
    /// Coupled ringing.
    pub coupled: f64,
    /// Free ringing.
    pub free: f64,
    /// Tip shares as given, and the hold on the detector's corners.
    pub given: f64,
    /// Stiffness of the lever.
    pub stiffness: f64,
}

/// Contact, tip shares and contact resonances.
#[derive(Debug, Clone, PartialEq)]
pub struct JointContact {
    /// Contact stiffness, N/m.
    pub stiffness_n_per_m: Estimate,
    /// Contact damping, N s/m.
    pub damping_n_s_per_m: Estimate,
    /// Second-order term, kg; none under a law of spring and damper.
    pub inertia_kg: Option<Estimate>,
    /// Chi square that this term was chosen for.
    pub law_gain: Option<f64>,
    /// Correlation of stiffness and damping.
    pub correlation: f64,
    /// Tip shares of the free modes; their sum is given.
    pub tip_shares: Vec<Estimate>,
    /// What the detector sees of each mode over the first one, times what it passes of static deflection; empty without
    /// residues.
    pub detector_gains: Vec<Estimate>,
    /// Contact resonances.
    pub resonances: Vec<ContactResonance>,
    /// Weighted square distance of all that was measured from what the estimate gives.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// Probability of a larger one where the model holds; NaN without degrees of freedom.
    pub p_value: f64,
    /// Whether residues fit; none where they are not known.
    pub residues: Option<ResidueTest>,
    /// Where the error of the stiffness comes from.
    pub budget: JointBudget,
}

/// A minimum with its model.
pub(super) struct Solved<'a> {
    model: JointModel<'a>,
    pub minimum: Minimum,
    pub freedom: usize,
    pub law_gain: Option<f64>,
}

impl<'a> Solved<'a> {
    pub fn new(model: JointModel<'a>, minimum: Minimum) -> Self {
        let freedom = freedom(&model, &minimum);
        Self { model, minimum, freedom, law_gain: None }
    }

    pub fn law(&self) -> ContactLaw {
        let value = |quantity| self.index(quantity).map_or(0.0, |p| self.minimum.values[p]);
        ContactLaw {
            stiffness_n_per_m: value(Quantity::Stiffness),
            damping_n_s_per_m: value(Quantity::Damping),
            inertia_kg: value(Quantity::Inertia),
        }
    }

    pub fn law_choice(&self) -> LawChoice {
        if self.index(Quantity::Inertia).is_some() { LawChoice::SecondOrder } else { LawChoice::SpringDamper }
    }

    fn index(&self, quantity: Quantity) -> Option<usize> {
        self.model.parameters.iter().position(|p| p.quantity == quantity)
    }

    /// Value and error of a number; a relative error of the lever's stiffness comes on top where it is proportional to
    /// it.
    fn estimate(&self, quantity: Quantity, scale_error: f64) -> Option<Estimate> {
        let p = self.index(quantity)?;
        let value = self.minimum.values[p];
        Some(Estimate { value, std: self.minimum.covariance[(p, p)].sqrt().hypot(value * scale_error) })
    }

    pub fn result(self, lever: &FreeLever, residues: Option<ResidueTest>) -> JointContact {
        let scale_error = lever.stiffness_n_per_m.std / lever.stiffness_n_per_m.value;
        let zero = Estimate { value: 0.0, std: 0.0 };
        let contact = [Quantity::Stiffness, Quantity::Damping].map(|q| self.estimate(q, scale_error).unwrap_or(zero));
        let covariance = match (self.index(Quantity::Stiffness), self.index(Quantity::Damping)) {
            (Some(a), Some(b)) => {
                self.minimum.covariance[(a, b)] + contact[0].value * contact[1].value * scale_error.powi(2)
            }
            _ => 0.0,
        };
        let tip_shares = self.shares();
        JointContact {
            stiffness_n_per_m: contact[0],
            damping_n_s_per_m: contact[1],
            inertia_kg: self.estimate(Quantity::Inertia, scale_error),
            law_gain: self.law_gain,
            correlation: covariance / (contact[0].std * contact[1].std),
            detector_gains: (1..tip_shares.len()).filter_map(|n| self.estimate(Quantity::Gain(n), 0.0)).collect(),
            resonances: self.resonances(lever, &tip_shares),
            tip_shares,
            chi_square: self.minimum.cost,
            freedom: self.freedom,
            p_value: chi_square_tail(self.minimum.cost, self.freedom),
            residues,
            budget: self.budget(contact[0].value * scale_error),
        }
    }

    fn shares(&self) -> Vec<Estimate> {
        let values = self.model.shares(&self.minimum.values).unwrap_or_default();
        let place: Vec<Option<usize>> = (0..values.len()).map(|n| self.index(Quantity::Share(n))).collect();
        // the first one's error is that of the sum of the others: d c_1 = -sum c_n d ln c_n
        let by = |n: usize, m: usize| match (place[n], place[m]) {
            (Some(a), Some(b)) => values[n] * values[m] * self.minimum.covariance[(a, b)],
            _ => 0.0,
        };
        let sum: f64 =
            (1..values.len()).flat_map(|n| (1..values.len()).map(move |m| (n, m))).map(|(n, m)| by(n, m)).sum();
        let std = |n: usize| if n == 0 { sum.max(0.0).sqrt() } else { by(n, n).sqrt() };
        values.iter().enumerate().map(|(n, &value)| Estimate { value, std: std(n) }).collect()
    }

    fn resonances(&self, lever: &FreeLever, shares: &[Estimate]) -> Vec<ContactResonance> {
        let poles = self.model.coupled_poles(&self.minimum.values).unwrap_or_default();
        let covariance = self.pole_covariance(poles.len());
        let measured = self.model.coupled.poles_only();
        let known =
            FreeLever { tip_share: shares.iter().map(|s| s.value).collect(), tip_share_error: 0.0, ..lever.clone() };
        let alone = single_poles(&known, &self.model.coupled.coupled_poles());
        let weights = self.weights();
        poles
            .iter()
            .zip(alone)
            .enumerate()
            .map(|(j, (&fitted, [stiffness, damping]))| ContactResonance {
                measured: mode(measured.poles[j], &measured.covariance, 2 * j),
                estimated: mode(fitted, &covariance, 2 * j),
                alone: PoleContact {
                    pole: measured.poles[j],
                    fitted,
                    stiffness_n_per_m: stiffness,
                    damping_n_s_per_m: damping,
                    stiffness_weight: weights[j][0],
                    damping_weight: weights[j][1],
                },
            })
            .collect()
    }

    /// Covariance of the coupled poles as the whole gives them.
    fn pole_covariance(&self, count: usize) -> Mat<f64> {
        let by: Vec<Vec<f64>> = (0..self.minimum.values.len())
            .map(|p| {
                let at = |sign: f64| {
                    let mut moved = self.minimum.values.clone();
                    moved[p] += sign * self.model.parameters[p].step;
                    self.model.coupled_poles(&moved)
                };
                let width = 2.0 * self.model.parameters[p].step;
                // the search has been to both sides
                match at(1.0).zip(at(-1.0)) {
                    Some((up, down)) => up.iter().zip(&down).flat_map(|(u, d)| parts((u - d) / width)).collect(),
                    None => vec![f64::NAN; 2 * count],
                }
            })
            .collect();
        let by = Mat::from_fn(2 * count, by.len(), |i, p| by[p][i]);
        &by * &self.minimum.covariance * by.transpose()
    }

    /// What each coupled pole with its residue counts in stiffness and damping: gain times slope of its rows; all sum
    /// to one.
    fn weights(&self) -> Vec<[f64; 2]> {
        let (slope, gain) = self.rows();
        let width = self.model.coupled.width();
        let first = self.model.rows[0].len();
        let mut weights = vec![[0.0; 2]; self.model.coupled.poles.len()];
        for (row, &number) in self.model.rows[1].iter().enumerate() {
            for (which, quantity) in [Quantity::Stiffness, Quantity::Damping].into_iter().enumerate() {
                if let Some(p) = self.index(quantity) {
                    weights[number / width][which] += gain[(p, first + row)] * slope[(first + row, p)];
                }
            }
        }
        weights
    }

    /// Slope of the data by the numbers, and the rows that make the numbers from data.
    fn rows(&self) -> (Mat<f64>, Mat<f64>) {
        let factor = &self.model.factor;
        let n = factor.nrows();
        let white = Mat::from_fn(n, self.minimum.slope.ncols(), |i, j| self.minimum.slope[(i, j)]);
        let inverse = whitened(factor, &Mat::from_fn(n, n, |i, j| if i == j { 1.0 } else { 0.0 }));
        let gain = &self.minimum.covariance * white.transpose() * inverse;
        (factor * white, gain)
    }

    fn budget(&self, stiffness: f64) -> JointBudget {
        let gain = &self.minimum.covariance * self.minimum.slope.transpose();
        let (free, data) = (self.model.rows[0].len(), self.model.factor.nrows());
        let part = |rows: std::ops::Range<usize>| match self.index(Quantity::Stiffness) {
            Some(p) => rows.map(|row| gain[(p, row)] * gain[(p, row)]).fold(0.0, |a, b| a + b).sqrt(),
            None => 0.0,
        };
        JointBudget {
            coupled: part(free..data),
            free: part(0..free),
            given: part(data..gain.ncols()),
            stiffness: stiffness.abs(),
        }
    }
}

/// Rows of data, and of what is known of shares, less what they determine: the rows' leverage, of which the hold on the
/// corners takes some.
fn freedom(model: &JointModel<'_>, minimum: &Minimum) -> usize {
    let known = model.parameters.iter().filter(|p| p.prior.is_some());
    let corner: Vec<bool> =
        (0..model.factor.nrows()).map(|_| false).chain(known.map(|p| p.quantity == Quantity::Corner)).collect();
    let (slope, covariance) = (&minimum.slope, &minimum.covariance);
    let spread = slope * covariance;
    let left = |row: usize| 1.0 - (0..slope.ncols()).map(|p| spread[(row, p)] * slope[(row, p)]).sum::<f64>();
    (0..corner.len()).filter(|&row| !corner[row]).map(left).sum::<f64>().round().max(0.0) as usize
}

fn parts(value: c64) -> [f64; 2] {
    [value.re, value.im]
}
