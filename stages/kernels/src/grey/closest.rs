//! The causal discrete model that is closest to a band-limited input's response.

use faer::{Mat, c64};

use super::discrete::{Delay, Parts, denominators};
use super::evaluation::solved;
use super::fractions::Fractions;
use super::point::Point;
use crate::linear_algebra::Qr;

/// Highest angular frequency per sample of the band, and points of the even grid.
const EDGE: f64 = 0.9 * std::f64::consts::PI;
const GRID: usize = 256;

/// Angular frequencies per sample at which the closest model is sought: an even grid, and each mode's line, which may
/// be narrower than the grid.
fn band(point: &Point) -> Vec<f64> {
    let even = (0..GRID).map(|k| EDGE * (k as f64 + 0.5) / GRID as f64);
    let lines = point.modes.iter().flat_map(|[w, q]| [-0.5, 0.0, 0.5].map(|part| w * (1.0 + part / q)));
    even.chain(lines.filter(|w| *w < EDGE)).collect()
}

/// The grey form's own response from the input that has these gains, without the dead samples.
fn response(point: &Point, gains: &[f64], delay: Delay, omega: f64) -> c64 {
    let s = c64::new(0.0, omega);
    let mode = |(&[w, q], &g): (&[f64; 2], &f64)| c64::new(g * w * w, 0.0) / (s * s + s * (w / q) + w * w);
    let direct = gains.get(point.modes.len()).copied().unwrap_or(0.0);
    let modes = point.modes.iter().zip(gains).map(mode).fold(c64::new(direct, 0.0), |sum, g| sum + g);
    let chain: c64 = point.poles.iter().map(|p| c64::new(*p, 0.0) / (s + p)).product();
    modes * chain * (-s * (delay.whole as f64 + delay.fraction)).exp()
}

/// The response of each numerator coefficient of one, then of D.
fn basis(parts: &Parts, omega: f64) -> Vec<c64> {
    let z = c64::cis(omega);
    let own = |(&order, a): (&usize, &[f64; 2])| match order {
        2 => vec![z / (z * z + z * a[0] + a[1]), (z * z + z * a[0] + a[1]).inv()],
        _ => vec![(z + a[0]).inv()],
    };
    parts.orders.iter().zip(&parts.a).flat_map(own).chain([c64::new(1.0, 0.0)]).collect()
}

/// Numerators by least squares on the response in the band: the response of a band-limited input is that of the system,
/// which no model of finite order has up to half the sample rate.
///
/// Source: L. Ljung, System Identification (1999), section 7.8 (fits of a response).
pub(super) fn closest(point: &Point, fractions: &Fractions, gains: &[f64], feedthrough: bool, delay: Delay) -> Parts {
    let upper: Vec<c64> = fractions.upper.iter().map(|mu| mu.exp()).collect();
    let real: Vec<c64> = fractions.decays.iter().map(|p| c64::new((-p).exp(), 0.0)).collect();
    let (mut parts, _) = denominators(&upper, &real, delay);
    let band = band(point);
    let rows: Vec<Vec<c64>> = band.iter().map(|omega| basis(&parts, *omega)).collect();
    let part = |value: c64, i: usize| if i.is_multiple_of(2) { value.re } else { value.im };
    let count = parts.orders.iter().sum::<usize>() + 1;
    let qr = Qr::new(Mat::from_fn(2 * band.len(), count, |i, j| part(rows[i / 2][j], i)));
    let r = qr.r();
    for gains in gains.chunks(point.modes.len() + usize::from(feedthrough)) {
        let wanted: Vec<c64> = band.iter().map(|omega| response(point, gains, delay, *omega)).collect();
        let mut right = Mat::from_fn(2 * band.len(), 1, |i, _| part(wanted[i / 2], i));
        qr.apply_transpose(right.as_mut());
        let joined = Mat::from_fn(count, count + 1, |i, j| if j < count { r[(i, j)] } else { right[(i, 0)] });
        let found = solved(joined.as_ref(), count, count);
        parts.b.push(by_section(&parts.orders, &found));
        parts.d.push(found[count - 1]);
    }
    parts
}

/// Numerators, two to a section.
fn by_section(orders: &[usize], mut values: &[f64]) -> Vec<[f64; 2]> {
    let next = |&order: &usize| {
        let (own, rest) = values.split_at(order);
        values = rest;
        [own[0], own.get(1).copied().unwrap_or(0.0)]
    };
    orders.iter().map(next).collect()
}

/// Root mean square error of the sections' response in the band, over that of the response; of all inputs the largest.
pub(super) fn response_error(point: &Point, gains: &[f64], per_input: usize, delay: Delay, parts: &Parts) -> f64 {
    let band = band(point);
    let ratio = |(input, gains): (usize, &[f64])| {
        let values: Vec<f64> = parts.numerators(input);
        let (mut error, mut all) = (0.0, f64::MIN_POSITIVE);
        for omega in &band {
            let wanted = response(point, gains, delay, *omega);
            let found: c64 = basis(parts, *omega).iter().zip(&values).map(|(basis, value)| basis * value).sum();
            error += (found - wanted).norm_sqr();
            all += wanted.norm_sqr();
        }
        (error / all).sqrt()
    };
    gains.chunks(per_input).enumerate().map(ratio).fold(0.0, f64::max)
}
