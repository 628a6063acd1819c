//! Poles on one side, or on the other, through the values around a peak.

use faer::c64;

use super::columns::{least_squares, power};
use super::resonance::Stretch;

/// Poles of a fit, at most.
const MOST_POLES: usize = 2;
/// Coefficients of the background.
const BACKGROUND: usize = 3;
/// Steps of Gauss-Newton, at most.
const STEPS: usize = 25;
/// A step that gains less ends the fit.
const LEAST_STEP_GAIN: f64 = 1e-4;
/// Distance of a pole from the real axis, at least, in mean steps of the frequencies: a nearer one is seen by one value.
const LEAST_DISTANCE: f64 = 0.25;
/// Values that count as independent, at least, however smooth a misfit is.
const LEAST_INDEPENDENT: f64 = 8.0;
/// Share of the squares which the background leaves that the poles leave, at most: correlated noise leaves more.
const MOST_LEFT: f64 = 0.1;
/// Halvings of the step between delays.
const REFINEMENTS: i32 = 4;
/// Turns of phase over half a stretch, in rad.
pub(super) const DELAYS: [f64; 17] =
    [0.0, -0.5, 0.5, -1.0, 1.0, -1.5, 1.5, -2.0, 2.0, -3.0, 3.0, -4.0, 4.0, -5.0, 5.0, -6.3, 6.3];

/// Poles, and what they and the background leave.
#[derive(Clone)]
struct Fit {
    poles: Vec<c64>,
    residues: Vec<c64>,
    residual: Vec<c64>,
    cost: f64,
}

/// Twice the gain in log-likelihood of poles above the real axis on poles below it; 0 where the background does as well.
pub(super) fn gain(stretch: &Stretch) -> f64 {
    compared(stretch, &fits(stretch, 1.0), &fits(stretch, -1.0))
}

/// The same over delays and advances, each side with its best.
pub(super) fn gain_with_delays(stretch: &Stretch) -> f64 {
    compared(stretch, &delayed(stretch, 1.0), &delayed(stretch, -1.0))
}

/// Fits with each of the delays, then with nearer and nearer ones of the best.
fn delayed(stretch: &Stretch, side: f64) -> Vec<Fit> {
    let mut best = (f64::INFINITY, 0.0);
    let mut all = Vec::new();
    let mut tried = |delay: f64, best: &mut (f64, f64)| {
        let fits = fits(&turned(stretch, delay), side);
        let cost = fits.iter().map(|fit| fit.cost).fold(f64::INFINITY, f64::min);
        if cost < best.0 {
            *best = (cost, delay);
        }
        all.extend(fits);
    };
    DELAYS.iter().for_each(|delay| tried(*delay, &mut best));
    for halving in 0..REFINEMENTS {
        let (step, centre) = (0.5_f64.powi(halving + 1), best.1);
        [centre - step, centre + step].into_iter().for_each(|delay| tried(delay, &mut best));
    }
    all
}

fn compared(stretch: &Stretch, above: &[Fit], below: &[Fit]) -> f64 {
    let Some(background) = solved(stretch, Vec::new()) else { return 0.0 };
    let Some(best) = above.iter().chain(below).min_by(|a, b| a.cost.total_cmp(&b.cost)) else { return 0.0 };
    if best.cost > MOST_LEFT * background.cost {
        return 0.0;
    }
    let independent = independent(&best.residual);
    let of = |fit: &Fit| criterion(fit, independent, stretch.x.len());
    let least = |fits: &[Fit]| fits.iter().map(of).fold(of(&background), f64::min);
    least(below) - least(above)
}

/// The values without a delay.
fn turned(stretch: &Stretch, delay: f64) -> Stretch {
    let values = stretch.x.iter().zip(&stretch.values).map(|(x, h)| h * c64::cis(delay * x)).collect();
    Stretch { values, x: stretch.x.clone(), ..*stretch }
}

/// Bayesian information criterion.
fn criterion(fit: &Fit, independent: f64, points: usize) -> f64 {
    let parameters = 4.0 * fit.poles.len() as f64;
    2.0 * independent * (fit.cost / points as f64).ln() + parameters * (2.0 * independent).ln()
}

