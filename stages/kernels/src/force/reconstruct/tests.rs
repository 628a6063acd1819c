//! Known forces over many seeds, and a slow twin.

use faer::Mat;

use super::*;
use crate::fixture::white_noise;

/// Two resonances and a pole, some thermal noise.
struct Toy {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    k: Vec<f64>,
}

impl Toy {
    fn new() -> Self {
        let mut a = vec![0.0; 25];
        for (first, (radius, angle)) in [(0, (0.995_f64, 0.06_f64)), (2, (0.998, 0.31))] {
            a[first * 5 + first] = 2.0 * radius * angle.cos();
            a[(first + 1) * 5 + first] = -radius * radius;
            a[first * 5 + first + 1] = 1.0;
        }
        a[24] = 0.2;
        let toy =
            Self { a, b: vec![0.0; 5], c: vec![1.0, 0.0, 1.0, 0.0, 1.0], k: vec![0.02, -0.015, 0.004, -0.003, 0.0] };
        // static gains 0.8, 0.15 and 0.05
        let gain = |radius: f64, angle: f64| 1.0 - 2.0 * radius * angle.cos() + radius * radius;
        Self { b: vec![0.0, 0.8 * gain(0.995, 0.06), 0.0, 0.15 * gain(0.998, 0.31), 0.05 * 0.8], ..toy }
    }

    fn model(&self) -> IdentifiedModel<'_> {
        IdentifiedModel { a: &self.a, b: &self.b, c: &self.c, d: 0.0, k: &self.k }
    }

    /// Response to a force with innovations of this size.
    fn respond(&self, u: &[f64], noise: f64, seed: u64) -> Vec<f64> {
        let e = white_noise(u.len(), noise, seed);
        let mut x = vec![0.0; 5];
        u.iter()
            .zip(e)
            .map(|(u, e)| {
                let y = self.c.iter().zip(&x).map(|(c, x)| c * x).sum::<f64>() + e;
                x = (0..5)
                    .map(|i| (0..5).map(|j| self.a[5 * i + j] * x[j]).sum::<f64>() + self.b[i] * u + self.k[i] * e)
                    .collect();
                y
            })
            .collect()
    }
}

/// Share of errors within one and two standard deviations.
fn shares(found: &Reconstruction, truth: &[f64], over: std::ops::Range<usize>) -> [f64; 2] {
    let n = over.len() as f64;
    [1.0, 2.0].map(|level| {
        over.clone().filter(|&t| (found.force[t] - truth[t]).abs() <= level * found.std[t]).count() as f64 / n
    })
}

#[test]
fn the_smoother_is_the_least_squares_solution() {
    let toy = Toy::new();
    let n = 70;
    for prior in [ForcePrior::RandomWalk, ForcePrior::IntegratedWalk] {
        let system = Augmented::new(&toy.model(), prior);
        let m = system.size;
        let y = white_noise(n, 1.0, 5);
        let strengths = Strengths { walk: [0.3, 0.6], jump: 2.0, transition: 20..23, start: 10.0 };
        let filtered = filter(&system, &y, &strengths, true);
        let (mean, std) = smooth(&system, &y, &strengths, &filtered);
        // twin: e and force are linear in start, walk and jumps; columns by running the recursion on unit vectors
        let columns = m + (n - 1) + 3;
        let prior_std = |p: usize| -> f64 {
            if p < m {
                10.0
            } else if p < m + 20 {
                0.3
            } else if p < m + n - 1 {
                0.6
            } else {
                2.0
            }
        };
        let run = |p: Option<usize>, y: &[f64]| -> (Vec<f64>, Vec<f64>) {
            let mut z = vec![0.0; m];
            if let Some(p) = p.filter(|p| *p < m) {
                z[p] = 1.0;
            }
            let (mut e, mut force) = (Vec::new(), Vec::new());
            for (t, y) in y.iter().enumerate() {
                e.push(y - system.out(&z));
                force.push(z[system.order]);
                z = system.advance(&z, *y);
                if p == Some(m + t) && t < n - 1 {
                    z[m - 1] += 1.0;
                }
                if p.is_some_and(|p| p >= m + n - 1 && p - (m + n - 1) + 20 == t) {
                    z[system.order] += 1.0;
                }
            }
            (e, force)
        };
        let zeros = vec![0.0; n];
        let (e0, f0) = run(None, &y);
        let responses: Vec<(Vec<f64>, Vec<f64>)> = (0..columns).map(|p| run(Some(p), &zeros)).collect();
        let normal = Mat::from_fn(columns, columns, |i, j| {
            let prior = if i == j { 1.0 / (prior_std(i) * prior_std(i)) } else { 0.0 };
            prior + responses[i].0.iter().zip(&responses[j].0).map(|(a, b)| a * b).sum::<f64>()
        });
        let right = Mat::from_fn(columns, 1 + n, |i, j| {
            if j == 0 {
                -responses[i].0.iter().zip(&e0).map(|(a, b)| a * b).sum::<f64>()
            } else {
                responses[i].1[j - 1]
            }
        });
        let solved = faer::linalg::solvers::Solve::solve(&normal.partial_piv_lu(), &right);
        for t in 0..n {
            let force = f0[t] + (0..columns).map(|p| responses[p].1[t] * solved[(p, 0)]).sum::<f64>();
            let variance = (0..columns).map(|p| responses[p].1[t] * solved[(p, 1 + t)]).sum::<f64>();
            // the twin's normal equations have a condition of 1e6 or so
            assert!((mean[t] - force).abs() < 1e-7, "{prior:?} {t}: {} {force}", mean[t]);
            assert!((std[t] / variance.sqrt() - 1.0).abs() < 1e-6, "{prior:?} {t}: {} {}", std[t], variance.sqrt());
        }
    }
}

