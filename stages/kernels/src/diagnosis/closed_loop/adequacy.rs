//! Whether a mass with friction is enough: a spring, dynamics of higher order, what noise does not explain.

use super::balance::{MASS, OFFSET, Rows, STIFFNESS, VISCOUS, Window};
use super::blocks::BlockedRegression;
use super::data::deviation;
use super::diagnose::Bench;
use super::estimate::{BLOCKS, Estimate};
use super::simulation::Simulated;

/// Part of the force that the balance may miss beside noise, rms: presliding, cogging and ripple of machines that are
/// in order take some per cent.
const MISSED_FORCE: f64 = 0.15;
/// Part of the tracking error that the simulated loop may miss beside noise, rms.
const MISSED_TRACKING: f64 = 0.2;
/// Noise on the output, in its standard deviations, that the loop and its sensor make.
const LOOP_NOISE: f64 = 3.0;
/// Part of the squares beside noise that higher dynamics take where the plant has them.
const TAKEN: f64 = 0.5;
/// Part of the squares up to which noise does not disturb the test: it correlates columns with the residual.
const NOISY: f64 = 0.25;
/// Part of the force, rms, below which nothing is looked for: the instants of reversals, known to a sample, take some
/// tenths of a per cent.
const NOTHING: f64 = 0.01;
/// Windows of the test, samples.
const WINDOWS: [usize; 6] = [8, 16, 32, 64, 128, 256];
/// Power of their weights: fourth derivatives are continuous.
const POWER: i32 = 5;

/// What the baseline misses.
pub(super) struct Adequacy {
    pub adequate: bool,
    pub evidence: Vec<String>,
    /// Rms of the force that neither balance nor noise explain, over the force's.
    pub missed_force: f64,
}

/// Judges a mass with friction and causes.
pub(super) fn adequacy(bench: &Bench<'_>, estimate: &Estimate, simulated: &Simulated) -> Adequacy {
    let force = bench.moments.force_squares().max(f64::MIN_POSITIVE);
    let missed = ((estimate.squares - bench.noise_squares(estimate)).max(0.0) / force).sqrt();
    let mut evidence = Vec::new();
    if missed > MISSED_FORCE {
        evidence.push(format!(
            "mass and friction leave {:.0} % of the force (rms) that noise of the position does not explain",
            100.0 * missed
        ));
    }
    if let Some((stiffness, std)) = estimate.of(STIFFNESS) {
        evidence.push(format!(
            "a spring of {stiffness:.4e} +- {std:.1e} force per displacement holds the mass: the plant does not \
             integrate"
        ));
    }
    if let Some(line) = tracking(bench, simulated) {
        evidence.push(line);
    }
    if let Some(line) = higher(bench, estimate) {
        evidence.push(line);
    }
    Adequacy { adequate: evidence.is_empty(), evidence, missed_force: missed }
}

/// Whether the simulated loop misses the tracking error.
fn tracking(bench: &Bench<'_>, simulated: &Simulated) -> Option<String> {
    let (r, y) = (bench.measured.reference, bench.measured.output);
    let series = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { bench.training.clone().map(f).collect() };
    let tracking = deviation(&series(&|k| r[k] - y[k]));
    let missed = series(&|k| simulated.output[k] - y[k]);
    let rms = (missed.iter().map(|e| e * e).sum::<f64>() / missed.len().max(1) as f64).sqrt();
    let limit = MISSED_TRACKING * tracking + LOOP_NOISE * bench.noise;
    // NaN: the simulated loop runs away
    if rms <= limit {
        return None;
    }
    Some(match rms.is_finite() {
        true => format!(
            "the loop simulated with mass and friction misses {:.0} % of the tracking error",
            100.0 * rms / tracking
        ),
        false => "the loop simulated with mass and friction is unstable, the measured one is not".to_owned(),
    })
}

/// Higher dynamics that takes most of what is left.
struct Extension {
    taken: f64,
    window: usize,
    /// On `y''''`.
    fourth: f64,
    mass: f64,
}

