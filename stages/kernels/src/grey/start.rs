//! Where the search begins: modes from other estimates, real poles and delay from a coarse grid.

use faer::c64;

use super::evaluation::{Evaluation, Problem};
use super::layout::Layout;
use super::options::{GreyOptions, GreyQuantity, GreyStart};
use super::point::Point;
use super::rules::Rules;
use super::search::{search, tried};
use crate::model::ModelError;
use crate::ringdown::Knowledge;
use crate::ringdown::internals::pole_of;
use crate::subspace::{Subspace, Weight};

/// Decays per sample of the fastest real pole on the grid; each further pole has half of the one before.
const DECAYS: [f64; 5] = [2.0, 0.7, 0.2, 0.05, 0.01];
/// Delays on the grid, samples: finer where a period of the fastest modes may be short.
const DELAYS: [f64; 10] = [0.05, 0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 6.5, 10.0, 16.0];
/// Sets of modes that go on the grid.
const SETS: usize = 2;
/// Steps that each of the best starts gets before the best of them goes on.
const FEW: usize = 8;

/// The lowest of the starts after a few steps. Errors: no start that shows as many modes as wanted.
pub(super) fn begin(
    problem: &Problem<'_>,
    options: &GreyOptions,
    interval_s: f64,
    data: (&[f64], &[f64]),
) -> Result<Evaluation, ModelError> {
    let mut found: Vec<Evaluation> = Vec::new();
    for modes in likeliest(problem, options, interval_s, sets(problem, options, interval_s, data)?) {
        found.extend(grid(problem, options, interval_s, &modes));
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    // neighbours on the grid end at the same minimum: of each set of real poles and each delay the best few
    let mut lowest: Option<Evaluation> = None;
    for start in found.into_iter().take(options.starts.max(1)) {
        let variance = problem.variance(&start);
        let found = search(problem, start, variance, FEW)?;
        if lowest.as_ref().is_none_or(|best| found.best.cost < best.cost) {
            lowest = Some(found.best);
        }
    }
    lowest.ok_or(ModelError::Degenerate("no start has a finite fit: give modes to start from, or fewer of them"))
}

/// The problem without slopes by the poles: a quarter of the work.
fn plain<'a>(problem: &Problem<'a>) -> Problem<'a> {
    Problem {
        series: problem.series.clone(),
        layout: Layout { slopes: false, ..problem.layout },
        linear: problem.linear,
        between: problem.between,
        rules: problem.rules.clone(),
    }
}

/// Real poles from a fastest one on, ascending.
fn decays_from(fastest: f64, count: usize) -> Vec<f64> {
    (0..count).rev().map(|k| fastest * 0.5_f64.powi(k as i32)).collect()
}

/// The sets that fit best with one choice of the rest.
fn likeliest(
    problem: &Problem<'_>,
    options: &GreyOptions,
    interval_s: f64,
    sets: Vec<Vec<[f64; 2]>>,
) -> Vec<Vec<[f64; 2]>> {
    let coarse = plain(problem);
    let delay = delays(options, interval_s).into_iter().nth(1).unwrap_or(0.0);
    let cost = |modes: &Vec<[f64; 2]>| {
        let point = Point { modes: modes.clone(), poles: decays_from(0.7, problem.layout.poles), delay };
        let point = problem.rules.obeyed(&point, &options.known);
        tried(&coarse, &point, 0.0).map_or(f64::INFINITY, |e| e.cost)
    };
    let mut ranked: Vec<(f64, Vec<[f64; 2]>)> = sets.into_iter().map(|modes| (cost(&modes), modes)).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<Vec<[f64; 2]>> = Vec::new();
    for (_, modes) in ranked {
        if chosen.len() < SETS && chosen.iter().all(|other| !alike(other, &modes)) {
            chosen.push(modes);
        }
    }
    chosen
}

/// Whether two sets end at the same minimum: every frequency within a tenth of its line's width.
fn alike(one: &[[f64; 2]], other: &[[f64; 2]]) -> bool {
    one.iter().zip(other).all(|([w, q], [v, _])| (w / v - 1.0).abs() < 0.1 / q.max(1.0))
}

/// Trials over decays and delays.
fn grid(problem: &Problem<'_>, options: &GreyOptions, interval_s: f64, modes: &[[f64; 2]]) -> Vec<Evaluation> {
    let coarse = plain(problem);
    let decays: &[f64] = if problem.layout.poles == 0 { &[1.0] } else { &DECAYS };
    let mut best: Vec<(f64, Point)> = Vec::new();
    for &fastest in decays {
        let poles = decays_from(fastest, problem.layout.poles);
        let own = delays(options, interval_s).into_iter().filter_map(|delay| {
            let point = Point { modes: modes.to_vec(), poles: poles.clone(), delay };
            let point = problem.rules.obeyed(&point, &options.known);
            tried(&coarse, &point, 0.0).map(|e| (e.cost, point))
        });
        best.extend(own);
    }
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    best.into_iter().take(options.starts.max(1)).filter_map(|(_, point)| tried(problem, &point, 0.0)).collect()
}

