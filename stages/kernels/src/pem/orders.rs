//! Several orders of one record, from estimates that are made once.

use super::conclusion::{Realised, realised};
use super::data::{Record, checked, prior_records};
use super::estimates::Estimates;
use super::identify::minimum;
use super::levenberg_marquardt::Limits;
use super::options::{Experiment, PemOptions};
use super::predictor::Problem;
use super::starts::{Start, output_errors, ranked, refined};
use crate::model::ModelError;

/// Fits of a record, one for each order, without errors of their parameters.
pub(crate) struct Orders<'a> {
    experiment: Experiment<'a>,
    sample_time_s: f64,
    fits: Vec<PemOptions>,
    priors: Vec<Record>,
    estimates: Estimates<'a>,
}

impl<'a> Orders<'a> {
    /// Prepares fits by these options, the orders ascending from one. Errors: no fits; too short a record; a prior that is
    /// out of range.
    pub fn new(experiment: Experiment<'a>, sample_time_s: f64, fits: Vec<PemOptions>) -> Result<Self, ModelError> {
        let estimates = Estimates::new(&[experiment], &fits)?;
        let first = fits.first().ok_or(ModelError::NoExperiment)?;
        let priors = prior_records(&[experiment], first)?;
        Ok(Self { experiment, sample_time_s, fits, priors, estimates })
    }

    /// `sum e^2` of the simulation by the most precise estimate's poles, before any iteration. Errors: as those of a fit.
    pub fn cost_of_start(&self, fit: usize) -> Result<f64, ModelError> {
        let options = self.options(fit)?;
        Ok(self.start(&self.problem(options)?, options)?.cost)
    }

    /// The simulation's errors after a few iterations from there. Errors: as those of a fit.
    pub fn errors_of_start(&self, fit: usize) -> Result<Vec<f64>, ModelError> {
        let options = self.options(fit)?;
        let problem = self.problem(options)?;
        let start = self.start(&problem, options)?;
        let mut errors = refined(&problem, std::iter::once(start.point), Limits::of(options))?.residual();
        errors.truncate(self.experiment.output.len());
        Ok(errors)
    }

    fn start(&self, problem: &Problem, options: &PemOptions) -> Result<Start, ModelError> {
        let poles = [self.estimates.precise(options)?];
        let best = ranked(problem, output_errors(&poles), 1)?.pop();
        best.ok_or(ModelError::Degenerate("no start could be evaluated"))
    }

    /// The model of a fit. Errors: as those of [`identify`](super::identify).
    pub fn model(&self, fit: usize) -> Result<Realised, ModelError> {
        let options = self.options(fit)?;
        let problem = self.problem(options)?;
        let state = minimum(&problem, &self.estimates, options)?;
        realised(&problem, &state, self.sample_time_s, options.noise)
    }

    fn options(&self, fit: usize) -> Result<&PemOptions, ModelError> {
        self.fits.get(fit).ok_or(ModelError::NoExperiment)
    }

    fn problem(&self, options: &PemOptions) -> Result<Problem<'_>, ModelError> {
        Ok(checked(&[self.experiment], self.sample_time_s, options)?.with_priors(&self.priors))
    }
}
