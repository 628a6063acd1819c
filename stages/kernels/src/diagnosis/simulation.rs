//! The model that a diagnosis ends with, to simulate other inputs with.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::data::FineInput;
use super::dynamics::{Added, Modal, Model, Run, Span, State, outputs};
use crate::block_oriented::BlockModel;
use crate::causes::Cause;
use crate::effects::{Instant, Intersample};

/// A diagnosed model, as it is stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "structure", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Simulation {
    /// Modes and real poles with causes.
    Modal(ModalSimulation),
    /// Linear parts around a static curve.
    Chain {
        /// In the units of input and output.
        model: BlockModel,
        /// Interval of the samples, s.
        interval_s: f64,
    },
}

/// Modes and real poles with causes, in units of the largest output and input of the record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModalSimulation {
    /// The linear part.
    pub dynamics: Modal,
    /// State of each stretch that was learnt from, at its first sample.
    pub states: Vec<State>,
    /// The causes, in the order in which they were added.
    pub causes: Vec<PlacedCause>,
    /// Unit of the scaled output by channel, in the record's.
    pub output_scale: Vec<f64>,
    /// Unit of the scaled input.
    pub input_scale: f64,
    /// Length that the causes' place in the record is counted in, s.
    pub reference_s: f64,
    /// Steps of the integrator between samples.
    pub steps: usize,
}

/// A cause with its values in scaled units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacedCause {
    /// Its name in the catalogue.
    pub id: String,
    /// In the order of its parameters.
    pub values: Vec<f64>,
    /// The modes that it sees as its first, second, ...; empty: in their own order.
    pub modes: Vec<usize>,
}

/// Why nothing is simulated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SimulationError {
    /// An input is wanted and not given.
    #[error("the model has an input, and none is given")]
    NoInput,
    /// An input is given and not wanted.
    #[error("the model is of free decays and has no input; give the number of samples")]
    NotDriven,
    /// A sample that is no number.
    #[error("sample {0} of the input is missing: the response to an unknown input is unknown")]
    Missing(usize),
    /// A state of another size.
    #[error("the initial state has {found} numbers, wanted {wanted}: deflection and rate / omega of each section")]
    State {
        /// Numbers that were given.
        found: usize,
        /// Numbers that are wanted.
        wanted: usize,
    },
    /// A state of linear parts around a curve.
    #[error("linear parts around a static curve are simulated from rest: they take no initial state")]
    FromRest,
    /// A cause that is not in the catalogue.
    #[error("there is no cause `{0}`")]
    NoCause(String),
    /// Parts that do not fit together.
    #[error("the stored model is damaged: {0}")]
    Damaged(&'static str),
}

/// What drives a simulation.
#[derive(Debug, Clone, Copy)]
pub enum Drive<'a> {
    /// An input, in the record's unit.
    Input(&'a [f64]),
    /// Nothing, for so many samples.
    Free(usize),
}

impl ModalSimulation {
    pub(super) fn new(model: &Model, scales: (&[f64], f64), reference_s: f64, steps: usize) -> Self {
        let placed = |added: &Added| PlacedCause {
            id: added.id().to_owned(),
            values: added.values.clone(),
            modes: added.modes.clone(),
        };
        Self {
            dynamics: model.dynamics.clone(),
            states: model.states.clone(),
            causes: model.causes.iter().map(placed).collect(),
            output_scale: scales.0.to_vec(),
            input_scale: scales.1,
            reference_s,
            steps,
        }
    }

    /// Errors: sections, weights, scales or values in other numbers than they belong to each other.
    fn check(&self) -> Result<(), SimulationError> {
        let sections = self.dynamics.sections.len();
        let channels = self.dynamics.weights.len();
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let whole = self.dynamics.weights.iter().all(|weights| weights.len() == sections)
            && self.dynamics.own.len() == sections
            && self.dynamics.own.iter().all(|channel| *channel < channels)
            && self.output_scale.len() == channels
            && self.states.iter().all(|state| state.sections.len() == sections)
            && (1..=1024).contains(&self.steps);
        let scaled = finite(&self.output_scale) && self.input_scale.is_finite() && self.input_scale != 0.0;
        match (whole, scaled) {
            (true, true) => Ok(()),
            (false, _) => Err(SimulationError::Damaged("its parts differ in number")),
            (true, false) => Err(SimulationError::Damaged("its scales are no numbers")),
        }
    }

    /// The model with the causes themselves. Errors: one that is not there, values in another number.
    fn model(&self, find: impl Fn(&str) -> Option<&'static dyn Cause>) -> Result<Model, SimulationError> {
        let causes = self.causes.iter().map(|placed| {
            let cause = find(&placed.id).ok_or_else(|| SimulationError::NoCause(placed.id.clone()))?;
            if cause.about().parameters.len() != placed.values.len() {
                return Err(SimulationError::Damaged("a cause has other parameters"));
            }
            Ok(Added { cause, values: placed.values.clone(), modes: placed.modes.clone() })
        });
        let causes = causes.collect::<Result<_, _>>()?;
        Ok(Model { dynamics: self.dynamics.clone(), states: Vec::new(), causes })
    }

