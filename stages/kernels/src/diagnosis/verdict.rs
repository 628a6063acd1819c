//! The answer of a diagnosis, as it is stored and shown.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a diagnosis concludes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Nothing is wrong above the false-alarm rate.
    Clean,
    /// One or several causes account for what is wrong.
    Named,
    /// Something is wrong that no catalogued cause accounts for, or two classes tie.
    Unexplained,
}

/// A number with its standard error; null where it could not be had.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Value {
    /// The estimate.
    pub value: Option<f64>,
    /// Its standard error.
    pub std: Option<f64>,
    /// Its unit.
    pub unit: String,
}

/// What an extension gains on data that did not choose it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// Rms of the held-out residuals without it.
    pub rms_before: Option<f64>,
    /// The same with it.
    pub rms_after: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// Gain of the held-out log likelihood.
    pub log_likelihood: Option<f64>,
    /// What was held out.
    pub held_out: String,
}

/// The next best name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunnerUp {
    /// Its id.
    pub id: String,
    /// Share of the named cause's gain that it reaches.
    pub share_of_gain: Option<f64>,
}

/// A named cause.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedCause {
    /// Its id.
    pub id: String,
    /// What it can't be distinguished from, itself included.
    pub class: Vec<String>,
    /// Probability of so large a sign without any cause, all candidates considered.
    pub p_value: Option<f64>,
    /// Its parameters.
    pub parameters: BTreeMap<String, Value>,
    /// What it gains.
    pub gain: Gain,
    /// Runner-up, null if none was tried.
    pub runner_up: Option<RunnerUp>,
    /// What would settle it.
    pub next_measurement: String,
}

/// A mode's numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosedMode {
    /// `abs(s) / 2 pi`, Hz.
    pub frequency_hz: f64,
    /// Its standard error, Hz.
    pub frequency_std_hz: Option<f64>,
    /// Quality factor.
    pub quality_factor: f64,
    /// Its standard error.
    pub quality_factor_std: Option<f64>,
}

/// Residual of a part that took no share in the choice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// Name of the part.
    pub name: String,
    /// Rms error of the baseline.
    pub rms_before: Option<f64>,
    /// Rms error of the extended model.
    pub rms_after: Option<f64>,
    /// Unit of both.
    pub unit: String,
}

/// One step of the ladder of models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// What was added.
    pub added: String,
    /// Parameters of the model so far, those of single events left out.
    pub parameters: usize,
    /// Rms of the residuals that chose it.
    pub rms: Option<f64>,
    /// Rms of the held-out residuals.
    pub held_out_rms: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// Gain of the log likelihood over the rung before.
    pub log_likelihood_gain: Option<f64>,
    /// Bayesian information criterion, smaller is better.
    pub bic: Option<f64>,
}

/// The model before it is extended.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BaselineSummary {
    /// Whether it describes what is linear, so that causes may extend it.
    pub adequate: bool,
    /// Poles of the dynamics, or the numbers of a model that has none; null where no model was found.
    pub order: Option<usize>,
    /// Its physical parameters, where it has any beside its modes.
    pub parameters: BTreeMap<String, Value>,
    /// Rms of what no model can follow: noise.
    pub noise_rms: Option<f64>,
    /// Rms of what repeats and the linear model does not follow: distortion.
    pub distortion_rms: Option<f64>,
}

/// The whole answer; its JSON is a contract.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// What is concluded.
    pub verdict: Verdict,
    /// Probability of so strong a sign where nothing is wrong, of the strongest; null where it could not be had.
    pub p_value: Option<f64>,
    /// The model that causes extend.
    #[serde(default)]
    pub baseline: BaselineSummary,
    /// The causes, in the order in which they were found; empty unless named.
    pub causes: Vec<NamedCause>,
    /// What gave them away, or what remains, in plain sentences.
    pub evidence: Vec<String>,
    /// Candidates nearest to an explanation where there is none.
    pub nearest: Vec<RunnerUp>,
    /// Modes before the extension.
    pub modes_before: Vec<DiagnosedMode>,
    /// Modes after it.
    pub modes_after: Vec<DiagnosedMode>,
    /// Gains on test parts.
    pub validation: Vec<Validation>,
    /// Models in order.
    pub ladder: Vec<Rung>,
    /// False-alarm rate that the p-values were held against.
    pub false_alarm_rate: f64,
}
