//! The number of modes, from the data.

use super::estimate::Ringdown;
use super::fit::{fit_ringdowns, fit_to};
use super::fitted::{ARRIVED, Fitted, NEARLY};
use super::freedom::freedom;
use super::gaps::Gaps;
use super::knowledge::{Knowledge, Known};
use super::ladder::ladder;
use super::modal_form::Exponential;
use super::normal::Freedom;
use super::options::{NoiseSource, RingdownOptions};
use super::records::Records;
use super::search::Point;
use crate::model::ModelError;
use crate::monitor::Monitor;

/// What a number of modes made of the events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeCount {
    /// The number.
    pub modes: usize,
    /// Whitened energy of the residuals of all events; NaN where there is no fit.
    pub chi_square: f64,
    /// Chi square and `ln N` per estimated parameter; NaN where there is no fit.
    pub bic: f64,
    /// Whitened energy of the residuals of each half of the events under the shape of the other half; NaN with fewer
    /// than [`HELD_OUT_EVENTS`] events.
    pub held_out: f64,
    /// How much more than the number chosen before it this held out, in standard errors of the events' own differences;
    /// negative: better.
    pub worse_by: f64,
}

/// The modes found, and what was seen.
#[derive(Debug, Clone)]
pub struct CountedRingdown {
    /// The fit with that number of modes.
    pub fit: Ringdown,
    /// The number.
    pub modes: usize,
    /// Every number that was tried, ascending.
    pub seen: Vec<ModeCount>,
}

/// Events from which the number is judged by held-out events: two halves of two.
pub const HELD_OUT_EVENTS: usize = 4;
/// Standard errors by which a further mode must do better on held-out events: one that is not there does so once in
/// some ten thousand, one that is there does where its amplitude is known to a quarter.
const CLEARLY: f64 = 2.0;
/// Standard errors from the best at which all that rings is known well enough: another fit begins there.
const BEGUN: f64 = 0.1;
/// Numbers of modes tried beyond the best; more where a cause may draw poles away from modes.
const BEYOND: usize = 2;
const BEYOND_RINGING: usize = 4;

/// [`fit_ringdowns`] with the number of modes chosen among 1 to `most`.
///
/// # Method
/// One Hankel matrix gives the poles; of these the one that takes most off the mean's residual is added to the fit
/// before, one by one, until two have brought the BIC under white noise no further. All numbers are then fitted again
/// under the noise of the best of these, so that chi squares compare. From four events on, a further mode must lower
/// the chi square of held-out halves (shape frozen, each event's own four parameters fitted) by two standard errors of
/// the events' differences and its BIC as well; with fewer the BIC alone.
/// # Shapes
/// As [`fit_ringdowns`]; `options.modes` is not used.
/// # Units
/// Volts, seconds, rad/s.
/// # Accuracy
/// A mode is found where its ringing is some four standard errors of its own amplitude. Two fits per number, four from
/// four events on.
/// # Errors
/// Those of [`fit_ringdowns`] with one mode; `most` of 0; given start values or knowledge of single modes, which have
/// no meaning yet; cancelled by the monitor.
/// # Source
/// G. Schwarz, Ann. Stat. 6 (1978) 461; M. Stone, J. R. Stat. Soc. B 36 (1974) 111.
pub fn fit_counted_ringdowns(
    events: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    most: usize,
    options: &RingdownOptions,
    monitor: &dyn Monitor,
) -> Result<CountedRingdown, ModelError> {
    check(most, options)?;
    let all = Data { events, free, interval_s };
    let ladder = ladder(&all, most, BEYOND, options, ARRIVED)?;
    let sufficient = all.fitted(&ladder.steps[ladder.best], options, ARRIVED)?;
    let judged = RingdownOptions { noise: NoiseSource::Known(sufficient.noise.clone()), ..options.clone() };
    monitor.expect(ladder.steps.len());
    let mut tries = Vec::new();
    for start in &ladder.steps {
        if monitor.is_cancelled() {
            return Err(ModelError::Cancelled);
        }
        tries.push(Try::of(&all, start, &judged));
        monitor.tick();
    }
    let mut seen = Vec::new();
    let mut chosen: Option<usize> = None;
    for (i, this) in tries.iter().enumerate() {
        let worse_by = chosen.map_or(f64::NAN, |best| this.worse_than(&tries[best]));
        let better = match chosen {
            None => this.bic.is_finite(),
            Some(best) => this.bic < tries[best].bic && (worse_by.is_nan() || worse_by < -CLEARLY),
        };
        if better {
            chosen = Some(i);
        }
        let held_out = if this.held_out.is_empty() { f64::NAN } else { this.held_out.iter().sum() };
        seen.push(ModeCount { modes: i + 1, chi_square: this.chi_square, bic: this.bic, held_out, worse_by });
    }
    let chosen = chosen.unwrap_or(ladder.best);
    let fit = if chosen == ladder.best { sufficient } else { all.fitted(&ladder.steps[chosen], options, ARRIVED)? };
    Ok(CountedRingdown { fit, modes: chosen + 1, seen })
}

/// [`fit_ringdowns`] with as many modes, up to `most`, as lower the BIC under white noise, or the most below that can be
/// fitted: all that rings, whatever its reason. Errors: those of that.
pub fn fit_all_that_rings(
    events: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    most: usize,
    options: &RingdownOptions,
) -> Result<Ringdown, ModelError> {
    check(most, options)?;
    let all = Data { events, free, interval_s };
    let ladder = ladder(&all, most, BEYOND_RINGING, options, NEARLY)?;
    let mut failed = None;
    for step in ladder.steps[..=ladder.best].iter().rev() {
        match all.fitted(step, options, BEGUN) {
            Ok(fitted) => return Ok(fitted),
            Err(error) => failed = failed.or(Some(error)),
        }
    }
    Err(failed.unwrap_or(ModelError::Degenerate("no exponentials")))
}

