//! How strongly the force may change: maximum likelihood.

use super::filter::{Filtered, Strengths, filter};
use super::system::Augmented;

/// Log-likelihood of a pass of the filter; the noise variance is given, or the best one is taken.
pub(super) fn log_likelihood(pass: &Filtered, noise_variance: Option<f64>) -> (f64, f64) {
    let n = pass.count.max(1) as f64;
    let variance = noise_variance.unwrap_or(pass.squares / n).max(f64::MIN_POSITIVE);
    let value = -0.5 * (n * variance.ln() + pass.logarithms + pass.squares / variance);
    (if value.is_finite() { value } else { f64::NEG_INFINITY }, variance)
}

/// Found strengths.
pub(super) struct Found {
    pub strengths: Strengths,
    pub noise_variance: f64,
    pub evaluations: usize,
    /// Whether a walk has become so weak that the data cannot tell it from none.
    pub walk_at_limit: bool,
}

/// Steps of the logarithm (base ten): first bracket, then parabola.
const FIRST_STEP: f64 = 1.5;
/// A walk of this step per sample moves by a hundredth of the noise over 1e4 samples.
const WEAKEST: f64 = 1e-4;
const STRONGEST: f64 = 1e8;

/// Maximises the likelihood over both walks and the jump, one after the other, twice; a parabola through the best three
/// ends each search.
pub(super) fn strongest(system: &Augmented, y: &[f64], start: Strengths, noise_variance: Option<f64>) -> Found {
    let mut evaluations = 0;
    let mut strengths = start;
    let mut value = |strengths: &Strengths| {
        evaluations += 1;
        log_likelihood(&filter(system, y, strengths, false), noise_variance).0
    };
    let weakest = if system.size == system.order + 1 { WEAKEST } else { 1e-4 * WEAKEST };
    let has_jump = !strengths.transition.is_empty();
    // without an event there is one walk
    let sides = if has_jump { 2 } else { 1 };
    for step in [FIRST_STEP, FIRST_STEP / 4.0].into_iter().take(if has_jump { 2 } else { 1 }) {
        for side in 0..sides {
            let found = search(strengths.walk[side], step, weakest, |walk| {
                let mut tried = strengths.clone();
                tried.walk[side] = walk;
                if sides == 1 {
                    tried.walk = [walk; 2];
                }
                value(&tried)
            });
            strengths.walk[side] = found;
            if sides == 1 {
                strengths.walk = [found; 2];
            }
        }
        if has_jump {
            strengths.jump =
                search(strengths.jump, step, WEAKEST, |jump| value(&Strengths { jump, ..strengths.clone() }));
        }
    }
    let variance = log_likelihood(&filter(system, y, &strengths, false), noise_variance).1;
    let walk_at_limit = strengths.walk.iter().any(|walk| *walk <= 2.0 * weakest);
    Found { strengths, noise_variance: variance, evaluations: evaluations + 1, walk_at_limit }
}

/// Maximum over the logarithm of a strength: steps until it falls on both sides, then the vertex of a parabola.
fn search(start: f64, step: f64, weakest: f64, mut value: impl FnMut(f64) -> f64) -> f64 {
    let (least, most) = (weakest.log10(), STRONGEST.log10());
    let mut at = |x: f64| value(10.0_f64.powf(x));
    let centre = start.log10().clamp(least, most);
    let mut points = vec![(centre, at(centre))];
    for direction in [1.0, -1.0] {
        let mut x = centre;
        loop {
            x += direction * step;
            if !(least..=most).contains(&x) {
                break;
            }
            let there = at(x);
            let best = points.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
            points.push((x, there));
            if there <= best {
                break;
            }
        }
        // the other side is known already where the first step fell on the way up
        let best = points.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(centre, |p| p.0);
        if direction > 0.0 && best > centre {
            break;
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = (0..points.len()).max_by(|&a, &b| points[a].1.total_cmp(&points[b].1)).unwrap_or(0);
    if best == 0 || best + 1 == points.len() {
        return 10.0_f64.powf(points[best].0);
    }
    let (l, c, r) = (points[best - 1], points[best], points[best + 1]);
    let (dl, dr) = ((c.1 - l.1) / (c.0 - l.0), (r.1 - c.1) / (r.0 - c.0));
    // slopes at the middles of two intervals: zero in between
    let bend = dr - dl;
    let vertex = if bend < 0.0 { 0.5 * (l.0 + c.0) - dl * 0.5 * (r.0 - l.0) / bend } else { c.0 };
    if !vertex.is_finite() {
        return 10.0_f64.powf(c.0);
    }
    let vertex = vertex.clamp(l.0, r.0);
    if at(vertex) >= c.1 { 10.0_f64.powf(vertex) } else { 10.0_f64.powf(c.0) }
}
