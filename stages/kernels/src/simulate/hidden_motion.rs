//! The motion of the tip with causes hidden in it, integrated in time.

use super::afm_system::AfmSystem;
use super::contact::Contact;
use super::detector::Detector;
use super::lever::ModalLever;
use super::motion::{ContactEvent, Drive, Motion, Run, Sampling, simulate_motion};
use super::optics::Optics;
use super::propagator::Propagator;
use crate::effects::{Effects, Motion as ModalMotion};
use crate::events::EventKind;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// Simulates a record with causes hidden in it.
///
/// # Model
/// As [`simulate_motion`], and: from a release on, the tip feels the share of the pull-off force that [`Effects::load`]
/// leaves; modal forces act always, with the gap since the release (the base's own motion included; zero while
/// attached; the distance from the surface before any release); the optics' maps act on the lever's signal before the
/// poles. Further modes, sections and feedthrough are part of `system`.
///
/// # Method
/// Exact linear propagation between instants so close that the load runs straight from one to the next within a
/// millionth (halved where it does not), which is exact for a straight load. Modal forces by Strang splitting: half a
/// kick, the exact linear flow with its thermal noise, half a kick, in steps in which the fastest mode turns by less
/// than a fraction of a radian while the lever rings, of a sample while it rests. Optics: what a map adds to the
/// lever's signal goes through poles and sections by itself, on straight lines between several points per sample.
///
/// # Accuracy
/// Loads: 1e-6 of the pull-off force. Modal forces: second order, about `STEP_RADIANS^2 / 12`, 1 % of their effect on
/// the fastest mode and 1e-4 of that on a mode ten times slower (halving tested). Optics: `(w / (8 rate))^2 / 12` of
/// what they add, 0.2 % at a fifth of the rate. With nothing hidden: the bits of [`simulate_motion`].
#[allow(clippy::too_many_arguments, reason = "the microscope's parts, and what is hidden")]
pub fn simulate_hidden(
    system: &AfmSystem,
    lever: &ModalLever,
    contact: &Contact,
    detector: &Detector,
    drive: &Drive,
    sampling: Sampling,
    effects: &Effects,
    rng: &mut ChaCha8Rng,
) -> Motion {
    let bent = effects.bend_the_motion() || effects.outlast_the_release();
    if !bent && effects.optics.is_empty() && system.signal_direct_m_per_n == 0.0 {
        return simulate_motion(system, lever, contact, drive, sampling, rng);
    }
    let mut run = Run::start(system, lever, contact, drive, sampling, rng);
    let mut hidden = bent.then(|| Hidden::new(effects, lever, detector.sensitivity_v_per_m, sampling.interval_s));
    let mut optics = (!effects.optics.is_empty()).then(|| Optics::new(system, detector, effects, sampling.interval_s));
    let (mut signal_m, mut force_n) = (Vec::with_capacity(sampling.samples), Vec::with_capacity(sampling.samples));
    for k in 0..sampling.samples {
        let force = run.force_n();
        let added = optics.as_mut().map_or(0.0, |optics| optics.added_m(&run));
        force_n.push(force);
        signal_m.push(run.signal_m() + system.signal_direct_m_per_n * force + added);
        let end_s = sampling.start_s + (k + 1) as f64 * sampling.interval_s;
        match &mut hidden {
            Some(hidden) => run.advance_hidden(hidden, end_s, rng),
            None => run.advance_to(end_s, rng),
        }
    }
    Motion { signal_m, force_n, events: run.into_events() }
}

/// How far a load may depart from a straight line in a step, of the pull-off force.
pub const LOAD_TOLERANCE: f64 = 1e-6;
/// How far the fastest mode turns in a step at most where modal forces act, rad.
pub const STEP_RADIANS: f64 = 0.35;
/// Steps are halved at most this often: 0.05 ns at 5 MS/s, over which a jump of the load is smeared.
const MAX_HALVINGS: i32 = 12;
/// Time constants of the slowest mode after which its ringing has gone: a factor 6e-6.
const RINGING: f64 = 12.0;
/// Loads below this share count as gone.
const LOAD_FLOOR: f64 = 1e-9;

/// The last release.
#[derive(Debug, Clone, Copy)]
struct Release {
    time_s: f64,
    /// Force on the tip just before it, N.
    force_n: f64,
    /// Gap at the crossing of the threshold, m.
    gap_m: f64,
}

/// What is hidden in the motion, and the state of its integration.
pub(super) struct Hidden<'a> {
    effects: &'a Effects,
    volts_per_m: f64,
    /// Volts of static deflection per metre of each mode.
    volts_per_modal_m: Vec<f64>,
    omega: Vec<f64>,
    /// When the load is gone, s after the release.
    gone_s: f64,
    /// Longest step where modal forces matter, s.
    longest_s: f64,
    /// How long that is after a change of the contact, s.
    ringing_s: f64,
    /// Until when that is.
    fine_until_s: f64,
    release: Option<Release>,
    ladders: [Ladder; 3],
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    /// What the last kick gave the tip, m/s^2.
    tip_acceleration: f64,
}

