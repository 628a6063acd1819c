//! What a cause says of itself.

use crate::effects::Effects;

/// Where a cause acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The force on the lever.
    Force,
    /// The lever.
    Lever,
    /// Optics and electronics.
    Detector,
    /// The record: what is added to it, or lost.
    Record,
    /// The archive: what changes from record to record.
    Archive,
    /// The measured input of a general system.
    Input,
}

/// What data must have for a cause to be found in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Events in which a lever is released from a load.
    Release,
    /// Runs of a system without such events: free decays, or a measured input and output.
    Run,
    /// A mode that it acts on.
    Mode,
    /// Two modes that it couples.
    TwoModes,
    /// A measured input.
    Input,
    /// Several records: it changes from one to the next.
    Records,
    /// One channel: it belongs to one sensor.
    OneChannel,
    /// One run: it differs from run to run.
    OneRun,
    /// No long records: what remembers is followed value by value from a record's beginning.
    ShortRun,
}

/// One number of a cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Its name, as in configs and results.
    pub name: &'static str,
    /// Its unit. `V` stands for the output's unit where that is another, `input` for the unit of a general system's
    /// input.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// Smallest value allowed.
    pub low: f64,
    /// Largest value allowed.
    pub high: f64,
}

/// How far a cause can be named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Identifiable {
    /// By the events' shape, in a joint fit.
    Shape,
    /// By a channel of its own over whole records.
    Record,
    /// Not from the data at hand, for this reason.
    No(&'static str),
}

/// What is known of a cause.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Its name in configs and verdicts.
    pub id: &'static str,
    /// The physics, in a sentence.
    pub physics: &'static str,
    /// Where it acts.
    pub part: Part,
    /// What the data must have to show it.
    pub needs: &'static [Need],
    /// Its numbers; the first is its strength, zero for nothing.
    pub parameters: &'static [Parameter],
    /// What the data at hand can't tell it from, itself included: any of them is a right name.
    pub class: &'static [&'static str],
    /// What looks like it, and what separates the two.
    pub resembles: &'static str,
    /// The measurement that would settle it.
    pub next_measurement: &'static str,
    /// Whether it can be named, and how.
    pub identifiable: Identifiable,
    /// Where the model comes from.
    pub source: &'static str,
}

impl About {
    /// Whether data are enough for it that have what `has` says.
    pub fn is_met(&self, has: impl Fn(Need) -> bool) -> bool {
        self.needs.iter().all(|need| has(*need))
    }

    /// Modes that it looks at: one for what acts on a mode's motion, two for a coupling.
    pub fn modes(&self) -> usize {
        let of = |need: &Need| match need {
            Need::Mode => 1,
            Need::TwoModes => 2,
            _ => 0,
        };
        self.needs.iter().map(of).sum()
    }
}

/// What the data show before any cause is tried: where trial values come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Frequencies of the modes, Hz.
    pub frequency_hz: Vec<f64>,
    /// Quality factors.
    pub quality_factor: Vec<f64>,
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Length of an event's window, s.
    pub window_s: f64,
    /// Time of its first sample since the record's first, s; 0 where there are several windows.
    pub begin_s: f64,
    /// Mean static deflection before the release, V, absolute value.
    pub level_v: f64,
    /// Largest input of a general system, in the input's unit, absolute value; 0 where there is none.
    pub input_level: f64,
    /// Standard deviation of the mean event's residual, V: what a strength is compared with.
    pub noise_v: f64,
    /// Frequencies at which residuals peak, Hz, strongest first.
    pub residual_peaks_hz: Vec<f64>,
    /// Where in the archive the events are, 0 its first record, 1 its last, ascending, each place once; empty where
    /// nothing is known of it.
    pub places: Vec<f64>,
}

/// A cause: one way in which a linear simulation can be wrong.
///
/// The same object serves the simulator (to hide it), the diagnosis (to find it) and the user (to simulate with it
/// afterwards).
pub trait Cause: Sync {
    /// What it is.
    fn about(&self) -> &About;

    /// Adds it to a simulation; `values` in the order of [`About::parameters`].
    fn add(&self, values: &[f64], effects: &mut Effects);

    /// Values at which its effect is compared with the residuals (secants: several where the shape depends on them).
    ///
    /// The first value of each is a strength that changes the response by about a hundredth.
    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>>;

    /// Whether a coupling is the same with its two modes exchanged.
    fn is_symmetric(&self) -> bool {
        false
    }

    /// Numbers that differ from record to record by chance, a line's phase among them: each must be found in every
    /// record.
    fn free_in_each_record(&self) -> usize {
        0
    }

    /// Part of what it explains of events that its model in a fit still gets wrong, where that is known: signs weaker
    /// than this are not named beside it.
    fn inexact(&self) -> f64 {
        0.0
    }

    /// The parameter that says when the effect sets in: between which events of an archive, whose trials are all there
    /// is, or when in a record, where the best trial is refined. It has no slope.
    fn sets_in(&self) -> Option<usize> {
        None
    }
}

/// Whether `values` lie within the limits. Errors: the parameter, what was found, the limits.
pub fn within_limits(about: &About, values: &[f64]) -> Result<(), (&'static str, f64, f64, f64)> {
    for (parameter, value) in about.parameters.iter().zip(values) {
        if !(parameter.low..=parameter.high).contains(value) {
            return Err((parameter.name, *value, parameter.low, parameter.high));
        }
    }
    Ok(())
}
