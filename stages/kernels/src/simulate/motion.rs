//! The piecewise-linear motion of the tip through one record.

use super::afm_system::AfmSystem;
use super::contact::Contact;
use super::discretisation::LinearSystem;
use super::lever::ModalLever;
use super::propagator::Propagator;
use super::ramp::TriangleRamp;
use crate::events::EventKind;
use crate::linear_algebra::dot;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// One change of regime.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEvent {
    /// Which way.
    pub kind: EventKind,
    /// When, on the ramp's clock, s.
    pub time_s: f64,
    /// Force on the tip just before a snap-off (negative: pulled to the sample) or just after a snap-in, N; at a
    /// snap-off minus the pull-off force.
    pub force_n: f64,
    /// The quasi-static load of the attached lever at this height of the base, N: what a slow instrument reads.
    /// At a snap-off it is smaller than the pull-off force by the thermal peak that made the difference.
    pub load_n: f64,
}

/// What moves the lever in one record.
#[derive(Debug, Clone)]
pub struct Drive<'a> {
    /// The piezo.
    pub ramp: TriangleRamp,
    /// Height of the surface on the ramp's scale, m.
    pub surface_m: f64,
    /// Pull-off force of each cycle, N; cycle 0 is the one running at time zero, the last entry serves all later ones.
    pub pull_off_n: &'a [f64],
}

/// Where the lever is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// First instant, s on the ramp's clock.
    pub start_s: f64,
    /// Distance of the instants, s.
    pub interval_s: f64,
    /// Number of instants.
    pub samples: usize,
}

/// The simulated motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Detector output at each instant, as static deflection, m.
    pub signal_m: Vec<f64>,
    /// Force of the sample on the tip at each instant, N: zero while free, negative while it holds the tip.
    pub force_n: Vec<f64>,
    /// Every change of regime, in time.
    pub events: Vec<ContactEvent>,
}

impl Drive<'_> {
    /// Pull-off force of the cycle that holds half-cycle `half`.
    pub fn pull_off_in(&self, half: i64) -> f64 {
        let cycle = usize::try_from(half.div_euclid(2)).unwrap_or(0).min(self.pull_off_n.len().saturating_sub(1));
        self.pull_off_n.get(cycle).copied().unwrap_or(f64::INFINITY)
    }

    /// Base above the surface, m.
    pub fn height_m(&self, half: i64, t_s: f64) -> f64 {
        self.ramp.height_m(half, t_s) - self.surface_m
    }
}

/// Event times are found to this share of a sample (0.6 s in double precision resolve 5e-10 of 0.2 us).
const CROSSING_TOLERANCE: f64 = 1e-8;

/// Simulates a record.
///
/// # Model
/// [`AfmSystem`]: between events a linear stochastic system, switched by the rules of [`Contact`].
///
/// # Method
/// One precomputed exact step per sample and regime; a step that would cross a kink of the ramp is cut there, one
/// that ends beyond a threshold is cut at the crossing, which is found on the exact path with the step's own deviates
/// (its noise scaled by the exact noise factor of the shorter step) by regula falsi (Illinois). The initial
/// state is drawn from the regime's stationary distribution.
///
/// # Accuracy
/// No integration error. Event times to 1e-8 of a sample. A crossing is missed only when the path goes over the
/// threshold and back within one sample; halving the sample interval changes nothing else (tested).
///
/// # Errors
/// None: parameters are checked before.
pub fn simulate_motion(
    system: &AfmSystem,
    lever: &ModalLever,
    contact: &Contact,
    drive: &Drive,
    sampling: Sampling,
    rng: &mut ChaCha8Rng,
) -> Motion {
    let mut run = Run::start(system, lever, contact, drive, sampling, rng);
    let (mut signal_m, mut force_n) = (Vec::with_capacity(sampling.samples), Vec::with_capacity(sampling.samples));
    for k in 0..sampling.samples {
        force_n.push(run.force_n());
        signal_m.push(run.signal_m());
        run.advance_to(sampling.start_s + (k + 1) as f64 * sampling.interval_s, rng);
    }
    Motion { signal_m, force_n, events: run.events }
}

pub(super) struct Run<'a> {
    pub(super) system: &'a AfmSystem,
    contact: &'a Contact,
    pub(super) drive: &'a Drive<'a>,
    free: Propagator,
    attached: Propagator,
    pub(super) interval_s: f64,
    /// Lever and contact in series, N/m.
    series_n_per_m: f64,
    pub(super) state: Vec<f64>,
    pub(super) next: Vec<f64>,
    pub(super) deviates: Vec<f64>,
    pub(super) time_s: f64,
    pub(super) half: i64,
    /// Pull-off force while attached.
    pub(super) held_n: Option<f64>,
    /// Force on the free tip at the start of a step and its rate, N and N/s, where one is hidden.
    pub(super) load: Option<(f64, f64)>,
    /// Acceleration of the tip by modal forces (m/s^2) and length of the step (s), whose half the state has got in
    /// advance.
    pub(super) kicked: (f64, f64),
    armed: bool,
    events: Vec<ContactEvent>,
}