impl<'a> Hidden<'a> {
    pub(super) fn new(effects: &'a Effects, lever: &ModalLever, volts_per_m: f64, interval_s: f64) -> Self {
        let omega: Vec<f64> = lever.modes.iter().map(|mode| TAU * mode.frequency_hz).collect();
        let fastest = omega.iter().copied().fold(0.0, f64::max);
        let mut longest_s = interval_s;
        while effects.bend_the_motion() && longest_s * fastest > STEP_RADIANS {
            longest_s *= 0.5;
        }
        let decay = |mode: &crate::simulate::lever::Mode| 2.0 * mode.quality_factor / (TAU * mode.frequency_hz);
        let slowest = lever.modes.iter().map(decay).fold(0.0, f64::max);
        let modes = omega.len();
        Self {
            effects,
            volts_per_m,
            volts_per_modal_m: lever.modes.iter().map(|mode| volts_per_m / mode.tip_share).collect(),
            omega,
            gone_s: last_share(|t| effects.load(t)),
            longest_s,
            ringing_s: RINGING * slowest,
            fine_until_s: f64::NEG_INFINITY,
            release: None,
            ladders: Default::default(),
            position: vec![0.0; modes],
            velocity: vec![0.0; modes],
            acceleration: vec![0.0; modes],
            tip_acceleration: 0.0,
        }
    }

    /// Force of the load that outlasts the threshold's crossing, at `time_s`, N.
    fn force_n(&self, time_s: f64) -> f64 {
        let Some(release) = self.release else { return 0.0 };
        let age = time_s - release.time_s;
        let share = if age > self.gone_s { 0.0 } else { self.effects.load(age.max(0.0)) };
        release.force_n * share
    }

    /// Whether the load runs straight over a step.
    fn straight(&self, time_s: f64, span_s: f64) -> bool {
        let Some(release) = self.release else { return true };
        if time_s - release.time_s > self.gone_s {
            return true;
        }
        let (start, end) = (self.force_n(time_s), self.force_n(time_s + span_s));
        [0.25, 0.5, 0.75].iter().all(|share| {
            let line = start + share * (end - start);
            (self.force_n(time_s + share * span_s) - line).abs() <= LOAD_TOLERANCE * release.force_n.abs()
        })
    }
}

/// The largest time at which `share` is not gone, to 1e-12 s; zero if it never is anything.
fn last_share(share: impl Fn(f64) -> f64) -> f64 {
    let ladder = || (0..=400).rev().map(|i| 1e-10 * 10f64.powf(f64::from(i) / 40.0));
    let Some(mut low) = ladder().find(|t| share(*t).abs() > LOAD_FLOOR) else {
        return if share(0.0).abs() > LOAD_FLOOR { 1e-10 } else { 0.0 };
    };
    let mut high = low * 10f64.powf(1.0 / 40.0);
    while high - low > 1e-12 {
        let middle = 0.5 * (low + high);
        if share(middle).abs() > LOAD_FLOOR {
            low = middle
        } else {
            high = middle
        }
        if middle == low && middle == high {
            break;
        }
    }
    high
}

/// Compiled steps of one regime: a sample halved again and again, and the last odd length.
#[derive(Debug, Default)]
struct Ladder {
    halved: Vec<Option<Propagator>>,
    odd: Option<(f64, Propagator)>,
}

impl Ladder {
    fn step(
        &mut self,
        system: &crate::simulate::discretisation::LinearSystem,
        interval_s: f64,
        span_s: f64,
    ) -> &Propagator {
        let level = (0..=MAX_HALVINGS).find(|&k| span_s == interval_s * 0.5f64.powi(k));
        match level {
            Some(level) => {
                let level = level as usize;
                if self.halved.len() <= level {
                    self.halved.resize(level + 1, None);
                }
                self.halved[level].get_or_insert_with(|| Propagator::new(&system.step(span_s)))
            }
            None => {
                if self.odd.as_ref().is_some_and(|(length, _)| *length != span_s) {
                    self.odd = None;
                }
                &self.odd.get_or_insert_with(|| (span_s, Propagator::new(&system.step(span_s)))).1
            }
        }
    }
}

