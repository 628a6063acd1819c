use super::*;
use crate::fixture::{Lever, white_noise};

const SETTINGS: AveragingSettings = AveragingSettings {
    correlation_samples: 256,
    max_shift_samples: 32,
    max_iterations: 20,
    tolerance_samples: 1e-3,
    min_correlation: 0.8,
};
const ONSET: usize = 400;

/// Scattered releases: true shifts, and the segments.
fn ensemble(count: usize, spread: f64, seed: u64) -> (Vec<f64>, Vec<Vec<f64>>) {
    let lever = Lever::paper();
    let draws = white_noise(3 * count, 1.0, 1000 + seed);
    let shifts: Vec<f64> = (0..count).map(|k| 2.0 * draws[3 * k]).collect();
    let segments = (0..count)
        .map(|k| {
            let load = -0.9 * (1.0 + spread * draws[3 * k + 1]).max(0.1);
            let noise = white_noise(1000, 1.2e-3, 100 * seed + k as u64);
            let signal = lever.release(1000, ONSET as f64 + shifts[k], load);
            signal
                .iter()
                .zip(noise)
                .zip(0..)
                .map(|((y, e), n)| y + e + 0.05 * draws[3 * k + 2] - 4.5e-6 * f64::from(n))
                .collect()
        })
        .collect();
    (shifts, segments)
}

fn errors(shifts: &[f64], averaging: &Averaging) -> Vec<f64> {
    let difference: Vec<f64> = shifts
        .iter()
        .zip(&averaging.events)
        .filter_map(|(truth, event)| event.ok().map(|event| event.shift - truth))
        .collect();
    let mean = difference.iter().sum::<f64>() / difference.len() as f64;
    difference.iter().map(|error| error - mean).collect()
}

#[test]
fn releases_of_scattered_amplitude_are_aligned_to_hundredths_of_a_sample() {
    for (seed, spread) in [(1, 0.06), (2, 0.3), (3, 0.3)] {
        let (shifts, segments) = ensemble(24, spread, seed);
        let averaging = correlation_average(&segments, ONSET, &SETTINGS);
        assert!(averaging.events.iter().all(Result::is_ok));
        assert!(averaging.last_change_samples <= 1e-3 && averaging.iterations <= 8, "{averaging:?}");
        let worst = errors(&shifts, &averaging).iter().fold(0.0f64, |worst, error| worst.max(error.abs()));
        println!("spread {spread}: worst shift error {worst:.4} samples, {} iterations", averaging.iterations);
        // 0.0024 rms at full amplitude (shift_refinement), three times that at a third of it, four sigma
        assert!(worst < 0.03, "{worst}");
        assert!(averaging.events.iter().flatten().all(|event| event.correlation > 0.999));
    }
}

#[test]
fn strangers_leave_and_do_not_spoil_the_rest() {
    let (shifts, mut segments) = ensemble(12, 0.1, 5);
    // a step without ringing, a burst of noise, a constant, a short one
    segments[1] = (0..1000).map(|k| if k < ONSET { -2.0 } else { 0.0 }).collect();
    segments[4] = white_noise(1000, 0.5, 77);
    segments[7] = vec![0.3; 1000];
    segments[9].truncate(500);
    let averaging = correlation_average(&segments, ONSET, &SETTINGS);
    let left: Vec<usize> = (0..12).filter(|&k| averaging.events[k].is_err()).collect();
    assert_eq!(left, vec![1, 4, 7, 9]);
    assert!(matches!(averaging.events[1], Err(Misfit::Correlation(value)) if value < 0.8));
    assert_eq!(averaging.events[7], Err(Misfit::Incomparable));
    // as above
    assert!(errors(&shifts, &averaging).iter().all(|error| error.abs() < 0.03));
}

#[test]
fn one_event_is_its_own_average_and_none_is_none() {
    let (_, segments) = ensemble(1, 0.0, 8);
    let event = correlation_average(&segments, ONSET, &SETTINGS).events[0].unwrap();
    assert!(event.shift.abs() < 1e-9 && event.correlation > 1.0 - 1e-9, "{event:?}");
    assert!(correlation_average(&[], ONSET, &SETTINGS).events.is_empty());
    assert_eq!(correlation_average(&segments, 3, &SETTINGS).events, vec![Err(Misfit::Incomparable)]);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (_, segments) = ensemble(10, 0.1, 9);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| correlation_average(&segments, ONSET, &SETTINGS))
    };
    assert_eq!(on(1), on(4));
}
