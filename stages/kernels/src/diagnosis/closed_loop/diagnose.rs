//! The whole way from samples to a verdict.

use std::ops::Range;

use super::answer::answer;
use super::balance::{ASYMMETRY, COULOMB, EXTRA, MASS, OFFSET, STIFFNESS, VISCOUS};
use super::balance::{Rows, Signals, Window, held, white_noise};
use super::controller::{Controller, identify};
use super::data::{ClosedLoop, ClosedLoopDiagnosis, ClosedLoopOptions, NotClosedLoop, training};
use super::estimate::{BLOCKS, Estimate, Moments, plant};
use super::motion::Plant;
use super::selection::choose;
use super::simulation::{Simulated, simulate_closed_loop};

/// Windows that are tried, samples: from what central differences need to a quarter second at 1 kHz.
const WINDOWS: [usize; 6] = [8, 16, 32, 64, 128, 256];
/// The window that starts: it halves the noise of the acceleration five times against the shortest.
const FIRST_WINDOW: usize = 32;
/// Simulations that make instruments; each starts from the estimate that the one before gave.
const ROUNDS: usize = 3;
/// Power of the window: second derivatives are continuous.
pub(super) const POWER: i32 = 3;
/// Standard errors of what counts: one chance in a hundred with 15 degrees of freedom.
const SIGNIFICANT: f64 = 3.0;

/// A measured loop with all that is computed of it once.
pub(super) struct Bench<'a> {
    pub measured: ClosedLoop<'a>,
    pub training: Range<usize>,
    pub controller: Controller,
    /// Force per unit of the drive, its sign set right.
    pub drive_scale: f64,
    /// Standard deviation of white noise on the position.
    pub noise: f64,
    pub signals: Signals,
    pub force: Vec<f64>,
    pub window: Window,
    pub moments: Moments,
    /// The same with the window that scatters second least: what differs is not noise alone.
    pub other: Option<Moments>,
    /// Columns that no name stands for.
    pub base: Vec<usize>,
}

impl Bench<'_> {
    /// The loop with a plant.
    pub fn simulated(&self, plant: &Plant) -> Simulated {
        simulate_closed_loop(&self.controller, plant, &self.measured)
    }

    /// Parameters of a set of columns.
    ///
    /// Their standard errors hold the scatter of the blocks and what another window makes of the same data: the two
    /// differ by wrong instants of reversals and by presliding.
    pub fn estimate(&self, set: &[usize]) -> Option<Estimate> {
        let mut estimate = self.moments.estimate(set)?;
        if let Some(other) = self.other.as_ref().and_then(|other| other.estimate(set)) {
            for ((std, value), rival) in estimate.stds.iter_mut().zip(&estimate.values).zip(&other.values) {
                *std = std.hypot(value - rival);
            }
        }
        Some(estimate)
    }

    /// Samples of a block of the training part.
    pub fn block(&self, b: usize) -> Range<usize> {
        let (start, length) = (self.training.start, self.training.len());
        start + b * length / BLOCKS..start + (b + 1) * length / BLOCKS
    }

    /// Squares of the balance's residual that white noise on the position makes.
    pub fn noise_squares(&self, estimate: &Estimate) -> f64 {
        let of = |column: usize| estimate.of(column).map_or(0.0, |(value, _)| value);
        let each = self.window.noise(of(MASS), of(VISCOUS), self.measured.interval_s) * self.noise.powi(2);
        each * self.moments.rows() as f64
    }
}

/// Diagnoses a measured axis under a feedback controller.
///
/// # Model, Method, Shapes, Units, Accuracy, Source
/// Those of the module's page. `validation` holds, part by part, the rms error of the position simulated from the
/// reference with mass and viscous friction alone, and with all that was found.
/// # Errors
/// [`NotClosedLoop`] where the drive is no function of both reference and output, or nothing can be computed.
pub fn diagnose_closed_loop(
    measured: &ClosedLoop<'_>,
    options: &ClosedLoopOptions<'_>,
) -> Result<ClosedLoopDiagnosis, NotClosedLoop> {
    measured.check()?;
    let training = training(measured, options)?;
    let controller = identify(measured, &training)?;
    let bench = prepared(*measured, training, controller)?;
    let choice = choose(&bench, options).ok_or(NotClosedLoop::NoMass)?;
    Ok(answer(bench, options, choice))
}