    /// Where the motion begins: a given state in the output's unit; else at rest under an input, and as the first
    /// decay that was learnt from without one.
    fn start(&self, state: Option<&[f64]>) -> Result<State, SimulationError> {
        let first = || self.states.first().filter(|_| !self.dynamics.driven).cloned();
        let Some(given) = state else { return Ok(first().unwrap_or_else(|| self.dynamics.at_rest())) };
        let sections = self.dynamics.sections.len();
        if given.len() != 2 * sections {
            return Err(SimulationError::State { found: given.len(), wanted: 2 * sections });
        }
        let scale = |section: usize| self.output_scale[self.dynamics.own[section]];
        let sections = given.chunks_exact(2).enumerate().map(|(s, x)| [x[0] / scale(s), x[1] / scale(s)]).collect();
        Ok(State { sections, ..self.dynamics.at_rest() })
    }
}

impl Simulation {
    /// The response of the model to an input, or its free motion, channel by channel.
    ///
    /// # Model
    /// As in [`diagnose`](super::diagnose): sections in free run, the forces of causes on them, maps and paths of input
    /// and output. What sets in at a time counts it from the first sample of the simulation, in the first record.
    /// # Shapes
    /// `state`: deflection and rate / omega of each section, one after the other; channels of as many samples as the
    /// input has.
    /// # Units
    /// Those of the record; the state in the output's.
    /// # Errors
    /// See [`SimulationError`].
    pub fn simulate(
        &self,
        drive: Drive<'_>,
        state: Option<&[f64]>,
        find: impl Fn(&str) -> Option<&'static dyn Cause>,
    ) -> Result<Vec<Vec<f64>>, SimulationError> {
        if let Drive::Input(u) = drive
            && let Some(sample) = u.iter().position(|u| !u.is_finite())
        {
            return Err(SimulationError::Missing(sample));
        }
        match (self, drive) {
            (Self::Chain { model, .. }, _) if !model.is_whole() => {
                Err(SimulationError::Damaged("its parts differ in number"))
            }
            (Self::Chain { .. }, _) if state.is_some() => Err(SimulationError::FromRest),
            (Self::Chain { model, .. }, Drive::Input(u)) => Ok(vec![model.simulate(u)]),
            (Self::Chain { .. }, Drive::Free(_)) => Err(SimulationError::NoInput),
            (Self::Modal(own), drive) => own.simulate(drive, state, find),
        }
    }

    /// Interval of the samples, s.
    pub fn interval_s(&self) -> f64 {
        match self {
            Self::Modal(own) => own.dynamics.interval_s,
            Self::Chain { interval_s, .. } => *interval_s,
        }
    }
}

impl ModalSimulation {
    fn simulate(
        &self,
        drive: Drive<'_>,
        state: Option<&[f64]>,
        find: impl Fn(&str) -> Option<&'static dyn Cause>,
    ) -> Result<Vec<Vec<f64>>, SimulationError> {
        self.check()?;
        let model = self.model(find)?;
        let state = self.start(state)?;
        let effects = model.effects();
        let interval_s = self.dynamics.interval_s;
        let (samples, nodes) = match drive {
            Drive::Input(_) if !self.dynamics.driven => return Err(SimulationError::NotDriven),
            Drive::Free(_) if self.dynamics.driven => return Err(SimulationError::NoInput),
            Drive::Free(samples) => (samples, None),
            Drive::Input(u) => {
                let scaled: Vec<f64> = u.iter().map(|u| u / self.input_scale).collect();
                let course = effects.intersample.unwrap_or(Intersample::Held);
                let input = FineInput::new(&scaled, course, self.steps);
                (u.len(), Some(input.passed(&effects.input, u.len(), interval_s, effects.by_sample)))
            }
        };
        if samples == 0 {
            return Ok(vec![Vec::new(); self.output_scale.len()]);
        }
        let mut dynamics = Cow::Borrowed(&self.dynamics);
        if !effects.frequency.is_empty() {
            let instant = Instant { record: 0, place: 0.0, time_s: 0.0, piezo_m: 0.0 };
            let factor = 1.0 + effects.frequency_change(&instant);
            dynamics.to_mut().sections.iter_mut().for_each(|section| section.frequency_hz *= factor);
        }
        let (reference_s, steps) = (self.reference_s, self.steps);
        let span =
            Span { interval_s, begin_s: 0.0, origin_s: 0.0, reference_s, record: 0, steps, samples, stored: samples };
        let run = Run { dynamics, state: &state, nodes: nodes.as_deref(), effects: &effects, span };
        let output = outputs(&[run]).pop().unwrap_or_default();
        let channels = output.chunks_exact(samples).zip(&self.output_scale);
        Ok(channels.map(|(values, scale)| values.iter().map(|value| value * scale).collect()).collect())
    }
}
