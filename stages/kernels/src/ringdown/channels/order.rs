//! How many modes there are: one after the other, each judged by what it explains.

use super::bank::Bank;
use super::basis::{Poles, own_count};
use super::fit::{ARRIVED, Fitted, NEARLY};
use super::levels::{density, flat, local_variances, residuals};
use super::noise::{NoiseModel, degrees, first_noise, rescaled};
use super::options::{ChannelNoise, ChannelOptions, ModesWanted};
use super::own::OwnPoles;
use super::records::Records;
use super::result::{ChannelRingdown, OrderTried};
use super::start::shift_invariant;
use crate::model::{ModelError, finite, go_on};
use crate::ringdown::RingdownNoise;
use crate::statistics::chi_square_tail;
use faer::c64;
use std::cell::OnceCell;

/// Candidates of the bank that are tried for each further mode.
const CANDIDATES: usize = 2;
/// Numbers of modes tried beyond the last one that was needed: two together may explain what neither does alone.
const BEYOND: usize = 1;
/// The same of those that white noise would not yield, wander might: several modes together look like wander as long as one
/// of them is missing.
const BEYOND_WANDER: usize = 6;
/// Share of a channel's energy that a further mode takes off and that more modes are tried for, however many: beside each
/// of a pair its partner looks like noise, until all are there. Why 0.05: of twelve modes alike each takes a twelfth; of a
/// noise that wanders over a hundredth of the record an exponential takes 0.02.
const STRONG: f64 = 0.05;
/// Share of a mode's gain that the bank sees at least: its places are coarse, and other modes have moved.
const BANK: f64 = 0.5;
/// Weighted square of a mode's amplitudes over its gain from which on no fit without it is tried.
pub(super) const CERTAIN: f64 = 10.0;
/// Operations of a step up to which noise is whitened that is not flat over a mode's line: a tenth of a second. Beyond,
/// least squares stay unbiased and lose a little.
const WHITENED: f64 = 5e7;
/// Turns of noise and fit at the end.
const NOISE_ROUNDS: usize = 2;

/// Fits modes with shared poles to all channels of all events at once.
///
/// # Model
/// `y_ec(k) = sum_j Re(rho_ecj exp(s_j k T)) + offset_ec + slope_ec k + n_c(k)`: poles shared by all channels c and
/// events e, residues free, noise of each channel white with wander of its own. Of several events the residues of a
/// mode are one complex shape times an amplitude per event; that is tested, not imposed.
/// # Method
/// Maximum likelihood by variable projection: records whitened by their channel's noise, amplitudes solved for by
/// orthogonal triangles, Levenberg-Marquardt on the poles. Modes are found one by one: a bank of decaying exponentials
/// over what is left gives the next pole, all poles are fitted again, and the mode is kept if twice the gain of the
/// log-likelihood is exceeded by noise, at the best of all places, with a probability below
/// [`ChannelOptions::false_alarm`]; each without which the others explain as much is left out again. Noise and fit in
/// turns.
/// Shapes: rank-one fit of the residues with their covariance.
/// # Shapes
/// `events`: per event C records of equal length, from the first free sample on; events may differ in length. `free`:
/// per quiet stretch C records.
/// # Units
/// The channels' own; seconds, rad/s, Hz.
/// # Accuracy
/// docs/results/decay.md. `N C (4 modes)^2` operations per step and shape of noise.
/// # Errors
/// No event, unequal lengths, too few samples, values that are not finite, no oscillation.
/// # Source
/// G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; S. M. Kay, Fundamentals of Statistical Signal
/// Processing II, 1998, chapter 7 (unknown arrival and frequency).
pub fn fit_channels(
    events: &[Vec<&[f64]>],
    free: &[Vec<&[f64]>],
    interval_s: f64,
    options: &ChannelOptions,
) -> Result<ChannelRingdown, ModelError> {
    Ok(fit_with_hits(events, free, interval_s, options)?.0)
}

/// The same, and the poles of each hit by itself; none of one that shows no mode for certain.
pub(super) fn fit_with_hits(
    events: &[Vec<&[f64]>],
    free: &[Vec<&[f64]>],
    interval_s: f64,
    options: &ChannelOptions,
) -> Result<(ChannelRingdown, Vec<Option<OwnPoles>>), ModelError> {
    for stretch in free.iter().flatten() {
        finite("free stretch", stretch)?;
    }
    go_on(&options.watch)?;
    let records = Records::of(events, interval_s, options)?;
    let ladder = Ladder { records: &records, noise: NoiseModel::new(&records, free, &options.noise), options };
    let (step, seen) = if options.start.is_empty() { ladder.climb()? } else { (ladder.given(), Vec::new()) };
    let refined = ladder.refined(step);
    let all = ChannelRingdown::of(&records, &refined, seen)?;
    let hits = OwnPoles::of_hits(&records, &refined, &all, options.false_alarm);
    Ok((all, hits))
}

