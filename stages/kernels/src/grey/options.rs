//! What is fitted, and what is known beforehand.

use crate::effects::Intersample;
use crate::model::ModelError;
use crate::pem::ResidualColour;
use crate::ringdown::Knowledge;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A parameter of the grey form that something can be known of; modes ascend in frequency, everything is counted from
/// 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GreyQuantity {
    /// `w / 2 pi` of a mode, Hz.
    Frequency(usize),
    /// Q of a mode.
    QualityFactor(usize),
    /// `p / 2 pi` of a real pole, Hz.
    RealPole(usize),
    /// Delay, s.
    Delay,
    /// Static gain of a mode from an input.
    Gain {
        /// The mode.
        mode: usize,
        /// The input.
        input: usize,
    },
    /// Feedthrough `d0` from an input.
    Feedthrough(usize),
}

/// A parameter and what is known of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GreyKnown {
    /// Of what.
    pub quantity: GreyQuantity,
    /// What.
    pub knowledge: Knowledge,
}

impl GreyKnown {
    /// Errors: a number that cannot be.
    pub fn check(&self) -> Result<(), ModelError> {
        // gains may have any sign, a delay may be none, an oscillation has Q above 1/2
        let floor = match self.quantity {
            GreyQuantity::Gain { .. } | GreyQuantity::Feedthrough(_) => f64::NEG_INFINITY,
            GreyQuantity::Delay => -f64::MIN_POSITIVE,
            GreyQuantity::QualityFactor(_) => 0.5,
            _ => 0.0,
        };
        if self.knowledge.is_possible(floor) {
            return Ok(());
        }
        let wanted = "finite, frequencies above 0, a quality factor above 0.5, a delay of 0 or more, ascending bounds, a standard deviation above 0";
        Err(ModelError::Parameter { name: "known", found: self.knowledge.value(), wanted })
    }
}

/// What the system did before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Before {
    /// Anything: an initial state of its own is estimated for each experiment. The input is taken as what it is at the
    /// first sample; samples that hold what was put in earlier (as many as the delay has) say nothing.
    Anything,
    /// It rested under its first input, for long.
    Settled,
    /// It rested without any input.
    Rest,
}

/// What the input does between its samples, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BetweenSamples {
    /// Chosen by the data.
    Auto,
    /// It is held until the next sample, as a force that is released at a sample is, or the output of a converter.
    Held,
    /// It goes straight to the next sample.
    Linear,
    /// It is the band-limited signal that the samples determine, as behind an anti-alias filter: exact to 1e-4 below
    /// 0.9 of half the sample rate. 33 samples at the beginning (unless settled or at rest) and 31 at the end are not
    /// counted: what was not recorded decides on them.
    BandLimited,
}

impl BetweenSamples {
    /// What is stated; none where the data choose.
    pub fn stated(self) -> Option<Intersample> {
        match self {
            Self::Auto => None,
            Self::Held => Some(Intersample::Held),
            Self::Linear => Some(Intersample::Linear),
            Self::BandLimited => Some(Intersample::BandLimited),
        }
    }
}

/// Where the search begins.
#[derive(Debug, Clone, PartialEq)]
pub enum GreyStart {
    /// At a subspace estimate.
    Subspace,
    /// At these modes, frequency in Hz and quality factor; as many as are fitted.
    Modes(Vec<[f64; 2]>),
    /// At these poles in the z plane, as other estimates give them; the modes that matter most are taken.
    Poles(Vec<faer::c64>),
}

/// What is fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct GreyOptions {
    /// Oscillating modes. Why: the paper's.
    #[schemars(range(min = 1, max = 40))]
    pub modes: usize,
    /// Real poles of detector and electronics. Why: further ones and the delay take each other's place.
    #[schemars(range(min = 0, max = 8))]
    pub real_poles: usize,
    /// Estimate a delay, or take what is `known` of it. Why: without it is none.
    pub delay: bool,
    /// Estimate what passes without any mode. Why: modes beyond the fitted ones act like that.
    pub feedthrough: bool,
    /// What the force does between its samples: `held` until the next, `linear`, `band-limited`, or `auto`, which fits
    /// with each and takes the likeliest (held, where the data do not tell them apart). Why: a wrong one costs accuracy
    /// from a tenth of the sample rate on, and what recorded the force rarely says.
    pub between: BetweenSamples,
    /// Before the first sample the system was `settled` under its first force, at `rest` without any, or `anything` (an
    /// initial state is estimated). Why: settled says more where it is true, as before a release.
    pub history: Before,
    /// Estimate a constant offset of the response.
    pub offset: bool,
    /// Estimate a linear drift of the response. Why: averaged records wander.
    pub drift: bool,
    /// Rows of the Hankel matrix of the start, six more than twice the modes and the real poles, at least.
    #[schemars(range(min = 2, max = 1000))]
    pub block_rows: usize,
    /// Starts that are refined.
    #[schemars(range(min = 1, max = 100))]
    pub starts: usize,
    /// Most steps of a search. Why: ten are usual.
    #[schemars(range(min = 1, max = 10_000))]
    pub max_iterations: usize,
    /// What is known beforehand; default nothing.
    #[serde(skip)]
    pub known: Vec<GreyKnown>,
    /// Where the search begins; default at a subspace estimate.
    #[serde(skip)]
    pub start: GreyStart,
    /// Whether standard errors follow the residual's own spectrum; default so.
    #[serde(skip)]
    pub colour: ResidualColour,
}

impl Default for GreyOptions {
    fn default() -> Self {
        Self {
            modes: 4,
            real_poles: 1,
            delay: true,
            feedthrough: true,
            offset: true,
            drift: true,
            history: Before::Anything,
            between: BetweenSamples::Auto,
            known: Vec::new(),
            start: GreyStart::Subspace,
            block_rows: 60,
            starts: 3,
            max_iterations: 60,
            colour: ResidualColour::Spectrum,
        }
    }
}
