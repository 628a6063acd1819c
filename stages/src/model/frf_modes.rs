//! The stage `model.frf_modes`.

#[cfg(test)]
mod hammer_tests;
mod remarks;
mod tables;
#[cfg(test)]
mod tests;

use afmid_pipeline::{Array, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, Table};
use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::remarks::{Remarks, driving_point};
use self::tables::{channels, fit_array, summary};
use super::count::Count;
use super::decay::{MODES, SHAPES};
use super::stabilisation::pole_table;
use crate::artifacts::{Frf, mode_table, rows_of, shape_array};
use crate::io::FRF;
use afmid_kernels::frf_modes::{FrfModes, FrfModesOptions, InputNoise, MeasuredResponses, frf_modes};
use afmid_kernels::model::ModelError;
use afmid_kernels::ringdown::{ModeEstimate, ModeShape, ModesWanted};

/// Fits modes and mode shapes to measured frequency responses: one set of poles for all responses.
///
/// # Model
/// `H_r = p^q ( sum_m A_rm / (p - s_m) + conj(A_rm) / (p - conj s_m) + L_r / p^2 + U_r )` plus noise, with `p = i w`
/// and q 0, 1 or 2 for a receptance, mobility or accelerance: poles shared, residues of each response its own, real
/// residual terms for modes below and above the band.
/// # Method
/// Starts from a common denominator over all orders (least-squares complex frequency domain); modes one by one, kept
/// where an F test finds their gain above chance at the level and correlation of what is left; maximum likelihood by
/// variable projection. Variances are those of the responses, or estimated by bands.
/// # Shapes
/// `modes` by row, ascending; `shapes` over mode and channel (a response's point that goes from response to response);
/// `diagram` a row per order and pole; `fit` over response and frequency.
/// # Units
/// Hz; shapes relative to the response with the largest residue, and per root of a kilogram at unit modal mass where
/// there is a driving point and the responses are displacement, velocity or acceleration per newton.
/// # Accuracy
/// docs/results/frf.md. Standard errors count what the fit leaves around a mode, neighbours that are alike, and
/// responses that disagree on a pole. A decay that a window added is taken off.
/// # Errors
/// Fewer than 8 lines, or values of a response; no mode.
/// # Source
/// P. Guillaume et al., Proc. 21st IMAC (2003); G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FrfModeFit {
    /// Oscillating modes, 1 to 40, or `auto`: as many up to `max_modes` as the responses show.
    pub modes: Count<40>,
    /// Largest number that `auto` finds. Why: each takes a fit.
    #[schemars(range(min = 1, max = 40))]
    pub max_modes: usize,
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: FrfModesOptions,
}

impl Default for FrfModeFit {
    fn default() -> Self {
        Self { modes: Count::Auto, max_modes: 12, fit: FrfModesOptions::default() }
    }
}

const DIAGRAM: Port<Table> = Port::new("diagram", "ordered-poles", "poles of every order, and whether they are stable");
const FIT: Port<Array> =
    Port::new("fit", "frf-fit", "responses as measured and as fitted, and all of them at once (mode indicator)");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "modes with damping and shapes, and what does not fit");

impl Stage for FrfModeFit {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.frf_modes",
        version: 6,
        summary: "fits modes and mode shapes to measured frequency responses of many channels",
        inputs: &[FRF.spec()],
        outputs: &[MODES.spec(), SHAPES.spec(), DIAGRAM.spec(), FIT.spec(), SUMMARY.spec()],
        source: "P. Guillaume et al., Proc. 21st IMAC (2003)",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        if let (Some(from), Some(to)) = (self.fit.from_hz, self.fit.to_hz) {
            faults.require(from < to, || format!("`from_hz` is {from}, wanted below `to_hz`, {to}"));
        }
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let frf = Frf::new(inputs.get(&FRF)?)?;
        let names = channels(&frf);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut found = self.fitted(&frf, &names)?;
        found.modes.iter_mut().for_each(|mode| frf.rate_error.widen(&mut mode.estimate.frequency_hz));
        Remarks { fit: self, found: &found, frf: &frf }.all().into_iter().for_each(|remark| cx.warn(remark));
        let shapes: Vec<&ModeShape> = found.modes.iter().map(|mode| &mode.shape).collect();
        let modes: Vec<ModeEstimate> = found.modes.iter().map(|mode| mode.estimate).collect();
        Ok(Ports::new()
            .with(&MODES, mode_table(&modes))
            .with(&SHAPES, shape_array(&shapes, &names))
            .with(&DIAGRAM, pole_table(&found.diagram))
            .with(&FIT, fit_array(&found, &frf))
            .with(&SUMMARY, summary(&found, &frf, &names)?))
    }

    fn examples() -> Vec<Example> {
        super::frf_modes_example::examples()
    }
}

impl FrfModeFit {
    /// Errors: those of the fit, a response that cannot be used by its name.
    fn fitted(&self, frf: &Frf<'_>, names: &[&str]) -> Result<FrfModes, StageError> {
        let options = FrfModesOptions {
            quantity: frf.quantity,
            added_decay_per_s: frf.added_decay_per_s,
            driving_point: driving_point(frf),
            modes: match self.modes {
                Count::Fixed(modes) => ModesWanted::Fixed(modes),
                Count::Auto => ModesWanted::AtMost(self.max_modes),
            },
            ..self.fit.clone()
        };
        let count = 0..frf.responses.len();
        let row = |r: usize| frf.row(r).iter().map(|h| c64::new(h.re, h.im)).collect();
        let rows: Vec<Vec<c64>> = count.clone().map(row).collect();
        let rows: Vec<&[c64]> = rows.iter().map(Vec::as_slice).collect();
        let variance: Option<Vec<&[f64]>> = count.map(|r| frf.row_variance(r)).collect();
        let run: Vec<usize> = frf.responses.iter().map(|response| response.run).collect();
        let relative = frf.input_noise.map(|values| rows_of(values, frf.responses.len()));
        let measured = MeasuredResponses {
            frequency_hz: frf.frequency_hz,
            transfer: &rows,
            variance: variance.as_deref(),
            input_noise: relative.as_deref().map(|relative| InputNoise { run: &run, relative }),
        };
        frf_modes(measured, &options).map_err(|error| match error {
            ModelError::Response { number, problem } => {
                let name = names.get(number - 1).copied().unwrap_or_default();
                StageError::new(format!("response {number} ({name}) {problem}")).help("leave it out")
            }
            other => StageError::from_error(other),
        })
    }
}
