//! Known truth: equations of motion integrated, fitted, compared.
//!
//! cargo run --release -p afmid-kernels --example moving -- [--kind NAME] [--first SEED] [--n N] [--verbose]

use std::f64::consts::{PI, TAU};
use std::time::Instant;

use afmid_kernels::ringdown::Estimate;
use afmid_kernels::ringdown::moving::*;

/// xoshiro256++, seeded by splitmix64.
struct Random([u64; 4]);

impl Random {
    fn new(seed: u64) -> Self {
        let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(12345);
        Self(std::array::from_fn(|_| {
            z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut x = z;
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            x ^ (x >> 31)
        }))
    }
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let s = &mut self.0;
        let out = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        low + (high - low) * (out >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        let u = self.uniform(1e-300, 1.0);
        (-2.0 * u.ln()).sqrt() * (TAU * self.uniform(0.0, 1.0)).cos()
    }
}

/// An oscillator: `x'' + spring + c v + cq |v| v + coul sign(v) = 0`.
#[derive(Clone, Copy, Default)]
struct System {
    w: f64,
    c: f64,
    cq: f64,
    k3: f64,
    coul: f64,
    /// Spring of power 1 + eps.
    eps: f64,
    pendulum: bool,
}

impl System {
    fn spring(&self, x: f64) -> f64 {
        let w2 = self.w * self.w;
        if self.pendulum {
            w2 * x.sin()
        } else if self.eps != 0.0 {
            w2 * x * x.abs().max(1e-12).powf(self.eps)
        } else {
            w2 * (x + self.k3 * x.powi(3))
        }
    }
    fn potential(&self, x: f64) -> f64 {
        let w2 = self.w * self.w;
        if self.pendulum {
            w2 * 2.0 * (0.5 * x).sin().powi(2)
        } else if self.eps != 0.0 {
            w2 * x.abs().powf(2.0 + self.eps) / (2.0 + self.eps)
        } else {
            w2 * (0.5 * x * x + 0.25 * self.k3 * x.powi(4))
        }
    }
    fn run(&self, n: usize, fs: f64, sub: usize, x0: f64) -> Vec<f64> {
        let h = 1.0 / fs / sub as f64;
        let (mut x, mut v) = (x0, 0.0_f64);
        let force = |x: f64, v: f64| {
            let dry = if self.coul > 0.0 { self.coul * (v / (1e-3 * self.w)).tanh() } else { 0.0 };
            -self.spring(x) - self.c * v - self.cq * v.abs() * v - dry
        };
        let mut y = Vec::with_capacity(n);
        for _ in 0..n {
            y.push(x);
            for _ in 0..sub {
                let (k1x, k1v) = (v, force(x, v));
                let (k2x, k2v) = (v + 0.5 * h * k1v, force(x + 0.5 * h * k1x, v + 0.5 * h * k1v));
                let (k3x, k3v) = (v + 0.5 * h * k2v, force(x + 0.5 * h * k2x, v + 0.5 * h * k2v));
                let (k4x, k4v) = (v + h * k3v, force(x + h * k3x, v + h * k3v));
                x += h / 6.0 * (k1x + 2.0 * k2x + 2.0 * k3x + k4x);
                v += h / 6.0 * (k1v + 2.0 * k2v + 2.0 * k3v + k4v);
            }
        }
        y
    }
    /// Period, fundamental amplitude and energy lost per period at peak amplitude xm.
    fn orbit(&self, xm: f64) -> (f64, f64, f64) {
        let e = self.potential(xm);
        let n = 400;
        let mut quarter = 0.0;
        let mut lost = 0.0;
        let mut times = vec![];
        for i in 0..n {
            let th = (i as f64 + 0.5) / n as f64 * PI / 2.0;
            let x = xm * th.sin();
            let v = (2.0 * (e - self.potential(x))).max(0.0).sqrt();
            let dx = xm * th.cos() * PI / 2.0 / n as f64;
            let dt = dx / v;
            times.push((quarter + 0.5 * dt, x, dt));
            quarter += dt;
            lost += 4.0 * dx * (self.c * v + self.cq * v * v + self.coul);
        }
        let period = 4.0 * quarter;
        let a1 = 8.0 / period * times.iter().map(|(t, x, dt)| x * (TAU * t / period).sin() * dt).sum::<f64>();
        (period, a1, lost)
    }
    /// Frequency and damping ratio at a fundamental amplitude.
    fn local(&self, a: f64) -> (f64, f64) {
        let mut xm = a;
        for _ in 0..6 {
            xm *= a / self.orbit(xm).1;
        }
        let (period, a1, lost) = self.orbit(xm);
        let d = 1e-3;
        let slope = (self.orbit(xm * (1.0 + d)).1 - self.orbit(xm * (1.0 - d)).1) / (2.0 * d * xm);
        let g = slope * lost / period / self.spring(xm) / a1;
        (1.0 / period, g / (TAU / period))
    }
}