impl Run<'_> {
    /// Advances to `end_s` with what is hidden.
    pub(super) fn advance_hidden(&mut self, hidden: &mut Hidden, end_s: f64, rng: &mut ChaCha8Rng) {
        let mut whole = true;
        while self.time_s < end_s {
            let kink_s = self.drive.ramp.end_s(self.half);
            let stop_s = end_s.min(kink_s);
            whole = whole && stop_s == end_s;
            let span_s = if whole { self.interval_s } else { stop_s - self.time_s };
            if span_s > 0.0 && self.walk(hidden, span_s, rng) {
                whole = false;
                continue;
            }
            self.time_s = stop_s;
            if stop_s == kink_s {
                self.half += 1;
            }
            self.load = hidden.release.map(|_| (hidden.force_n(stop_s), 0.0));
            self.arm();
        }
    }

    /// Advances to `end_s` within a sample, where nothing changes on the way.
    pub(super) fn advance_within(&mut self, hidden: &mut Option<Hidden>, end_s: f64, rng: &mut ChaCha8Rng) {
        let span_s = end_s - self.time_s;
        if span_s <= 0.0 {
            return;
        }
        match hidden {
            Some(hidden) => {
                self.walk(hidden, span_s, rng);
                self.load = hidden.release.map(|_| (hidden.force_n(end_s), 0.0));
            }
            None => self.state = self.path(span_s),
        }
        self.time_s = end_s;
        self.arm();
    }

    /// Goes on by `span_s` in steps short enough; true: the regime changed on the way.
    fn walk(&mut self, hidden: &mut Hidden, span_s: f64, rng: &mut ChaCha8Rng) -> bool {
        let shortest = self.interval_s * 0.5f64.powi(MAX_HALVINGS);
        let straight = self.held_n.is_some() || hidden.straight(self.time_s, span_s);
        let longest_s = if self.time_s < hidden.fine_until_s { hidden.longest_s } else { self.interval_s };
        if span_s > longest_s || !straight && span_s > shortest {
            let half = 0.5 * span_s;
            return self.walk(hidden, half, rng) || self.walk(hidden, half, rng);
        }
        self.hop(hidden, span_s, rng)
    }

    /// One step; true: the regime changed in it, and the time is that of the change.
    fn hop(&mut self, hidden: &mut Hidden, span_s: f64, rng: &mut ChaCha8Rng) -> bool {
        for deviate in &mut self.deviates {
            *deviate = StandardNormal.sample(rng);
        }
        self.kick(hidden, 0.5 * span_s);
        self.kicked = (hidden.tip_acceleration, span_s);
        let force = hidden.force_n(self.time_s);
        self.load = hidden.release.map(|_| (force, (hidden.force_n(self.time_s + span_s) - force) / span_s));
        let (first, second) = self.inputs();
        let (regime, interval_s) = (self.regime(), self.interval_s);
        let ladder = &mut hidden.ladders[self.regime_index()];
        ladder.step(regime, interval_s, span_s).advance(&self.state, first, second, &self.deviates, &mut self.next);
        if self.excess(&self.next, self.time_s + span_s) > 0.0 {
            let before_s = self.time_s;
            self.switch(span_s);
            self.kicked = (0.0, 0.0);
            self.kick(hidden, self.time_s - before_s - 0.5 * span_s);
            self.note_change(hidden);
            return true;
        }
        std::mem::swap(&mut self.state, &mut self.next);
        self.time_s += span_s;
        self.kicked = (0.0, 0.0);
        self.kick(hidden, 0.5 * span_s);
        self.arm();
        false
    }

    /// Begins or ends what follows a release.
    pub(super) fn note_change(&mut self, hidden: &mut Hidden) {
        let Some(&ContactEvent { kind, time_s, force_n, .. }) = self.last_event() else { return };
        hidden.fine_until_s = time_s + hidden.ringing_s;
        match kind {
            EventKind::SnapIn => {
                hidden.release = None;
                self.load = None;
            }
            EventKind::SnapOff => {
                let height = self.drive.height_m(self.half, time_s);
                let gap_m = self.system.gap_m(&self.state, height);
                hidden.release = Some(Release { time_s, force_n, gap_m });
                self.load = Some((hidden.force_n(self.time_s), 0.0));
            }
        }
    }

    /// Modal forces act on the rates for `weight_s`.
    fn kick(&mut self, hidden: &mut Hidden, weight_s: f64) {
        if hidden.effects.modal_force.is_empty() {
            return;
        }
        let gap_m = match (self.held_n, hidden.release) {
            (Some(_), _) => 0.0,
            (None, release) => {
                let height = self.drive.height_m(self.half, self.time_s);
                self.system.gap_m(&self.state, height) - release.map_or(0.0, |release| release.gap_m)
            }
        };
        for (n, scale) in hidden.volts_per_modal_m.iter().enumerate() {
            hidden.position[n] = scale * self.state[2 * n];
            hidden.velocity[n] = scale * hidden.omega[n] * self.state[2 * n + 1];
        }
        hidden.acceleration.fill(0.0);
        let motion = ModalMotion {
            position: &hidden.position,
            velocity: &hidden.velocity,
            omega: &hidden.omega,
            gap: hidden.volts_per_m * gap_m,
            thermal: 0.0,
        };
        for force in &hidden.effects.modal_force {
            force.add(&motion, &mut hidden.acceleration);
        }
        for (n, scale) in hidden.volts_per_modal_m.iter().enumerate() {
            self.state[2 * n + 1] += weight_s * hidden.acceleration[n] / (scale * hidden.omega[n]);
        }
        let tip = hidden.acceleration.iter().zip(&hidden.volts_per_modal_m).map(|(a, scale)| a / scale);
        hidden.tip_acceleration = tip.sum();
    }
}