/// Delays to try, samples.
fn delays(options: &GreyOptions, interval_s: f64) -> Vec<f64> {
    let known = options.known.iter().find(|k| k.quantity == GreyQuantity::Delay).map(|k| k.knowledge);
    match known {
        Some(Knowledge::Fixed(value)) => vec![value / interval_s],
        Some(Knowledge::About(value, std)) => {
            [-1.5, -0.5, 0.0, 0.5, 1.5].iter().map(|z| ((value + z * std) / interval_s).max(0.0)).collect()
        }
        Some(Knowledge::Between(least, most)) => {
            let (least, most) = (least / interval_s, most / interval_s);
            let count = (2.0 * (most - least)).ceil().clamp(3.0, 40.0);
            (0..count as usize).map(|i| least + (most - least) * (i as f64 + 0.5) / count).collect()
        }
        _ => DELAYS.to_vec(),
    }
}

/// Sets of modes, `[w per sample, Q]`.
fn sets(
    problem: &Problem<'_>,
    options: &GreyOptions,
    interval_s: f64,
    (u, y): (&[f64], &[f64]),
) -> Result<Vec<Vec<[f64; 2]>>, ModelError> {
    let candidates: Vec<Vec<[f64; 2]>> = match &options.start {
        GreyStart::Modes(given) => {
            if given.len() != options.modes {
                let wanted = "as many as are fitted";
                return Err(ModelError::Parameter { name: "modes to start from", found: given.len() as f64, wanted });
            }
            vec![given.iter().map(|[f, q]| [std::f64::consts::TAU * f * interval_s, *q]).collect()]
        }
        GreyStart::Poles(poles) => vec![oscillating(poles)],
        GreyStart::Subspace => subspace(options, u, y)?,
    };
    let enough = candidates.into_iter().filter(|modes| modes.len() >= options.modes);
    let mut sets: Vec<Vec<[f64; 2]>> = enough.filter_map(|modes| strongest(problem, options, modes)).collect();
    sets.iter_mut().for_each(|set| set.sort_by(|a, b| a[0].total_cmp(&b[0])));
    sets.dedup();
    if sets.is_empty() {
        let wanted = "at most the oscillations that the start shows; give modes to start from, or other block rows";
        return Err(ModelError::Parameter { name: "modes", found: options.modes as f64, wanted });
    }
    Ok(sets)
}

/// Modes of upper poles in the z plane; those that grow are reflected.
fn oscillating(poles: &[c64]) -> Vec<[f64; 2]> {
    let upper = poles.iter().filter(|z| z.im > 1e-9 * z.norm()).map(|z| z.ln());
    let modes = upper.map(|s| [s.norm(), s.norm() / (2.0 * s.re.abs().max(1e-9))]);
    modes.filter(|[w, q]| *q > 0.6 && *w < std::f64::consts::PI && pole_of(*w, *q).is_finite()).collect()
}

/// Poles of both subspace estimates at some orders.
fn subspace(options: &GreyOptions, u: &[f64], y: &[f64]) -> Result<Vec<Vec<[f64; 2]>>, ModelError> {
    let least = 2 * options.modes + options.real_poles;
    let rows = options.block_rows;
    let plain = Subspace::new(u, y, rows)?;
    let instrumental =
        Subspace::with_instruments(u, y, rows.min(y.len() / (4 + 2 * (u.len() / y.len()))), Weight::Moesp);
    let mut sets = Vec::new();
    for order in [least, least + 2, least + 4] {
        // an order that is too high, or whose eigenvalues fail, is no start; others are
        sets.extend(plain.poles(order).ok());
        sets.extend(instrumental.as_ref().ok().and_then(|estimate| estimate.poles(order).ok()));
    }
    Ok(sets.iter().map(|poles| oscillating(poles)).collect())
}

/// Those modes that take most of the output, fitted all together.
fn strongest(problem: &Problem<'_>, options: &GreyOptions, modes: Vec<[f64; 2]>) -> Option<Vec<[f64; 2]>> {
    if modes.len() == options.modes {
        return Some(modes);
    }
    let count = modes.len();
    let rules = Rules::of(&[], count, problem.layout.poles, problem.layout.inputs, problem.linear.feedthrough, 1.0);
    let all = Problem {
        series: problem.series.clone(),
        layout: Layout { modes: count, slopes: false, ..problem.layout },
        linear: problem.linear,
        between: problem.between,
        rules: rules.ok()?,
    };
    let poles = decays_from(0.7, problem.layout.poles);
    let fitted = tried(&all, &Point { modes: modes.clone(), poles, delay: 0.05 }, 0.0)?;
    let per_input = count + usize::from(problem.linear.feedthrough);
    // a response rings at Q times its static gain, and a narrow one is heard less often: the gain times the root of Q
    let strength = |n: usize| -> f64 {
        (0..problem.layout.inputs).map(|i| fitted.shared[i * per_input + n].powi(2)).sum::<f64>() * modes[n][1]
    };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| strength(b).total_cmp(&strength(a)));
    Some(order[..options.modes].iter().map(|&n| modes[n]).collect())
}
