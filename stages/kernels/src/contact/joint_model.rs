//! What the lever and its contact make of one set of numbers: poles and residues of both ringings.

use crate::linear_algebra::cholesky;
use faer::{Mat, c64};

use super::coupled::coupled_poles;
use super::detector::{Detector, release};
use super::estimate::whitened;
use super::law::ContactLaw;
use super::lever::FreeLever;
use super::quantities::{Parameter, Quantity};
use super::ringing::Ringing;
use crate::ringdown::{Estimate, ModeEstimate};

/// Half turns of the reference's phase that are tried: an onset within a window of that many half periods.
const TURNS: i32 = 8;

pub(super) struct JointModel<'a> {
    lever: &'a FreeLever,
    pub free: &'a Ringing,
    pub coupled: &'a Ringing,
    /// Reference modes of both ringings, where residues are used.
    references: Option<[usize; 2]>,
    /// Half turns between the references' phases as predicted and as measured.
    turns: [f64; 2],
    pub parameters: Vec<Parameter>,
    /// Which numbers of either ringing have an error.
    pub rows: [Vec<usize>; 2],
    data: Vec<f64>,
    /// Lower Cholesky factor of the covariance of the data.
    pub factor: Mat<f64>,
}

/// The lever, the contact and what is in front of them, for one set of numbers.
struct State {
    lever: FreeLever,
    poles: Vec<c64>,
    law: ContactLaw,
    gain: Vec<f64>,
    detector: Detector,
}

impl<'a> JointModel<'a> {
    /// None where the start predicts nothing.
    pub fn new(
        lever: &'a FreeLever,
        free: &'a Ringing,
        coupled: &'a Ringing,
        parameters: Vec<Parameter>,
    ) -> Option<Self> {
        let references = free.reference().zip(coupled.reference()).map(|(a, b)| [a, b]);
        let kept = |ringing: &Ringing| -> Vec<usize> {
            (0..ringing.covariance.nrows()).filter(|&i| ringing.covariance[(i, i)] > 0.0).collect()
        };
        let rows = [kept(free), kept(coupled)];
        let (n, all) = (rows[0].len(), rows[0].len() + rows[1].len());
        let covariance = Mat::from_fn(all, all, |i, j| match (i < n, j < n) {
            (true, true) => free.covariance[(rows[0][i], rows[0][j])],
            (false, false) => coupled.covariance[(rows[1][i - n], rows[1][j - n])],
            _ => 0.0,
        });
        let numbers = [free.numbers(), coupled.numbers()];
        let data = (0..2).flat_map(|k| rows[k].iter().map(|&i| numbers[k][i]).collect::<Vec<f64>>()).collect();
        let factor = cholesky(&covariance);
        let mut model = Self { lever, free, coupled, references, turns: [0.0; 2], parameters, rows, data, factor };
        let start: Vec<f64> = model.parameters.iter().map(|p| p.start).collect();
        model.residuals(&start)?;
        // either ringing's turns change its own misfit alone
        for k in 0..if model.references.is_some() { 2 } else { 0 } {
            let costs = (-TURNS..=TURNS).map(|turn| {
                model.turns[k] = f64::from(turn);
                let cost = model.residuals(&start).map_or(f64::INFINITY, |r| r.iter().map(|v| v * v).sum::<f64>());
                (turn, cost)
            });
            let (turn, _) = costs.min_by(|a, b| a.1.total_cmp(&b.1))?;
            model.turns[k] = f64::from(turn);
        }
        Some(model)
    }

    /// Whitened distance of the data from what `values` predict, then that of the values from what is known of them.
    pub fn residuals(&self, values: &[f64]) -> Option<Vec<f64>> {
        let predicted = self.predicted(values)?;
        let column = Mat::from_fn(self.data.len(), 1, |i, _| self.data[i] - predicted[i]);
        let white = whitened(&self.factor, &column);
        let known = self.parameters.iter().zip(values).filter_map(|(p, v)| Some((p.start - v) / p.prior?));
        let all: Vec<f64> = (0..self.data.len()).map(|i| white[(i, 0)]).chain(known).collect();
        all.iter().all(|v| v.is_finite()).then_some(all)
    }