/// How many values of a residual count: fewer where neighbours are alike.
fn independent(residual: &[c64]) -> f64 {
    let alike: f64 = residual.windows(2).map(|pair| (pair[0].conj() * pair[1]).re).sum();
    let correlation = (alike / power(residual)).clamp(0.0, 1.0);
    let count = residual.len() as f64;
    (count * (1.0 - correlation) / (1.0 + correlation)).max(LEAST_INDEPENDENT)
}

/// Fits of one and more poles on a side.
fn fits(stretch: &Stretch, side: f64) -> Vec<Fit> {
    let mut found: Vec<Fit> = Vec::new();
    let mut start = vec![c64::new(stretch.peak, side * stretch.half_width)];
    while found.len() < MOST_POLES {
        let Some(fit) = refined(stretch, start, side) else { break };
        let worst = (0..stretch.x.len()).max_by(|a, b| fit.residual[*a].norm().total_cmp(&fit.residual[*b].norm()));
        let place = worst.map_or(stretch.peak, |k| stretch.x[k]);
        start = fit.poles.iter().copied().chain([c64::new(place, side * stretch.half_width)]).collect();
        found.push(fit);
    }
    found
}

/// Residues and background for these poles.
fn solved(stretch: &Stretch, poles: Vec<c64>) -> Option<Fit> {
    let mut columns: Vec<Vec<c64>> = poles.iter().map(|pole| powers(stretch, *pole, 1)).collect();
    columns.extend(background(stretch));
    let (coefficients, residual) = least_squares(&columns, &stretch.values)?;
    let residues = coefficients.iter().take(poles.len()).copied().collect();
    // what rounding leaves
    let cost = power(&residual).max(1e-24 * power(&stretch.values));
    Some(Fit { poles, residues, residual, cost })
}

fn powers(stretch: &Stretch, pole: c64, power: i32) -> Vec<c64> {
    stretch.x.iter().map(|x| (1.0 / (c64::new(*x, 0.0) - pole)).powi(power)).collect()
}

fn background(stretch: &Stretch) -> impl Iterator<Item = Vec<c64>> + '_ {
    (0..BACKGROUND as i32).map(|power| stretch.x.iter().map(|x| c64::new(x.powi(power), 0.0)).collect())
}

/// Gauss-Newton over the poles; steps that cross the axis or do not gain are halved.
fn refined(stretch: &Stretch, start: Vec<c64>, side: f64) -> Option<Fit> {
    let least = LEAST_DISTANCE * 2.0 / (stretch.x.len() - 1) as f64;
    let mut fit = solved(stretch, start)?;
    for _ in 0..STEPS {
        let Some(step) = step(stretch, &fit) else { break };
        let next = (0..8).find_map(|halvings| {
            let share = 0.5_f64.powi(halvings);
            let kept = |pole: c64| c64::new(pole.re.clamp(-1.5, 1.5), side * (side * pole.im).clamp(least, 4.0));
            let poles = fit.poles.iter().zip(&step).map(|(pole, step)| kept(pole + step * share)).collect();
            solved(stretch, poles).filter(|next| next.cost < fit.cost)
        });
        let Some(next) = next else { break };
        let settled = next.cost > (1.0 - LEAST_STEP_GAIN) * fit.cost;
        fit = next;
        if settled {
            break;
        }
    }
    Some(fit)
}

/// The step of the poles by Gauss-Newton: `dH/dp = A / (x - p)^2`.
fn step(stretch: &Stretch, fit: &Fit) -> Option<Vec<c64>> {
    let mut columns: Vec<Vec<c64>> = fit.poles.iter().map(|pole| powers(stretch, *pole, 2)).collect();
    columns.extend(fit.poles.iter().map(|pole| powers(stretch, *pole, 1)));
    columns.extend(background(stretch));
    let (coefficients, _) = least_squares(&columns, &fit.residual)?;
    let ratio = |(change, residue): (&c64, &c64)| change / residue;
    let steps: Vec<c64> = coefficients.iter().zip(&fit.residues).map(ratio).collect();
    steps.iter().all(|step| step.is_finite()).then_some(steps)
}