#[test]
fn the_band_holds_the_true_force_as_often_as_it_says() {
    let toy = Toy::new();
    let (n, noise) = (2000, 1e-3);
    let mut pooled = [0.0; 2];
    let seeds = 40;
    let (mut walks, mut noises) = (0.0, 0.0);
    for seed in 0..seeds {
        // a walk of a fifth of the noise per sample, and a jump of -0.5 at 1000
        let steps = white_noise(n, 2e-4, 300 + seed);
        let mut force = 0.0;
        let truth: Vec<f64> = steps
            .iter()
            .enumerate()
            .map(|(t, step)| {
                force += step + if t == 1000 { -0.5 } else { 0.0 };
                force
            })
            .collect();
        let y = toy.respond(&truth, noise, 700 + seed);
        let settings =
            ReconstructionSettings { prior: ForcePrior::RandomWalk, transition: 997..1003, noise_variance: None };
        let found = reconstruct(toy.model(), &y, &settings).unwrap();
        let [one, two] = shares(&found, &truth, 0..n);
        pooled[0] += one / seeds as f64;
        pooled[1] += two / seeds as f64;
        walks += 0.5 * (found.walk_std[0] + found.walk_std[1]) / seeds as f64;
        noises += found.noise_variance.sqrt() / seeds as f64;
    }
    println!("within one and two standard deviations: {pooled:?}; walk {walks:e}, noise {noises:e}");
    // errors correlate over some 30 samples: 40 x 2000 / 30 = 2700 values, 0.9 and 0.4 %; four of them
    assert!((pooled[0] - 0.683).abs() < 0.036 && (pooled[1] - 0.954).abs() < 0.018, "{pooled:?}");
    // the walk is known to some per cent per seed
    assert!((walks / 2e-4 - 1.0).abs() < 0.05 && (noises / noise - 1.0).abs() < 0.01);
}

#[test]
fn a_weak_walk_is_named_and_wrong_inputs_are_refused() {
    let toy = Toy::new();
    let y = toy.respond(&[0.0; 1500], 1e-3, 9);
    let settings = ReconstructionSettings { prior: ForcePrior::RandomWalk, transition: 0..0, noise_variance: None };
    let found = reconstruct(toy.model(), &y, &settings).unwrap();
    // no force at all: the band is that of a constant, 1e-3 / sqrt(1500 values, thinned by the thermal motion)
    assert!(found.force.iter().zip(&found.std).all(|(f, s)| f.abs() < 5.0 * s));
    assert!(found.walk_std[0] < 2e-5, "{:?}", found.walk_std);
    let bad = |model: IdentifiedModel<'_>, y: &[f64]| reconstruct(model, y, &settings).is_err();
    assert!(bad(IdentifiedModel { c: &toy.c[1..], ..toy.model() }, &y));
    assert!(bad(toy.model(), &y[..30]));
    assert!(bad(toy.model(), &[0.5; 1500]));
    assert!(bad(toy.model(), &[&y[..700], &[f64::NAN], &y[700..]].concat()));
    let outside = ReconstructionSettings { transition: 1400..1600, ..settings.clone() };
    assert!(reconstruct(toy.model(), &y, &outside).is_err());
}

#[test]
fn order_twelve_and_8192_samples_are_quick() {
    // poles of twelve states, sections in observer form as `model.pem` makes them
    let (n, order) = (8192, 12);
    let mut a = vec![0.0; order * order];
    let (mut b, mut c, mut k) = (vec![0.0; order], vec![0.0; order], vec![0.0; order]);
    for i in 0..order / 2 {
        let (radius, angle) = (0.9995 - 0.02 * i as f64, 0.06 + 0.25 * i as f64);
        a[2 * i * order + 2 * i] = 2.0 * radius * f64::cos(angle);
        a[(2 * i + 1) * order + 2 * i] = -radius * radius;
        a[2 * i * order + 2 * i + 1] = 1.0;
        (b[2 * i + 1], c[2 * i], k[2 * i]) = (0.01, 1.0, 1e-3);
    }
    let model = IdentifiedModel { a: &a, b: &b, c: &c, d: 0.0, k: &k };
    let y: Vec<f64> = white_noise(n, 1e-3, 3);
    let settings =
        ReconstructionSettings { prior: ForcePrior::RandomWalk, transition: 4000..4040, noise_variance: None };
    let clock = std::time::Instant::now();
    let found = reconstruct(model, &y, &settings).unwrap();
    // printed, not asserted: timings belong to benches
    println!("8192 samples, order 12: {} passes, {:?}", found.evaluations, clock.elapsed());
    assert!(found.std.iter().all(|s| s.is_finite() && *s > 0.0));
}
