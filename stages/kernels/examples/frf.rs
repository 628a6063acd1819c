//! Monte Carlo of modes from frequency responses against the Cramer-Rao bound: `docs/results/frf.md`.
//!
//! `cargo run --release -p afmid-kernels --example frf -- [SEEDS] [CASE] [known]`

mod scores;

use std::f64::consts::TAU;

use afmid_kernels::frf_modes::{FrfModel, FrfModes, FrfModesOptions, FrfQuantity, MeasuredResponses, frf_modes};
use afmid_kernels::linear_algebra::{Qr, product, symmetric_inverse};
use afmid_kernels::{Mat, c64};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use scores::{Outcome, head, row};

/// What a row of the table simulates.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    modes: usize,
    /// Quality factors, drawn evenly in the logarithm.
    quality: (f64, f64),
    /// Whether the second mode is as near to the first as ten of the bound on their distance.
    close: bool,
    /// Band in Hz and distance of the lines.
    band: (f64, f64, f64),
    /// Whether a mode lies below the band and one above it.
    outside: bool,
    /// Numbers of responses.
    responses: &'static [usize],
}

/// Numbers of responses of most cases.
const MANY: [usize; 3] = [2, 4, 12];

const CASES: [Case; 7] = [
    Case {
        name: "Q 10, 3 modes",
        modes: 3,
        quality: (8.0, 15.0),
        close: false,
        band: (20.0, 500.0, 1.0),
        outside: false,
        responses: &MANY,
    },
    Case {
        name: "Q 20 to 200, 4 modes",
        modes: 4,
        quality: (20.0, 200.0),
        close: false,
        band: (40.0, 600.0, 0.5),
        outside: false,
        responses: &MANY,
    },
    Case {
        name: "Q 300 to 1000, 6 modes",
        modes: 6,
        quality: (300.0, 1000.0),
        close: false,
        band: (40.0, 840.0, 0.2),
        outside: false,
        responses: &MANY,
    },
    Case {
        name: "Q 1000, coarse",
        modes: 3,
        quality: (1e3, 1e3),
        close: false,
        band: (50.0, 450.0, 0.2),
        outside: false,
        responses: &MANY,
    },
    Case {
        name: "close pair, Q 50 to 300",
        modes: 3,
        quality: (50.0, 300.0),
        close: true,
        band: (50.0, 450.0, 0.5),
        outside: false,
        responses: &MANY,
    },
    Case {
        name: "modes outside the band",
        modes: 3,
        quality: (20.0, 200.0),
        close: false,
        band: (60.0, 500.0, 0.5),
        outside: true,
        responses: &MANY,
    },
    Case {
        name: "close pair in one response",
        modes: 3,
        quality: (50.0, 300.0),
        close: true,
        band: (50.0, 450.0, 0.5),
        outside: false,
        responses: &[1],
    },
];

/// Responses with their noise.
struct Truth {
    model: FrfModel,
    /// Modes inside the band.
    inside: usize,
    frequency_hz: Vec<f64>,
    /// Standard deviation of the complex error of each response.
    noise: Vec<f64>,
}

fn pole(f: f64, q: f64) -> c64 {
    let w = TAU * f;
    c64::new(-0.5 * w / q, w * (1.0 - 0.25 / (q * q)).sqrt())
}

