//! Monte Carlo of free decays in several channels against the Cramer-Rao bound: `docs/results/decay.md`.
//!
//! `cargo run --release -p afmid-kernels --example decay -- [SEEDS] [CASE]`

mod scores;

use std::f64::consts::{PI, TAU};

use afmid_kernels::linear_algebra::{Qr, product, symmetric_inverse};
use afmid_kernels::ringdown::{ChannelNoise, ChannelOptions, ChannelRingdown, ModesWanted, fit_channels};
use afmid_kernels::{Mat, c64};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use scores::{Outcome, head, row};

const RATE_HZ: f64 = 5e3;

/// What a row of the table simulates.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    modes: usize,
    /// Quality factors, drawn evenly in the logarithm.
    quality: (f64, f64),
    /// Whether the second mode is as near to the first as ten of the bound on their distance.
    close: bool,
    events: usize,
    samples: usize,
}

const CASES: [Case; 7] = [
    Case { name: "Q 3", modes: 1, quality: (3.0, 3.0), close: false, events: 1, samples: 600 },
    Case { name: "Q 3 to 30, 2 modes", modes: 2, quality: (3.0, 30.0), close: false, events: 1, samples: 1500 },
    Case { name: "Q 20 to 300, 3 modes", modes: 3, quality: (20.0, 300.0), close: false, events: 1, samples: 5000 },
    Case { name: "Q 300 to 3000, 4 modes", modes: 4, quality: (300.0, 3e3), close: false, events: 1, samples: 8000 },
    Case { name: "Q 30000", modes: 1, quality: (3e4, 3e4), close: false, events: 1, samples: 20_000 },
    Case { name: "close pair, Q 50 to 1000", modes: 2, quality: (50.0, 1e3), close: true, events: 1, samples: 8000 },
    Case { name: "3 modes, 4 hits", modes: 3, quality: (20.0, 300.0), close: false, events: 4, samples: 3000 },
];

/// A system with its sensors, hits and noise.
struct Truth {
    poles: Vec<c64>,
    /// Shape of each mode over the channels.
    shapes: Vec<Vec<c64>>,
    /// Amplitude of each mode in each event.
    hits: Vec<Vec<c64>>,
    noise: Vec<f64>,
    samples: usize,
}

fn pole(f: f64, q: f64) -> c64 {
    let w = TAU * f;
    c64::new(-0.5 * w / q, w * (1.0 - 0.25 / (q * q)).sqrt())
}

impl Truth {
    fn drawn(case: &Case, channels: usize, noise: f64, rng: &mut ChaCha8Rng) -> Self {
        let (low, high) = case.quality;
        let mut f = rng.random_range(90.0..160.0);
        let mut poles = Vec::new();
        for _ in 0..case.modes {
            let q = low * (high / low).powf(rng.random_range(0.0..1.0));
            poles.push(pole(f, q));
            f *= rng.random_range(1.5..2.4);
        }
        let sign = |rng: &mut ChaCha8Rng| if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
        let shapes = (0..case.modes)
            .map(|_| {
                (0..channels)
                    .map(|_| c64::from_polar(sign(rng) * rng.random_range(0.3..1.0), rng.random_range(-0.4..0.4)))
                    .collect()
            })
            .collect();
        let hits = (0..case.events)
            .map(|e| {
                let strength = [1.0, 0.5, 0.8, 0.3][e % 4];
                let one = |rng: &mut ChaCha8Rng| {
                    c64::from_polar(strength * rng.random_range(0.5..1.0), rng.random_range(-PI..PI))
                };
                (0..case.modes).map(|_| one(rng)).collect()
            })
            .collect();
        let relative: Vec<f64> = (0..channels).map(|_| rng.random_range(0.7..1.4)).collect();
        let mut truth = Self { poles, shapes, hits, noise: vec![0.0; channels], samples: case.samples };
        let peak = (0..case.events)
            .flat_map(|e| (0..channels).map(move |c| (e, c)))
            .flat_map(|(e, c)| truth.signal(e, c))
            .fold(0.0_f64, |m, y| m.max(y.abs()));
        truth.noise = relative.iter().map(|r| r * noise * peak).collect();
        if case.close {
            truth.bring_together();
        }
        truth
    }

