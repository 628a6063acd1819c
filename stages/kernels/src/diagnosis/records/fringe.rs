//! Light that interferes: the free level waves with the position.

use std::f64::consts::PI;

use super::basis::{legendre, span};
use super::free_level::{FreeLevel, FreeRecord, HeldOut};
use super::fringe_fit::fit_fringe;
use super::position::Candidate;
use super::replicates::t_test;
use super::sign::{RecordSign, gain, value};
use super::yardstick::of_many;

/// Highest degree in the position that is asked for.
const HIGHEST_DEGREE: usize = 5;

/// A wave in the position, alike in all records.
///
/// # Method
/// The free level on Legendre polynomials of the position, lower ones projected out; t tests over records of degrees 2
/// to 5: a bend is what a straight line can't give. Then a wave by least squares.
pub(super) fn fringe(level: &FreeLevel) -> Option<Candidate> {
    let track = level.records.iter().map(|record| span(&record.position_m));
    let common = track.fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let degrees: Vec<f64> = (2..=HIGHEST_DEGREE).map(|degree| bend_p(&level.records, common, degree)).collect();
    let fit = fit_fringe(&level.records, None)?;
    let held_out = fringe_held_out(level, None);
    let (before, after) = held_out.rms();
    let sign = RecordSign {
        id: "interference-fringe",
        p_value: of_many(degrees.iter().copied().fold(1.0, f64::min), degrees.len()),
        parameters: vec![
            ("amplitude_v", value(fit.amplitude_v.0, fit.amplitude_v.1, "V")),
            ("wavelength_m", value(fit.wavelength_m.0, fit.wavelength_m.1, "m")),
            ("phase", value(fit.phase.0, fit.phase.1, "rad")),
        ],
        evidence: format!(
            "the free level waves with the piezo position, by {:.2e} V, alike in {} records",
            fit.amplitude_v.0,
            level.records.len()
        ),
        gain: gain(before, after, "free stretches of the other half of the records"),
        runner_up: None,
        tied: false,
    };
    let wavenumber = 4.0 * PI / fit.wavelength_m.0;
    let columns = move |record: &FreeRecord| {
        let (sines, cosines) = record.position_m.iter().map(|z| (wavenumber * z).sin_cos()).unzip();
        // the straight line goes with it: what is left of a wave longer than the travel is mostly that
        vec![sines, cosines, record.position_m.clone()]
    };
    Some(Candidate { sign, held_out, columns: Box::new(columns) })
}

fn bend_p(records: &[FreeRecord], common: (f64, f64), degree: usize) -> f64 {
    let factor = |record: &FreeRecord| {
        let lower: Vec<Vec<f64>> = (1..degree).map(|d| legendre(&record.position_m, common, d)).collect();
        record.factor(&legendre(&record.position_m, common, degree), &lower)
    };
    t_test(&records.iter().filter_map(factor).collect::<Vec<_>>())
}

/// What a fringe fitted to the records of the other parity takes off each record; its wavelength bounded, if `light` is
/// given.
pub(super) fn fringe_held_out(level: &FreeLevel, light: Option<(f64, f64)>) -> HeldOut {
    let fits = [1, 0].map(|other| fit_fringe(level.half(other), light));
    HeldOut::new(level, |parity, record| fits[parity].as_ref().map(|fit| fit.shape(&record.position_m)))
}