    /// The numbers that have an error, of the free ringing, then of the coupled one.
    pub fn predicted(&self, values: &[f64]) -> Option<Vec<f64>> {
        let state = self.state(values)?;
        let coupled = self.poles(&state)?;
        let [free, touching] = match self.references {
            None => [None, None],
            Some(references) => {
                let released = (0..state.poles.len()).map(|n| {
                    let p = state.poles[n];
                    release(p) * state.detector.at(p) * state.gain[n]
                });
                let caught = coupled.iter().map(|&s| state.caught(s));
                [
                    Some(self.referred(self.free, &state.poles, released.collect(), 0, references[0])?),
                    Some(self.referred(self.coupled, &coupled, caught.collect(), 1, references[1])?),
                ]
            }
        };
        let blank =
            |poles: Vec<c64>, residues| Ringing { poles, residues, covariance: Mat::zeros(0, 0), real_poles: 0 };
        let numbers = [blank(state.poles.clone(), free).numbers(), blank(coupled, touching).numbers()];
        Some((0..2).flat_map(|k| self.rows[k].iter().map(|&i| numbers[k][i]).collect::<Vec<f64>>()).collect())
    }

    /// The coupled poles that `values` give.
    pub fn coupled_poles(&self, values: &[f64]) -> Option<Vec<c64>> {
        self.poles(&self.state(values)?)
    }

    /// Tip shares, the first of which makes up for the others.
    pub fn shares(&self, values: &[f64]) -> Option<Vec<f64>> {
        let mut shares = self.lever.tip_share.clone();
        let sum: f64 = shares.iter().sum();
        for (parameter, value) in self.parameters.iter().zip(values) {
            if let Quantity::Share(n) = parameter.quantity {
                shares[n] = value.exp();
            }
        }
        shares[0] = sum - shares[1..].iter().sum::<f64>();
        (shares[0] > 0.0).then_some(shares)
    }

    fn poles(&self, state: &State) -> Option<Vec<c64>> {
        coupled_poles(&state.lever, state.law, &self.coupled.poles)
    }

    fn state(&self, values: &[f64]) -> Option<State> {
        let (mut law, mut poles) = (ContactLaw::from([0.0; 2]), self.free.poles.clone());
        let (mut gain, mut corner) = (vec![1.0; poles.len()], Vec::new());
        for (parameter, &value) in self.parameters.iter().zip(values) {
            match parameter.quantity {
                Quantity::Stiffness => law.stiffness_n_per_m = value,
                Quantity::Damping => law.damping_n_s_per_m = value,
                Quantity::Inertia => law.inertia_kg = value,
                Quantity::PoleRe(n) => poles[n].re = value,
                Quantity::PoleIm(n) => poles[n].im = value,
                Quantity::Gain(n) => gain[n] = value,
                Quantity::Corner => corner.push(value.exp()),
                Quantity::Share(_) => {}
            }
        }
        if poles.iter().any(|p| p.re >= 0.0 || p.im <= 0.0) {
            return None;
        }
        let exact = |value: f64| Estimate { value, std: 0.0 };
        let mode = |p: &c64| ModeEstimate {
            frequency_hz: exact(p.norm() / std::f64::consts::TAU),
            quality_factor: exact(-0.5 * p.norm() / p.re),
        };
        let lever = FreeLever {
            stiffness_n_per_m: exact(self.lever.stiffness_n_per_m.value),
            modes: poles.iter().map(mode).collect(),
            tip_share: self.shares(values)?,
            tip_share_error: 0.0,
        };
        Some(State { lever, poles, law, gain, detector: Detector { corner } })
    }

    /// `residues` with the amplitude and the onset that make the reference's what was measured.
    fn referred(
        &self,
        measured: &Ringing,
        poles: &[c64],
        residues: Vec<c64>,
        which: usize,
        reference: usize,
    ) -> Option<Vec<c64>> {
        let ratio = measured.residues.as_ref()?[reference] / residues[reference];
        let turn = self.turns[which];
        let onset = -(ratio.arg() + std::f64::consts::PI * turn) / poles[reference].im;
        let sign = if turn.rem_euclid(2.0) == 1.0 { -1.0 } else { 1.0 };
        let amplitude = sign * ratio.norm() * (poles[reference].re * onset).exp();
        Some(poles.iter().zip(residues).map(|(&p, r)| r * (-p * onset).exp() * amplitude).collect())
    }
}

impl State {
    /// Residue of the pair at `s` in the ringing after the contact has caught the tip, less amplitude: `Res_s[H(s) D(s)
    /// / (s (1 + kappa G))]`.
    fn caught(&self, s: c64) -> c64 {
        let lever = self.poles.iter().zip(&self.gain).fold(c64::new(0.0, 0.0), |sum, (p, gain)| {
            sum + c64::new(gain * p.norm_sqr(), 0.0) / ((s - p) * (s - p.conj()))
        });
        let g = self.lever.compliance(s);
        let by_s = self.law.slope(s) * g.value + self.law.at(s) * g.by_s;
        lever * self.detector.at(s) / (s * by_s) * 2.0
    }
}