impl Truth {
    fn drawn(case: &Case, responses: usize, noise: f64, rng: &mut ChaCha8Rng) -> Self {
        let (low, high) = case.quality;
        let (from, to, step) = case.band;
        // evenly spread with room between
        let room = (to - from) / case.modes as f64;
        let mut poles: Vec<c64> = (0..case.modes)
            .map(|m| {
                let q = low * (high / low).powf(rng.random_range(0.0..1.0));
                pole(from + room * (m as f64 + rng.random_range(0.25..0.75)), q)
            })
            .collect();
        if case.outside {
            poles.extend([pole(0.3 * from, 20.0), pole(2.5 * to, 100.0)]);
        }
        let sign = |rng: &mut ChaCha8Rng| if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
        // of each mode the largest response peaks between 0.3 and 1
        let shapes: Vec<Vec<c64>> = poles
            .iter()
            .map(|s| {
                let strength = rng.random_range(0.3..1.0);
                let mut shape: Vec<c64> = (0..responses)
                    .map(|_| c64::from_polar(sign(rng) * rng.random_range(0.3..1.0), rng.random_range(-0.2..0.2)))
                    .collect();
                let most = shape.iter().map(|z| z.norm()).fold(0.0, f64::max);
                let turn = c64::new(0.0, 1.0) * (strength * -s.re / s.norm_sqr() / most);
                shape.iter_mut().for_each(|z| *z *= turn);
                shape
            })
            .collect();
        let relative: Vec<f64> = (0..responses).map(|_| rng.random_range(0.7..1.4)).collect();
        let model = FrfModel {
            residues: (0..responses).map(|r| shapes.iter().map(|shape| shape[r]).collect()).collect(),
            poles,
            lower: (0..responses).map(|_| rng.random_range(-0.1..0.1)).collect(),
            upper: (0..responses).map(|_| rng.random_range(-0.1..0.1) / (TAU * to).powi(2)).collect(),
            quantity: FrfQuantity::Accelerance,
            added_decay_per_s: 0.0,
        };
        let frequency_hz = (0..=((to - from) / step).round() as usize).map(|k| from + step * k as f64).collect();
        let mut truth = Self { model, inside: case.modes, frequency_hz, noise: vec![0.0; responses] };
        truth.noise = relative.iter().map(|r| r * noise).collect();
        if case.close {
            truth.bring_together();
        }
        truth
    }

    /// Moves the second mode to where the bound on the distance from the first is a twelfth of it.
    fn bring_together(&mut self) {
        let (first, q) = (self.model.poles[0], -0.5 * self.model.poles[1].norm() / self.model.poles[1].re);
        let f = first.norm() / TAU;
        let distance_over_bound = |truth: &Self| {
            let bound = truth.bound();
            let (a, b) = (truth.model.poles[0], truth.model.poles[1]);
            let slope = |s: c64| [s.re / s.norm(), s.im / s.norm()];
            let g = [-slope(a)[0], -slope(a)[1], slope(b)[0], slope(b)[1]];
            let variance: f64 = (0..4).map(|i| (0..4).map(|j| g[i] * bound[(i, j)] * g[j]).sum::<f64>()).sum();
            (b.norm() - a.norm()) / variance.sqrt()
        };
        let (mut low, mut high) = (-4.0_f64, -1.0_f64);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            self.model.poles[1] = pole(f * (1.0 + 10f64.powf(middle)), q);
            if distance_over_bound(self) < 12.0 { low = middle } else { high = middle }
        }
        self.model.poles[1] = pole(f * (1.0 + 10f64.powf(high)), q);
    }

    /// Cramer-Rao bound of the poles' real and imaginary parts, residues and residual terms free.
    fn bound(&self) -> Mat<f64> {
        let poles = &self.model.poles;
        let (n, count) = (self.frequency_hz.len(), 2 * poles.len());
        let own = count + 2;
        let mut matrix = Mat::<f64>::zeros(2 * n, own + count);
        for (k, f) in self.frequency_hz.iter().enumerate() {
            let p = c64::new(0.0, TAU * f);
            let mut put = |column: usize, value: c64| {
                matrix[(k, column)] = value.re;
                matrix[(n + k, column)] = value.im;
            };
            for (j, s) in poles.iter().enumerate() {
                for (power, first) in [(1, 0), (2, own)] {
                    let upper = p * p * (p - s).inv().powi(power);
                    let lower = p * p * (p - s.conj()).inv().powi(power);
                    put(first + 2 * j, upper + lower);
                    put(first + 2 * j + 1, c64::new(0.0, 1.0) * (upper - lower));
                }
            }
            put(count, c64::new(1.0, 0.0));
            put(count + 1, p * p);
        }
        let scale: Vec<f64> = (0..own + count).map(|j| matrix.col(j).norm_l2()).collect();
        (0..own + count).for_each(|j| matrix.col_mut(j).iter_mut().for_each(|value| *value /= scale[j]));
        let r = Qr::new(matrix).r();
        let mut information = Mat::<f64>::zeros(count, count);
        for (row, noise) in self.model.residues.iter().zip(&self.noise) {
            let jacobian = Mat::from_fn(count, count, |i, p| {
                let a = if p % 2 == 1 { c64::new(0.0, 1.0) * row[p / 2] } else { row[p / 2] };
                let (x, y) = (own + 2 * (p / 2), own + 2 * (p / 2) + 1);
                // a standard deviation of the complex value is sqrt(2) of its parts'
                (a.re * scale[x] * r[(own + i, x)] + a.im * scale[y] * r[(own + i, y)]) * 2f64.sqrt() / noise
            });
            information += product(jacobian.transpose(), jacobian.as_ref());
        }
        symmetric_inverse(&information)
    }
}

