//! What causes change, as parts that add up in one simulation.

mod formula;
mod passage;

use std::fmt;
use std::sync::Arc;

use faer::c64;

pub use formula::{Binary, Formula, MOST_OPERATIONS, Operation, Unary};
pub use passage::{Passage, SignalPath, StaticMap, pass};

/// Motion of the lever at one instant, in volts of static deflection (deflection times sensitivity).
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Modal coordinates: each is the load's static deflection when the lever is held, V.
    pub position: &'a [f64],
    /// Their rates, V/s.
    pub velocity: &'a [f64],
    /// Undamped angular frequencies, rad/s.
    pub omega: &'a [f64],
    /// Displacement of the tip since its release, V.
    pub gap: f64,
    /// Standard deviation of the first mode's thermal motion, as far as `position` is without it, V: a mean motion; 0
    /// where it is the motion itself.
    pub thermal: f64,
}

/// Where and when a sample was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// Number of the record in its archive, from 0.
    pub record: usize,
    /// Place in the archive, 0 at its first record, 1 at its last.
    pub place: f64,
    /// Time since the record's first sample, s.
    pub time_s: f64,
    /// Piezo position, m.
    pub piezo_m: f64,
}

/// Share of the load that still acts `t` seconds after the release (t >= 0); the unhurt release leaves none. What acts
/// again later than 120 samples after it must last 8 samples to be seen by the diagnosis.
pub type RemainingLoad = Arc<dyn Fn(f64) -> f64 + Send + Sync>;
/// Any force: adds to the acceleration of each mode, V/s^2.
pub type ForceLaw = Arc<dyn Fn(&Motion<'_>, &mut [f64]) + Send + Sync>;
/// Relative change of every mode's frequency at a place in the archive.
pub type FrequencyChange = Arc<dyn Fn(&Instant) -> f64 + Send + Sync>;
/// Volts added behind the electronics.
pub type Added = Arc<dyn Fn(&Instant) -> f64 + Send + Sync>;

/// What a factor of a [`PowerLaw`] is of its mode's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Deflection q, V.
    Deflection,
    /// Rate q' / omega, V.
    Rate,
    /// |q|.
    Distance,
    /// |q' / omega|.
    Speed,
    /// Amplitude sqrt(q^2 + (q' / omega)^2).
    Amplitude,
}

impl Quantity {
    /// Its value at a deflection and rate / omega.
    pub fn of(self, [q, rate]: [f64; 2]) -> f64 {
        match self {
            Self::Deflection => q,
            Self::Rate => rate,
            Self::Distance => q.abs(),
            Self::Speed => rate.abs(),
            Self::Amplitude => (q * q + rate * rate).sqrt(),
        }
    }
}

/// One factor of a [`PowerLaw`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Factor {
    /// Which.
    pub of: Quantity,
    /// Of which mode.
    pub mode: usize,
}

/// A force on one mode that is a product: acceleration `- omega^2 strength x_1 x_2 ...`.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerLaw {
    /// The mode that it acts on.
    pub on: usize,
    /// Strength, 1/V^(factors - 1).
    pub strength: f64,
    /// Its factors.
    pub factors: Vec<Factor>,
}

impl PowerLaw {
    /// A force on mode `on`.
    pub fn new(on: usize, strength: f64, factors: &[(Quantity, usize)]) -> Self {
        let factors = factors.iter().map(|(of, mode)| Factor { of: *of, mode: *mode }).collect();
        Self { on, strength, factors }
    }

    /// Acceleration of the mode that it acts on; none where a mode is not there.
    fn acceleration(&self, motion: &Motion<'_>) -> Option<f64> {
        let omega = motion.omega.get(self.on)?;
        let mut product = omega * omega * self.strength;
        for Factor { of, mode } in &self.factors {
            let q = *motion.position.get(*mode)?;
            let rate = motion.velocity.get(*mode)? / motion.omega.get(*mode)?;
            product *= of.of([q, rate]);
        }
        Some(-product)
    }
}

/// A force on the modes.
#[derive(Clone)]
pub enum ModalForce {
    /// A product of powers: many motions are simulated under it side by side.
    Power(PowerLaw),
    /// Any other, and the modes that it takes for its first, second, ...; empty: in their own order.
    Law(ForceLaw, Vec<usize>),
}

/// Most modes that a law with an order of its own sees; those of the catalogue see two.
const MOST_MODES: usize = 8;
/// Modes that a law of the catalogue sees: few are copied quickly.
const FEW_MODES: usize = 2;

