use std::f64::consts::TAU;

use super::*;
use crate::events::BlockMeans;
use crate::fixture::{Lever, white_noise};

const RATE: f64 = 5e6;
const LSB: f64 = 0.977e-3;
/// 22 V/s: 200 nm in half a cycle of 5.58 Hz at 1e7 V/m.
const CONTACT_SLOPE: f64 = 22.0 / RATE;

/// Force curves in volts: free, snap-in, contact up and down, rupture; `cycle` samples each.
struct Curve {
    cycle: usize,
    cycles: usize,
    rupture: bool,
    load: f64,
}

impl Curve {
    fn snap_in(&self, n: usize) -> usize {
        n * self.cycle + self.cycle / 4
    }

    fn snap_off(&self, n: usize) -> usize {
        n * self.cycle + self.cycle * 4 / 5
    }

    fn signal(&self) -> Vec<f64> {
        let ring = Lever::paper().release(12_000, 0.0, -1.0);
        let mut y = vec![0.0; self.cycle * self.cycles];
        for n in 0..self.cycles {
            let (on, off) = (self.snap_in(n), self.snap_off(n));
            let top = on + (off - on) * 2 / 5;
            let top_level = -0.04 + CONTACT_SLOPE * (top - on) as f64;
            let slope_down = (self.load - top_level) / (off - top) as f64;
            for k in on..off {
                let x = (k - on) as f64;
                let swing = 0.04 * (-x / 80.0).exp() * (TAU * x / 30.0).cos();
                let up = CONTACT_SLOPE * x.min((top - on) as f64);
                y[k] = -0.04 + swing + up + if k > top { slope_down * (k - top) as f64 } else { 0.0 };
            }
            let rest = (n + 1) * self.cycle - off;
            for k in 0..rest {
                let fading = self.load * (1.0 - k as f64 / rest as f64);
                y[off + k] = if self.rupture { ring.get(k).map_or(0.0, |value| value * -self.load) } else { fading };
            }
        }
        y
    }
}

fn quantised(signal: &[f64], noise: f64, seed: u64) -> Vec<i16> {
    signal.iter().zip(white_noise(signal.len(), noise, seed)).map(|(y, e)| ((y + e) / LSB).round() as i16).collect()
}

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
    let curve = Curve { cycle: 200_000, cycles: 3, rupture: true, load: -0.9 };
    let signal = curve.signal();
    for seed in 0..4 {
        assert_found(&run(&quantised(&signal, 1.2e-3, seed)), &both(&curve));
    }
    // no noise at all: rounding is the floor
    assert_found(&run(&quantised(&signal, 0.0, 0)), &both(&curve));
}

#[test]
fn hum_drift_spikes_and_clipping_make_no_events() {
    let curve = Curve { cycle: 300_000, cycles: 1, rupture: true, load: -0.9 };
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
    let curve = Curve { cycle: 300_000, cycles: 1, rupture: false, load: -0.5 };
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
