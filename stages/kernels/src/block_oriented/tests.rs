use faer::c64;
use rayon::prelude::*;

use super::*;
use crate::draws::few_or_all;
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

    /// Own poles that no pole of the fit's same part is near, by its standard errors.
    fn missed(&self, fit: &BlockFit, bound: f64) -> Vec<(bool, c64)> {
        let first = self.first.poles().into_iter().map(|z| (true, z));
        let own = first.chain(self.second.poles().into_iter().map(|z| (false, z)));
        let near = |found: &BlockPole, z: c64| (z - found.z).norm() < bound * found.std;
        own.filter(|(of_first, z)| !fit.poles().iter().any(|p| p.of_first == *of_first && near(p, *z))).collect()
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
    let wiener_hammerstein = Structure::WienerHammerstein;
    let cases = [
        (Structure::Wiener, saturating as fn(f64) -> f64, 0.01, 0),
        (Structure::Wiener, diode, 0.003, 15),
        (Structure::Hammerstein, quadratic, 0.01, 20),
        (Structure::Hammerstein, diode, 0.003, 35),
        (wiener_hammerstein, saturating, 0.01, 40),
        (wiener_hammerstein, saturating, 0.01, 45),
        (wiener_hammerstein, quadratic, 0.001, 50),
        (wiener_hammerstein, quadratic, 0.001, 55),
        (wiener_hammerstein, diode, 0.003, 60),
        (wiener_hammerstein, diode, 0.003, 65),
    ];
    // every structure and every curve in every run
    let cases: Vec<_> = cases.into_iter().step_by(few_or_all(2, 1)).collect();
    let outcome = |&(structure, bend, share, seed): &(Structure, fn(f64) -> f64, f64, u64)| {
        let truth = Truth::new(structure, bend);
        let samples = 12_000;
        let mut u = coloured(2 * samples, 100 + seed);
        // fresh data within the range of the curve: beyond it the spline is straight and the truth is not
        u[samples..].iter_mut().for_each(|u| *u *= 0.8);
        let clean = truth.output(&u);
        let y = noisy(&clean[..samples], share, 200 + seed);
        let scale = model::deviation(&clean[..samples]);
        let fitted = |tried: Structure| {
            let options = BlockOptions { structures: vec![tried], order: truth.order(), ..BlockOptions::default() };
            let fit = fit_block_oriented(&u[..samples], &y, &options, &Unwatched).unwrap();
            let error = rms(fit.model.simulate(&u).iter().zip(&clean).skip(samples).map(|(s, y)| s - y));
            (error / scale, fit)
        };
        let (error, fit) = fitted(structure);
        for other in Structure::ALL.into_iter().filter(|other| *other != structure) {
            let (errors, _) = fitted(other);
            assert!(error < errors, "{structure:?} {seed}: {error}, {other:?} {errors}");
        }
        // white noise leaves an error of sqrt(parameters / samples) of its own; three: its scatter, and the spline
        let floor = share * (fit.model.vector().len() as f64 / samples as f64).sqrt();
        let missed = truth.missed(&fit, 4.0);
        println!(
            "{structure:?} {seed}: error {:.2} floors, missed {missed:?}, {:?}",
            error / floor,
            fit.curve_strength()
        );
        let bend = fit.curve_strength();
        assert!(bend.relative > 4.0 * bend.std, "{structure:?} {seed}: {bend:?}");
        (error > 3.0 * floor || !missed.is_empty()).then_some((structure, seed))
    };
    let wrong: Vec<(Structure, u64)> = cases.par_iter().filter_map(outcome).collect();
    // at the least noise one division of six is right and its poles are not within their errors
    assert!(wrong.iter().all(|(structure, _)| *structure == wiener_hammerstein) && wrong.len() <= 1, "{wrong:?}");
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
