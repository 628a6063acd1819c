//! Each estimator in a few lines, without any config: `cargo run -p afmid-stages --example estimators`.

use afmid_kernels::model::ModelError;
use afmid_kernels::modes::Root;
use afmid_kernels::pem::{Experiment, PemOptions, identify};
use afmid_kernels::ringdown::{NoiseSource, RingdownOptions, fit_ringdowns};
use afmid_kernels::stabilisation::{StabilisationCriteria, stabilisation};
use afmid_kernels::subspace::Subspace;
use afmid_kernels::vector_fitting::{MeasuredResponse, VectorFitting, vector_fitting};
use num_complex::Complex64;

/// A resonance at 50 kHz with Q = 40, sampled at 1 MS/s.
const INTERVAL_S: f64 = 1e-6;

fn main() -> Result<(), ModelError> {
    prediction_error_method()?;
    subspace()?;
    free_decay()?;
    stable_poles()?;
    frequency_response()?;
    ringdowns()
}

/// Input and output: a step that ends, with a little noise.
fn data() -> (Vec<f64>, Vec<f64>) {
    let u: Vec<f64> = (0..4096).map(|k| if k < 200 { 1.0 } else { 0.0 }).collect();
    let (w, a) = (std::f64::consts::TAU * 50e3 * INTERVAL_S, std::f64::consts::PI * 50e3 / 40.0 * INTERVAL_S);
    let (a1, a2) = (-2.0 * (-a).exp() * w.cos(), (-2.0 * a).exp());
    let mut y = vec![0.0; u.len()];
    for k in 2..u.len() {
        y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + 0.1 * u[k - 1];
    }
    let noisy = y.iter().enumerate().map(|(k, y)| y + 1e-4 * ((k * k) as f64).sin()).collect();
    (u, noisy)
}

fn prediction_error_method() -> Result<(), ModelError> {
    let (u, y) = data();
    let options = PemOptions { order: 2, ..PemOptions::default() };
    let fit = identify(&[Experiment { input: &u, output: &y }], INTERVAL_S, &options)?;
    let mode = fit.modes()?[0].root;
    let (f, std, converged) = (mode.frequency_hz, mode.frequency_std_hz, fit.verdict.converged);
    println!("pem: {f:.1} +- {std:.1} Hz, converged: {converged}");
    Ok(())
}

fn subspace() -> Result<(), ModelError> {
    let (u, y) = data();
    let z = Subspace::new(&u, &y, 60)?.poles(2)?[0];
    println!("subspace: {:.1} Hz", Root::without_errors(z, INTERVAL_S).frequency_hz);
    Ok(())
}

fn free_decay() -> Result<(), ModelError> {
    let (_, y) = data();
    let z = Subspace::of_decay(&y[200..], 60)?.poles(2)?[0];
    println!("era: {:.1} Hz", Root::without_errors(z, INTERVAL_S).frequency_hz);
    Ok(())
}

fn stable_poles() -> Result<(), ModelError> {
    let (_, y) = data();
    let era = Subspace::of_decay(&y[200..], 60)?;
    let orders = (2..=12).map(|order| Ok((order, era.poles(order)?))).collect::<Result<Vec<_>, ModelError>>()?;
    let found = stabilisation(&orders, INTERVAL_S, &StabilisationCriteria::default())?;
    println!("stabilisation: {:?} at order {:?}", found.modes.first().map(|mode| mode.frequency_hz), found.order);
    Ok(())
}

fn frequency_response() -> Result<(), ModelError> {
    let f: Vec<f64> = (1..400).map(|k| 1e3 * f64::from(k)).collect();
    // z / (z^2 - 1.8 z + 0.95), measured
    let z = |f: &f64| Complex64::cis(std::f64::consts::TAU * f * INTERVAL_S);
    let g: Vec<Complex64> = f.iter().map(z).map(|z| z / (z * z - 1.8 * z + 0.95)).collect();
    let measured = MeasuredResponse { frequency_hz: &f, transfer: &g, variance: None };
    let fit = vector_fitting(measured, INTERVAL_S, &VectorFitting { order: 2, ..VectorFitting::default() })?;
    println!("vector fitting: {:?}", fit.model.sections[0].a);
    Ok(())
}

fn ringdowns() -> Result<(), ModelError> {
    let (_, y) = data();
    let options = RingdownOptions { modes: 1, real_poles: 0, noise: NoiseSource::White, ..RingdownOptions::default() };
    let mode = fit_ringdowns(&[&y[200..]], &[], INTERVAL_S, &options)?.modes()[0];
    println!(
        "ringdown: {:.2} +- {:.2} Hz, Q {:.3}",
        mode.frequency_hz.value, mode.frequency_hz.std, mode.quality_factor.value
    );
    Ok(())
}
