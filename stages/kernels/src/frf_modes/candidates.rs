//! Where modes may be: poles that are stable over the orders, and what a fit leaves.

use faer::c64;
use rayon::prelude::*;

use super::FrfModesOptions;
use super::data::Lines;
use super::polynomial::Diagram;

/// Distance in half widths below which two starts are one. Why: either explains 98 % of what the other does.
const SAME: f64 = 0.3;
/// Candidates at most. Why: of a mode several starts remain, and modes are tens.
const MOST: usize = 60;
/// Orders at which a pole must be stable. Why: as in `model.stabilisation`, noise seldom keeps a pole for four.
const ORDERS: usize = 4;
/// Half widths on either side over which a trial pole is compared with the residual: 89 % of its energy.
const REACH: f64 = 6.0;
/// Ratio of one trial half width to the next. Why: midway between two, either explains 98.6 % of a mode.
const RATIO: f64 = 1.6;
/// Trial poles of the residual at most. Why: the search comes back as long as one of them stays, and each that does not
/// costs a fit.
const FEW: usize = 6;
/// Least half width of a trial pole over the distance of the lines about it. Why: a narrower one is seen at one line
/// alone, whatever its width; less than a half, since frequencies may be rounded.
const SEEN: f64 = 0.4;
/// Least half width over the highest frequency: four decades above rounding.
const NARROWEST: f64 = 1e-12;

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
    let last = lines.frequency_hz[lines.len() - 1];
    let widest = 0.5 * last / options.least_quality_factor.max(4.0);
    let narrowest = lines.frequency_hz.windows(2).map(|pair| 0.5 * (pair[1] - pair[0])).fold(widest, f64::min);
    let widths: Vec<f64> = std::iter::successors(Some(narrowest.max(NARROWEST * last)), |w| Some(w * RATIO))
        .take_while(|w| *w < widest)
        .collect();
    let mut all: Vec<(f64, c64)> = widths
        .par_iter()
        .flat_map_iter(|&width| {
            places(&lines.frequency_hz, width).into_iter().map(move |f| {
                let s = std::f64::consts::TAU * c64::new(-width, f);
                (matched(lines, left, s, REACH * width), s)
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

/// Frequencies of trial poles, a half width apart; none between lines that are too far apart to see them.
fn places(frequency_hz: &[f64], width: f64) -> Vec<f64> {
    let mut all = Vec::new();
    let mut next = frequency_hz[0];
    for pair in frequency_hz.windows(2) {
        if width < SEEN * (pair[1] - pair[0]) {
            next = next.max(pair[1]);
        }
        while next < pair[1] {
            all.push(next);
            next += width;
        }
    }
    all
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
