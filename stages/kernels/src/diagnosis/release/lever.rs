//! The baseline: a modal lever behind real poles, released from a load, in closed form.

use faer::c64;

use crate::model::held_apart;
use crate::ringdown::Exponential;

/// One mode of the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeverMode {
    /// Undamped angular frequency, rad/s.
    pub omega: f64,
    /// Quality factor, above 1/2.
    pub quality_factor: f64,
    /// Share of the static response.
    pub share: f64,
}

/// Lever and detector of the baseline.
///
/// # Model
/// `H(s) = sum_n g_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) prod_k p_k / (s + p_k)`, `sum g_n = 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Lever {
    /// Modes, ascending.
    pub modes: Vec<LeverMode>,
    /// Real poles of the detector, rad/s.
    pub poles: Vec<f64>,
}

/// Poles closer than this share of themselves are held apart.
const APART: f64 = 1e-5;

impl Lever {
    /// Parameters as numbers: per mode ln w, ln Q; shares of all modes but the first; ln of the poles.
    pub fn parameters(&self) -> Vec<f64> {
        let rates = self.modes.iter().flat_map(|m| [m.omega.ln(), m.quality_factor.ln()]);
        let shares = self.modes.iter().skip(1).map(|m| m.share);
        rates.chain(shares).chain(self.poles.iter().map(|p| p.ln())).collect()
    }

    /// The lever of such numbers; as many modes and poles as this one has.
    pub fn with(&self, values: &[f64]) -> Self {
        let n = self.modes.len();
        let (rates, rest) = values.split_at(2 * n);
        let (shares, poles) = rest.split_at(n - 1);
        let first = 1.0 - shares.iter().sum::<f64>();
        let modes = rates
            .chunks(2)
            .zip(std::iter::once(&first).chain(shares))
            .map(|(r, share)| LeverMode { omega: r[0].exp(), quality_factor: r[1].exp(), share: *share })
            .collect();
        Self { modes, poles: poles.iter().map(|p| p.exp()).collect() }
    }

    /// Number of parameters that belong to the modes' frequencies and quality factors: the first ones.
    pub fn rates(&self) -> usize {
        2 * self.modes.len()
    }

    /// What is left after the release of a unit load that pulled the signal to -1: `y(t) = sum Re(rho exp(s t))`.
    pub fn release(&self) -> Vec<Exponential> {
        let poles = held_apart(&self.poles, APART);
        let mut out = Vec::with_capacity(self.modes.len() + poles.len());
        for mode in &self.modes {
            let s = mode.pole();
            let chain: c64 = poles.iter().map(|p| c64::new(*p, 0.0) / (s + p)).product();
            let residue = c64::new(mode.share * mode.omega * mode.omega, 0.0) / c64::new(0.0, 2.0 * s.im) * chain;
            // the pair counts twice; the sign is that of a load taken away from -1
            out.push(Exponential { pole: s, residue: residue / s * 2.0 });
        }
        for (k, p) in poles.iter().enumerate() {
            let s = -p;
            let lever: f64 = self
                .modes
                .iter()
                .map(|m| {
                    let w2 = m.omega * m.omega;
                    m.share * w2 / (s * s + s * m.omega / m.quality_factor + w2)
                })
                .sum();
            let others: f64 = poles.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, q)| q / (q - p)).product();
            out.push(Exponential { pole: c64::new(s, 0.0), residue: c64::new(p * lever * others / s, 0.0) });
        }
        out
    }

    /// By how much the detector's delay, `sum 1 / p`, has changed in `next` beyond what a `step` of the parameters says
    /// to first order, s.
    ///
    /// Onsets and delay show as their sum: a step that keeps the sum to first order alone leads off the ridge as soon
    /// as poles move by some per cent.
    pub fn bent_delay_s(&self, step: &[f64], next: &Self) -> f64 {
        let steps = step[step.len() - self.poles.len()..].iter();
        let bent = |((old, new), step): ((&f64, &f64), &f64)| 1.0 / new - (1.0 - step) / old;
        self.poles.iter().zip(&next.poles).zip(steps).map(bent).sum()
    }

    /// The same with all frequencies changed in proportion.
    pub fn scaled(&self, change: f64) -> Self {
        let modes = self.modes.iter().map(|m| LeverMode { omega: m.omega * (1.0 + change), ..*m }).collect();
        Self { modes, poles: self.poles.clone() }
    }
}

impl LeverMode {
    /// The pole in the upper half plane, rad/s.
    pub fn pole(&self) -> c64 {
        let damping = 0.5 / self.quality_factor;
        c64::new(-self.omega * damping, self.omega * (1.0 - damping * damping).max(1e-12).sqrt())
    }
}
