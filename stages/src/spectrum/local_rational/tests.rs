//! Smoothing against the closed form.

use super::*;
use crate::fixture::{Lever, white_noise};
use crate::spectrum::{PolynomialSettings, bin_frequencies, local_polynomial};

const N: usize = 8192;

fn truth() -> (Vec<f64>, Vec<Complex64>) {
    let lever = Lever::paper();
    let f: Vec<f64> = bin_frequencies(N, 5e6).into_iter().filter(|f| *f <= 1.2e6).collect();
    let g = f
        .iter()
        .map(|f| {
            let g = lever.transfer(faer::c64::new(0.0, TAU * f));
            Complex64::new(g.re, g.im)
        })
        .collect();
    (f, g)
}

fn settings(half_width_bins: usize) -> RationalSettings {
    RationalSettings { numerator_order: 2, denominator_order: 2, half_width_bins, transient: None }
}

#[test]
fn probe() {
    let (f, g) = truth();
    let v = vec![0.0; g.len()];
    let bins = Bins { frequency_hz: &f, transfer: &g, variance: &v };
    for m in [4, 6, 8, 10, 12, 16, 24] {
        let start = std::time::Instant::now();
        let s = local_rational(bins, settings(m), &[]).unwrap();
        let worst = s
            .transfer
            .iter()
            .zip(&g)
            .zip(&f)
            .map(|((s, g), f)| ((s - g).norm() / g.norm(), *f))
            .fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
        println!("{m} worst {worst:?} {:?}", start.elapsed());
        for peak in [46.3e3, 247.4e3, 580.8e3, 1051.2e3] {
            let k = (peak / 5e6 * N as f64).round() as usize;
            println!("    {peak} {:e}", s.transfer[k].norm() / g[k].norm() - 1.0);
        }
        let p = local_polynomial(bins, PolynomialSettings { degree: 2, half_width_bins: m, adapt_sigma: None }, &[])
            .unwrap();
        for peak in [46.3e3, 247.4e3, 580.8e3, 1051.2e3] {
            let k = (peak / 5e6 * N as f64).round() as usize;
            println!("    poly {peak} {:e}", p.transfer[k].norm() / g[k].norm() - 1.0);
        }
    }
    // noise
    let noise = white_noise(2 * g.len(), 1e-4, 1);
    for m in [4, 6, 8, 10, 12, 16, 24] {
        let v = vec![2e-8; g.len()];
        let gn: Vec<Complex64> =
            g.iter().enumerate().map(|(k, g)| g + Complex64::new(noise[2 * k], noise[2 * k + 1])).collect();
        let bins = Bins { frequency_hz: &f, transfer: &gn, variance: &v };
        let s = local_rational(bins, settings(m), &[]).unwrap();
        let rms = (s.transfer.iter().zip(&g).map(|(s, g)| (s - g).norm_sqr()).sum::<f64>() / g.len() as f64).sqrt();
        let pred = (s.variance.iter().sum::<f64>() / g.len() as f64).sqrt();
        let p =
            local_polynomial(bins, PolynomialSettings { degree: 2, half_width_bins: m, adapt_sigma: Some(2.0) }, &[])
                .unwrap();
        let prms = (p.transfer.iter().zip(&g).map(|(s, g)| (s - g).norm_sqr()).sum::<f64>() / g.len() as f64).sqrt();
        println!("{m} noise 1.41e-4 rms {rms:e} predicted {pred:e}; adaptive polynomial {prms:e}");
        for peak in [46.3e3, 247.4e3, 580.8e3, 1051.2e3] {
            let k = (peak / 5e6 * N as f64).round() as usize;
            println!(
                "    {peak} rat {:e} {:e} poly {:e} {} ",
                s.transfer[k].norm() / g[k].norm() - 1.0,
                s.variance[k].sqrt() / g[k].norm(),
                p.transfer[k].norm() / g[k].norm() - 1.0,
                p.half_width[k]
            );
        }
    }
}
