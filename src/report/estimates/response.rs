//! Frequency response of a state-space model, on a grid that follows its resonances.

use afmid_pipeline::{Matrix, StateSpace};
use num_complex::Complex64;

/// Most points of a curve; models of high order get fewer, so that a page never takes more than a second or two.
const MOST_POINTS: usize = 6_000;

/// Response of the first output to the first input, from `lowest_hz` (default: a ten-thousandth of the Nyquist
/// frequency) up to it.
///
/// Model: `H(z) = C (zI - A)^-1 B + D`, `z = exp(i 2 pi f Ts)`.
/// Method: points equally spaced in log f, then every interval halved whose middle lies off the chord by more than 1 %
/// in magnitude or phase, up to ten times: peaks narrower than the first grid are found as long as their flanks are
/// seen.
/// None: no input or output, no sample time, or A has a pole on every point of the grid.
pub(crate) fn model_curve(model: &StateSpace, lowest_hz: Option<f64>) -> Option<(Vec<f64>, Vec<Complex64>)> {
    let (n, nyquist) = (model.order(), 0.5 / model.sample_time_s);
    if model.validate().is_err() || model.b.columns == 0 || model.c.rows == 0 || !(nyquist.is_finite() && nyquist > 0.0)
    {
        return None;
    }
    let cost = (n.max(8) as f64).powi(3);
    let budget = ((4e8 / cost) as usize).clamp(200, MOST_POINTS);
    let low = lowest_hz.filter(|low| *low > 0.0 && *low < nyquist).unwrap_or(1e-4 * nyquist);
    let at = |f: f64| transfer(model, Complex64::from_polar(1.0, std::f64::consts::TAU * f * model.sample_time_s));
    let first = budget / 6;
    let grid = |k: usize| low * (nyquist / low).powf(k as f64 / first as f64);
    let mut points: Vec<(f64, Option<Complex64>)> = (0..=first).map(|k| (grid(k), at(grid(k)))).collect();
    for _ in 0..10 {
        let refined = refine(&points, &at, budget);
        if refined.len() == points.len() {
            break;
        }
        points = refined;
    }
    let curve: (Vec<f64>, Vec<Complex64>) = points.into_iter().filter_map(|(f, h)| Some((f, h?))).unzip();
    (!curve.0.is_empty()).then_some(curve)
}

fn refine(
    points: &[(f64, Option<Complex64>)],
    at: &dyn Fn(f64) -> Option<Complex64>,
    budget: usize,
) -> Vec<(f64, Option<Complex64>)> {
    let mut out = Vec::with_capacity(points.len() * 2);
    let mut room = budget.saturating_sub(points.len());
    for pair in points.windows(2) {
        let [(f0, h0), (f1, h1)] = pair else { continue };
        out.push((*f0, *h0));
        let (Some(h0), Some(h1)) = (h0, h1) else { continue };
        // neighbours closer than this look like their chord: most intervals are settled without computing their middle
        let turn = (h1 / h0).ln().norm();
        if room == 0 || turn < 0.02 {
            continue;
        }
        let f = (f0 * f1).sqrt();
        let middle = at(f);
        if middle.is_none_or(|h| ((h * h) / (h0 * h1)).ln().norm() > 0.02 || turn > 0.2) {
            out.push((f, middle));
            room -= 1;
        }
    }
    out.extend(points.last());
    out
}

/// `C (zI - A)^-1 B + D` of the first input and output by Gaussian elimination with partial pivoting; none where zI - A
/// is singular.
fn transfer(model: &StateSpace, z: Complex64) -> Option<Complex64> {
    let n = model.order();
    let row = |matrix: &Matrix, row: usize| -> Vec<Complex64> {
        let start = row * matrix.columns;
        matrix.values.iter().skip(start).take(matrix.columns).map(|value| Complex64::new(-value, 0.0)).collect()
    };
    let mut rows: Vec<Vec<Complex64>> = (0..n)
        .map(|k| {
            let mut values = row(&model.a, k);
            if let Some(diagonal) = values.get_mut(k) {
                *diagonal += z;
            }
            values.push(Complex64::new(model.b.at(k, 0), 0.0));
            values
        })
        .collect();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| rows[i][k].norm_sqr().total_cmp(&rows[j][k].norm_sqr()))?;
        rows.swap(k, pivot);
        let (head, tail) = rows.split_at_mut(k + 1);
        let top = &head[k];
        if top[k].norm_sqr() == 0.0 {
            return None;
        }
        for row in tail {
            let factor = row[k] / top[k];
            for (value, above) in row.iter_mut().zip(top).skip(k) {
                *value -= factor * above;
            }
        }
    }
    let mut x = vec![Complex64::new(0.0, 0.0); n];
    for k in (0..n).rev() {
        let known: Complex64 = (k + 1..n).map(|j| rows[k][j] * x[j]).sum();
        x[k] = (rows[k][n] - known) / rows[k][k];
    }
    let h = (0..n).map(|k| x[k] * model.c.at(0, k)).sum::<Complex64>() + model.d.at(0, 0);
    h.is_finite().then_some(h)
}

