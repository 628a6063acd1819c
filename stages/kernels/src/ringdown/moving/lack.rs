//! What the fit leaves round a line, over what noise leaves there.

use crate::ringdown::moving::blocks::{COLUMNS, Compressed, Pattern};
use crate::ringdown::moving::model::{Mode, Probe, normal, paths, rows_of};
use crate::ringdown::moving::search::Fit;
use crate::ringdown::moving::select::scored;
use crate::statistics::chi_square_tail;

/// Polynomials of the score test.
const POLYNOMIALS: usize = 5;
/// Probability with which noise alone is called a lack of fit.
const LEVEL: f64 = 1e-3;

/// What is left round a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lack {
    /// Factor by which the variance of estimates exceeds that of noise alone; 1 where noise may leave as much.
    pub factor: f64,
    /// Probability that noise leaves as much, the less of both tests.
    pub p_value: f64,
    /// Mean square of what the laws leave as functions of the amplitude, in units of noise.
    pub along: f64,
    /// Mean square of what is left in the line's band, in units of noise.
    pub band: f64,
}

/// Two tests: deviations of log amplitude and phase that are smooth functions of the squared amplitude (score test),
/// and the energy in the span of the line's carrier.
pub fn lack(data: &Compressed, fit: &Fit, weights: &[f64], mode: usize) -> Lack {
    let (gain, degrees) = smooth(data, fit, weights, mode).unwrap_or((0.0, 1));
    let (energy, rows) = band(data, fit, weights, fit.modes[mode].carrier).unwrap_or((0.0, 0));
    let (along, wide) = (gain / degrees as f64, if rows > 0 { energy / rows as f64 } else { 1.0 });
    // of a gain that is no number nothing is known
    let p_along = chi_square_tail(gain.max(0.0), degrees);
    let p_wide = if rows > 0 { chi_square_tail(energy, rows) } else { 1.0 };
    let by_along = if p_along < LEVEL { along.max(1.0) } else { 1.0 };
    let by_band = if p_wide < LEVEL { 1.0 + (wide - 1.0).max(0.0) * data.records.len() as f64 } else { 1.0 };
    Lack { factor: by_along.max(by_band), p_value: p_along.min(p_wide), along, band: wide }
}

fn smooth(data: &Compressed, fit: &Fit, weights: &[f64], mode: usize) -> Option<(f64, usize)> {
    let mut wide: Vec<Mode> = fit.modes.clone();
    let paths = paths(data, &fit.modes)?;
    let square = |log: f64| (2.0 * log).exp();
    let high = wide[mode].starts.iter().map(|s| square(s.0)).fold(0.0, f64::max);
    let last = |p: &crate::ringdown::moving::path::Path| {
        p.nodes.len().checked_sub(p.width).map_or(high, |at| square(p.nodes[at]))
    };
    let low = paths[mode].iter().map(last).fold(high, f64::min);
    wide[mode].probe = Some(Probe { count: POLYNOMIALS, between: (low, high) });
    let base: usize = wide[..mode].iter().map(Mode::count).sum();
    let new: Vec<usize> = wide[mode].probe_places().map(|p| base + p).collect();
    let normal = normal(data, &wide, weights)?;
    let old: Vec<usize> = (0..normal.score.len()).filter(|i| !new.contains(i)).collect();
    scored(&normal.information, &normal.score, &old, &new)
}

/// Weighted energy of what is left in the span of a carrier's columns, and its degrees of freedom.
fn band(data: &Compressed, fit: &Fit, weights: &[f64], carrier: usize) -> Option<(f64, usize)> {
    let paths = paths(data, &fit.modes)?;
    let bases: Vec<Vec<Vec<f64>>> = data.patterns.iter().map(|p| basis(p, carrier)).collect();
    let (mut energy, mut columns) = (0.0, 0_usize);
    for record in &data.records {
        let left = rows_of(data, record, &fit.modes, &paths).left;
        let mut from = 0;
        for block in &record.blocks {
            let rows = data.patterns[block.pattern].rows;
            for unit in &bases[block.pattern] {
                let share: f64 = unit.iter().zip(&left[from..from + rows]).map(|(u, l)| u * l).sum();
                energy += weights[record.channel] * share * share;
                columns += 1;
            }
            from += rows;
        }
    }
    let used: usize = fit.modes.iter().filter(|m| m.carrier == carrier).map(Mode::count).sum();
    let degrees = columns.checked_sub(used).filter(|degrees| *degrees >= 2)?;
    Some((energy, degrees))
}

/// Orthonormal basis of a carrier's columns of R.
fn basis(pattern: &Pattern, carrier: usize) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = Vec::new();
    for k in 0..COLUMNS {
        let mut column: Vec<f64> =
            (0..pattern.rows).map(|i| pattern.r[i * pattern.columns + carrier * COLUMNS + k]).collect();
        let full = column.iter().map(|v| v * v).sum::<f64>().sqrt();
        for _ in 0..2 {
            for unit in &out {
                let share: f64 = unit.iter().zip(&column).map(|(u, c)| u * c).sum();
                column.iter_mut().zip(unit).for_each(|(c, u)| *c -= share * u);
            }
        }
        let size = column.iter().map(|v| v * v).sum::<f64>().sqrt();
        if size > 1e-6 * full && size > 0.0 {
            column.iter_mut().for_each(|c| *c /= size);
            out.push(column);
        }
    }
    out
}