fn outcome(case: &Case, responses: usize, noise: f64, seed: u64, known: bool) -> Outcome {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let truth = Truth::drawn(case, responses, noise, &mut rng);
    let rows: Vec<Vec<c64>> = (0..responses)
        .map(|r| {
            let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
            let part = truth.noise[r] / 2f64.sqrt();
            let exact = truth.model.response(r, &truth.frequency_hz);
            exact.into_iter().map(|h| h + c64::new(part * normal(&mut rng), part * normal(&mut rng))).collect()
        })
        .collect();
    let rows: Vec<&[c64]> = rows.iter().map(Vec::as_slice).collect();
    let variance: Vec<Vec<f64>> = truth.noise.iter().map(|s| vec![s * s; truth.frequency_hz.len()]).collect();
    let variance: Vec<&[f64]> = variance.iter().map(Vec::as_slice).collect();
    let measured = MeasuredResponses {
        frequency_hz: &truth.frequency_hz,
        transfer: &rows,
        variance: known.then_some(&variance[..]),
        input_noise: None,
    };
    let options = FrfModesOptions { quantity: FrfQuantity::Accelerance, ..FrfModesOptions::default() };
    let begin = std::time::Instant::now();
    let fit = frf_modes(measured, &options);
    let ms = begin.elapsed().as_secs_f64() * 1e3;
    let mut out = Outcome::new(truth.inside, responses, ms);
    let Ok(fit) = fit else {
        println!("    {} {responses} responses, seed {seed}: {:?}", case.name, fit.err());
        return out;
    };
    out.right = fit.modes.len() == truth.inside;
    if !out.right {
        let f = |s: &c64| (s.norm() / TAU, -0.5 * s.norm() / s.re);
        println!(
            "    {} {responses} responses, seed {seed}: {} modes {:.2?} truth {:.2?} {:.1?}",
            case.name,
            fit.modes.len(),
            fit.model.poles.iter().map(f).collect::<Vec<_>>(),
            truth.model.poles.iter().map(f).collect::<Vec<_>>(),
            fit.tried.iter().map(|s| (s.modes, s.gain, s.kept)).collect::<Vec<_>>()
        );
        return out;
    }
    measure(&truth, &fit, &mut out);
    out
}

fn measure(truth: &Truth, fit: &FrfModes, out: &mut Outcome) {
    let bound = truth.bound();
    for (j, mode) in fit.modes.iter().enumerate() {
        let (re, im) = (2 * j, 2 * j + 1);
        out.take(truth.model.poles[j], [bound[(re, re)], bound[(re, im)], bound[(im, im)]], &mode.estimate);
        let reference = mode.shape.reference;
        for (r, point) in mode.shape.points.iter().enumerate().filter(|(r, _)| *r != reference) {
            out.take_point(point, truth.model.residues[r][j] / truth.model.residues[reference][j]);
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seeds: u64 = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(40);
    let chosen: Option<usize> = arguments.get(1).and_then(|a| a.parse().ok());
    let known = arguments.iter().any(|a| a == "known");
    head("case, responses, noise");
    let mut all: Vec<Outcome> = Vec::new();
    for (number, case) in CASES.iter().enumerate().filter(|(i, _)| chosen.is_none_or(|c| c == *i)) {
        let mut own = Vec::new();
        for &responses in case.responses {
            for (place, noise) in [1e-3, 1e-2, 5e-2].into_iter().enumerate() {
                let first = 1_000_000 * number as u64 + 10_000 * responses as u64 + 1_000 * place as u64;
                let outcomes: Vec<Outcome> = (0..seeds)
                    .into_par_iter()
                    .map(|seed| outcome(case, responses, noise, first + seed, known))
                    .collect();
                row(&format!("{}, {responses}, {} %", case.name, 100.0 * noise), &outcomes);
                own.extend(outcomes);
            }
        }
        row(&format!("**{}**", case.name), &own);
        all.extend(own);
    }
    row("**all**", &all);
}
