//! Simulated decays of every kind, with their truth.

use std::f64::consts::{PI, TAU};

use afmid_kernels::ringdown::moving::{Exponential, Line};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::systems::System;

/// Explicit random numbers.
struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}

/// A record, what a linear fit would hand over, and the truth.
pub struct Case {
    pub hits: Vec<Vec<Vec<f64>>>,
    pub fs: f64,
    pub lines: Vec<Line>,
    /// Of each mode: system, largest and least amplitude.
    pub truth: Vec<(System, f64, f64)>,
    /// Linear modes expected in the one line.
    pub close: bool,
}

pub const KINDS: [&str; 18] = [
    "linear",
    "pendulum",
    "hardening",
    "softening",
    "drag",
    "drag-hardening",
    "pair",
    "coulomb",
    "log",
    "two-moving",
    "channels",
    "hits",
    "close-pair",
    "steady",
    "multiple",
    "near-pair",
    "play",
    "two-moving-hits",
];

/// Draws a case; `level`: noise over the first amplitude. Of even seeds the record ends long before the ringing.
pub fn case(kind: &str, s: u64, level: f64) -> Case {
    let mut r = Random::new(s * 100 + KINDS.iter().position(|k| *k == kind).unwrap_or(0) as u64);
    let pendulum = kind == "pendulum";
    let f = if pendulum { r.uniform(0.4, 1.2) } else { r.uniform(0.5, 900.0) };
    let mut q = r.uniform(60f64.ln(), 500f64.ln()).exp();
    let w = TAU * f;
    let per = r.uniform(14.0, 60.0);
    let fs = f * per;
    let even = s.is_multiple_of(2);
    let share = r.uniform(0.15, 0.6);
    let mut n = ((if even { (q * share).max(25.0) } else { (q * 1.6).clamp(120.0, 900.0) }) * per) as usize;
    let mut a = r.uniform(0.15, 0.35);
    let mut sys = System { w, pendulum, ..System::default() };
    if pendulum && s % 4 < 2 {
        a = r.uniform(0.25, 0.6);
        q = r.uniform(250.0, 600.0);
        n = ((q * r.uniform(0.15, 0.4)).max(25.0) * per) as usize;
    }
    sys.c = w / q;
    match kind {
        "multiple" => (sys.k3, a) = (0.4, 0.35),
        "hardening" | "channels" | "two-moving" | "two-moving-hits" => sys.k3 = r.uniform(0.05, 0.4),
        "softening" => sys.k3 = -r.uniform(0.05, 0.25),
        "drag-hardening" | "hits" | "steady" => sys.k3 = 0.2,
        "log" => sys.eps = r.uniform(0.003, 0.02) * if r.uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 },
        "play" => sys.play = r.uniform(0.002, 0.02) * a,
        _ => {}
    }
    if kind.contains("drag") || kind == "hits" || kind == "steady" {
        sys.cq = r.uniform(0.3, 1.5) / q;
    }
    if kind == "coulomb" {
        let share = r.uniform(0.2, 1.5);
        sys.coul = share * w / (2.0 * q) * a * PI * w / 2.0;
        let stop = (1.0 + 1.0 / share).ln() * 2.0 * q / w;
        let wanted = if even { r.uniform(0.3, 0.6) } else { 0.92 };
        n = ((stop * wanted * fs) as usize).max((20.0 * per) as usize);
    }
    let noise = level * a;
    let clean = sys.run(n, fs, 24, a);
    let tail = |y: &[f64], per: f64| {
        y[y.len().saturating_sub((3.0 * per) as usize)..].iter().fold(0.0_f64, |m, v| m.max(v.abs()))
    };
    let end = tail(&clean, 2.0 * per).max(4.0 * noise);
    let pole = |r: &mut Random, sys: &System, high: f64, low: f64| {
        let (a, b) = (sys.local(high), sys.local(low.min(high)));
        let at = r.uniform(0.2, 0.9);
        let zeta = (a.1.ln() * (1.0 - at) + b.1.ln() * at).exp();
        let f = a.0 + (b.0 - a.0) * at;
        let turn = TAU * f * (1.0 + zeta * r.uniform(-0.3, 0.3));
        Exponential { rate_per_s: turn * zeta * r.uniform(0.75, 1.4), turn_rad_per_s: turn }
    };
    let mut truth = vec![(sys, a, end)];
    let mut lines = vec![Line { poles: vec![pole(&mut r, &sys, a, end)] }];
    let t = |k: usize| k as f64 / fs;
    let noisy = |r: &mut Random, y: &[f64], scale: f64| -> Vec<f64> {
        y.iter().map(|v| v * scale + noise * r.normal()).collect()
    };
    let hits = match kind {
        "pair" => {
            let f2 = f * r.uniform(2.1, 3.7);
            let q2 = q * r.uniform(0.5, 1.5);
            let mut y = clean.clone();
            if f2 * 2.3 < fs {
                y.iter_mut().enumerate().for_each(|(k, y)| {
                    *y += 0.4 * a * (-PI * f2 / q2 * t(k)).exp() * (TAU * f2 * t(k) + 1.0).cos();
                });
                let zeta = 0.5 / q2;
                let w2 = TAU * f2 * (1.0 + zeta * zeta).sqrt();
                let second = System { w: w2, c: 2.0 * zeta * w2 / (1.0 + zeta * zeta).sqrt(), ..System::default() };
                truth.push((second, 0.4 * a, 4.0 * noise));
                lines.push(Line { poles: vec![pole(&mut r, &second, 0.4 * a, 4.0 * noise)] });
            }
            vec![vec![noisy(&mut r, &y, 1.0)]]
        }
        "two-moving" => {
            let f2 = f * r.uniform(1.3, 2.7);
            let q2 = q * r.uniform(0.6, 1.5);
            let second = System {
                w: TAU * f2,
                c: TAU * f2 / q2,
                cq: r.uniform(0.3, 1.5) / q2,
                k3: r.uniform(-0.2, 0.3),
                ..System::default()
            };
            let b = r.uniform(0.4, 1.0) * a;
            let other = second.run(n, fs, 24, b);
            let low = tail(&other, 2.0 * per).max(4.0 * noise);
            truth.push((second, b, low));
            lines.push(Line { poles: vec![pole(&mut r, &second, b, low)] });
            let y: Vec<f64> = clean.iter().zip(&other).map(|(x, y)| x + y).collect();
            vec![vec![noisy(&mut r, &y, 1.0)]]
        }
        "two-moving-hits" => {
            let (f2, q2) = (f * r.uniform(1.3, 2.7), q * r.uniform(0.6, 1.5));
            let (c, k3) = (TAU * f2 / q2, r.uniform(-0.2, 0.3));
            let second = System { w: TAU * f2, c, cq: r.uniform(0.3, 1.5) / q2, k3, ..System::default() };
            let (first_shape, second_shape) = ([1.0, -0.7, 0.4], [1.0, 0.9, -0.3]);
            let (mut low, mut high) = ([end, a], [0.0_f64, 0.0]);
            let hits: Vec<Vec<Vec<f64>>> = (0..2 + (s % 3) as usize)
                .map(|_| {
                    let starts = [a * r.uniform(0.4, 1.0), a * r.uniform(0.4, 1.0)];
                    let ringing = [sys.run(n, fs, 24, starts[0]), second.run(n, fs, 24, starts[1])];
                    for mode in 0..2 {
                        high[mode] = high[mode].max(starts[mode]);
                        low[mode] = low[mode].min(tail(&ringing[mode], 2.0 * per).max(4.0 * noise));
                    }
                    let sum = |c: usize, k: usize| first_shape[c] * ringing[0][k] + second_shape[c] * ringing[1][k];
                    (0..3).map(|c| (0..n).map(|k| sum(c, k) + noise * r.normal()).collect()).collect()
                })
                .collect();
            truth = vec![(sys, high[0], low[0]), (second, high[1], low[1])];
            lines.push(Line { poles: vec![pole(&mut r, &second, high[1], low[1])] });
            hits
        }
        "steady" => {
            let turn = w * (1.0 + r.uniform(-2.0, 2.0) / q);
            let y: Vec<f64> = clean.iter().enumerate().map(|(k, y)| y + 0.03 * a * (turn * t(k) + 0.7).cos()).collect();
            vec![vec![noisy(&mut r, &y, 1.0)]]
        }
        "multiple" => {
            let main = lines[0].poles[0];
            let third = Exponential { rate_per_s: 3.0 * main.rate_per_s, turn_rad_per_s: 3.0 * main.turn_rad_per_s };
            lines.push(Line { poles: vec![third] });
            vec![vec![noisy(&mut r, &clean, 1.0)]]
        }
        "channels" => vec![[1.0, -0.7, 0.2].iter().map(|s| noisy(&mut r, &clean, *s)).collect()],
        "hits" => {
            let count = 2 + (s % 3) as usize;
            let hit = |r: &mut Random, i: usize| {
                let y = if i == 0 { clean.clone() } else { sys.run(n, fs, 24, a * r.uniform(0.3, 0.95)) };
                truth[0].2 = truth[0].2.min(tail(&y, 2.0 * per).max(4.0 * noise));
                [1.0, -0.5].iter().map(|s| noisy(r, &y, *s)).collect()
            };
            let mut hit = hit;
            (0..count).map(|i| hit(&mut r, i)).collect()
        }
        "close-pair" | "near-pair" => {
            let apart = if kind == "near-pair" { r.uniform(0.1, 0.8) } else { r.uniform(0.8, 4.0) };
            let q2 = q * r.uniform(0.6, 1.6);
            let f2 = f * (1.0 + apart * 0.5 / q);
            let channels = 1 + (s % 3) as usize;
            let n = ((q * r.uniform(0.8, 1.6)).clamp(60.0, 700.0) * per) as usize;
            let b = a * r.uniform(0.4, 1.0);
            let phase = r.uniform(0.0, TAU);
            let z = [0.5 / q, 0.5 / q2];
            let one = |f: f64, z: f64, ph: f64, k: usize| (-TAU * f * z * t(k)).exp() * (TAU * f * t(k) + ph).cos();
            let shapes = [[1.0, 1.0], [1.0, -0.8], [0.3, 0.9]];
            let all = |r: &mut Random, c: usize| -> Vec<f64> {
                (0..n)
                    .map(|k| {
                        shapes[c][0] * a * one(f, z[0], 0.0, k)
                            + shapes[c][1] * b * one(f2, z[1], phase, k)
                            + noise * r.normal()
                    })
                    .collect()
            };
            let rows: Vec<Vec<f64>> = (0..channels).map(|c| all(&mut r, c)).collect();
            let make = |f: f64, z: f64| {
                let w = TAU * f * (1.0 + z * z).sqrt();
                System { w, c: 2.0 * z * w / (1.0 + z * z).sqrt(), ..System::default() }
            };
            let (one, two) = (make(f, z[0]), make(f2, z[1]));
            truth = vec![(one, a, 4.0 * noise), (two, b, 4.0 * noise)];
            lines = if even {
                vec![Line { poles: vec![pole(&mut r, &one, a, 4.0 * noise), pole(&mut r, &two, b, 4.0 * noise)] }]
            } else {
                vec![Line { poles: vec![pole(&mut r, &make(0.5 * (f + f2), z[0]), a, 4.0 * noise)] }]
            };
            vec![rows]
        }
        _ => vec![vec![noisy(&mut r, &clean, 1.0)]],
    };
    Case { hits, fs, lines, truth, close: kind.ends_with("e-pair") || kind == "near-pair" }
}