fn higher(bench: &Bench<'_>, estimate: &Estimate) -> Option<String> {
    let found = WINDOWS
        .iter()
        .filter(|m| **m * 4 * BLOCKS <= bench.training.len())
        .filter_map(|&m| extension(bench, estimate, m))
        .max_by(|a, b| a.taken.total_cmp(&b.taken))
        .filter(|found| found.taken > TAKEN)?;
    let share = 100.0 * found.taken;
    let omega_squared = found.mass / found.fourth;
    let resonance = (omega_squared > 0.0).then(|| omega_squared.sqrt());
    Some(match resonance.filter(|omega| omega * bench.measured.interval_s < std::f64::consts::PI) {
        Some(omega) => format!(
            "dynamics of higher order take {share:.0} % of the squares that mass and friction leave: a resonance near \
             {:.3} Hz, as of a compliant axis",
            omega / std::f64::consts::TAU
        ),
        None => format!(
            "dynamics of higher order take {share:.0} % of the squares that mass and friction leave: a delay or lag of \
             the drive, or a compliance (windows of {} samples)",
            found.window
        ),
    })
}

/// What `F + a F' + b F'' = M y'' + .. + c y''' + d y''''` takes at one window; none where noise disturbs it.
fn extension(bench: &Bench<'_>, estimate: &Estimate, samples: usize) -> Option<Extension> {
    let interval_s = bench.measured.interval_s;
    let window = Window::new(samples, POWER);
    let rows = Rows::new(&bench.signals, bench.noise, interval_s, samples, &bench.training, BLOCKS);
    if rows.len() < 8 * BLOCKS {
        return None;
    }
    let all = rows.columns(&bench.signals, &window);
    let set: Vec<usize> = estimate.set.iter().copied().chain([OFFSET]).collect();
    let places: Vec<usize> = (0..=STIFFNESS).filter(|column| set.contains(column)).collect();
    let mut columns: Vec<Vec<f64>> = places.iter().filter_map(|&column| all.get(column).cloned()).collect();
    let base: Vec<usize> = (0..columns.len()).collect();
    let y = bench.measured.output;
    let derived = |x: &[f64], times: usize| (0..times).fold(x.to_vec(), |x, _| slope(&x, interval_s));
    let acceleration = slope(&slope(y, interval_s), interval_s);
    for series in
        [derived(&bench.force, 1), derived(&bench.force, 2), derived(&acceleration, 1), derived(&acceleration, 2)]
    {
        columns.push(rows.filtered(&series, &window));
    }
    let force = rows.filtered(&bench.force, &window);
    let blocked = BlockedRegression::new(&columns, &force, &vec![true; force.len()], BLOCKS);
    let before = blocked.held_out(&base);
    let of = |column: usize| estimate.of(column).map_or(0.0, |(value, _)| value);
    let noise = window.noise(of(MASS), of(VISCOUS), interval_s) * bench.noise.powi(2) * rows.len() as f64;
    let total: f64 = force.iter().map(|f| f * f).sum();
    let quiet = noise < NOISY * before && before > NOTHING * NOTHING * total;
    if !quiet {
        return None;
    }
    let which: Vec<usize> = (0..columns.len()).collect();
    let taken = 1.0 - blocked.held_out(&which) / before;
    let solved = blocked.solve(&which, None).coefficients;
    let value = |place: usize| solved.get(place).copied().unwrap_or(f64::NAN);
    Some(Extension { taken, window: samples, fourth: value(columns.len() - 1), mass: value(0) })
}

/// Central difference, the ends as their neighbours.
fn slope(x: &[f64], interval_s: f64) -> Vec<f64> {
    let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
    let inner = |k: usize| k.clamp(1, x.len().saturating_sub(2).max(1));
    (0..x.len()).map(inner).map(|k| (at(k + 1) - at(k - 1)) / (2.0 * interval_s)).collect()
}
