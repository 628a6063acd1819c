//! What is identified, how, and what comes of it.

use faer::{Mat, c64};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::covariance::ResidualColour;
use crate::Watch;
use crate::model::{InnovationsModel, InputGains, ModelError};
use crate::modes::{ModeCriteria, Pole, PoleClass, poles};
use crate::optimise::Ending;

/// One record of input and output, equally sampled.
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// u, N samples; of several inputs one after the other, a multiple of N.
    pub input: &'a [f64],
    /// y, N samples; NaN where missing, which only output error allows ([`NoiseModel::White`] or
    /// [`Focus::Simulation`]).
    pub output: &'a [f64],
}

/// What is estimated, and how far the iteration goes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct PemOptions {
    /// Order n of the model, at least 1.
    #[serde(skip)]
    pub order: usize,
    /// Rows of the Hankel matrix that the start comes from, more than `order`. Why: half as many blur close poles.
    #[schemars(range(min = 2, max = 1000))]
    pub block_rows: usize,
    /// Most iterations in each stretch of the search. Why: ten to thirty are usual.
    #[schemars(range(min = 1, max = 10_000))]
    pub max_iterations: usize,
    /// Parametrisation of the Kalman gain: `thermal` (white output noise and a white force on every section, one
    /// intensity each), `free` (all its elements), `white` (none: output error) or `coloured` (none; the errors are
    /// whitened by an autoregressive filter of their own, for noise that does not pass through the model's poles). Why:
    /// a free gain also fits the dips that the fit itself leaves at resonances.
    pub noise: NoiseModel,
    /// Which errors are made small: `prediction` (one sample ahead) or `simulation` (output error, started from the
    /// best of the subspace estimates and the prediction model; K is zero). Why: the most efficient where the noise
    /// model holds.
    pub focus: Focus,
    /// Starts that are refined. Why: more than three also take subspace estimates with instruments, which records of
    /// rich input need: take 8 there.
    #[schemars(range(min = 1, max = 100))]
    pub starts: usize,
    /// Prior variance of the response outside the excited band: as if white noise of this share of each input's energy
    /// had been put in and nothing had come out. Why: records that excite a narrow band need one to say anything
    /// beyond it: the share of noise in the output, over the samples.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub prior: f64,
    /// Estimate a constant offset of the response.
    pub offset: bool,
    /// Estimate a linear drift of the response. Why: averaged records wander.
    pub drift: bool,
    /// Share of the residual in the tangent space that counts as zero gradient: a hundredth of a standard error at 8192
    /// samples.
    #[serde(skip)]
    pub gradient_tolerance: f64,
    /// How the covariance treats the residual.
    #[serde(skip)]
    pub colour: ResidualColour,
    /// Who watches, and may end it.
    #[serde(skip)]
    pub watch: Watch,
}

impl Default for PemOptions {
    fn default() -> Self {
        Self {
            order: 11,
            block_rows: 60,
            max_iterations: 60,
            offset: true,
            drift: true,
            noise: NoiseModel::Thermal,
            focus: Focus::Prediction,
            starts: 3,
            prior: 0.0,
            gradient_tolerance: 1e-4,
            colour: ResidualColour::Spectrum,
            watch: Watch::default(),
        }
    }
}

impl PemOptions {
    /// Whether estimates with instruments are among the starts.
    pub(crate) fn many_starts(&self) -> bool {
        self.starts > Self::default().starts
    }
}

/// How the Kalman gain is parametrised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseModel {
    /// K = 0: output error.
    White,
    /// K from the intensities of white output noise and of white forces on the sections (thermal noise): one parameter
    /// per section.
    Thermal,
    /// K free: n parameters.
    Free,
    /// K = 0, the noise whitened by an autoregressive filter of its own (Box and Jenkins): for noise that does not pass
    /// through the model's poles.
    Coloured,
}

/// Which errors are made small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Focus {
    /// One-step prediction errors: most efficient where the noise model holds.
    Prediction,
    /// Simulation errors: output error, refined from the best of the subspace estimates and the prediction model; K =
    /// 0. For models of too low an order, this spreads what they cannot follow as the input's use asks.
    Simulation,
}

/// How the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// Why it ended.
    pub ending: Ending,
    /// Whether the result is a minimum: gradient small against the residual, or the residual rounding alone.
    pub converged: bool,
    /// Accepted steps, from the best start on.
    pub iterations: usize,
    /// Norm of the residual's part in the tangent space over the residual's norm; times `sqrt(N)`: standard errors from
    /// the minimum.
    pub gradient: f64,
    /// Coordinates at the limit of the parametrisation (undamped within any window).
    pub at_limit: usize,
}

/// A model with everything that its estimate yields.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The model from the first input: A and A - K C stable. Where nothing was put in, its b is the first experiment's
    /// x0, as of a pulse one sample before: what a mode counts for is what rings.
    pub model: InnovationsModel,
    /// How the further inputs enter it.
    pub further_inputs: Vec<InputGains>,
    /// x0 of each experiment.
    pub initial_states: Vec<Vec<f64>>,
    /// Offset of y of each experiment, at its centre.
    pub offsets: Vec<f64>,
    /// Drift of y of each experiment, per second.
    pub slopes: Vec<f64>,
    /// Prediction errors of each experiment.
    pub residuals: Vec<Vec<f64>>,
    /// Parameters that whiten the errors, which a test of whiteness takes off its degrees of freedom: none of output
    /// error, intensities of the sections' forces, coefficients of a free gain or of a noise filter.
    pub noise_parameters: usize,
    /// Mean square of e, corrected for the number of parameters.
    pub innovation_variance: f64,
    /// Covariance of [`InnovationsModel::parameters`], then of b and D of each further input.
    pub covariance: Mat<f64>,
    /// Poles of the predictor, eigenvalues of A - K C: the zeros of the noise model.
    pub predictor_poles: Vec<c64>,
    /// Singular values of the start's Hankel matrix.
    pub singular_values: Vec<f64>,
    /// How the iteration ended.
    pub verdict: Verdict,
}

impl Identified {
    /// All poles with their standard errors, ascending in frequency. Errors: as [`poles`].
    pub fn poles(&self, criteria: &ModeCriteria) -> Result<Vec<Pole>, ModelError> {
        let count = 2 * self.model.order() + 1;
        let covariance = self.covariance.submatrix(0, 0, count, count).to_owned();
        poles(&self.model, &covariance, criteria)
    }

    /// The resonances among the poles, by the default criteria. Errors: as [`poles`].
    pub fn modes(&self) -> Result<Vec<Pole>, ModelError> {
        let mut found = self.poles(&ModeCriteria::default())?;
        found.retain(|pole| pole.kind == PoleClass::Mechanical);
        Ok(found)
    }
}
