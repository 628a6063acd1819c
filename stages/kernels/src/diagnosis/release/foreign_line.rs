//! Foreign lines that run through events.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::joint::JointFit;
use super::problem::Problem;
use super::residuals::residuals;
use super::window::EventWindow;

/// Periods of a line that a window must hold: slower ones are in the events' own offsets and slopes.
const LEAST_PERIODS: f64 = 4.0;

/// The windows less sines of those frequencies, Hz, each of the amplitude and phase that a baseline's residual shows in
/// its event; those too slow for the windows stay. None where nothing is taken off.
///
/// # Method
/// Least squares, event by event. Ten events' phases are never quite evenly spread: what is left of the line in their
/// weighted mean would be named for a resonance.
pub fn without_lines(problem: &Problem<'_>, baseline: &JointFit, frequencies_hz: &[f64]) -> Option<Vec<EventWindow>> {
    let cut = problem.cut;
    let length_s = cut.samples as f64 * cut.interval_s;
    let lines: Vec<f64> = frequencies_hz.iter().copied().filter(|f| f * length_s > LEAST_PERIODS).collect();
    if lines.is_empty() {
        return None;
    }
    let left = residuals(problem, &baseline.state, &baseline.starts);
    let one = |((window, residual), start): ((&EventWindow, &Vec<f64>), &usize)| {
        let mut less = window.clone();
        let mut residual = residual.clone();
        for frequency in &lines {
            let turn = TAU * frequency * cut.interval_s;
            let [cosine, sine] = sine_in(&residual, turn);
            let at = |k: f64| cosine * (turn * k).cos() + sine * (turn * k).sin();
            residual.iter_mut().enumerate().for_each(|(k, r)| *r -= at(k as f64));
            less.values.iter_mut().enumerate().for_each(|(k, v)| *v -= at(k as f64 - *start as f64));
        }
        less
    };
    Some(problem.windows.par_iter().zip(&left).zip(&baseline.starts).map(one).collect())
}

/// Cosine and sine parts of that many radians a sample, by least squares.
fn sine_in(values: &[f64], turn: f64) -> [f64; 2] {
    let (mut cc, mut cs, mut ss, mut yc, mut ys) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (k, y) in values.iter().enumerate() {
        let (s, c) = (turn * k as f64).sin_cos();
        (cc, cs, ss) = (cc + c * c, cs + c * s, ss + s * s);
        (yc, ys) = (yc + y * c, ys + y * s);
    }
    let determinant = cc * ss - cs * cs;
    if determinant > 0.0 { [(ss * yc - cs * ys) / determinant, (cc * ys - cs * yc) / determinant] } else { [0.0; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_is_found_with_its_phase() {
        let values: Vec<f64> =
            (0..500).map(|k| 0.3 * (0.2 * f64::from(k)).cos() - 0.1 * (0.2 * f64::from(k)).sin()).collect();
        let [cosine, sine] = sine_in(&values, 0.2);
        assert!((cosine - 0.3).abs() < 1e-12 && (sine + 0.1).abs() < 1e-12, "{cosine} {sine}");
    }
}