    /// Moves the second mode to where the bound on the distance from the first is a twelfth of it.
    fn bring_together(&mut self) {
        let (first, q) = (self.poles[0], -0.5 * self.poles[1].norm() / self.poles[1].re);
        let f = first.norm() / TAU;
        let distance_over_bound = |truth: &Self| {
            let bound = truth.bound();
            let (a, b) = (truth.poles[0], truth.poles[1]);
            let slope = |s: c64| [s.re / s.norm(), s.im / s.norm()];
            let g = [-slope(a)[0], -slope(a)[1], slope(b)[0], slope(b)[1]];
            let variance: f64 = (0..4).map(|i| (0..4).map(|j| g[i] * bound[(i, j)] * g[j]).sum::<f64>()).sum();
            (b.norm() - a.norm()) / variance.sqrt()
        };
        let (mut low, mut high) = (-5.0_f64, 0.0_f64);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            self.poles[1] = pole(f * (1.0 + 10f64.powf(middle)), q);
            if distance_over_bound(self) < 12.0 { low = middle } else { high = middle }
        }
        self.poles[1] = pole(f * (1.0 + 10f64.powf(high)), q);
    }

    fn residue(&self, event: usize, channel: usize, mode: usize) -> c64 {
        self.hits[event][mode] * self.shapes[mode][channel]
    }

    fn signal(&self, event: usize, channel: usize) -> Vec<f64> {
        let mut y = vec![0.0; self.samples];
        for (j, s) in self.poles.iter().enumerate() {
            let mut z = self.residue(event, channel, j);
            let step = (s / RATE_HZ).exp();
            for v in &mut y {
                *v += z.re;
                z *= step;
            }
        }
        y
    }

    /// Cramer-Rao bound of the poles' real and imaginary parts, residues, offsets and slopes free.
    fn bound(&self) -> Mat<f64> {
        let (modes, n) = (self.poles.len(), self.samples);
        let own = 2 * modes + 2;
        let mut information = Mat::<f64>::zeros(2 * modes, 2 * modes);
        let steps: Vec<Vec<c64>> =
            self.poles.iter().map(|s| (0..n).map(|k| (s * (k as f64 / RATE_HZ)).exp()).collect()).collect();
        let mut matrix = Mat::<f64>::zeros(n, own + 4 * modes);
        for k in 0..n {
            let t = k as f64 / RATE_HZ;
            for (j, z) in steps.iter().enumerate() {
                matrix[(k, 2 * j)] = z[k].re;
                matrix[(k, 2 * j + 1)] = z[k].im;
                matrix[(k, own + 4 * j)] = t * z[k].re;
                matrix[(k, own + 4 * j + 1)] = t * z[k].im;
            }
            matrix[(k, 2 * modes)] = 1.0;
            matrix[(k, 2 * modes + 1)] = 2.0 * k as f64 / n as f64 - 1.0;
        }
        // unused columns stay zero: two per mode suffice
        let r = Qr::new(matrix).r();
        for event in 0..self.hits.len() {
            for channel in 0..self.noise.len() {
                let rows = 4 * modes;
                let jacobian = Mat::from_fn(rows, 2 * modes, |i, p| {
                    let rho = self.residue(event, channel, p / 2);
                    let rho = if p % 2 == 1 { c64::new(0.0, 1.0) * rho } else { rho };
                    let (a, b) = (own + 4 * (p / 2), own + 4 * (p / 2) + 1);
                    (rho.re * r[(own + i, a)] - rho.im * r[(own + i, b)]) / self.noise[channel]
                });
                information += product(jacobian.transpose(), jacobian.as_ref());
            }
        }
        symmetric_inverse(&information)
    }
}

