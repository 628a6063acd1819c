use super::*;
use crate::monitor::Unwatched;

#[test]
fn bench_dev() {
    let read = |p: &str| -> Vec<f64> {
        std::fs::read(p).unwrap().chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect()
    };
    let (u, y) = (read("/tmp/wh_u.f64"), read("/tmp/wh_y.f64"));
    let t = std::time::Instant::now();
    let o = BlockOptions { transient: 1000, ..BlockOptions::default() };
    let fit = fit_block_oriented(&u[5200..105200], &y[5200..105200], &o, &Unwatched).unwrap();
    println!("{:?} {} {}", t.elapsed(), fit.training_rms, fit.linear_rms);
    for t in &fit.tried { println!("{t:?}"); }
    let s = fit.model.simulate(&u[105200..184000]);
    let e: f64 = s.iter().zip(&y[105200..184000]).skip(1000).map(|(a, b)| (a - b).powi(2)).sum();
    println!("test rms {} mV", 1e3 * (e / 77800.0).sqrt());
    println!("{:?} {:?}", fit.poles(), fit.curve_strength());
    println!("{:?}\n{:?}", fit.model.curve.knots(), fit.model.curve.values());
}