impl<'a> Run<'a> {
    pub(super) fn start(
        system: &'a AfmSystem,
        lever: &ModalLever,
        contact: &'a Contact,
        drive: &'a Drive<'a>,
        sampling: Sampling,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let half = drive.ramp.half_cycle(sampling.start_s);
        let height = drive.height_m(half, sampling.start_s);
        let pull_off = drive.pull_off_in(half);
        let attached = if half.rem_euclid(2) == 0 {
            height < contact.snap_in_gap_m
        } else {
            let lowest = -0.5 * drive.ramp.range_m - drive.surface_m;
            lowest < contact.snap_in_gap_m && height < contact.pull_off_height_m(lever.stiffness_n_per_m, pull_off)
        };
        let free_step = Propagator::new(&system.free.step(sampling.interval_s));
        let attached_step = Propagator::new(&system.attached.step(sampling.interval_s));
        let regime = if attached { &system.attached } else { &system.free };
        let size = system.size();
        let factor = regime.stationary_covariance(sampling.interval_s).semidefinite_cholesky();
        let deviates: Vec<f64> = (0..size).map(|_| StandardNormal.sample(rng)).collect();
        let mut state = system.rest(lever, attached.then_some(height));
        for (i, x) in state.iter_mut().enumerate() {
            *x += (0..=i).map(|j| factor[(i, j)] * deviates[j]).sum::<f64>();
        }
        state.resize(free_step.width(), 0.0);
        Self {
            system,
            contact,
            drive,
            next: state.clone(),
            free: free_step,
            attached: attached_step,
            interval_s: sampling.interval_s,
            series_n_per_m: 1.0 / (1.0 / lever.stiffness_n_per_m + 1.0 / contact.stiffness_n_per_m),
            state,
            deviates,
            time_s: sampling.start_s,
            half,
            held_n: attached.then_some(pull_off),
            load: None,
            kicked: (0.0, 0.0),
            armed: !attached && height > contact.snap_in_gap_m,
            events: Vec::new(),
        }
    }

