//! What the stages that give poles have in common: the closest simulation with these poles, as artifacts.

use afmid_pipeline::{Context, Document, Port, Ports, StageError, StateSpace};
use faer::c64;
use serde_json::{Value, json};

use super::order::{choice_document, simulated_percent};
use crate::artifacts::{DataSet, PairSeries, state_nuisances, state_space};
use afmid_kernels::pem::{Experiment, Identified, PemOptions, with_poles};
use afmid_kernels::validation::{Nuisances, OrderChoice};

pub(super) const MODEL: Port<StateSpace> =
    Port::new("model", "model", "the model, with the covariance of its parameters");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "order, singular values, fit of the data that it is from");

/// How the linear part is fitted, and what is reported of the poles.
pub(super) struct Realised<'a> {
    pub set: DataSet,
    pub first: usize,
    pub offset: bool,
    pub drift: bool,
    pub singular_values: &'a [f64],
    pub choice: Option<&'a OrderChoice>,
    /// The gap in the singular values, where the order comes from it.
    pub gap: Option<usize>,
}

impl Realised<'_> {
    /// Model and summary; warns of poles that had to be reflected. Errors: as [`with_poles`].
    pub fn ports(&self, poles: &[c64], series: &PairSeries, cx: &Context) -> Result<Ports, StageError> {
        let unstable = poles.iter().filter(|z| z.norm() > 1.0).count();
        if unstable > 0 {
            cx.warn(format!(
                "{unstable} of {} poles lie outside the unit circle and are reflected into it; fewer states or other block rows may do",
                poles.len()
            ));
        }
        let options =
            PemOptions { block_rows: poles.len() + 1, offset: self.offset, drift: self.drift, ..PemOptions::default() };
        let experiment = Experiment { input: &series.input, output: &series.output };
        let fit = with_poles(&[experiment], 1.0 / series.rate, poles, &options).map_err(StageError::from_error)?;
        let mut model = state_space(&fit, self.set, self.first)?;
        state_nuisances(&mut model, self.nuisances());
        series.rate_error.state_in(&mut model);
        Ok(Ports::new().with(&MODEL, model).with(&SUMMARY, self.summary(&fit, unstable, series)?))
    }

    fn nuisances(&self) -> Nuisances {
        Nuisances { offset: self.offset, slope: self.drift }
    }

    fn summary(&self, fit: &Identified, unstable: usize, series: &PairSeries) -> Result<Document, StageError> {
        Document::new(&json!({
            "order": fit.model.order(),
            "order_choice": self.choice.map_or(Value::Null, choice_document),
            "singular_value_gap": self.gap,
            "set": self.set,
            "samples": series.output.len(),
            "first_sample": self.first,
            "reflected_poles": unstable,
            "simulation_fit_percent": simulated_percent(fit, &series.input, &series.output, self.nuisances()),
            "residual_std": { "value": fit.innovation_variance.sqrt(), "unit": series.unit },
            "singular_values": self.singular_values,
        }))
    }
}
