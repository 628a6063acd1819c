use faer::c64;

use super::*;
use crate::fixture::white_noise;
use crate::monitor::Unwatched;

/// Noise with most of its power below a tenth of the sample rate.
fn coloured(samples: usize, seed: u64) -> Vec<f64> {
    let shape = Rational::from_roots(&[c64::new(0.6, 0.0), c64::new(0.3, 0.0)], &[c64::new(-0.5, 0.0)]).unwrap();
    shape.filter(&white_noise(samples, 1.0, seed))
}

fn pair(re: f64, im: f64) -> [c64; 2] {
    [c64::new(re, im), c64::new(re, -im)]
}

fn part(poles: ([c64; 2], f64), zeros: [c64; 2]) -> Rational {
    Rational::from_roots(&[poles.0[0], poles.0[1], c64::new(poles.1, 0.0)], &zeros).unwrap()
}

/// Third order, a low pass with a notch.
fn low_pass() -> Rational {
    part((pair(0.75, 0.35), 0.7), pair(-0.3, 0.9))
}

/// Third order, resonant.
fn resonance() -> Rational {
    part((pair(0.55, 0.65), 0.4), pair(0.2, 0.3))
}

/// A known chain.
struct Truth {
    first: Rational,
    second: Rational,
    bend: fn(f64) -> f64,
}

impl Truth {
    fn new(structure: Structure, bend: fn(f64) -> f64) -> Self {
        let (first, second) = match structure {
            Structure::Wiener => (low_pass(), Rational::unit()),
            Structure::Hammerstein => (Rational::unit(), resonance()),
            Structure::WienerHammerstein => (low_pass(), resonance()),
        };
        Self { first, second, bend }
    }

    fn order(&self) -> usize {
        self.first.order() + self.second.order()
    }

    fn output(&self, u: &[f64]) -> Vec<f64> {
        let before = self.first.filter(u);
        let scale = model::deviation(&before);
        let after: Vec<f64> = before.iter().map(|x| (self.bend)(x / scale)).collect();
        self.second.filter(&after)
    }

    /// Poles of both parts that the fit has at no distance of `bound` standard errors.
    fn far(&self, fit: &BlockFit, bound: f64) -> Vec<BlockPole> {
        let near = |found: &BlockPole| {
            let own = if found.of_first { self.first.poles() } else { self.second.poles() };
            own.iter().any(|z| (z - found.z).norm() < bound * found.std)
        };
        fit.poles().into_iter().filter(|found| !near(found)).collect()
    }
}

fn saturating(x: f64) -> f64 {
    (0.7 * x).tanh()
}

fn diode(x: f64) -> f64 {
    x - 0.4 * (1.0 + (3.0 * (x - 0.5)).exp()).ln()
}

fn quadratic(x: f64) -> f64 {
    x + 0.25 * x * x
}

fn rms(e: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = e.fold((0.0, 0), |(sum, count), e| (sum + e * e, count + 1));
    (sum / f64::from(count)).sqrt()
}

fn noisy(y: &[f64], share: f64, seed: u64) -> Vec<f64> {
    let noise = white_noise(y.len(), share * model::deviation(y), seed);
    y.iter().zip(noise).map(|(y, e)| y + e).collect()
}

#[test]
fn every_structure_is_found_and_predicts_fresh_data_to_the_noise_free_floor() {
    let cases = [
        (Structure::Wiener, saturating as fn(f64) -> f64, 0.01),
        (Structure::Wiener, diode, 0.003),
        (Structure::Hammerstein, quadratic, 0.01),
        (Structure::Hammerstein, diode, 0.003),
        (Structure::WienerHammerstein, saturating, 0.01),
        (Structure::WienerHammerstein, quadratic, 0.001),
        (Structure::WienerHammerstein, diode, 0.003),
    ];
    for (number, (structure, bend, share)) in cases.into_iter().enumerate() {
        for seed in [10 * number as u64, 10 * number as u64 + 5] {
            let truth = Truth::new(structure, bend);
            let samples = 12_000;
            // one scale of the curve for both halves
            let mut u = coloured(2 * samples, 100 + seed);
            // fresh data within the range of the curve: beyond it the spline is straight and the truth is not
            u[samples..].iter_mut().for_each(|u| *u *= 0.8);
            let clean = truth.output(&u);
            let y = noisy(&clean[..samples], share, 200 + seed);
            let deviation = model::deviation(&clean);
            let mut errors = Vec::new();
            let mut fits = Vec::new();
            for tried in Structure::ALL {
                let options = BlockOptions { structures: vec![tried], order: truth.order(), ..BlockOptions::default() };
                let fit = fit_block_oriented(&u[..samples], &y, &options, &Unwatched).unwrap();
                let error = rms(fit.model.simulate(&u).iter().zip(&clean).skip(samples).map(|(s, y)| s - y));
                errors.push(error / deviation);
                fits.push(fit);
            }
            let at = Structure::ALL.iter().position(|s| *s == structure).unwrap();
            let fit = &fits[at];
            let count = fit.model.vector().len() as f64;
            println!(
                "{structure:?} {share} {errors:?} {} {:?} {:?} {}",
                share * (count / samples as f64).sqrt(),
                truth.far(fit, 4.0),
                fit.curve_strength(),
                fit.model.curve.values().len()
            );
        }
    }
}

#[test]
fn a_linear_system_has_a_curve_that_does_not_bend() {
    for seed in 0..4 {
        let u = coloured(6000, seed);
        let y = noisy(&low_pass().filter(&u), 0.01, 50 + seed);
        for structure in [Structure::Wiener, Structure::Hammerstein] {
            let options = BlockOptions { structures: vec![structure], order: 3, ..BlockOptions::default() };
            let fit = fit_block_oriented(&u, &y, &options, &Unwatched).unwrap();
            let bend = fit.curve_strength();
            println!("{bend:?} {} {}", fit.model.curve.values().len(), fit.training_rms / fit.linear_rms);
            assert!(bend.relative < 4.0 * bend.std, "{bend:?}");
            // the curve takes ten parameters of 6000 samples more
            assert!((fit.training_rms / fit.linear_rms - 1.0).abs() < 0.005);
        }
    }
}
