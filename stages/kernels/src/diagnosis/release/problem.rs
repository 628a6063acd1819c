//! The data of a joint fit, and what is known beforehand.

use std::sync::Arc;

use faer::Mat;

use super::lever::{Lever, LeverMode};
use super::prepared::Prepared;
use super::signals::Signals;
use super::state::State;
use super::stepper::Release;
use super::window::{Cut, EventWindow};
use crate::model::ModelError;
use crate::ringdown::internals::Whitener;
use crate::ringdown::{EventParameters, RingdownNoise, ThermalMode};

/// The data and what is known beforehand.
pub struct Problem<'a> {
    /// The events.
    pub windows: &'a [EventWindow],
    /// How their windows are cut.
    pub cut: Cut,
    /// Noise that they are weighted with.
    pub noise: RingdownNoise,
    /// Nominal detector poles, rad/s.
    pub nominal_poles: Vec<f64>,
    /// Standard deviation of their logarithms.
    pub pole_std: f64,
    /// What free exponentials say of the modes; weakly held, so that no weak mode runs off to absorb a misfit of
    /// another kind.
    pub seen: Vec<SeenMode>,
    /// Whether modes stay near what free exponentials show: a weak one may otherwise run off to a few turns and take what
    /// a cause does at the release. Not at first: fits that have far to go, as that of a rupture, stop at the bound.
    pub confined: bool,
    /// What follows from cut and noise, made when it is asked for; `Prepared::default()`.
    pub prepared: Prepared,
}

/// A mode as free exponentials show it, and how weakly the fit is held to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenMode {
    /// The mode.
    pub mode: LeverMode,
    /// Standard deviations of ln w and ln Q.
    pub std: [f64; 2],
}

/// Samples by which an onset may pass its interval: a release begins with the fifth power of time (a mode and three
/// poles), so that at a fifth of a sample the model still is right to a hundred-thousandth.
const SLACK: f64 = 0.2;

/// Factor by which a confined mode's quality factor may differ from that of free exponentials: a cause biases those by
/// tens of per cent.
const STRAY: f64 = 3.0;

