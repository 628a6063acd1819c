//! A lower sample rate.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

/// A record at a lower rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Decimated {
    /// What is left.
    pub samples: Vec<f64>,
    /// Place of the first of them in the record.
    pub first: usize,
    /// Their distance in the record.
    pub every: usize,
}

/// Stop band's edge over the pass band's.
const EDGE: f64 = 1.3;
/// Samples that are kept in each period of the pass band's edge: more than twice the stop band's edge.
const A_PERIOD: f64 = 5.0;
/// Bandwidth of the Blackman window's transition times its length in samples.
const TRANSITION: f64 = 5.5;

/// Low-pass filters a record up to `highest_hz` and keeps every so many samples; none where the record is shorter than
/// the filter or its rate is low enough.
///
/// # Model
/// A sum of damped exponentials stays one with the same poles: each is only scaled.
/// # Method
/// Windowed sinc of linear phase, its delay taken out; the filter's half length is lost at either end. Missing samples
/// (NaN) stay missing, with all that the filter mixes them with.
/// # Accuracy
/// Flat to 3e-4 up to `highest_hz`, 74 dB down from 1.3 times that on.
/// # Source
/// A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, 3rd ed., 2010, section 7.5.
pub fn decimate(record: &[f64], rate_hz: f64, highest_hz: f64) -> Option<Decimated> {
    let every = (rate_hz / (A_PERIOD * highest_hz)).floor() as usize;
    let width_hz = (EDGE - 1.0) * highest_hz;
    let half = (0.5 * TRANSITION * rate_hz / width_hz).ceil() as usize;
    if every < 2 || record.len() <= 2 * half {
        return None;
    }
    let cut = (highest_hz + 0.5 * width_hz) / rate_hz;
    let tap = |k: usize| {
        let x = k as f64 - half as f64;
        let sinc = if x == 0.0 { 2.0 * cut } else { (TAU * cut * x).sin() / (PI * x) };
        let phase = PI * k as f64 / half as f64;
        sinc * (0.42 - 0.5 * phase.cos() + 0.08 * (2.0 * phase).cos())
    };
    let taps: Vec<f64> = (0..=2 * half).map(tap).collect();
    let gain: f64 = taps.iter().sum();
    let starts: Vec<usize> = (0..record.len() - 2 * half).step_by(every).collect();
    let filtered = |start: &usize| {
        let window = &record[*start..*start + taps.len()];
        window.iter().zip(&taps).map(|(y, tap)| y * tap).sum::<f64>() / gain
    };
    Some(Decimated { samples: starts.par_iter().map(filtered).collect(), first: half, every })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_below_stays_and_what_lies_above_goes() {
        let rate_hz = 12_800.0;
        let line = |hz: f64| -> Vec<f64> { (0..20_000).map(|k| (TAU * hz * f64::from(k) / rate_hz).cos()).collect() };
        for hz in [20.0, 80.5, 150.0] {
            let lower = decimate(&line(hz), rate_hz, 150.0).expect("long enough");
            assert_eq!(lower.every, 17);
            for (i, value) in lower.samples.iter().enumerate() {
                let k = (lower.first + i * lower.every) as f64;
                let truth = (TAU * hz * k / rate_hz).cos();
                assert!((value - truth).abs() < 3e-4, "{hz} Hz: {value} for {truth}");
            }
        }
        for hz in [196.0, 297.7, 1527.0, 6000.0] {
            let lower = decimate(&line(hz), rate_hz, 150.0).expect("long enough");
            let most = lower.samples.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            // 74 dB
            assert!(most < 3e-4, "{hz} Hz: {most}");
        }
        assert!(decimate(&line(20.0)[..1000], rate_hz, 150.0).is_none(), "shorter than the filter");
        assert!(decimate(&line(20.0), rate_hz, 3000.0).is_none(), "slow enough");
    }
}
