//! Errors of estimates over many seeds against the Cramer-Rao bound, as rows of the tables in `docs/results`.

use std::f64::consts::TAU;

use afmid_kernels::c64;
use afmid_kernels::ringdown::{ModeEstimate, ShapePoint};

/// Of a normal deviate's values 95 % lie within.
const INSIDE: f64 = 1.96;

/// Errors of one seed.
#[derive(Default)]
pub struct Outcome {
    /// Whether as many modes were found as there are.
    pub right: bool,
    /// How many there are, and points of a shape.
    modes: usize,
    points: usize,
    /// Error over bound of frequency and damping ratio.
    over_bound: Vec<[f64; 2]>,
    /// Error over stated error of frequency, quality factor and damping ratio.
    z: Vec<[f64; 3]>,
    /// The same of real and imaginary part of shape points.
    shape: Vec<f64>,
    ms: f64,
}

impl Outcome {
    /// Nothing found yet.
    pub fn new(modes: usize, points: usize, ms: f64) -> Self {
        Self { modes, points, ms, ..Self::default() }
    }

    /// Takes a mode: its pole, the bound on the variance of the pole's real and imaginary part and their covariance, and
    /// what was found.
    pub fn take(&mut self, s: c64, [rr, ri, ii]: [f64; 3], found: &ModeEstimate) {
        let w = s.norm();
        let (f, q, zeta) = (w / TAU, -0.5 * w / s.re, -s.re / w);
        let deviation = |g: [f64; 2]| (g[0] * g[0] * rr + 2.0 * g[0] * g[1] * ri + g[1] * g[1] * ii).sqrt();
        let bound_f = deviation([s.re / w, s.im / w]) / TAU;
        let bound_zeta = deviation([-1.0 / w + s.re * s.re / w.powi(3), s.re * s.im / w.powi(3)]);
        let (frequency, damping) = (found.frequency_hz, found.damping_ratio());
        self.over_bound.push([(frequency.value - f) / bound_f, (damping.value - zeta) / bound_zeta]);
        self.z.push([
            (frequency.value - f) / frequency.std,
            (found.quality_factor.value - q) / found.quality_factor.std,
            (damping.value - zeta) / damping.std,
        ]);
    }

    /// Takes a point of a shape.
    pub fn take_point(&mut self, point: &ShapePoint, truth: c64) {
        let error = point.value - truth;
        self.shape.extend([error.re / point.re_std(), error.im / point.im_std()]);
    }
}

/// The head of the table; the first column says what cases are.
pub fn head(cases: &str) {
    println!("| {cases} | seeds | right number | rms f | rms damping | f | Q | damping | shape | ms |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
}

/// A row: of modes of a wrong number no interval holds the truth.
pub fn row(name: &str, outcomes: &[Outcome]) {
    let right = outcomes.iter().filter(|o| o.right).count();
    let rms = |k: usize| {
        let all: Vec<f64> = outcomes.iter().flat_map(|o| o.over_bound.iter().map(move |v| v[k])).collect();
        (all.iter().map(|v| v * v).sum::<f64>() / all.len().max(1) as f64).sqrt()
    };
    let modes: usize = outcomes.iter().map(|o| o.modes).sum();
    let covered = |k: usize| {
        let inside = outcomes.iter().flat_map(|o| &o.z).filter(|z| z[k].abs() < INSIDE).count();
        100.0 * inside as f64 / modes as f64
    };
    let values: usize = outcomes.iter().map(|o| 2 * o.modes * (o.points - 1)).sum();
    let inside = outcomes.iter().flat_map(|o| &o.shape).filter(|z| z.abs() < INSIDE).count();
    let shape = if values == 0 { "-".to_owned() } else { format!("{:.1}", 100.0 * inside as f64 / values as f64) };
    let mut ms: Vec<f64> = outcomes.iter().map(|o| o.ms).collect();
    ms.sort_by(f64::total_cmp);
    println!(
        "| {name} | {} | {right} | {:.2} | {:.2} | {:.1} | {:.1} | {:.1} | {shape} | {:.0} |",
        outcomes.len(),
        rms(0),
        rms(1),
        covered(0),
        covered(1),
        covered(2),
        ms[ms.len() / 2]
    );
}
