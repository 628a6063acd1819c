//! Partial fractions of the grey form, and what its parameters change in them.

use faer::c64;

use super::point::Point;
use crate::model::held_apart;

/// Real poles closer than this share of themselves are held apart.
const APART: f64 = 1e-4;

/// A residue and its slopes by the point's values (but the delay).
#[derive(Debug, Clone)]
pub(super) struct Fraction {
    pub residue: c64,
    pub slopes: Vec<c64>,
}

/// Residues of `mode_n chain` at the mode's own upper pole and at every real pole, and of the chain alone.
///
/// # Model
/// `w_n^2 / (s^2 + w_n/Q_n s + w_n^2) prod p_k/(s + p_k) = 2 Re-part(own / (s - s_n)) + sum_k rest_k / (s + p_k)`;
/// chain: `prod p_k/(s + p_k)`.
pub(super) struct Fractions {
    pub upper: Vec<c64>,
    /// Slopes of the upper poles by ln w and ln Q.
    pub upper_slopes: Vec<[c64; 2]>,
    pub decays: Vec<f64>,
    pub own: Vec<Fraction>,
    pub rest: Vec<Vec<Fraction>>,
    pub chain: Vec<Fraction>,
}

impl Fractions {
    pub fn of(point: &Point) -> Self {
        let (upper, decays) = (point.upper(), held_apart(&point.poles, APART));
        let upper_slopes: Vec<[c64; 2]> = point
            .modes
            .iter()
            .zip(&upper)
            .map(|([w, q], s)| [*s, c64::new(0.5 * w / q, 0.25 * w * w / (q * q * s.im))])
            .collect();
        let own = (0..upper.len()).map(|n| own(point, n, upper[n], upper_slopes[n], &decays)).collect();
        let chain: Vec<Fraction> = (0..decays.len()).map(|k| chain(point, k, &decays)).collect();
        let rest = (0..upper.len())
            .map(|n| chain.iter().enumerate().map(|(k, of)| rest(point, n, k, decays[k], of)).collect())
            .collect();
        Self { upper, upper_slopes, decays, own, rest, chain }
    }
}

fn one() -> c64 {
    c64::new(1.0, 0.0)
}

/// From a residue and its logarithm's slopes.
fn fraction(residue: c64, logarithmic: Vec<c64>) -> Fraction {
    Fraction { residue, slopes: logarithmic.into_iter().map(|d| residue * d).collect() }
}

fn own(point: &Point, n: usize, s: c64, by: [c64; 2], decays: &[f64]) -> Fraction {
    let [w, _] = point.modes[n];
    let behind: c64 = decays.iter().map(|p| c64::new(*p, 0.0) / (s + p)).product();
    let residue = c64::new(w * w, 0.0) / c64::new(0.0, 2.0 * s.im) * behind;
    let mut log = vec![c64::new(0.0, 0.0); 2 * point.modes.len() + decays.len()];
    for (i, ds) in by.into_iter().enumerate() {
        let direct = if i == 0 { 2.0 } else { 0.0 };
        let turned: c64 = decays.iter().map(|p| ds / (s + p)).fold(c64::new(0.0, 0.0), |a, b| a + b);
        log[2 * n + i] = c64::new(direct - ds.im / s.im, 0.0) - turned;
    }
    for (k, p) in decays.iter().enumerate() {
        log[2 * point.modes.len() + k] = s / (s + p);
    }
    fraction(residue, log)
}

fn chain(point: &Point, k: usize, decays: &[f64]) -> Fraction {
    let p = decays[k];
    let others = || decays.iter().enumerate().filter(move |(j, _)| *j != k);
    let residue = p * others().map(|(_, q)| q / (q - p)).product::<f64>();
    let first = 2 * point.modes.len();
    let mut log = vec![c64::new(0.0, 0.0); first + decays.len()];
    log[first + k] = one() * (1.0 + others().map(|(_, q)| p / (q - p)).sum::<f64>());
    for (j, q) in others() {
        log[first + j] = one() * (-p / (q - p));
    }
    fraction(one() * residue, log)
}

fn rest(point: &Point, n: usize, k: usize, p: f64, chain: &Fraction) -> Fraction {
    let ([w, q], s) = (point.modes[n], -p);
    let below = s * s + w * s / q + w * w;
    let mode = w * w / below;
    let mut slopes: Vec<c64> = chain.slopes.iter().map(|d| d * mode).collect();
    let residue = chain.residue * mode;
    slopes[2 * n] += residue * (2.0 - (w * s / q + 2.0 * w * w) / below);
    slopes[2 * n + 1] += residue * (w * s / q / below);
    slopes[2 * point.modes.len() + k] += residue * ((2.0 * s + w / q) * p / below);
    Fraction { residue, slopes }
}

#[cfg(test)]
#[test]
fn slopes_are_differences() {
    let point = Point { modes: vec![[0.3, 40.0], [1.1, 3.0]], poles: vec![0.8, 2.0], delay: 0.0 };
    let values = point.values();
    let all = |point: &Point| {
        let f = Fractions::of(point);
        let rest = f.rest.iter().flatten().map(|f| f.residue).collect::<Vec<_>>();
        f.own.iter().chain(&f.chain).map(|f| f.residue).chain(rest).collect::<Vec<c64>>()
    };
    let here = Fractions::of(&point);
    let flat: Vec<&Fraction> = here.own.iter().chain(&here.chain).chain(here.rest.iter().flatten()).collect();
    for i in 0..values.len() - 1 {
        let moved = |d: f64| {
            let mut values = values.clone();
            values[i] += d;
            all(&point.with(&values))
        };
        for (f, (up, down)) in flat.iter().zip(moved(1e-6).into_iter().zip(moved(-1e-6))) {
            // second differences of 1e-6, residues of order one
            assert!(((up - down) / 2e-6 - f.slopes[i]).norm() < 1e-7 * (1.0 + f.residue.norm()), "{i}");
        }
    }
    // at rest every mode is one
    for (n, own) in here.own.iter().enumerate() {
        let sum = (own.residue / -here.upper[n]).re * 2.0
            + here.rest[n].iter().zip(&here.decays).map(|(r, p)| r.residue.re / p).sum::<f64>();
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
    }
}
