use super::*;
use crate::fixture::{Lever, white_noise};

#[test]
fn quick() {
    let lever = Lever::paper();
    let y0 = lever.release(8192, 1200.3, -0.8);
    let u: Vec<f64> = (0..8192).map(|k| if k <= 1200 { -0.8 } else { 0.0 }).collect();
    for noise in [0.0, 1e-4] {
        let y: Vec<f64> = y0.iter().zip(white_noise(8192, noise, 1)).map(|(y, n)| y + n).collect();
        let t = std::time::Instant::now();
        let fit = identify(&[Experiment { input: &u, output: &y }], 2e-7, &PemOptions::default()).unwrap();
        println!("{:?} {:?} {:e}", t.elapsed(), fit.verdict, fit.innovation_variance);
        for s in &fit.model.sections {
            for z in s.poles() {
                let s = z.ln() * 5e6;
                println!("  {} {:.8e} {:.6}", z, s.norm() / std::f64::consts::TAU, -s.norm() / 2.0 / s.re);
            }
        }
    }
}
