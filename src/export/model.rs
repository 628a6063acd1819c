//! What an export states of a model.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use afmid_kernels::model::ModelError;
use afmid_pipeline::{Attribute, Matrix, StateSpace};
use afmid_stages::model::system_poles;
use serde::Serialize;

use super::units::Units;

/// Version of what is exported: raised when a key changes its meaning or goes.
pub const VERSION: u32 = 1;
const EQUATIONS: &str = "x(t+Ts) = A x(t) + B u(t) + K e(t), y(t) = C x(t) + D u(t) + e(t)";

/// A model with everything that another program needs, under the names that both formats use.
#[derive(Debug, Serialize)]
pub struct ExportedModel {
    /// Version of this layout; first, because files are known by it.
    pub afmid_model: u32,
    /// The pipeline's name.
    pub pipeline: String,
    /// `stage.port`.
    pub source: String,
    /// The stage's name in the registry.
    pub uses: String,
    /// The program that identified it.
    pub program: String,
    /// What the matrices mean.
    pub equations: &'static str,
    /// Ts in seconds.
    pub sample_time_s: f64,
    /// Rows of A.
    #[serde(rename = "A")]
    pub a: Vec<Vec<f64>>,
    /// Rows of B.
    #[serde(rename = "B")]
    pub b: Vec<Vec<f64>>,
    /// Rows of C.
    #[serde(rename = "C")]
    pub c: Vec<Vec<f64>>,
    /// Rows of D.
    #[serde(rename = "D")]
    pub d: Vec<Vec<f64>>,
    /// Rows of K.
    #[serde(rename = "K")]
    pub k: Vec<Vec<f64>>,
    /// State at the first sample.
    pub x0: Vec<f64>,
    /// Variance of e; NaN (null) if unknown.
    pub innovation_variance: f64,
    /// Names of the free parameters, in the order of `covariance`.
    pub parameter_names: Vec<String>,
    /// Their values.
    pub parameters: Vec<f64>,
    /// Their covariance; none (null) if unknown.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Units of what goes in and comes out.
    pub units: Units,
    /// Eigenvalues of A, both of a pair.
    pub poles: Vec<ExportedPole>,
    /// Scalars that describe the whole.
    pub attributes: BTreeMap<String, Attribute>,
}

/// A pole; a real negative one and one at zero have no continuous counterpart that is real: theirs are of the principal
/// logarithm, or NaN (null).
#[derive(Debug, Serialize)]
pub struct ExportedPole {
    /// Real part in the z plane.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
    /// `|s| / 2 pi`, `s = ln(z) / Ts`.
    pub frequency_hz: f64,
    /// `|s| / (-2 Re s)`.
    pub quality_factor: f64,
}

/// Where a model comes from.
#[derive(Debug, Clone, Copy)]
pub struct Origin<'a> {
    /// The pipeline's name.
    pub pipeline: &'a str,
    /// `stage.port`.
    pub source: &'a str,
    /// The stage's name in the registry.
    pub uses: &'a str,
    /// The program that identified it.
    pub program: &'a str,
}

impl ExportedModel {
    /// Describes a model. Errors: matrices that do not fit together or are not finite, eigenvalues that do not
    /// converge.
    pub fn new(model: &StateSpace, origin: Origin, units: Units) -> Result<Self, ModelError> {
        Ok(Self {
            afmid_model: VERSION,
            pipeline: origin.pipeline.to_owned(),
            source: origin.source.to_owned(),
            uses: origin.uses.to_owned(),
            program: origin.program.to_owned(),
            equations: EQUATIONS,
            sample_time_s: model.sample_time_s,
            a: rows(&model.a),
            b: rows(&model.b),
            c: rows(&model.c),
            d: rows(&model.d),
            k: rows(&model.k),
            x0: model.x0.clone(),
            innovation_variance: model.innovation_variance,
            parameter_names: model.parameter_names.clone(),
            parameters: model.parameters.clone(),
            covariance: (!model.covariance.values.is_empty()).then(|| rows(&model.covariance)),
            units,
            poles: system_poles(model)?.iter().map(|z| ExportedPole::new(z.re, z.im, model.sample_time_s)).collect(),
            attributes: model.attributes.clone(),
        })
    }
}

impl ExportedPole {
    fn new(re: f64, im: f64, sample_time_s: f64) -> Self {
        // docs/conventions.md: s = ln(z) / Ts
        let (s_re, s_im) = (re.hypot(im).ln() / sample_time_s, im.atan2(re) / sample_time_s);
        let magnitude = s_re.hypot(s_im);
        Self { re, im, frequency_hz: magnitude / TAU, quality_factor: magnitude / (-2.0 * s_re) }
    }
}

fn rows(matrix: &Matrix) -> Vec<Vec<f64>> {
    matrix.values.chunks(matrix.columns.max(1)).map(<[f64]>::to_vec).collect()
}