    pub(super) fn regime(&self) -> &'a LinearSystem {
        match self.regime_index() {
            0 => &self.system.free,
            1 => &self.system.attached,
            _ => &self.system.loaded,
        }
    }

    /// 0 free, 1 attached, 2 free under a load.
    pub(super) fn regime_index(&self) -> usize {
        match (self.held_n, self.load) {
            (Some(_), _) => 1,
            (None, None) => 0,
            (None, Some(_)) => 2,
        }
    }

    /// Height of the base above the surface and its velocity.
    pub(super) fn base(&self) -> (f64, f64) {
        (self.drive.height_m(self.half, self.time_s), self.drive.ramp.velocity_m_per_s(self.half))
    }

    /// What drives the present regime, and its rate: the base, or a load.
    pub(super) fn inputs(&self) -> (f64, f64) {
        match (self.held_n, self.load) {
            (None, Some(load)) => load,
            _ => self.base(),
        }
    }

    /// Detector output now, m.
    pub(super) fn signal_m(&self) -> f64 {
        dot(&self.system.signal_weights, &self.state)
    }

    pub(super) fn last_event(&self) -> Option<&ContactEvent> {
        self.events.last()
    }

    pub(super) fn into_events(self) -> Vec<ContactEvent> {
        self.events
    }

    /// Advances to `end_s`, a whole sample at once where nothing happens in it.
    pub(super) fn advance_to(&mut self, end_s: f64, rng: &mut ChaCha8Rng) {
        let mut whole = true;
        while self.time_s < end_s {
            let kink_s = self.drive.ramp.end_s(self.half);
            let stop_s = end_s.min(kink_s);
            for deviate in &mut self.deviates {
                *deviate = StandardNormal.sample(rng);
            }
            let height = self.drive.height_m(self.half, self.time_s);
            let velocity = self.drive.ramp.velocity_m_per_s(self.half);
            whole = whole && stop_s == end_s;
            if whole {
                let step = if self.held_n.is_some() { &self.attached } else { &self.free };
                step.advance(&self.state, height, velocity, &self.deviates, &mut self.next);
            } else {
                self.next = self.path(stop_s - self.time_s);
            }
            let span = if whole { self.interval_s } else { stop_s - self.time_s };
            if self.excess(&self.next, self.time_s + span) > 0.0 {
                self.switch(span);
                whole = false;
                continue;
            }
            std::mem::swap(&mut self.state, &mut self.next);
            self.time_s = stop_s;
            if stop_s == kink_s {
                self.half += 1;
            }
            self.arm();
        }
    }

    /// Force of the sample on the tip now.
    pub(super) fn force_n(&self) -> f64 {
        if self.held_n.is_none() {
            return self.load.map_or(0.0, |(force_n, _)| force_n);
        }
        let height = self.drive.height_m(self.half, self.time_s);
        -self.system.tension_n(&self.state, height, self.drive.ramp.velocity_m_per_s(self.half))
    }

    /// How far `state` at `t_s` lies beyond the threshold of the present regime; positive: it has been crossed.
    pub(super) fn excess(&self, state: &[f64], t_s: f64) -> f64 {
        let height = self.drive.height_m(self.half, t_s);
        match self.held_n {
            Some(pull_off) => (self.tension_n(state, t_s) - pull_off) / self.contact.stiffness_n_per_m,
            None if self.armed => self.contact.snap_in_gap_m - self.system.gap_m(state, height),
            None => -1.0,
        }
    }

    /// Tension of the contact with `state` at `t_s` within the present step; what a kick gave too early or still owes
    /// is put right.
    fn tension_n(&self, state: &[f64], t_s: f64) -> f64 {
        let height = self.drive.height_m(self.half, t_s);
        let velocity = self.drive.ramp.velocity_m_per_s(self.half);
        let owed = self.kicked.0 * (t_s - self.time_s - 0.5 * self.kicked.1);
        self.system.tension_n(state, height, velocity) + self.contact.damping_n_s_per_m * owed
    }

    /// The state `span_s` from now, with this step's deviates.
    pub(super) fn path(&self, span_s: f64) -> Vec<f64> {
        let (first, second) = self.inputs();
        let mut state = self.regime().step(span_s).advance(&self.state, first, second, &self.deviates);
        state.resize(self.state.len(), 0.0);
        state
    }

    /// Goes to the crossing within `span_s` and changes the regime there.
    pub(super) fn switch(&mut self, span_s: f64) {
        let (span, state) = self.crossing(span_s);
        let force_n = -self.tension_n(&state, self.time_s + span);
        self.state = state;
        self.time_s += span;
        self.change(force_n);
    }

    /// Changes the regime here and now, under this force on the tip.
    pub(super) fn change(&mut self, force_n: f64) {
        let height = self.drive.height_m(self.half, self.time_s);
        let kind = match self.held_n {
            Some(_) => {
                self.held_n = None;
                self.armed = false;
                EventKind::SnapOff
            }
            None => {
                self.held_n = Some(self.drive.pull_off_in(self.half));
                EventKind::SnapIn
            }
        };
        let load_n = -height * self.series_n_per_m;
        self.events.push(ContactEvent { kind, time_s: self.time_s, force_n, load_n });
        self.arm();
    }

    /// Illinois regula falsi for the crossing; returns its distance from now and the state there.
    fn crossing(&self, span_s: f64) -> (f64, Vec<f64>) {
        let (mut low, mut high) = (0.0, span_s);
        let mut f_low = self.excess(&self.state, self.time_s);
        let mut state = self.path(high);
        let mut f_high = self.excess(&state, self.time_s + high);
        if f_low >= 0.0 || f_high <= 0.0 {
            // at the threshold already: within rounding of it
            return if f_low >= 0.0 { (0.0, self.state.clone()) } else { (high, state) };
        }
        let mut last_was_high = None;
        for _ in 0..60 {
            let span = (low * f_high - high * f_low) / (f_high - f_low);
            let there = self.path(span);
            let f = self.excess(&there, self.time_s + span);
            if f > 0.0 {
                (high, f_high, state) = (span, f, there);
                // Illinois: an end kept twice in a row counts half
                f_low *= if last_was_high == Some(true) { 0.5 } else { 1.0 };
                last_was_high = Some(true);
            } else {
                (low, f_low) = (span, f);
                f_high *= if last_was_high == Some(false) { 0.5 } else { 1.0 };
                last_was_high = Some(false);
            }
            if high - low < CROSSING_TOLERANCE * self.interval_s || f == 0.0 {
                break;
            }
        }
        (high, state)
    }

    /// Arms the catch once the gap has exceeded it.
    pub(super) fn arm(&mut self) {
        if self.held_n.is_none() && !self.armed {
            let height = self.drive.height_m(self.half, self.time_s);
            self.armed = self.system.gap_m(&self.state, height) > self.contact.snap_in_gap_m;
        }
    }
}