/// Standard error in radians above which a phase says nothing about its turn: a third of the half turn that unwrapping
/// must tell apart.
const VAGUE_RAD: f64 = 1.0;

/// Phase in degrees without jumps, starting within half a turn of zero; NaN where the response is unknown or zero.
///
/// Method: each value is put on the turn nearest to the last one that is well known. `std_rad` are the phases' standard
/// errors (empty: all are well known): noise, as in the depth of an antiresonance, is put on a turn and never decides
/// on one.
pub(super) fn unwrapped_degrees(transfer: &[Complex64], std_rad: &[f64]) -> Vec<f64> {
    let mut last: Option<f64> = None;
    transfer
        .iter()
        .enumerate()
        .map(|(k, h)| {
            let phase = degrees(*h);
            if phase.is_nan() {
                return phase;
            }
            let phase = last.map_or(phase, |last| near(phase, last));
            if last.is_none() || std_rad.get(k).is_none_or(|std| *std <= VAGUE_RAD) {
                last = Some(phase);
            }
            phase
        })
        .collect()
}

/// Phase in degrees, on the turn that lies nearest to a reference phase: noise never makes it wander off.
pub(super) fn degrees_near(frequency_hz: &[f64], transfer: &[Complex64], reference: (&[f64], &[f64])) -> Vec<f64> {
    let (grid, phases) = reference;
    frequency_hz
        .iter()
        .zip(transfer)
        .map(|(f, h)| {
            let above = grid.partition_point(|have| have < f);
            let below = above.saturating_sub(1);
            let nearer = |k: &usize| grid.get(*k).map_or(f64::INFINITY, |have| (have - f).abs());
            let k = if nearer(&below) <= nearer(&above) { below } else { above };
            match phases.get(k) {
                Some(phase) if phase.is_finite() => near(degrees(*h), *phase),
                _ => f64::NAN,
            }
        })
        .collect()
}

/// How far beyond half a turn a phase may go before it is drawn a turn further up or down: noise about half a turn does
/// not make it jump to and fro.
const BEYOND_DEG: f64 = 45.0;

/// Phases without jumps, put back by whole turns into about half a turn on either side of zero: five modes in a row fall by
/// two and a half turns, which tells no more than the frequencies do.
pub(super) fn within_a_turn(phases: &[f64]) -> Vec<f64> {
    let mut turns = 0.0;
    let mut put = |phase: &f64| {
        if (phase + 360.0 * turns).abs() > 180.0 + BEYOND_DEG {
            turns = -(phase / 360.0).round();
        }
        phase + 360.0 * turns
    };
    phases.iter().map(&mut put).collect()
}

/// The same without a line across each jump by a turn.
pub(super) fn broken_at_jumps(mut phases: Vec<f64>) -> Vec<f64> {
    for k in (1..phases.len()).rev() {
        if (phases[k] - phases[k - 1]).abs() > 180.0 + BEYOND_DEG {
            phases[k] = f64::NAN;
        }
    }
    phases
}

fn degrees(h: Complex64) -> f64 {
    if h.is_finite() && h.norm() > 0.0 { h.arg().to_degrees() } else { f64::NAN }
}