fn check(most: usize, options: &RingdownOptions) -> Result<(), ModelError> {
    if most == 0 {
        return Err(ModelError::Parameter { name: "largest number of modes", found: 0.0, wanted: "at least 1" });
    }
    let of_mode =
        |known: &Known| !matches!(known.quantity, super::Quantity::RealPole(_)) && known.knowledge != Knowledge::Free;
    if options.start.is_some() || options.known.iter().any(of_mode) {
        let found = options.known.len() as f64;
        return Err(ModelError::Parameter {
            name: "known or start",
            found,
            wanted: "none of a mode whose number is to be found",
        });
    }
    Ok(())
}

/// Events and what belongs to them.
pub(super) struct Data<'a> {
    pub events: &'a [&'a [f64]],
    pub free: &'a [&'a [f64]],
    pub interval_s: f64,
}

impl Data<'_> {
    /// From a start to at most `arrived` standard errors from the best.
    pub fn fitted(
        &self,
        start: &[Exponential],
        options: &RingdownOptions,
        arrived: f64,
    ) -> Result<Ringdown, ModelError> {
        let options = RingdownOptions { start: Some(start.to_vec()), ..options.clone() };
        fit_to(self.events, self.free, self.interval_s, &options, arrived)
    }
}

/// One number of modes, fitted.
struct Try {
    chi_square: f64,
    bic: f64,
    /// Per event; empty where it was not judged.
    held_out: Vec<f64>,
}

impl Try {
    fn of(all: &Data<'_>, start: &[Exponential], judged: &RingdownOptions) -> Self {
        let options = RingdownOptions { start: Some(start.to_vec()), bootstrap_draws: 0, ..judged.clone() };
        let none = Self { chi_square: f64::NAN, bic: f64::NAN, held_out: Vec::new() };
        let Ok(fit) = all.fitted(start, &options, ARRIVED) else { return none };
        let chi_square = fit.reduced_chi_square * fit.freedom as f64;
        let missing: usize = options.missing.iter().flatten().map(|range| range.len()).sum();
        let observed = all.events.iter().map(|event| event.len()).sum::<usize>() - missing.min(fit.freedom);
        let bic = chi_square + (observed.saturating_sub(fit.freedom)) as f64 * (observed as f64).ln();
        let held_out = held_out(all, &fit.exponentials, &options).unwrap_or_default();
        Self { chi_square, bic, held_out }
    }

    /// Difference of the held-out energies over its standard error; NaN where it was not judged.
    fn worse_than(&self, other: &Self) -> f64 {
        let count = self.held_out.len() as f64;
        if self.held_out.is_empty() || self.held_out.len() != other.held_out.len() {
            return f64::NAN;
        }
        let differences: Vec<f64> = self.held_out.iter().zip(&other.held_out).map(|(a, b)| a - b).collect();
        let mean = differences.iter().sum::<f64>() / count;
        let spread = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (count - 1.0);
        mean / (spread / count).sqrt().max(f64::MIN_POSITIVE)
    }
}

/// Chi square of every event under the shape of the other half. None with too few events or where a half has no fit.
fn held_out(all: &Data<'_>, start: &[Exponential], options: &RingdownOptions) -> Option<Vec<f64>> {
    let count = all.events.len();
    if count < HELD_OUT_EVENTS {
        return None;
    }
    let mut out = vec![0.0; count];
    for parity in 0..2 {
        let (test, train): (Vec<usize>, Vec<usize>) = (0..count).partition(|i| i % 2 == parity);
        let of = |chosen: &[usize]| -> (Vec<&[f64]>, RingdownOptions) {
            let missing = chosen.iter().filter_map(|&i| options.missing.get(i).cloned()).collect();
            let options = RingdownOptions { missing, start: Some(start.to_vec()), ..options.clone() };
            (chosen.iter().map(|&i| all.events[i]).collect(), options)
        };
        let (events, own) = of(&train);
        let shape = fit_ringdowns(&events, &[], all.interval_s, &own).ok()?.exponentials;
        let (events, own) = of(&test);
        for (event, energy) in test.iter().zip(frozen(&events, all.interval_s, &shape, &own)?) {
            out[*event] = energy;
        }
    }
    Some(out)
}

/// Chi square of each event with the shape held and its own parameters fitted.
fn frozen(events: &[&[f64]], interval_s: f64, shape: &[Exponential], options: &RingdownOptions) -> Option<Vec<f64>> {
    let gaps = Gaps::of(&options.missing, events.len(), events.first()?.len()).ok()?;
    let bridged = gaps.bridged(events);
    let events: &[&[f64]] = &bridged.iter().map(|event| &**event).collect::<Vec<_>>();
    let records = Records { events, gaps: &gaps, free: &[], interval_s };
    let own = super::guess::shares(events, shape, interval_s, options);
    let mut point = Point { exponentials: shape.to_vec(), events: own };
    let NoiseSource::Known(noise) = &options.noise else { return None };
    let freedom = Freedom { shared: Vec::new(), ..freedom(shape, options) };
    Fitted::of(&records, noise, &mut point, &freedom, ARRIVED).ok().map(|fitted| fitted.energies())
}