fn outcome(case: &Case, channels: usize, noise: f64, seed: u64, colour: bool) -> Outcome {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let truth = Truth::drawn(case, channels, noise, &mut rng);
    let records: Vec<Vec<Vec<f64>>> = (0..case.events)
        .map(|e| {
            (0..channels)
                .map(|c| {
                    let offset = rng.random_range(-1.0..1.0);
                    let y = truth.signal(e, c);
                    y.into_iter()
                        .map(|v| {
                            v + offset
                                + truth.noise[c]
                                    * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng)
                        })
                        .collect()
                })
                .collect()
        })
        .collect();
    let events: Vec<Vec<&[f64]>> = records.iter().map(|e| e.iter().map(Vec::as_slice).collect()).collect();
    let noise = if colour { ChannelNoise::Estimated } else { ChannelNoise::White };
    let options = ChannelOptions { modes: ModesWanted::AtMost(8), noise, ..ChannelOptions::default() };
    let begin = std::time::Instant::now();
    let fit = fit_channels(&events, &[], 1.0 / RATE_HZ, &options);
    let ms = begin.elapsed().as_secs_f64() * 1e3;
    let mut out = Outcome::new(case.modes, channels, ms);
    let Ok(fit) = fit else {
        println!("    {} {channels} channels, seed {seed}: {:?}", case.name, fit.err());
        return out;
    };
    out.right = fit.poles.len() == case.modes;
    if !out.right {
        let f = |s: &c64| (s.norm() / TAU, -0.5 * s.norm() / s.re);
        println!(
            "    {} {channels} channels, seed {seed}: {} modes {:.2?} truth {:.2?} {:.1?}",
            case.name,
            fit.poles.len(),
            fit.poles.iter().map(f).collect::<Vec<_>>(),
            truth.poles.iter().map(f).collect::<Vec<_>>(),
            fit.seen.iter().map(|s| (s.modes, s.gain, s.kept)).collect::<Vec<_>>()
        );
        return out;
    }
    measure(&truth, &fit, &mut out);
    out
}

fn measure(truth: &Truth, fit: &ChannelRingdown, out: &mut Outcome) {
    let bound = truth.bound();
    for (j, mode) in fit.modes().iter().enumerate() {
        let (re, im) = (2 * j, 2 * j + 1);
        out.take(truth.poles[j], [bound[(re, re)], bound[(re, im)], bound[(im, im)]], mode);
        let shape = &fit.shapes[j];
        for (c, point) in shape.points.iter().enumerate().filter(|(c, _)| *c != shape.reference) {
            out.take_point(point, truth.shapes[j][c] / truth.shapes[j][shape.reference]);
        }
        if !shape.rank_one.holds() {
            println!("    the hits do not share one shape: mode {}", j + 1);
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seeds: u64 = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(40);
    let chosen: Option<usize> = arguments.get(1).and_then(|a| a.parse().ok());
    let colour = !arguments.iter().any(|a| a == "white");
    head("case, channels, noise");
    let mut all: Vec<Outcome> = Vec::new();
    for (number, case) in CASES.iter().enumerate().filter(|(i, _)| chosen.is_none_or(|c| c == *i)) {
        let mut own = Vec::new();
        for channels in [1, 3, 12] {
            for (place, noise) in [1e-3, 1e-2, 5e-2].into_iter().enumerate() {
                let first = 1_000_000 * number as u64 + 100_000 * channels as u64 + 10_000 * place as u64;
                let outcomes: Vec<Outcome> = (0..seeds)
                    .into_par_iter()
                    .map(|seed| outcome(case, channels, noise, first + seed, colour))
                    .collect();
                row(&format!("{}, {channels}, {} %", case.name, 100.0 * noise), &outcomes);
                own.extend(outcomes);
            }
        }
        row(&format!("**{}**", case.name), &own);
        all.extend(own);
    }
    row("**all**", &all);
}
