//! Known truth: levers of two to five modes.

use super::tests::INTERVAL_S;
use super::{CountedRingdown, NoiseSource, RingdownOptions, fit_counted_ringdowns};
use crate::Unwatched;
use crate::fixture::{Lever, white_noise};
use crate::model::ModelError;

/// The first modes of a lever whose fifth is the next of a beam.
fn lever(modes: usize) -> Lever {
    let mut lever = Lever::paper();
    lever.frequency_hz.push(1.66e6);
    lever.quality_factor.push(650.0);
    lever.static_share.push(0.0035);
    lever.frequency_hz.truncate(modes);
    lever.quality_factor.truncate(modes);
    lever.static_share.truncate(modes);
    lever
}

fn counted(modes: usize, events: usize, seed: u64, noise: NoiseSource) -> CountedRingdown {
    let lever = lever(modes);
    let events: Vec<Vec<f64>> = (0..events as u64)
        .map(|e| {
            let noise = white_noise(2049, 1.2e-3, 100 * seed + e);
            let release = lever.release(2049, 0.05 + 0.11 * e as f64, -0.8 - 0.02 * e as f64);
            release[1..].iter().zip(noise).map(|(y, n)| y + 0.01 + n).collect()
        })
        .collect();
    let borrowed: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
    let options = RingdownOptions { noise, ..RingdownOptions::default() };
    fit_counted_ringdowns(&borrowed, &[], INTERVAL_S, 7, &options, &Unwatched).unwrap()
}

/// How many of some seeds give the right number, and the mean square of the modes' errors over their standard errors.
fn right(events: usize, seeds: u64, noise: &NoiseSource) -> Vec<(usize, usize, f64)> {
    let of = |modes: usize| {
        let truth = lever(modes);
        let (mut right, mut square) = (0, 0.0);
        for seed in 0..seeds {
            let found = counted(modes, events, seed, noise.clone());
            if found.modes != modes {
                println!("{modes} modes, {events} events, seed {seed}: {:#?}", found.seen);
                continue;
            }
            right += 1;
            for (mode, f) in found.fit.modes().iter().zip(&truth.frequency_hz) {
                square += ((mode.frequency_hz.value - f) / mode.frequency_hz.std).powi(2) / modes as f64;
            }
        }
        (modes, right, square / right.max(1) as f64)
    };
    let all = (2..=5).map(of).collect();
    println!("{events} events, {noise:?}: {all:.3?} of {seeds}");
    all
}

#[test]
fn several_events_tell_the_number_of_modes() {
    for (modes, right, square) in right(8, 10, &NoiseSource::White) {
        // a mode that is not there is taken once in thousands, one that is there is far above the limit
        assert!(right >= 9, "{modes}: {right} of 10");
        // 9 times 2 to 5 squares of unit normal numbers: at most 30 %; four of these
        assert!((0.2..2.2).contains(&square), "{modes}: {square}");
    }
}

#[test]
fn several_events_tell_it_under_noise_that_is_estimated() {
    for (modes, right, _) in right(6, 6, &NoiseSource::Estimated) {
        assert!(right >= 5, "{modes}: {right} of 6");
    }
}

#[test]
fn one_event_tells_the_number_of_modes() {
    for (modes, right, _) in right(1, 12, &NoiseSource::White) {
        // BIC's false alarms of a mode of four parameters among 2000 samples: below a per cent
        assert!(right >= 11, "{modes}: {right} of 12");
    }
}

#[test]
fn what_was_seen_is_reported() {
    let found = counted(3, 8, 1, NoiseSource::White);
    assert!(found.seen.iter().enumerate().all(|(i, count)| count.modes == i + 1) && found.seen.len() >= 3);
    assert!(found.seen[..3].iter().all(|count| count.held_out.is_finite() && count.bic > count.chi_square));
    assert!(found.seen[2].worse_by < -2.0 && found.seen[0].worse_by.is_nan());
    let one = counted(2, 1, 1, NoiseSource::White);
    assert!(one.seen.iter().all(|count| count.held_out.is_nan()));
}

#[test]
fn none_is_refused() {
    let y = white_noise(400, 1.0, 1);
    let found = fit_counted_ringdowns(&[&y], &[], INTERVAL_S, 0, &RingdownOptions::default(), &Unwatched);
    assert!(matches!(found, Err(ModelError::Parameter { .. })));
}