/// The fit from the poles of the options, those left out that the others make up for; none where a mode more explains
/// more than chance does, or noise alone as much as the last.
pub(super) fn explained(
    events: &[Vec<&[f64]>],
    free: &[Vec<&[f64]>],
    interval_s: f64,
    options: &ChannelOptions,
) -> Option<ChannelRingdown> {
    let records = Records::of(events, interval_s, options).ok()?;
    let ladder = Ladder { records: &records, noise: NoiseModel::new(&records, free, &options.noise), options };
    let mut tried = Vec::new();
    let step = ladder.pruned(ladder.given(), &mut tried);
    let silent = || {
        let none = ladder.mark(&ladder.settled(ladder.weighed(&Poles(Vec::new()), &step.weights)));
        step.last_pole().is_none_or(|place| ladder.by_chance(ladder.gain(&none, &step, &[place]), 1))
    };
    if step.fitted.poles.0.len() < 2 && silent() {
        return None;
    }
    if ladder.further(&step).is_some() {
        return None;
    }
    ChannelRingdown::of(&records, &ladder.refined(step), tried).ok()
}

/// A fit with its noise.
struct Step {
    fitted: Fitted,
    /// Under which it was fitted.
    weights: Vec<RingdownNoise>,
    /// What it leaves, where it was asked for.
    noise: OnceCell<Vec<RingdownNoise>>,
    /// Energy that each channel leaves, in its own unit; of given noise the whitened one.
    energy: Vec<f64>,
    /// Minus twice the log-likelihood under its noise, where it was asked for.
    coloured: OnceCell<f64>,
}

impl Step {
    fn last_pole(&self) -> Option<c64> {
        self.fitted.poles.0.last().copied()
    }
}

/// What later steps are compared with.
#[derive(Clone)]
struct Mark {
    poles: Poles,
    noise: Vec<RingdownNoise>,
    energy: Vec<f64>,
    /// Minus twice the log-likelihood under the weights of its fit.
    plain: f64,
    /// The same under its noise, where it was asked for.
    coloured: OnceCell<f64>,
}

struct Ladder<'a> {
    records: &'a Records<'a>,
    noise: NoiseModel<'a>,
    options: &'a ChannelOptions,
}