impl ModalForce {
    /// Any force.
    pub fn law(law: impl Fn(&Motion<'_>, &mut [f64]) + Send + Sync + 'static) -> Self {
        Self::Law(Arc::new(law), Vec::new())
    }

    /// Adds to the acceleration of each mode, V/s^2.
    pub fn add(&self, motion: &Motion<'_>, acceleration: &mut [f64]) {
        match self {
            Self::Law(law, order) if order.is_empty() => law(motion, acceleration),
            Self::Law(law, order) if order.len() <= FEW_MODES => {
                seen_from::<FEW_MODES>(law, order, motion, acceleration);
            }
            Self::Law(law, order) => seen_from::<MOST_MODES>(law, order, motion, acceleration),
            Self::Power(law) => {
                if let (Some(to), Some(by)) = (acceleration.get_mut(law.on), law.acceleration(motion)) {
                    *to += by;
                }
            }
        }
    }

    /// Makes it take modes `order` for its first, second, ...; what has no place there is no force.
    pub fn place(&mut self, order: &[usize]) {
        let of = |mode: usize| order.get(mode).copied().unwrap_or(usize::MAX);
        match self {
            Self::Power(law) => {
                law.on = of(law.on);
                law.factors.iter_mut().for_each(|factor| factor.mode = of(factor.mode));
            }
            Self::Law(_, own) if own.is_empty() => *own = order.to_vec(),
            Self::Law(_, own) => own.iter_mut().for_each(|mode| *mode = of(*mode)),
        }
    }
}

fn seen_from<const N: usize>(law: &ForceLaw, order: &[usize], motion: &Motion<'_>, acceleration: &mut [f64]) {
    let count = order.len().min(N);
    let of = |values: &[f64]| -> [f64; N] {
        std::array::from_fn(|i| order.get(i).and_then(|mode| values.get(*mode)).copied().unwrap_or(0.0))
    };
    let (position, velocity, omega) = (of(motion.position), of(motion.velocity), of(motion.omega));
    let seen = Motion {
        position: &position[..count],
        velocity: &velocity[..count],
        omega: &omega[..count],
        gap: position[0],
        thermal: motion.thermal,
    };
    let mut own = [0.0; N];
    law(&seen, &mut own[..count]);
    for (mode, own) in order.iter().zip(own) {
        if let Some(to) = acceleration.get_mut(*mode) {
            *to += own;
        }
    }
}

/// A load that outlasts the release as `Re(share exp(rate t))` of what it was: as a [`RemainingLoad`], but followed
/// exactly and at no cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayingLoad {
    /// Share of the load, with its phase.
    pub share: c64,
    /// Rate, rad/s; its real part below 0.
    pub rate: c64,
}

/// A further oscillation that the load drives like the lever's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtraMode {
    /// Undamped frequency, Hz.
    pub frequency_hz: f64,
    /// Quality factor.
    pub quality_factor: f64,
    /// Share of the static response.
    pub share: f64,
}

/// A linear section of the electronics: `(high s + low w) / (s + w)`, w the pole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearSection {
    /// Pole, rad/s.
    pub pole: f64,
    /// Gain far below the pole.
    pub low: f64,
    /// Gain far above it.
    pub high: f64,
}

/// How an input runs between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Intersample {
    /// Held until the next sample.
    #[default]
    Held,
    /// On a straight line.
    Linear,
    /// As the band-limited signal that the samples determine.
    BandLimited,
}

/// Everything that causes add to a simulation; empty: nothing is wrong.
///
/// Parts of one kind add up (forces, loads, volts) or follow one another in order (passages, sections), so that causes
/// compose.
#[derive(Clone, Default)]
pub struct Effects {
    /// Loads that outlast the release.
    pub remaining_load: Vec<RemainingLoad>,
    /// Loads that decay, in closed form.
    pub decaying_load: Vec<DecayingLoad>,
    /// Forces on the modes.
    pub modal_force: Vec<ModalForce>,
    /// Further modes.
    pub extra_modes: Vec<ExtraMode>,
    /// What the deflection signal passes through in order, volts to volts, before the electronics. Paths act on the
    /// samples of a stretch and begin at its first.
    pub optics: Vec<Passage>,
    /// Sections of the electronics beside the detector's own.
    pub electronics: Vec<LinearSection>,
    /// Signal per load (both in V of static deflection) that bypasses the lever.
    pub feedthrough: f64,
    /// Changes of the modes over the archive.
    pub frequency: Vec<FrequencyChange>,
    /// Signals added to the record.
    pub added: Vec<Added>,
    /// Lowest and highest volt that the converter delivers.
    pub limits: Option<(f64, f64)>,
    /// Standard deviation of the sampling instant from event to event, s.
    pub jitter_s: f64,
    /// Delay of the whole readout, s.
    pub delay_s: f64,
    /// Standard deviation of the light's intensity over its mean.
    pub intensity: f64,
    /// Samples that were never stored: when since the record's start (s), how many; a fraction of one is a shift of the
    /// clock.
    pub lost: Vec<(f64, f64)>,
    /// What a measured input passes through in order. Paths act on its whole record, between samples too.
    pub input: Vec<Passage>,
    /// How a measured input runs between samples; none: as the baseline has it.
    pub intersample: Option<Intersample>,
    /// Whether a measured input passes sample by sample, and what acts runs on straight lines between.
    pub by_sample: bool,
}