/// The columns that start: what a machine usually has.
const START: [usize; 4] = [MASS, VISCOUS, COULOMB, OFFSET];
/// The same on a spring.
const ON_SPRING: [usize; 5] = [MASS, VISCOUS, COULOMB, OFFSET, STIFFNESS];
/// Part of the squares that a spring takes where there is one; cables and cogging take less.
const TAKEN: f64 = 0.5;

fn prepared(
    measured: ClosedLoop<'_>,
    training: Range<usize>,
    controller: Controller,
) -> Result<Bench<'_>, NotClosedLoop> {
    let interval_s = measured.interval_s;
    let extra = measured.extra.map(|(_, p)| p);
    let noise = white_noise(measured.output.get(training.clone()).unwrap_or_default());
    let signals = Signals::new(measured.output, extra, interval_s);
    let mut drive_scale = measured.drive_scale;
    let mut force = held(measured.drive, drive_scale);
    let sums = |instruments: &Signals, force: &[f64], samples: usize| {
        let window = Window::new(samples, POWER);
        let rows = Rows::new(&signals, noise, interval_s, samples, &training, BLOCKS);
        let x = rows.columns(&signals, &window);
        let z = rows.columns(instruments, &window);
        Moments::new(&x, &z, &rows.filtered(force, &window), &rows.block)
    };
    let start = |moments: &Moments| match moments.estimate(&START) {
        Some(free) => Some(moments.estimate(&ON_SPRING).filter(|held| springs(&free, held)).unwrap_or(free)),
        None => moments.estimate(&START[..2]),
    };

    let (mut samples, mut second) = (FIRST_WINDOW, None);
    let mut other = None;
    let mut moments = sums(&signals, &force, samples);
    let mut found = start(&moments).ok_or(NotClosedLoop::NoMass)?;
    if found.of(MASS).is_some_and(|(mass, _)| mass < 0.0) {
        drive_scale = -drive_scale;
        force = held(measured.drive, drive_scale);
        moments = sums(&signals, &force, samples);
        found = start(&moments).ok_or(NotClosedLoop::NoMass)?;
    }
    for round in 0..ROUNDS {
        let mut plant = plant(&found.set, &found.values, drive_scale);
        plant.coulomb = plant.coulomb.max(0.0);
        let simulated = simulate_closed_loop(&controller, &plant, &measured);
        if !simulated.is_finite() {
            break;
        }
        let instruments = Signals::new(&simulated.output, extra, interval_s);
        let fits = |m: &&usize| **m * 4 * BLOCKS <= training.len();
        let lengths: Vec<usize> =
            if round == 0 { WINDOWS.iter().filter(fits).copied().collect() } else { vec![samples] };
        let tried = |m: usize| {
            let sums = sums(&instruments, &force, m);
            let found = start(&sums)?;
            let scatter: f64 = found.stds.iter().map(|std| std.ln()).sum();
            scatter.is_finite().then_some((scatter, m, sums, found))
        };
        let mut order: Vec<_> = lengths.into_iter().filter_map(tried).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut order = order.into_iter();
        let Some((_, m, better_sums, better)) = order.next() else { break };
        (samples, moments, found) = (m, better_sums, better);
        second = if round == 0 { order.next().map(|(_, m, ..)| m) } else { second };
        other = second.map(|m| sums(&instruments, &force, m));
    }
    if found.of(MASS).is_none_or(|(mass, _)| mass.is_nan() || mass <= 0.0) {
        return Err(NotClosedLoop::NoMass);
    }
    let mut base = base(&moments);
    base.extend(found.of(STIFFNESS).map(|_| STIFFNESS));
    let window = Window::new(samples, POWER);
    Ok(Bench { measured, training, controller, drive_scale, noise, signals, force, window, moments, other, base })
}

/// Whether a spring holds the mass.
fn springs(free: &Estimate, held: &Estimate) -> bool {
    let strong = held.of(STIFFNESS).is_some_and(|(value, std)| value.abs() > 2.0 * SIGNIFICANT * std);
    let total = |estimate: &Estimate| estimate.held_out.iter().sum::<f64>();
    strong && total(held) < (1.0 - TAKEN) * total(free)
}

/// Mass, viscous friction, and the extra channel where it pushes the plant beside the drive.
fn base(moments: &Moments) -> Vec<usize> {
    let all = moments.estimate(&[MASS, VISCOUS, COULOMB, OFFSET, ASYMMETRY, EXTRA]);
    let pushes = all.and_then(|all| all.of(EXTRA)).is_some_and(|(value, std)| value.abs() > 2.0 * SIGNIFICANT * std);
    let mut base = vec![MASS, VISCOUS];
    base.extend(pushes.then_some(EXTRA));
    base
}