impl Ladder<'_> {
    fn fit(&self, start: &Poles, noise: &[RingdownNoise], arrived: f64) -> Fitted {
        Fitted::of(self.records, noise, start, self.options.least_quality_factor, arrived)
    }

    fn given_noise(&self) -> bool {
        matches!(self.options.noise, ChannelNoise::Known(_))
    }

    /// A fit under these weights, its energies in the channels' own units.
    fn weighed(&self, start: &Poles, weights: &[RingdownNoise]) -> Step {
        let fitted = self.fit(start, weights, NEARLY);
        let unit = |c: usize| if self.given_noise() { 1.0 } else { weights[c].white };
        let energy = fitted.energy.iter().enumerate().map(|(c, energy)| energy * unit(c)).collect();
        let noise = OnceCell::from(weights.to_vec());
        Step { fitted, weights: weights.to_vec(), noise, energy, coloured: OnceCell::new() }
    }

    fn mark(&self, step: &Step) -> Mark {
        let plain = step.fitted.deviance(self.records);
        let (poles, noise) = (step.fitted.poles.clone(), self.noise_of(step).to_vec());
        Mark { poles, noise, energy: step.energy.clone(), plain, coloured: step.coloured.clone() }
    }

    /// The same with each channel's weight from what it leaves, and its noise.
    fn settled(&self, step: Step) -> Step {
        if self.given_noise() {
            return step;
        }
        let weights = rescaled(self.records, &step.fitted, &step.weights);
        let mut step = self.weighed(&step.fitted.poles, &weights);
        step.noise = OnceCell::new();
        step
    }

    /// The noise that a step leaves.
    fn noise_of<'s>(&self, step: &'s Step) -> &'s [RingdownNoise] {
        step.noise.get_or_init(|| self.noise.estimated(&step.fitted, &step.weights))
    }

    /// Minus twice the log-likelihood of a fit from these poles under this noise.
    fn deviance(&self, poles: &Poles, noise: &[RingdownNoise]) -> f64 {
        self.fit(poles, noise, NEARLY).deviance(self.records)
    }

    /// Gain of twice the log-likelihood, each step under white or under coloured noise, whichever is likelier; a lower
    /// bound of it where that is more than chance.
    fn likelihood_gain(&self, before: &Mark, step: &Step, modes: usize) -> f64 {
        let plain = step.fitted.deviance(self.records);
        let coloured = before.coloured.get_or_init(|| self.deviance(&before.poles, &before.noise));
        let least = coloured.min(before.plain);
        if !self.by_chance(least - plain, modes) {
            return least - plain;
        }
        least - plain.min(*step.coloured.get_or_init(|| self.deviance(&step.fitted.poles, self.noise_of(step))))
    }

    /// Operations of a step of the fit under coloured noise.
    fn operations(&self, poles: &Poles) -> f64 {
        let columns = own_count(poles.0.len(), self.records.drift) + 2 * poles.0.len();
        self.records.all.iter().map(|record| record.values.len() as f64).sum::<f64>() * (columns * columns) as f64
    }

    /// Whether noise that is not flat over these lines can be whitened in reasonable time.
    fn is_coloured(&self, noise: &[RingdownNoise], lines: &[c64], poles: &Poles) -> bool {
        !flat(noise, lines, self.records.interval_s) && self.operations(poles) < WHITENED
    }

    /// Gain of twice the log-likelihood of a step over an earlier one, for its modes at `places`.
    ///
    /// Method: fall of the energy over the variance of what the step leaves; where noise is estimated, round these
    /// modes' lines.
    fn white_gain(&self, before: &Mark, step: &Step, places: &[c64]) -> f64 {
        let fall = |c: usize| before.energy[c] - step.energy[c];
        if self.given_noise() {
            return (0..step.energy.len()).map(fall).sum();
        }
        let rounding = &self.records.rounding;
        let degrees = degrees(self.records, &step.fitted);
        let usual: Vec<f64> = (0..degrees.len()).map(|c| (step.energy[c] / degrees[c]).max(rounding[c])).collect();
        let mut variance = usual.clone();
        if self.options.noise == ChannelNoise::Estimated {
            let left = residuals(self.records, &step.fitted);
            let local = |place: &c64| local_variances(self.records, &left, &step.fitted.poles, *place, &usual);
            let all: Vec<Vec<f64>> = places.iter().map(local).collect();
            let most = |c: usize| all.iter().map(|own| own[c]).reduce(f64::max).unwrap_or(usual[c]).max(rounding[c]);
            variance = (0..usual.len()).map(most).collect();
        }
        (0..usual.len()).map(|c| fall(c) / variance[c]).sum()
    }

    /// The same where noise is coloured: what is left of it looks like modes of a few periods. The likelihoods count too,
    /// each fit under its own noise.
    fn coloured_gain(&self, gain: f64, before: &Mark, step: &Step, modes: usize) -> f64 {
        let beyond = || self.by_chance(gain, modes) || self.operations(&step.fitted.poles) > WHITENED;
        match self.given_noise() || beyond() || self.noise_of(step).iter().all(RingdownNoise::is_white) {
            true => gain,
            false => gain.min(self.likelihood_gain(before, step, modes)),
        }
    }

    /// Gain of a step for its modes at `places`, by both.
    fn gain(&self, before: &Mark, step: &Step, places: &[c64]) -> f64 {
        self.coloured_gain(self.white_gain(before, step, places), before, step, places.len())
    }

    /// Whether noise alone would gain that much with `modes` further ones.
    fn by_chance(&self, gain: f64, modes: usize) -> bool {
        let places = self.records.longest as f64;
        let degrees = modes * (2 + 2 * self.records.all.len());
        // of what is no number nothing can be said
        gain.is_nan()
            || gain <= 0.0
            || chi_square_tail(gain, degrees) * places.powi(modes as i32) > self.options.false_alarm
    }

    /// The fit from the poles of the options.
    fn given(&self) -> Step {
        self.settled(self.weighed(&Poles(self.options.start.clone()), &self.first_noise()))
    }

    fn first_noise(&self) -> Vec<RingdownNoise> {
        match &self.options.noise {
            ChannelNoise::Known(noise) => noise.clone(),
            _ => first_noise(self.records),
        }
    }

    fn climb(&self) -> Result<(Step, Vec<OrderTried>), ModelError> {
        let (least, most) = match self.options.modes {
            ModesWanted::Fixed(count) => (count, count),
            ModesWanted::AtMost(count) => (0, count),
        };
        if let Some(found) = self.at_once(least) {
            return Ok(found);
        }
        let mut current = self.weighed(&Poles(Vec::new()), &self.first_noise());
        let mut needed = self.mark(&current);
        // without a mode all is noise: what that explains needs none
        needed.noise = self.noise_of(&self.settled(self.weighed(&Poles(Vec::new()), &self.first_noise()))).to_vec();
        let mut all_noise = Some(needed.noise.clone());
        let mut seen = Vec::new();
        let mut best: Option<Step> = None;
        let mut place = 0;
        for modes in 1..=most {
            go_on(&self.options.watch)?;
            let Some(next) = self.next(&current, all_noise.take().as_deref(), modes <= least) else { break };
            let places = &next.fitted.poles.0[place.min(modes - 1)..];
            let white = self.white_gain(&needed, &next, places);
            let gain = self.coloured_gain(white, &needed, &next, places.len());
            let kept = modes <= least || !self.by_chance(gain, modes - place);
            seen.push(OrderTried { modes, gain, kept });
            let fall = |c: usize| current.energy[c] - next.energy[c] > STRONG * current.energy[c];
            let beyond = match self.by_chance(white, modes - place) {
                _ if (0..next.energy.len()).any(fall) => most,
                true => BEYOND,
                false => BEYOND_WANDER,
            };
            if kept {
                (needed, place) = (self.mark(&next), modes);
                best = None;
            } else if modes > place + beyond {
                break;
            }
            // what is kept is the present one until a further one is tried
            let last = std::mem::replace(&mut current, next);
            if !kept && best.is_none() {
                best = Some(last);
            }
        }
        if place == 0 {
            return Err(ModelError::Degenerate("no oscillation above the noise"));
        }
        let step = best.unwrap_or(current);
        if least > 0 {
            let more = |gain| OrderTried { modes: least + 1, gain, kept: false };
            seen.extend(self.further(&step).map(more));
        }
        Ok((if least == 0 { self.pruned(step, &mut seen) } else { step }, seen))
    }

    /// A given number of modes from where the records' Hankel matrices have them; none unless each is certain and a
    /// further one would explain no more than chance does.
    fn at_once(&self, modes: usize) -> Option<(Step, Vec<OrderTried>)> {
        if modes == 0 {
            return None;
        }
        let noise = self.first_noise();
        let start = shift_invariant(self.records, &noise, modes, self.options.least_quality_factor)?;
        let step = self.settled(self.weighed(&start, &noise));
        let certain = |j: usize| !self.by_chance(step.fitted.projection.strength(j) / CERTAIN, 1);
        if !(0..modes).all(certain) || self.further(&step).is_some() {
            return None;
        }
        let none = self.mark(&self.weighed(&Poles(Vec::new()), &noise));
        let gain = self.white_gain(&none, &step, &step.fitted.poles.0);
        Some((step, vec![OrderTried { modes, gain, kept: true }]))
    }

    /// Gain of a mode more; none where it explains no more than chance does.
    fn further(&self, step: &Step) -> Option<f64> {
        let more = self.next(step, None, false)?;
        let gain = self.gain(&self.mark(step), &more, &[more.last_pole()?]);
        (!self.by_chance(gain, 1)).then_some(gain)
    }

    /// The best fit with a mode more; none where nothing is left that may be one, unless one is `wanted`.
    ///
    /// Starts are the bank's best places under the present noise and under its white part alone: ringing that is not
    /// yet fitted looks like wander, and wander like ringing. The banks' further places are tried where the best ones
    /// gain no more than noise may. `other`: one more noise under which places are looked for.
    fn next(&self, current: &Step, other: Option<&[RingdownNoise]>, wanted: bool) -> Option<Step> {
        let least_q = self.options.least_quality_factor;
        let bank = Bank::of(self.records, &current.fitted, least_q);
        let places = |noise: &[RingdownNoise]| bank.candidates(noise, &current.fitted.poles, CANDIDATES);
        let noise = self.noise_of(current);
        let plain: Vec<RingdownNoise> = noise.iter().map(|noise| RingdownNoise::white(noise.white)).collect();
        let mut banks = vec![places(noise)];
        if noise != plain {
            banks.push(places(&plain));
        }
        banks.extend(other.map(places));
        let before = self.mark(current);
        let mut found: Option<Step> = None;
        let mut tried: Vec<Poles> = Vec::new();
        let cost = |step: &Step| -> f64 { step.fitted.energy.iter().sum() };
        for rank in 0..CANDIDATES {
            for (gain, start) in banks.iter().filter_map(|bank| bank.get(rank)) {
                if tried.contains(start) || !wanted && self.by_chance(gain / BANK, 1) {
                    continue;
                }
                tried.push(start.clone());
                let step = self.weighed(start, &current.weights);
                if found.as_ref().is_none_or(|best| cost(&step) < cost(best)) {
                    found = Some(step);
                }
            }
            let Some(best) = &found else { continue };
            let last = best.fitted.poles.0.len() - 1;
            if rank + 1 == CANDIDATES || !self.by_chance(self.gain(&before, best, &best.fitted.poles.0[last..]), 1) {
                break;
            }
        }
        found.map(|step| self.settled(step))
    }

    /// Leaves out modes without which the others explain as much.
    fn pruned(&self, step: Step, seen: &mut Vec<OrderTried>) -> Step {
        let mut step = step;
        loop {
            let count = step.fitted.poles.0.len();
            if count < 2 {
                return step;
            }
            let without = |j: usize| {
                let mut poles = step.fitted.poles.clone();
                let place = poles.0.remove(j);
                let smaller = self.weighed(&poles, &step.weights);
                (self.gain(&self.mark(&self.settled(smaller)), &step, &[place]), poles)
            };
            let doubtful = |j: &usize| self.by_chance(step.fitted.projection.strength(*j) / CERTAIN, 1);
            let least = (0..count).filter(doubtful).map(without).min_by(|a, b| a.0.total_cmp(&b.0));
            match least {
                Some((gain, smaller)) if self.by_chance(gain, 1) => {
                    seen.push(OrderTried { modes: count - 1, gain, kept: true });
                    step = self.settled(self.weighed(&smaller, &step.weights));
                }
                _ => return step,
            }
        }
    }

    /// Noise and fit in turns to the end, and the level of the noise round each mode over that of the fit, per channel.
    ///
    /// Method: noise that is flat over each mode's line needs no whitening: least squares, each channel with the level
    /// of its noise round the modes, and errors with the level at each.
    fn refined(&self, step: Step) -> Refined {
        let mut noise = self.noise_of(&step).to_vec();
        let Step { mut fitted, .. } = step;
        let level =
            |noise: &RingdownNoise, s: &c64| density(noise, self.records.interval_s, s.im * self.records.interval_s);
        let even = !self.given_noise() && !self.is_coloured(&noise, &fitted.poles.0, &fitted.poles);
        if even {
            let poles = fitted.poles.0.clone();
            let mean = |noise: &RingdownNoise| poles.iter().map(|s| level(noise, s)).sum::<f64>() / poles.len() as f64;
            // the level of one channel's white noise moves no pole
            let rounds = if noise.len() == 1 && noise[0].is_white() { 1 } else { NOISE_ROUNDS };
            for round in 0..rounds {
                let white: Vec<RingdownNoise> = noise.iter().map(|noise| RingdownNoise::white(mean(noise))).collect();
                fitted = self.fit(&fitted.poles, &white, if round + 1 == rounds { ARRIVED } else { NEARLY });
                noise = match noise.iter().all(RingdownNoise::is_white) {
                    true => rescaled(self.records, &fitted, &white),
                    false => self.noise.estimated(&fitted, &white),
                };
            }
            let white: Vec<RingdownNoise> = noise.iter().map(|noise| RingdownNoise::white(mean(noise))).collect();
            fitted = self.fit(&fitted.poles, &white, ARRIVED);
            let levels = noise
                .iter()
                .zip(&white)
                .map(|(noise, white)| fitted.poles.0.iter().map(|s| level(noise, s) / white.white).collect())
                .collect();
            return Refined { fitted, noise, levels };
        }
        if !self.given_noise() {
            fitted = self.fit(&fitted.poles, &noise, NEARLY);
        }
        for _ in 0..NOISE_ROUNDS {
            noise = self.noise.estimated(&fitted, &noise);
            fitted = self.fit(&fitted.poles, &noise, ARRIVED);
        }
        if !self.given_noise() {
            noise = rescaled(self.records, &fitted, &noise);
            fitted = self.fit(&fitted.poles, &noise, ARRIVED);
        }
        let levels = vec![vec![1.0; fitted.poles.0.len()]; self.records.channels];
        Refined { fitted, noise, levels }
    }
}

/// The last fit.
pub(super) struct Refined {
    pub fitted: Fitted,
    pub noise: Vec<RingdownNoise>,
    /// Per channel and mode: density of the noise at the mode over the level under which it was fitted.
    pub levels: Vec<Vec<f64>>,
}

impl Refined {
    /// Numbers of the modes, ascending by natural frequency.
    pub fn order(&self) -> Vec<usize> {
        let poles = &self.fitted.poles.0;
        let mut order: Vec<usize> = (0..poles.len()).collect();
        order.sort_by(|&a, &b| poles[a].norm().total_cmp(&poles[b].norm()));
        order
    }
}
