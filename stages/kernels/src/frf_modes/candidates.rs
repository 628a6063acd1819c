//! Where modes may be: poles that are stable over the orders, and what a fit leaves.

use faer::c64;
use rayon::prelude::*;

use super::FrfModesOptions;
use super::data::Lines;
use super::polynomial::Diagram;

/// Distance in half widths below which two starts are one.
const SAME: f64 = 0.3;
/// Candidates at most. Why: of a mode several starts remain, and modes are tens.
const MOST: usize = 60;
/// Orders at which a pole must be stable. Why: as in `model.stabilisation`, noise seldom keeps a pole for four.
const ORDERS: usize = 4;
/// Half widths on either side over which a trial pole is compared with the residual.
const REACH: f64 = 6.0;
/// Ratio of one trial half width to the next.
const RATIO: f64 = 1.6;
/// Trial poles of the residual at most.
const FEW: usize = 6;

/// Stable poles, those of most orders first, each once.
pub(super) fn stable(diagram: &Diagram, options: &FrfModesOptions) -> Vec<c64> {
    let listed = diagram.found.poles.iter().zip(&diagram.poles);
    let good = listed.filter(|(pole, _)| pole.stable() && pole.quality_factor() >= options.least_quality_factor);
    let all: Vec<(usize, c64)> = good.map(|(_, own)| *own).collect();
    let count = |s: c64| {
        let mut orders: Vec<usize> = all.iter().filter(|(_, t)| same(s, *t)).map(|(order, _)| *order).collect();
        orders.dedup();
        orders.len()
    };
    // of poles that are alike the one of the highest order: noise has its own poles there
    let mut counted: Vec<(usize, usize, c64)> = all.iter().map(|(order, s)| (count(*s), *order, *s)).collect();
    counted.retain(|(count, ..)| *count >= ORDERS);
    counted.sort_by(|x, y| y.0.cmp(&x.0).then(y.1.cmp(&x.1)).then(x.2.im.total_cmp(&y.2.im)));
    thinned(counted.into_iter().map(|(.., s)| s), MOST)
}

/// Whether two poles are one start.
pub(super) fn same(a: c64, b: c64) -> bool {
    (a - b).norm() < SAME * a.re.abs().max(b.re.abs())
}

fn thinned(all: impl Iterator<Item = c64>, most: usize) -> Vec<c64> {
    let mut kept: Vec<c64> = Vec::new();
    for s in all {
        if kept.len() < most && !kept.iter().any(|t| same(s, *t)) {
            kept.push(s);
        }
    }
    kept
}

/// Poles that explain most of what is left, each by itself: a matched filter over half widths and frequencies.
pub(super) fn of_residual(lines: &Lines, left: &[Vec<c64>], options: &FrfModesOptions) -> Vec<c64> {
    let (first, last) = (lines.frequency_hz[0], lines.frequency_hz[lines.len() - 1]);
    let spacing = lines.spacing_hz();
    let widest = 0.5 * last / options.least_quality_factor.max(4.0);
    let widths: Vec<f64> =
        std::iter::successors(Some(0.5 * spacing), |w| Some(w * RATIO)).take_while(|w| *w < widest).collect();
    let mut all: Vec<(f64, c64)> = widths
        .par_iter()
        .flat_map_iter(|&width| {
            let count = ((last - first) / width) as usize;
            (0..=count).map(move |i| {
                let f = first + width * i as f64;
                let s = std::f64::consts::TAU * c64::new(-width, f);
                (matched(lines, left, s, (REACH * width).max(2.0 * spacing)), s)
            })
        })
        .collect();
    all.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.im.total_cmp(&y.1.im)));
    // trial poles that lie within the width of a better one are its flanks
    let mut kept: Vec<c64> = Vec::new();
    for (_, s) in all {
        if kept.len() == FEW {
            break;
        }
        if !kept.iter().any(|t| (s.im - t.im).abs() < 2.0 * s.re.abs().max(t.re.abs())) {
            kept.push(s);
        }
    }
    kept
}

/// Weighted squares that `1/(p-s)` takes from what is left nearby.
fn matched(lines: &Lines, left: &[Vec<c64>], s: c64, reach_hz: f64) -> f64 {
    let range = lines.around(s.im / std::f64::consts::TAU, reach_hz);
    let function: Vec<c64> = range.clone().map(|k| lines.factor[k] / (lines.p[k] - s)).collect();
    let own = |(left, weight): (&Vec<c64>, &Vec<f64>)| {
        let (left, weight) = (&left[range.clone()], &weight[range.clone()]);
        let (mut along, mut size) = (c64::new(0.0, 0.0), 0.0);
        for ((g, e), w) in function.iter().zip(left).zip(weight) {
            along += g.conj() * e * *w;
            size += w * g.norm_sqr();
        }
        if size > 0.0 { along.norm_sqr() / size } else { 0.0 }
    };
    left.iter().zip(&lines.weight).map(own).sum()
}
