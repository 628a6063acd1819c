//! How many modes there are: one after the other, each judged by what it explains.

use super::bank::candidates;
use super::basis::Poles;
use super::fit::{ARRIVED, Fitted, NEARLY};
use super::noise::{estimated, first_noise, rescaled};
use super::options::{ChannelNoise, ChannelOptions, ModesWanted};
use super::records::Records;
use super::result::{ChannelRingdown, OrderTried};
use crate::model::{ModelError, finite};
use crate::ringdown::RingdownNoise;
use crate::statistics::chi_square_tail;

/// Candidates of the bank that are tried for each further mode.
const CANDIDATES: usize = 2;
/// Numbers of modes tried beyond the last one that was needed: two together may explain what neither does alone.
const BEYOND: usize = 1;
/// Share of a mode's gain that the bank sees at least: its places are coarse, and other modes have moved.
const BANK: f64 = 0.5;
/// Weighted square of a mode's amplitudes over its gain from which on no fit without it is tried.
const CERTAIN: f64 = 10.0;
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
    for stretch in free.iter().flatten() {
        finite("free stretch", stretch)?;
    }
    let records = Records::of(events, interval_s, options)?;
    let ladder = Ladder { records: &records, free, options };
    let (step, seen) = if options.start.is_empty() { ladder.climb()? } else { (ladder.given(), Vec::new()) };
    let (fitted, noise) = ladder.refined(step);
    ChannelRingdown::of(&records, fitted, noise, seen)
}

/// A fit with its noise.
struct Step {
    fitted: Fitted,
    noise: Vec<RingdownNoise>,
    deviance: f64,
}

struct Ladder<'a> {
    records: &'a Records<'a>,
    free: &'a [Vec<&'a [f64]>],
    options: &'a ChannelOptions,
}

impl Ladder<'_> {
    fn fit(&self, start: &Poles, noise: &[RingdownNoise], arrived: f64) -> Fitted {
        Fitted::of(self.records, noise, start, self.options.least_quality_factor, arrived)
    }

    /// The noise of a fit, and the fit under that noise.
    fn settled(&self, fitted: &Fitted, noise: &[RingdownNoise]) -> Step {
        let noise = estimated(self.records, self.free, fitted, noise, &self.options.noise);
        let fitted = self.fit(&fitted.poles, &noise, NEARLY);
        let deviance = self.deviance(&fitted);
        Step { fitted, noise, deviance }
    }

    fn deviance(&self, fitted: &Fitted) -> f64 {
        match &self.options.noise {
            // given variances are not scaled
            ChannelNoise::Known(_) => fitted.energy.iter().chain(&fitted.log_variance).sum(),
            _ => fitted.deviance(self.records),
        }
    }

    /// Whether noise alone would gain that much with `modes` further ones.
    fn by_chance(&self, gain: f64, modes: usize) -> bool {
        let places = self.records.longest as f64;
        let degrees = modes * (2 + 2 * self.records.all.len());
        gain <= 0.0 || chi_square_tail(gain, degrees) * places.powi(modes as i32) > self.options.false_alarm
    }

    /// The fit from the poles of the options.
    fn given(&self) -> Step {
        let first = self.first_noise();
        let fitted = self.fit(&Poles(self.options.start.clone()), &first, NEARLY);
        self.settled(&fitted, &first)
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
        let first = self.first_noise();
        let fitted = self.fit(&Poles(Vec::new()), &first, NEARLY);
        // without a mode all is noise: what that explains needs none
        let rest = self.settled(&fitted, &first);
        let mut needed = self.deviance(&fitted).min(rest.deviance);
        let mut current = Step { fitted, noise: first, deviance: needed };
        let mut all_noise = Some(rest.noise);
        let mut seen = Vec::new();
        let mut best: Option<Step> = None;
        let mut place = 0;
        for modes in 1..=most {
            let Some(next) = self.next(&current, all_noise.take().as_deref(), modes <= least) else { break };
            let gain = needed - next.deviance;
            let kept = modes <= least || !self.by_chance(gain, modes - place);
            seen.push(OrderTried { modes, gain, kept });
            if kept {
                (needed, place) = (next.deviance, modes);
                best = None;
            } else if modes > place + BEYOND {
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
        Ok((if least == 0 { self.pruned(step, &mut seen) } else { step }, seen))
    }

    /// The best fit with a mode more; none where nothing is left that may be one, unless one is `wanted`.
    ///
    /// Starts are the bank's best places under the present noise and under its white part alone: ringing that is not
    /// yet fitted looks like wander, and wander like ringing. The banks' further places are tried where the best ones
    /// gain no more than noise may. `other`: one more noise under which places are looked for.
    fn next(&self, current: &Step, other: Option<&[RingdownNoise]>, wanted: bool) -> Option<Step> {
        let least_q = self.options.least_quality_factor;
        let places = |noise: &[RingdownNoise]| candidates(self.records, noise, &current.fitted, least_q, CANDIDATES);
        let plain: Vec<RingdownNoise> = current.noise.iter().map(|noise| RingdownNoise::white(noise.white)).collect();
        let mut banks = vec![places(&current.noise)];
        if current.noise != plain {
            banks.push(places(&plain));
        }
        banks.extend(other.map(places));
        let mut found: Option<Step> = None;
        let mut tried: Vec<Poles> = Vec::new();
        for rank in 0..CANDIDATES {
            for (gain, start) in banks.iter().filter_map(|bank| bank.get(rank)) {
                if tried.contains(start) || !wanted && self.by_chance(gain / BANK, 1) {
                    continue;
                }
                tried.push(start.clone());
                let step = self.settled(&self.fit(start, &current.noise, NEARLY), &current.noise);
                if found.as_ref().is_none_or(|best| step.deviance < best.deviance) {
                    found = Some(step);
                }
            }
            let best = found.as_ref().map_or(f64::INFINITY, |best| best.deviance);
            if !self.by_chance(current.deviance - best, 1) {
                break;
            }
        }
        found
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
                poles.0.remove(j);
                self.settled(&self.fit(&poles, &step.noise, NEARLY), &step.noise)
            };
            let doubtful = |j: &usize| self.by_chance(step.fitted.projection.strength(*j) / CERTAIN, 1);
            let least = (0..count).filter(doubtful).map(without).min_by(|a, b| a.deviance.total_cmp(&b.deviance));
            match least {
                Some(smaller) if self.by_chance(smaller.deviance - step.deviance, 1) => {
                    let gain = smaller.deviance - step.deviance;
                    seen.push(OrderTried { modes: count - 1, gain, kept: true });
                    step = smaller;
                }
                _ => return step,
            }
        }
    }

    /// Noise and fit in turns to the end.
    fn refined(&self, step: Step) -> (Fitted, Vec<RingdownNoise>) {
        let Step { mut fitted, mut noise, .. } = step;
        for _ in 0..NOISE_ROUNDS {
            noise = estimated(self.records, self.free, &fitted, &noise, &self.options.noise);
            fitted = self.fit(&fitted.poles, &noise, ARRIVED);
        }
        if !matches!(self.options.noise, ChannelNoise::Known(_)) {
            noise = rescaled(self.records, &fitted, &noise);
            fitted = self.fit(&fitted.poles, &noise, ARRIVED);
        }
        (fitted, noise)
    }
}
