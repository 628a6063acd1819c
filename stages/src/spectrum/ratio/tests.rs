//! The estimate against the closed form.

use super::*;
use crate::fixture::{Lever, white_noise};
use crate::spectrum::{Taper, taper};

const N: usize = 8192;
const T0: usize = 1024;
const LOAD: f64 = -0.9;

fn settings(ends: EndTreatment) -> EtfeSettings {
    EtfeSettings {
        sample_rate_hz: 5e6,
        bandwidth_hz: 1.2e6,
        vanishing_ratio: 0.05,
        ends,
        intersample: Intersample::Held,
        normalise: true,
    }
}

fn step(samples: usize) -> Vec<f64> {
    (0..samples).map(|k| if k < T0 { LOAD } else { 0.0 }).collect()
}

fn truth(frequency_hz: f64) -> Complex64 {
    let g = Lever::paper().transfer(faer::c64::new(0.0, TAU * frequency_hz));
    Complex64::new(g.re, g.im)
}

/// Largest and root-mean-square relative error over a band.
fn errors(got: &Etfe, from_hz: f64, to_hz: f64) -> (f64, f64) {
    let errors: Vec<f64> = got
        .frequency_hz
        .iter()
        .zip(&got.transfer)
        .filter(|(f, _)| (from_hz..=to_hz).contains(*f))
        .map(|(f, g)| (g - truth(*f)).norm() / truth(*f).norm())
        .collect();
    (
        errors.iter().copied().fold(0.0, f64::max),
        (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt(),
    )
}

#[test]
fn probe() {
    for n in [N, 4 * N] {
        let u = step(n);
        let y = Lever::paper().release(n, T0 as f64, LOAD);
        let se = vec![0.0; n];
        let d = etfe(&u, &y, &se, settings(EndTreatment::Differenced)).unwrap();
        let w = taper(Taper::Tukey { alpha: 0.1 }, n).unwrap();
        let uw: Vec<f64> = u.iter().zip(&w).map(|(a, b)| a * b).collect();
        let yw: Vec<f64> = y.iter().zip(&w).map(|(a, b)| a * b).collect();
        let p = etfe(&uw, &yw, &se, settings(EndTreatment::Windowed)).unwrap();
        for (name, e) in [("differenced", &d), ("tukey", &p)] {
            println!("{n} {name} vanish {} G0 {}", e.vanishing, e.transfer[0]);
            for (a, b) in [
                (10e3, 40e3),
                (40e3, 52e3),
                (52e3, 230e3),
                (230e3, 260e3),
                (260e3, 560e3),
                (560e3, 600e3),
                (600e3, 1.03e6),
                (1.03e6, 1.07e6),
                (1.07e6, 1.2e6),
            ] {
                println!("   {a} {b} {:?}", errors(e, a, b));
            }
        }
    }
}
