//! Starting poles: spread over the band, or at the peaks.

use faer::c64;

use super::VectorFitting;
use super::basis::Poles;
use super::linear::Points;

/// Damping of starting pairs over their angle, as Gustavsen and Semlyen (1999) advise: weak, for a well-conditioned
/// start.
const DAMPING: f64 = 0.01;
/// Where real starting poles lie: a detector's, decaying within a few samples.
const REAL: (f64, f64) = (0.1, 0.8);

/// Three sets: angles spread linearly and logarithmically over the band, and at the most prominent peaks.
pub(super) fn starting_poles(points: &Points, settings: &VectorFitting) -> Vec<Poles> {
    let pairs = settings.modes.unwrap_or(settings.order / 2);
    let reals = settings.order - 2 * pairs;
    let angles = points.z.iter().map(|z| z.arg().abs());
    let high = angles.clone().fold(0.0, f64::max) * 0.999;
    let low = angles.filter(|angle| *angle > 0.0).fold(high, f64::min).max(1e-3 * high);
    let at = |i: usize, count: usize| (i as f64 + 0.5) / count.max(1) as f64;
    let linear: Vec<f64> = (0..pairs).map(|i| low + (high - low) * at(i, pairs)).collect();
    let logarithmic: Vec<f64> = (0..pairs).map(|i| low * (high / low).powf(at(i, pairs))).collect();
    let mut peaks = peaks(points);
    peaks.truncate(pairs);
    // what the peaks leave over goes between: never two poles in one place
    let rest = pairs - peaks.len();
    peaks.extend((0..rest).map(|i| 1.007 * (low + (high - low) * at(i, rest))));
    [linear, logarithmic, peaks]
        .into_iter()
        .map(|angles| {
            let pair = |angle: f64| c64::from_polar((-DAMPING * angle).exp(), angle);
            let real = |i: usize| c64::new(REAL.0 + (REAL.1 - REAL.0) * at(i, reals), 0.0);
            Poles(angles.into_iter().map(pair).chain((0..reals).map(real)).collect())
        })
        .collect()
}

/// Angles of local maxima of the magnitude, the most prominent first: in a difference, not a ratio, noise where there
/// is no signal hardly stands out.
fn peaks(points: &Points) -> Vec<f64> {
    let size: Vec<f64> = points.g.iter().map(|g| g.norm().max(f64::MIN_POSITIVE)).collect();
    let mut found: Vec<(f64, f64)> = (1..size.len().saturating_sub(1))
        .filter(|&k| size[k] > size[k - 1] && size[k] >= size[k + 1])
        .map(|k| (prominence(&size, k), points.z[k].arg().abs()))
        .collect();
    found.sort_by(|x, y| y.0.total_cmp(&x.0));
    found.into_iter().map(|(_, angle)| angle).collect()
}

/// Height over the higher of the two valleys that part a maximum from higher ground.
fn prominence(size: &[f64], k: usize) -> f64 {
    let valley = |side: &mut dyn Iterator<Item = &f64>| {
        side.take_while(|s| **s <= size[k]).fold(size[k], |least, s| least.min(*s))
    };
    let (left, right) = (valley(&mut size[..k].iter().rev()), valley(&mut size[k + 1..].iter()));
    size[k] - left.max(right)
}