struct Case {
    hits: Vec<Vec<Vec<f64>>>,
    fs: f64,
    lines: Vec<Line>,
    /// Of each mode: system, largest and least amplitude.
    truth: Vec<(System, f64, f64)>,
    /// Linear modes expected in the one line.
    close: bool,
}

const KINDS: [&str; 16] = [
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
];

fn case(kind: &str, s: u64, level: f64) -> Case {
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
        "hardening" | "channels" | "two-moving" => sys.k3 = r.uniform(0.05, 0.4),
        "softening" => sys.k3 = -r.uniform(0.05, 0.25),
        "drag-hardening" | "hits" | "steady" => sys.k3 = 0.2,
        "log" => sys.eps = r.uniform(0.003, 0.02) * if r.uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 },
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

#[derive(Default)]
struct Tally {
    right: usize,
    count: usize,
    none: usize,
    verdict: usize,
    z: Vec<f64>,
    z_course: Vec<f64>,
    ms: Vec<(f64, usize)>,
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let option = |name: &str| args.iter().position(|a| a == name).and_then(|i| args.get(i + 1)).cloned();
    let number = |name: &str, default: u64| option(name).and_then(|v| v.parse().ok()).unwrap_or(default);
    let (first, n) = (number("--first", 300), number("--n", 20));
    let only = option("--kind").unwrap_or_default();
    let outliers = number("--outliers", 1000) as f64;
    let level = option("--noise").and_then(|v| v.parse().ok()).unwrap_or(0.003);
    let verbose = args.iter().any(|a| a == "--verbose");
    for kind in KINDS.iter().filter(|k| only.is_empty() || only.split(',').any(|o| o == **k)) {
        let mut tally = Tally::default();
        for s in (first..first + n).step_by(number("--step", 1) as usize) {
            let mut case = case(kind, s, level);
            if let Some(folder) = option("--poles") {
                let Ok(text) = std::fs::read_to_string(format!("{folder}/{kind}-{s}.poles")) else { continue };
                let line = |row: &str| {
                    let v: Vec<f64> = row.split_whitespace().filter_map(|v| v.parse().ok()).collect();
                    Line {
                        poles: v.chunks(2).map(|p| Exponential { rate_per_s: p[0], turn_rad_per_s: p[1] }).collect(),
                    }
                };
                let all: Vec<Line> = text.lines().map(line).collect();
                let multiple = |l: &Line| {
                    let f = l.poles[0].turn_rad_per_s;
                    all.iter()
                        .any(|o| [2.0, 3.0].iter().any(|n| (f / (n * o.poles[0].turn_rad_per_s) - 1.0).abs() < 0.002))
                };
                case.lines = all.iter().filter(|l| !multiple(l)).cloned().collect();
            }
            let events: Vec<Vec<&[f64]>> =
                case.hits.iter().map(|h| h.iter().map(|row| row.as_slice()).collect()).collect();
            let samples: usize = case.hits.iter().flatten().map(Vec::len).sum();
            if let Some(folder) = option("--dump") {
                let mut text = String::from("Time (s)");
                (0..case.hits[0].len()).for_each(|c| text += &format!(",x{c} (m)"));
                for k in 0..case.hits[0][0].len() {
                    text += &format!("\n{:.9e}", k as f64 / case.fs);
                    case.hits[0].iter().for_each(|row| text += &format!(",{:.9e}", row[k]));
                }
                let _ = std::fs::write(format!("{folder}/{kind}-{s}.csv"), text + "\n");
                continue;
            }
            let begun = Instant::now();
            let found = follow_moving(&events, 1.0 / case.fs, &case.lines, &Options::default());
            let ms = begun.elapsed().as_secs_f64() * 1e3;
            tally.ms.push((ms, samples));
            tally.count += 1;
            let mut line = if option("--poles").is_some() {
                format!("given {:?}", case.lines.iter().map(|l| l.poles.len()).collect::<Vec<_>>())
            } else {
                String::new()
            };
            let mut ok = true;
            let before = tally.z.len();
            match found {
                Err(e) => {
                    ok = false;
                    line = format!("{e}");
                }
                Ok(found) => {
                    let modes: Vec<&FollowedMode> = found.lines.iter().flat_map(|l| &l.modes).collect();
                    let modes: Vec<&FollowedMode> =
                        if *kind == "steady" { modes.into_iter().take(1).collect() } else { modes };
                    ok &= modes.len() == case.truth.len();
                    let is_none = found.lines.iter().any(|l| l.follows == Follows::None);
                    tally.none += usize::from(is_none);
                    let expected = |i: usize| {
                        let sys = &case.truth[i.min(case.truth.len() - 1)].0;
                        let moves = sys.k3 != 0.0 || sys.cq != 0.0 || sys.coul != 0.0 || sys.eps != 0.0 || sys.pendulum;
                        if case.close {
                            Follows::Exponentials(2)
                        } else if moves {
                            Follows::Moving
                        } else {
                            Follows::Linear
                        }
                    };
                    tally.verdict += usize::from(found.lines.iter().enumerate().all(|(i, l)| {
                        l.follows == expected(i)
                            || *kind == "multiple"
                                && i == 1
                                && matches!(l.follows, Follows::Multiple { of: 0, multiple: 3 })
                            || *kind == "steady" && l.follows == Follows::Beside
                    }));
                    for (i, (sys, high, low)) in case.truth.iter().enumerate() {
                        let (fh, zh) = sys.local(*high);
                        line += &format!(
                            " | w0 {:.5} f {:.5}..{:.5} Q {:.1}..{:.1} A {:.3}..{:.4}",
                            sys.w / TAU,
                            fh,
                            sys.local(low.min(*high)).0,
                            0.5 / zh,
                            0.5 / sys.local(low.min(*high)).1,
                            high,
                            low
                        );
                        let (fl, zl) = sys.local(low.min(*high));
                        let mut near: Vec<&&FollowedMode> = modes
                            .iter()
                            .filter(|m| (fh.min(fl) * 0.999..fh.max(fl) * 1.001).contains(&m.frequency_hz.value))
                            .collect();
                        if case.close {
                            near.sort_by(|a, b| {
                                (a.frequency_hz.value - fl).abs().total_cmp(&(b.frequency_hz.value - fl).abs())
                            });
                            near.truncate(1);
                        }
                        let (ql, qh) = ((0.5 / zh).min(0.5 / zl), (0.5 / zh).max(0.5 / zl));
                        ok &= near.len() == 1;
                        if let Some(m) = near.first() {
                            let q = m.quality_factor;
                            ok &= q.std < 0.3 * q.value
                                && (ql * 0.9 - 3.0 * q.std..qh * 1.1 + 3.0 * q.std).contains(&q.value);
                            let scale = m.shape[0].norm();
                            let zs = |p: &CoursePoint| {
                                let (f, z) = sys.local(p.amplitude * scale);
                                [
                                    (p.frequency_hz.value - f) / p.frequency_hz.std,
                                    (p.damping_ratio.value - z) / p.damping_ratio.std,
                                ]
                            };
                            if modes.len() == case.truth.len() {
                                let z = zs(&m.course[0]);
                                tally.z.extend(z);
                                m.course.iter().skip(1).for_each(|p| tally.z_course.extend(zs(p)));
                                line += &format!(
                                    " f {:.5}({:.5}) z {:+.1} Q {:.4}({:.2}) true {:.4} z {:+.1} g{:?} w{:?} h{:?}",
                                    m.frequency_hz.value,
                                    m.frequency_hz.std,
                                    z[0],
                                    q.value,
                                    q.std,
                                    0.5 / sys.local(m.amplitudes.0 * scale).1,
                                    z[1],
                                    m.damping_terms.iter().map(|t| t.0).collect::<Vec<_>>(),
                                    m.frequency_terms.iter().map(|t| t.0).collect::<Vec<_>>(),
                                    m.harmonics.iter().map(Option::is_some).collect::<Vec<_>>(),
                                );
                            }
                        }
                        let _ = i;
                    }
                    if !ok {
                        for m in &modes {
                            line += &format!(
                                " GOT f {:.5}({:.5}) Q {:.4}({:.2}) at {:.4} {:?} {:?}",
                                m.frequency_hz.value,
                                m.frequency_hz.std,
                                m.quality_factor.value,
                                m.quality_factor.std,
                                m.amplitudes.0,
                                m.damping_terms.iter().map(|t| t.0).collect::<Vec<_>>(),
                                m.frequency_terms.iter().map(|t| t.0).collect::<Vec<_>>()
                            );
                        }
                    }
                    for l in &found.lines {
                        line += &format!(
                            " [{:?} lack {:.2} p {:.1e} along {:.2} band {:.2} dbic {:.0}]",
                            l.follows,
                            l.lack.factor,
                            l.lack.p_value,
                            l.lack.along,
                            l.lack.band,
                            l.bic_difference.unwrap_or(0.0)
                        );
                    }
                    let bad = |e: &Estimate| !(e.value.is_finite() && e.std.is_finite());
                    if modes.iter().any(|m| bad(&m.frequency_hz) || bad(&m.quality_factor)) || !found.bic.is_finite() {
                        println!("NOT FINITE {kind}-{s}");
                    }
                }
            }
            tally.right += usize::from(ok);
            let out = tally.z.len() > before && tally.z[before..].iter().any(|z| z.abs() > outliers);
            if verbose || !ok || out || args.iter().any(|a| a == "--none") && line.contains("[None") {
                println!("{} {kind}-{s} N {samples} {ms:.1} ms {line}", if ok { "ok " } else { "NO " });
            }
        }
        let rms = |z: &[f64]| (z.iter().map(|z| z * z).sum::<f64>() / z.len().max(1) as f64).sqrt();
        let above = |z: &[f64], l: f64| z.iter().filter(|z| z.abs() > l).count();
        let mut ms: Vec<f64> = tally.ms.iter().map(|m| m.0).collect();
        ms.sort_by(f64::total_cmp);
        let worst = ms.last().copied().unwrap_or(0.0);
        println!(
            "{kind:15} right {}/{} verdict {} none {} | end: z rms {:.2}, >2 {}, >3 {} of {} | course: rms {:.2}, >3 {} of {} | median {:.1} ms worst {:.1} ms, {:.1} ms per 20k",
            tally.right,
            tally.count,
            tally.verdict,
            tally.none,
            rms(&tally.z),
            above(&tally.z, 2.0),
            above(&tally.z, 3.0),
            tally.z.len(),
            rms(&tally.z_course),
            above(&tally.z_course, 3.0),
            tally.z_course.len(),
            ms.get(ms.len() / 2).copied().unwrap_or(0.0),
            worst,
            tally.ms.iter().map(|m| m.0).sum::<f64>() / tally.ms.iter().map(|m| m.1 as f64).sum::<f64>() * 2e4
        );
    }
}
