//! The detector behind the lever, as far as residues show it.

use faer::c64;

use super::ringing::Ringing;

/// A chain of real poles: `D(s) = prod 1 / (1 + s / d_i)`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Detector {
    /// Corners `d_i`, rad/s.
    pub corner: Vec<f64>,
}

/// Corners that are tried, in the highest mode's frequency: from one that hides it to one that it hardly feels.
const CORNERS: [f64; 2] = [0.3, 20.0];
/// Number of them: steps of 5 %.
const TRIALS: usize = 85;
/// Ratio between neighbouring corners at the start: equal ones could not part.
const SPREAD: f64 = 1.35;

impl Detector {
    pub fn at(&self, s: c64) -> c64 {
        let one = c64::new(1.0, 0.0);
        self.corner.iter().fold(one, |d, &corner| d / (s / corner + 1.0))
    }

    /// `count` corners that turn the free modes' residues onto a common onset.
    ///
    /// # Method
    /// A release of a lever of real gains has residues of equal phase before the detector. One corner for all poles of
    /// the chain, by trial, least squares of what phases remain beyond the reference's.
    pub fn start(free: &Ringing, reference: usize, count: usize) -> Self {
        let highest = free.poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
        let trial = |i: usize| highest * CORNERS[0] * (CORNERS[1] / CORNERS[0]).powf(i as f64 / (TRIALS - 1) as f64);
        let chain = |corner: f64| Self { corner: vec![corner; count] };
        let best = (0..TRIALS)
            .map(trial)
            .min_by(|a, b| chain(*a).misfit(free, reference).total_cmp(&chain(*b).misfit(free, reference)));
        let corner = best.unwrap_or(highest);
        let middle = 0.5 * (count as f64 - 1.0);
        Self { corner: (0..count).map(|i| corner * SPREAD.powf(i as f64 - middle)).collect() }
    }

    fn misfit(&self, free: &Ringing, reference: usize) -> f64 {
        let Some(residues) = &free.residues else { return 0.0 };
        let gain: Vec<c64> = free.poles.iter().zip(residues).map(|(&p, &r)| r / release(p) / self.at(p)).collect();
        let onset = half_turn(gain[reference].arg()) / free.poles[reference].im;
        (0..gain.len())
            .map(|n| {
                let phase = half_turn((gain[n] * (-free.poles[n] * onset).exp()).arg());
                let variance = free.covariance[(4 * n + 2, 4 * n + 2)] / residues[n].norm_sqr();
                if variance > 0.0 { phase * phase / variance } else { 0.0 }
            })
            .sum()
    }
}

/// Residue of a mode of gain one in the ringing after a unit load is taken off, less the detector: `Res_p[w^2 /
/// ((s-p)(s-p*))] / p`, a pair as one.
pub(super) fn release(p: c64) -> c64 {
    let two_i = c64::new(0.0, 2.0 * p.im);
    c64::new(2.0 * p.norm_sqr(), 0.0) / (two_i * p)
}

/// A phase less whole half turns: the sign of a gain is not known.
fn half_turn(phase: f64) -> f64 {
    phase - std::f64::consts::PI * (phase / std::f64::consts::PI).round()
}
