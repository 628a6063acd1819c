//! Each hit's own poles: one step from those of all hits.

use faer::{Mat, c64};

use super::order::{CERTAIN, Refined};
use super::records::Records;
use super::result::ChannelRingdown;
use crate::linear_algebra::definite_inverse;
use crate::ringdown::ModeEstimate;
use crate::ringdown::estimate::mode;
use crate::statistics::chi_square_tail;

/// Poles of the modes that a hit shows for certain.
pub(super) struct OwnPoles {
    /// Numbers of these modes in the fit of all hits, ascending.
    pub modes: Vec<usize>,
    pub poles: Vec<c64>,
    /// Of their parts, 1/s^2.
    covariance: Mat<f64>,
    /// Probability that noise alone moves them as far from those of all hits.
    pub chance: f64,
    /// Energy of each over that of a unit of white noise, as of the fit of all hits.
    pub energy: Vec<f64>,
}

impl OwnPoles {
    /// One for each hit that shows a mode for certain.
    ///
    /// # Method
    /// The step of the search for the hit's records alone, from poles that are as near as their error: as good as a fit.
    /// # Source
    /// E. L. Lehmann, G. Casella, Theory of Point Estimation, 2nd ed., theorem 6.4.3.
    pub fn of_hits(
        records: &Records<'_>,
        refined: &Refined,
        all: &ChannelRingdown,
        false_alarm: f64,
    ) -> Vec<Option<Self>> {
        (0..records.events).map(|event| Self::of(event, records, refined, all, false_alarm)).collect()
    }

    fn of(
        event: usize,
        records: &Records<'_>,
        refined: &Refined,
        all: &ChannelRingdown,
        false_alarm: f64,
    ) -> Option<Self> {
        let own: Vec<usize> = (0..records.all.len()).filter(|&r| records.all[r].event == event).collect();
        let is_certain = |j: &usize| {
            let strength: f64 = own.iter().map(|&r| all.records[r].strength(*j)).sum();
            let places = records.longest as f64;
            chi_square_tail(strength / CERTAIN, 2 + 2 * own.len()) * places <= false_alarm
        };
        let modes: Vec<usize> = (0..all.poles.len()).filter(is_certain).collect();
        let unit_s = refined.fitted.unit_s;
        let order = refined.order();
        let size = 2 * modes.len();
        // numbers of a parameter in the search's order and in that of the fit of all hits
        let place = |i: usize| 2 * order[modes[i / 2]] + i % 2;
        let in_all = |i: usize| 2 * modes[i / 2] + i % 2;
        let level = |r: usize, i: usize| {
            refined.levels[records.all[r].channel][order[modes[i / 2]]] * all.lack_of_fit[modes[i / 2]]
        };
        let (mut information, mut scores) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, size));
        let mut gradient = vec![0.0; size];
        for &r in &own {
            let solved = &refined.fitted.projection.solved[r];
            for i in 0..size {
                gradient[i] += solved.gradient[place(i)] / unit_s;
                for k in 0..size {
                    let part = solved.information[(place(i), place(k))];
                    information[(i, k)] += part;
                    scores[(i, k)] += (level(r, i) * level(r, k)).sqrt() * part;
                }
            }
        }
        let inverse = definite_inverse(&information)?;
        let covariance = faer::Scale(unit_s.powi(-2)) * (&inverse * &scores * &inverse);
        let step: Vec<f64> = (0..size).map(|i| (0..size).map(|k| inverse[(i, k)] * gradient[k]).sum()).collect();
        // the hit is one of all: the difference varies by the hit's covariance less that of all
        let apart = Mat::from_fn(size, size, |i, k| covariance[(i, k)] - all.covariance[(in_all(i), in_all(k))]);
        let weight = definite_inverse(&apart)?;
        let square: f64 = (0..size).map(|i| (0..size).map(|k| step[i] * weight[(i, k)] * step[k]).sum::<f64>()).sum();
        let poles: Vec<c64> =
            modes.iter().enumerate().map(|(i, &j)| all.poles[j] + c64::new(step[2 * i], step[2 * i + 1])).collect();
        let energy_of = |j: usize| -> f64 {
            own.iter().map(|&r| all.records[r].residues[j].norm_sqr() / all.noise[records.all[r].channel].white).sum()
        };
        let energy = modes.iter().map(|&j| energy_of(j) / -all.poles[j].re).collect();
        let chance = if square.is_finite() { chi_square_tail(square.max(0.0), size) } else { 0.0 };
        (size > 0).then_some(Self { modes, poles, covariance, chance, energy })
    }

    /// Energy and number of the strongest of its modes, and its estimate; `none`: numbers of those that are no modes.
    pub fn strongest(&self, none: &[usize]) -> Option<(f64, usize, ModeEstimate)> {
        let places = (0..self.modes.len()).filter(|&place| !none.contains(&self.modes[place]));
        let place = places.max_by(|&a, &b| self.energy[a].total_cmp(&self.energy[b]))?;
        let estimate = mode(self.poles[place], &self.covariance, 2 * place);
        Some((self.energy[place], self.modes[place], estimate))
    }
}
