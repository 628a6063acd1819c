//! Modes at the samples: residuals, and multiples of the phase in them.

use std::f64::consts::PI;

use crate::ringdown::moving::blocks::{Compressed, NODES, lagrange};
use crate::ringdown::moving::follow::Options;
use crate::ringdown::moving::model::{MULTIPLES, Mode, paths};
use crate::ringdown::moving::path::path;
use crate::ringdown::moving::search::Fit;
use crate::statistics::chi_square_tail;
use faer::c64;

/// Share of the Nyquist frequency up to which multiples are modelled.
const BELOW_NYQUIST: f64 = 0.9;

/// Multiples of modes that the residuals contain, by mode and place in [`MULTIPLES`].
///
/// Method: each channel's residual on `a^n exp(i n phi)`, chi square of two degrees each.
pub(crate) fn multiples(
    data: &Compressed,
    found: &Fit,
    events: &[Vec<&[f64]>],
    interval_s: f64,
    variances: &[f64],
    options: &Options,
) -> Vec<(usize, usize)> {
    let left = residuals(data, &found.modes, events, interval_s);
    let mut out = Vec::new();
    for (number, mode) in found.modes.iter().enumerate() {
        for (which, multiple) in MULTIPLES.iter().enumerate() {
            let turn = data.carriers[mode.carrier] * *multiple as f64;
            let apart = |other: &f64| (other - turn).abs() > 0.03 * turn;
            if mode.harmonics[which].is_some()
                || turn * interval_s >= BELOW_NYQUIST * PI
                || !data.carriers.iter().all(apart)
            {
                continue;
            }
            let mut sums = vec![(c64::default(), 0.0); data.channels];
            for (hit, rows) in left.iter().enumerate() {
                let Some(wave) = wave(data, mode, hit, *multiple, rows.first().map_or(0, Vec::len), interval_s) else {
                    continue;
                };
                for (sum, row) in sums.iter_mut().zip(rows) {
                    for (y, w) in row.iter().zip(&wave) {
                        sum.0 += w.conj().scale(*y);
                        sum.1 += 0.5 * w.norm_sqr();
                    }
                }
            }
            let gain: f64 = sums.iter().zip(variances).map(|(s, v)| s.0.norm_sqr() / s.1.max(1e-300) / v).sum();
            if chi_square_tail(gain, 2 * data.channels) < 0.5 * options.false_alarm {
                out.push((number, which));
            }
        }
    }
    out
}

/// `a^n exp(i n phi)` of a mode at the samples of a hit.
pub(crate) fn wave(
    data: &Compressed,
    mode: &Mode,
    hit: usize,
    n: usize,
    samples: usize,
    interval_s: f64,
) -> Option<Vec<c64>> {
    let of = &data.hits[hit];
    let path = path(&mode.laws(), mode.starts[hit], &of.times_s)?;
    let (count, power) = (of.blocks.len(), n as f64);
    let turn = data.carriers[mode.carrier] * power;
    let mut out = Vec::with_capacity(samples);
    for (b, (middle, half)) in of.blocks.iter().enumerate() {
        let envelope: [c64; NODES] = std::array::from_fn(|j| {
            let s = &path.nodes[(NODES * b + j) * path.width..];
            c64::cis(power * s[1] + turn * middle).scale((power * s[0]).exp())
        });
        let (from, to) = (b * samples / count, (b + 1) * samples / count);
        let first = from as f64 * interval_s - middle;
        let (mut carrier, step) = (c64::cis(turn * first), c64::cis(turn * interval_s));
        for k in 0..to - from {
            let at = lagrange((first + k as f64 * interval_s) / half);
            let value = (0..NODES).fold(c64::default(), |s, j| s + envelope[j].scale(at[j]));
            out.push(value * carrier);
            carrier *= step;
        }
    }
    Some(out)
}

/// What is left of each sample, offset and slope taken off; missing samples: 0.
pub(crate) fn residuals(
    data: &Compressed,
    modes: &[Mode],
    events: &[Vec<&[f64]>],
    interval_s: f64,
) -> Vec<Vec<Vec<f64>>> {
    if paths(data, modes).is_none() {
        return events.iter().map(|e| e.iter().map(|row| vec![0.0; row.len()]).collect()).collect();
    }
    let of = |hit: usize, channel: usize, row: &[f64]| {
        let mut left = row.to_vec();
        for mode in modes {
            let parts = (0..2).filter_map(|w| Some((MULTIPLES[w], mode.harmonics[w].as_ref()?[channel])));
            for (n, weight) in std::iter::once((1, mode.shape[channel])).chain(parts) {
                let weight = weight.scale(mode.unit);
                let Some(wave) = wave(data, mode, hit, n, row.len(), interval_s) else { continue };
                left.iter_mut().zip(&wave).for_each(|(l, w)| *l -= w.re * weight.re - w.im * weight.im);
            }
        }
        without_drift(&mut left);
        left
    };
    let event = |(hit, rows): (usize, &Vec<&[f64]>)| rows.iter().enumerate().map(|(c, row)| of(hit, c, row)).collect();
    events.iter().enumerate().map(event).collect()
}

pub(crate) fn without_drift(left: &mut [f64]) {
    let middle = 0.5 * (left.len() as f64 - 1.0);
    let (mut n, mut y, mut x, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (k, v) in left.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        let t = (k as f64 - middle) / middle.max(1.0);
        (n, y, x, xx, xy) = (n + 1.0, y + v, x + t, xx + t * t, xy + t * v);
    }
    let square = xx - x * x / f64::max(n, 1.0);
    let slope = if square > 0.0 { (xy - x * y / n) / square } else { 0.0 };
    let offset = if n > 0.0 { (y - slope * x) / n } else { 0.0 };
    for (k, v) in left.iter_mut().enumerate() {
        *v = if v.is_finite() { *v - offset - slope * (k as f64 - middle) / middle.max(1.0) } else { 0.0 };
    }
}