impl Problem<'_> {
    /// The same knowledge about other events.
    pub fn with_windows<'b>(&self, windows: &'b [EventWindow]) -> Problem<'b> {
        Problem {
            windows,
            cut: self.cut,
            noise: self.noise.clone(),
            nominal_poles: self.nominal_poles.clone(),
            pole_std: self.pole_std,
            seen: self.seen.clone(),
            confined: self.confined,
            prepared: self.prepared.of_a_part(),
        }
    }

    /// Whether an event's onset has left the interval before its release sample by more than [`SLACK`].
    pub(super) fn have_passed(&self, state: &State) -> bool {
        state.events.iter().any(|own| self.has_passed(own))
    }

    fn has_passed(&self, own: &EventParameters) -> bool {
        let onset = own.onset_s / self.cut.interval_s;
        !(-1.0 - SLACK..=SLACK).contains(&onset)
    }

    /// Starts of the windows for the events' present onsets. Errors: an event that leaves its samples.
    pub(super) fn starts(&self, state: &mut State, starts: &mut [usize]) -> Result<(), ModelError> {
        for ((own, start), window) in state.events.iter_mut().zip(starts.iter_mut()).zip(self.windows) {
            if !self.has_passed(own) {
                // a start that was carried over from other events may lie beyond this one's samples
                if *start + self.cut.samples > window.values.len() {
                    return Err(ModelError::Degenerate("an onset left its window"));
                }
                continue;
            }
            let onset = *start as f64 + self.cut.before as f64 + own.onset_s / self.cut.interval_s;
            let next = window.start(onset, &self.cut).ok_or(ModelError::Degenerate("an onset left its window"))?;
            own.onset_s += (*start as f64 - next as f64) * self.cut.interval_s;
            *start = next;
        }
        Ok(())
    }

    pub(super) fn whitener(&self) -> Arc<Whitener> {
        self.prepared.whitener(|| Whitener::new(&self.noise, self.cut.interval_s, self.cut.samples, &[]))
    }

    /// The events cut at `starts` and whitened.
    pub(super) fn data(&self, whitener: &Whitener, starts: &[usize]) -> Signals {
        let mut out = Signals::with_capacity(self.cut.samples, starts.len());
        for (window, &start) in self.windows.iter().zip(starts) {
            out.push(&window.values[start..start + self.cut.samples]);
        }
        out.whiten(whitener);
        out
    }

    /// Standard deviation of the first mode's thermal motion, V of its modal coordinate.
    fn thermal(&self) -> f64 {
        let Some(first) = self.seen.first().map(|seen| seen.mode) else { return 0.0 };
        let own = |mode: &&ThermalMode| (mode.pole.im / first.omega - 1.0).abs();
        let motion = self.noise.thermal.iter().min_by(|a, b| own(a).total_cmp(&own(b)));
        let seen = motion.filter(|mode| own(mode) < 0.1).map_or(0.0, |mode| mode.variance.sqrt());
        if first.share == 0.0 { 0.0 } else { seen / first.share.abs() }
    }

    /// An event as it is to be simulated.
    pub(super) fn release(&self, own: &EventParameters) -> Release {
        Release {
            amplitude: own.amplitude,
            lead_s: -own.onset_s,
            before: self.cut.before,
            samples: self.cut.samples,
            interval_s: self.cut.interval_s,
            thermal: self.thermal(),
        }
    }

    /// The state with every mode's quality factor as far as it may be from what free exponentials show.
    pub(super) fn confined(&self, mut state: State) -> State {
        for (mode, seen) in state.lever.modes.iter_mut().zip(&self.seen).filter(|_| self.confined) {
            let quality = seen.mode.quality_factor;
            mode.quality_factor = mode.quality_factor.clamp(quality / STRAY, quality * STRAY);
        }
        state
    }

    /// The same, its modes [confined](Self::confined), where one has run off in a fit; else none.
    pub(super) fn where_a_mode_ran_off(&self, fitted: &State) -> Option<Self> {
        let ran_off = |(mode, seen): (&LeverMode, &SeenMode)| {
            (mode.quality_factor / seen.mode.quality_factor).ln().abs() > STRAY.ln()
        };
        let any = !self.confined && fitted.lever.modes.iter().zip(&self.seen).any(ran_off);
        any.then(|| Self {
            noise: self.noise.clone(),
            nominal_poles: self.nominal_poles.clone(),
            seen: self.seen.clone(),
            prepared: self.prepared.of_a_part(),
            confined: true,
            ..*self
        })
    }

    /// Parameters of which something is known: number, distance from it, its standard deviation.
    fn known(&self, lever: &Lever) -> Vec<(usize, f64, f64)> {
        let first = lever.parameters().len() - lever.poles.len();
        let poles = lever.poles.iter().zip(&self.nominal_poles).enumerate();
        let poles = poles.map(|(k, (pole, nominal))| (first + k, (pole / nominal).ln(), self.pole_std));
        let modes = lever.modes.iter().zip(&self.seen).enumerate().flat_map(|(m, (now, seen))| {
            [
                (2 * m, (now.omega / seen.mode.omega).ln(), seen.std[0]),
                (2 * m + 1, (now.quality_factor / seen.mode.quality_factor).ln(), seen.std[1]),
            ]
        });
        poles.chain(modes).collect()
    }

    pub(super) fn prior_cost(&self, lever: &Lever) -> f64 {
        self.known(lever).iter().map(|(_, distance, std)| (distance / std).powi(2)).sum()
    }

    pub(super) fn add_prior(&self, lever: &Lever, information: &mut Mat<f64>, gradient: &mut [f64]) {
        for (parameter, distance, std) in self.known(lever) {
            information[(parameter, parameter)] += std.powi(-2);
            gradient[parameter] -= distance / (std * std);
        }
    }
}