fn near(phase: f64, reference: f64) -> f64 {
    phase + 360.0 * ((reference - phase) / 360.0).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_that_falls_by_many_turns_stays_near_zero_and_its_line_breaks_where_it_jumps() {
        let fall: Vec<f64> = (0..=1080).map(|k| -f64::from(k)).collect();
        let within = within_a_turn(&fall);
        assert!(within.iter().all(|phase| (-225.0..=180.0).contains(phase)), "{within:?}");
        assert!(within.iter().zip(&fall).all(|(a, b)| ((a - b) / 360.0).fract() == 0.0));
        let broken = broken_at_jumps(within);
        assert_eq!(broken.iter().filter(|phase| phase.is_nan()).count(), 3);
        // noise about half a turn
        let flat: Vec<f64> = (0..50).map(|k| 180.0 + 30.0 * f64::from(k).sin()).collect();
        assert_eq!(broken_at_jumps(within_a_turn(&flat)), flat);
    }

    /// One resonance, as a rotation by `angle` shrunk to radius `r`: poles r exp(+-i angle).
    fn resonator(r: f64, angle: f64) -> StateSpace {
        let (c, s) = (r * angle.cos(), r * angle.sin());
        StateSpace {
            a: Matrix { rows: 2, columns: 2, values: vec![c, -s, s, c] },
            b: Matrix::column(vec![1.0, 0.0]),
            c: Matrix::row(vec![0.0, 1.0]),
            d: Matrix::row(vec![0.0]),
            k: Matrix::column(vec![0.0, 0.0]),
            x0: vec![0.0; 2],
            sample_time_s: 2e-7,
            ..StateSpace::default()
        }
    }

    #[test]
    fn the_response_is_the_closed_form() {
        let (r, angle) = (0.9, 0.7);
        let model = resonator(r, angle);
        let (f, h) = model_curve(&model, None).expect("a curve");
        for (f, h) in f.iter().zip(&h) {
            let z = Complex64::from_polar(1.0, std::f64::consts::TAU * f * 2e-7);
            let truth =
                r * angle.sin() / ((z - Complex64::from_polar(r, angle)) * (z - Complex64::from_polar(r, -angle)));
            // rounding of a 2 x 2 solve
            assert!((h - truth).norm() < 1e-12 * truth.norm(), "{f} {h} {truth}");
        }
    }

    #[test]
    fn sharp_peaks_are_resolved() {
        // Q about 5000 at a tenth of the sample rate: a twentieth of the first grid's spacing
        let (r, angle) = (1.0 - 6e-5, 0.628);
        let (_, h) = model_curve(&resonator(r, angle), None).expect("a curve");
        let peak = h.iter().map(|h| h.norm()).fold(0.0, f64::max);
        // at the pole's angle: r sin / ((1 - r) |1 - r exp(-2 i angle)|)
        let truth = r * angle.sin() / ((1.0 - r) * (1.0 - Complex64::from_polar(r, -2.0 * angle)).norm());
        // chords within 1 % in the logarithm miss at most about that much of the top
        assert!((peak / truth - 1.0).abs() < 0.02, "{peak} {truth}");
        assert!(h.len() <= MOST_POINTS);
    }

    #[test]
    fn models_without_a_response_have_no_curve() {
        assert!(model_curve(&StateSpace::default(), None).is_none());
        assert!(model_curve(&StateSpace { sample_time_s: f64::NAN, ..resonator(0.5, 0.1) }, None).is_none());
    }

    #[test]
    fn phases_stay_on_the_turn_of_the_reference() {
        let f: Vec<f64> = (0..200).map(f64::from).collect();
        let h: Vec<Complex64> = f.iter().map(|f| Complex64::from_polar(1.0, -0.1 * f)).collect();
        let truth: Vec<f64> = f.iter().map(|f| (-0.1 * f).to_degrees()).collect();
        let alone = unwrapped_degrees(&h, &[]);
        let guided = degrees_near(&f, &h, (&f, &truth));
        for k in 0..200 {
            assert!((alone[k] - truth[k]).abs() < 1e-9 && (guided[k] - truth[k]).abs() < 1e-9);
        }
        assert!(
            unwrapped_degrees(&[Complex64::new(f64::NAN, 0.0), Complex64::new(0.0, 0.0)], &[])
                .iter()
                .all(|p| p.is_nan())
        );
        assert!(degrees_near(&f, &h, (&[], &[])).iter().all(|p| p.is_nan()));
    }

    #[test]
    fn noise_decides_on_no_turn() {
        // a stretch of vague phases that turn round and round
        let h: Vec<Complex64> = (0..100)
            .map(|k| Complex64::from_polar(1.0, if (40..60).contains(&k) { 2.0 * f64::from(k) } else { -0.5 }))
            .collect();
        let std: Vec<f64> = (0..100).map(|k| if (40..60).contains(&k) { 2.0 } else { 0.01 }).collect();
        let phases = unwrapped_degrees(&h, &std);
        assert!((phases[99] - (-0.5f64).to_degrees()).abs() < 1e-9, "{}", phases[99]);
        assert!(phases.iter().all(|phase| phase.abs() < 220.0));
    }
}
