//! What a diagnosis of a system is asked for.

use super::bench::Part;

/// Settings; the defaults suit a record whose noise is white.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemOptions {
    /// Samples that choose the causes and fit everything: first, one past the last.
    pub training: (usize, usize),
    /// Parts to judge on.
    pub parts: Vec<Part>,
    /// Rate of false alarms over all candidates together.
    pub false_alarm_rate: f64,
    /// Least share by which a cause has to lower the held-out error.
    pub least_gain: f64,
    /// Remaining misfit over the rest of the residual, both root mean squares, up to which causes are named.
    pub tolerated_misfit: f64,
    /// Most causes.
    pub most_causes: usize,
    /// Ids of the candidates; empty: all for input and output.
    pub candidates: Vec<String>,
    /// Unit of the output.
    pub output_unit: String,
    /// Unit of the input.
    pub input_unit: String,
}

impl Default for SystemOptions {
    fn default() -> Self {
        Self {
            training: (0, 0),
            parts: Vec::new(),
            false_alarm_rate: 0.01,
            least_gain: 0.0005,
            tolerated_misfit: 0.25,
            most_causes: 8,
            candidates: Vec::new(),
            output_unit: "V".to_owned(),
            input_unit: "V".to_owned(),
        }
    }
}
