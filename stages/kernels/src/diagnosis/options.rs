//! What a diagnosis is asked for.

use super::data::{Part, Stretch};
use super::dynamics::Sensed;
use crate::causes::Cause;

/// Settings; the defaults suit a record whose noise is white.
#[derive(Clone)]
pub struct DiagnosisOptions {
    /// Stretches that choose the causes and fit everything.
    pub training: Vec<Stretch>,
    /// Parts to judge on.
    pub parts: Vec<Part>,
    /// Rate of false alarms over all candidates together.
    pub false_alarm_rate: f64,
    /// Least share by which a cause has to lower the held-out error.
    pub least_gain: f64,
    /// Remaining misfit over the rest of the residual, both root mean squares, up to which causes are named.
    pub tolerated_misfit: f64,
    /// What a single law that no name covers may do over what all names do together, both root mean squares.
    pub tolerated_law: f64,
    /// Whether each stretch has an offset of its own, as decays that were cut from longer records do; else an offset is
    /// a cause.
    pub free_offsets: bool,
    /// What each channel senses; deflections where it is not said.
    pub sensed: Vec<Sensed>,
    /// Whether all channels have one unit, the output's.
    pub one_unit: bool,
    /// Whether it is always said how far a linear model of one input goes, not only where nothing else accounts for the
    /// data.
    pub linear_fit: bool,
    /// Most causes.
    pub most_causes: usize,
    /// Steps of sections that the searches from all baselines may take together, and half of it the laws without a name:
    /// single causes take a tenth, five causes of a measured system most of it.
    pub work: u64,
    /// Causes that are tried, as far as the data have what they need.
    pub candidates: Vec<&'static dyn Cause>,
    /// Unit of the output.
    pub output_unit: String,
    /// Unit of the input.
    pub input_unit: String,
}

impl DiagnosisOptions {
    /// What a channel senses.
    pub(crate) fn sensed(&self, channel: usize) -> Sensed {
        self.sensed.get(channel).copied().unwrap_or_default()
    }
}

impl Default for DiagnosisOptions {
    fn default() -> Self {
        Self {
            training: Vec::new(),
            parts: Vec::new(),
            false_alarm_rate: 0.01,
            least_gain: 0.0005,
            tolerated_misfit: 0.25,
            tolerated_law: 0.15,
            free_offsets: false,
            sensed: Vec::new(),
            one_unit: true,
            linear_fit: false,
            most_causes: 8,
            work: 2_000_000_000,
            candidates: crate::causes::CATALOGUE.to_vec(),
            output_unit: "V".to_owned(),
            input_unit: "V".to_owned(),
        }
    }
}
