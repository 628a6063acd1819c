//! A release at a given instant against closed forms, and against the release that the microscope makes by itself.

use super::*;
use crate::causes::{Effects, Instant, find};
use crate::fixture::Lever as ClosedForm;

const AT: Instant = Instant { record: 0, place: 0.0, time_s: 0.0, piezo_m: 0.0 };
const CUT: Cut = Cut { before: 16, samples: 4000 };

#[test]
fn a_release_between_two_samples_is_the_closed_form() {
    let (microscope, closed) = (Afm::default().microscope(), ClosedForm::paper());
    for (amplitude_v, lead) in [(0.9, 0.0), (0.9, 0.37), (-0.4, 0.8), (1.3, -1.6), (0.9, 2.25)] {
        let release = Release { amplitude_v, lead_s: 0.2e-6 * lead, at: AT };
        let found = microscope.released(&release, &Effects::default(), CUT);
        let truth = closed.release(CUT.samples, 16.0 - lead, -amplitude_v);
        let worst = found.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // exact propagation; the closed form's residues are good to 1e-9
        assert!(worst < 1e-7, "{amplitude_v} {lead} {worst:e}");
    }
}

/// What causes change, by a release that is let go and by one that tears off on the moving ramp.
#[test]
fn what_causes_change_is_that_of_the_microscopes_own_release() {
    let afm = Afm { ramp_hz: 2.0, ..Afm::default() };
    let microscope = afm.microscope();
    let place = Place { record: 0, records: 2, samples: 200_000, margin_samples: 0, seed: 1 };
    for (id, values) in [
        ("quadratic-detector", vec![0.02]),
        ("tether-tail", vec![0.02, 8e-5]),
        ("duffing", vec![0.001]),
        ("finite-rupture", vec![1.28e-6]),
    ] {
        let mut effects = Effects::default();
        let cause = find(id).expect("a cause");
        cause.add(&values, &mut effects);
        let nothing = Effects::default();
        let own = |effects: &Effects| microscope.quiet_release(330e-9, effects, place, CUT).expect("a release");
        let amplitude_v = 330e-9 / 3.8 * 1e7;
        let given = |effects: &Effects| {
            microscope.released(&Release { amplitude_v, lead_s: 0.0, at: AT }, effects, CUT)
        };
        let change = |with: Vec<f64>, without: Vec<f64>| -> Vec<f64> {
            with.iter().zip(&without).map(|(a, b)| a - b).collect()
        };
        let (a, b) = (change(own(&effects), own(&nothing)), change(given(&effects), given(&nothing)));
        let size = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let worst = a.iter().zip(&b).skip(CUT.before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // the ramp's base moves by 0.64 nm meanwhile, 6 mV of 0.87 V, and what a map of the signal adds changes by twice that share
        assert!(size > 1e-3 && worst < 0.03 * size, "{id}: {worst:e} of {size:e}");
    }
}
