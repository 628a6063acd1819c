use std::f64::consts::TAU;

use super::*;
use crate::events::block_means::BlockMeans;
use crate::events::curves::{Curve, LSB, RATE, quantised};
use crate::fixture::white_noise;

fn run(codes: &[i16]) -> Detection {
    let mut means = BlockMeans::new(16, LSB, None);
    codes.chunks(10_007).for_each(|chunk| means.push(chunk));
    let rounding_std = LSB / 12f64.sqrt();
    detect(means.means(), &DetectionSettings { level_blocks: 64, significance: 8.0, rounding_std, block_samples: 16 })
}

fn assert_found(detection: &Detection, wanted: &[(usize, EventKind)]) {
    let found: Vec<_> = detection.events.iter().map(|event| (event.block * 16, event.kind)).collect();
    assert_eq!(found.len(), wanted.len(), "found {found:?}, wanted {wanted:?}");
    for (found, wanted) in found.iter().zip(wanted) {
        // the edge is known to two blocks
        assert!(found.1 == wanted.1 && found.0.abs_diff(wanted.0) <= 48, "found {found:?}, wanted {wanted:?}");
    }
}

fn both(curve: &Curve) -> Vec<(usize, EventKind)> {
    (0..curve.cycles)
        .flat_map(|n| [(curve.snap_in(n), EventKind::SnapIn), (curve.snap_off(n), EventKind::SnapOff)])
        .collect()
}

#[test]
fn every_cycle_gives_a_snap_in_and_a_snap_off_and_turning_points_give_none() {
    let curve = Curve { cycle: 200_000, cycles: 3, rupture: true, load: -0.9, fraction: 0.0 };
    let signal = curve.signal();
    for seed in 0..4 {
        assert_found(&run(&quantised(&signal, 1.2e-3, seed)), &both(&curve));
    }
    // no noise at all: rounding is the floor
    assert_found(&run(&quantised(&signal, 0.0, 0)), &both(&curve));
}

#[test]
fn hum_drift_spikes_and_clipping_make_no_events() {
    let curve = Curve { cycle: 300_000, cycles: 1, rupture: true, load: -0.9, fraction: 0.0 };
    for seed in 0..4u64 {
        let phase = seed as f64;
        let mut wander = 0.0;
        let steps = white_noise(300_000, 2e-5, 50 + seed);
        let disturbed: Vec<f64> = (0..)
            .zip(curve.signal().iter().zip(steps))
            .map(|(k, (y, step))| {
                wander += step;
                (y + 0.1 * (TAU * 50.0 * f64::from(k) / RATE + phase).sin() + wander).clamp(-2.0, 0.6)
            })
            .collect();
        let mut codes = quantised(&disturbed, 1.2e-3, seed);
        for (k, height) in
            [(20_000, 2000), (20_001, 2000), (100_003, -1500), (200_031, 900), (290_000, -2000), (74_300, 800)]
        {
            codes[k] += height;
        }
        assert_found(&run(&codes), &both(&curve));
    }
}

#[test]
fn noise_alone_and_curves_without_rupture_hold_no_rupture() {
    for seed in 0..5 {
        assert_found(&run(&quantised(&vec![0.0; 200_000], 1.2e-3, seed)), &[]);
        assert_found(&run(&quantised(&vec![0.0; 200_000], 0.2, seed)), &[]);
    }
    let curve = Curve { cycle: 300_000, cycles: 1, rupture: false, load: -0.5, fraction: 0.0 };
    assert_found(&run(&quantised(&curve.signal(), 1.2e-3, 3)), &[(curve.snap_in(0), EventKind::SnapIn)]);
}

#[test]
fn a_downward_jump_without_contact_is_dismissed_with_its_height() {
    let signal: Vec<f64> = (0..100_000).map(|k| if k < 50_000 { 0.1 } else { -0.3 }).collect();
    let detection = run(&quantised(&signal, 1.2e-3, 1));
    assert!(detection.events.is_empty());
    assert_eq!(detection.dismissed[0].reason, Dismissal::NoContact);
    // 8 times the scale of a jump, 1.2 mV * sqrt(8 / 1024)
    assert!((detection.dismissed[0].jump + 0.4).abs() < 1e-3);
}

#[test]
fn a_step_at_the_very_end_is_not_judged() {
    let signal: Vec<f64> = (0..100_000).map(|k| if k < 99_900 { -0.5 } else { 0.0 }).collect();
    let detection = run(&quantised(&signal, 1.2e-3, 1));
    assert!(detection.events.is_empty());
    assert_eq!(detection.dismissed[0].reason, Dismissal::Unjudged);
}

#[test]
fn records_too_short_for_anything_hold_nothing() {
    for samples in [0, 1, 16, 40, 100, 2000] {
        assert_eq!(run(&vec![7; samples]).events, vec![]);
    }
    let settings = DetectionSettings { level_blocks: 0, significance: 8.0, rounding_std: 0.0, block_samples: 0 };
    assert!(detect(&[f32::NAN; 100], &settings).events.is_empty());
}