impl Effects {
    /// Whether an input passes through the same as under others: the same passages, not such as act alike.
    pub fn have_the_input_of(&self, others: &Self) -> bool {
        let same = |(own, other): (&Passage, &Passage)| own.is(other);
        self.intersample == others.intersample
            && self.lost_samples() == others.lost_samples()
            && self.by_sample == others.by_sample
            && self.input.len() == others.input.len()
            && self.input.iter().zip(&others.input).all(same)
    }

    /// Samples that were never stored, all together, the last begun counted whole.
    pub fn lost_samples(&self) -> usize {
        self.lost.iter().map(|(_, count)| count.max(0.0)).sum::<f64>().ceil() as usize
    }

    /// Whether the motion itself is no longer that of a linear lever under the load.
    pub fn bend_the_motion(&self) -> bool {
        !self.modal_force.is_empty()
    }

    /// Whether any load is left after the release.
    pub fn outlast_the_release(&self) -> bool {
        !self.remaining_load.is_empty() || !self.decaying_load.is_empty()
    }

    /// Whether twice the load makes twice the signal.
    pub fn are_linear(&self) -> bool {
        self.modal_force.is_empty() && self.optics.is_empty()
    }

    /// Whether anything but frequencies changes in the signal of one event.
    pub fn change_the_shape(&self) -> bool {
        let parts = [
            !self.outlast_the_release(),
            self.modal_force.is_empty(),
            self.extra_modes.is_empty(),
            self.optics.is_empty(),
            self.electronics.is_empty(),
            self.feedthrough == 0.0,
        ];
        parts.contains(&false)
    }

    /// Relative change of all frequencies there and then.
    pub fn frequency_change(&self, at: &Instant) -> f64 {
        self.frequency.iter().map(|change| change(at)).sum()
    }

    /// Adds what sees modes `order` as its first, second, ...; empty: in their own order.
    pub fn add_at(&mut self, order: &[usize], add: impl FnOnce(&mut Self)) {
        let before = self.modal_force.len();
        add(self);
        if !order.is_empty() {
            self.modal_force[before..].iter_mut().for_each(|force| force.place(order));
        }
    }

    /// Share of the load that acts `t` seconds after the release, before it for t < 0.
    pub fn load(&self, t: f64) -> f64 {
        if t < 0.0 {
            return 1.0;
        }
        let decaying = self.decaying_load.iter().map(|load| (load.share * (load.rate * t).exp()).re);
        self.remaining_load.iter().map(|load| load(t)).chain(decaying).sum()
    }

    /// Whether what is seen, or what acts, depends on more than the value of that instant: releases are simulated
    /// without such paths.
    pub fn have_paths(&self) -> bool {
        self.optics.iter().chain(&self.input).any(Passage::is_path)
    }

    /// The deflection signal as the maps of the optics show it; see [`pass`] for paths.
    pub fn seen(&self, volts: f64) -> f64 {
        let through = |v: f64, passage: &Passage| match passage {
            Passage::Map(map) => map(v),
            Passage::Path(_) => v,
        };
        self.optics.iter().fold(volts, through)
    }
}

impl fmt::Debug for Effects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Effects")
            .field("remaining_load", &self.remaining_load.len())
            .field("decaying_load", &self.decaying_load)
            .field("modal_force", &self.modal_force.len())
            .field("extra_modes", &self.extra_modes)
            .field("optics", &self.optics)
            .field("electronics", &self.electronics)
            .field("feedthrough", &self.feedthrough)
            .field("frequency", &self.frequency.len())
            .field("added", &self.added.len())
            .field("limits", &self.limits)
            .field("jitter_s", &self.jitter_s)
            .field("delay_s", &self.delay_s)
            .field("intensity", &self.intensity)
            .field("lost", &self.lost)
            .field("input", &self.input)
            .field("intersample", &self.intersample)
            .field("by_sample", &self.by_sample)
            .finish()
    }
}
