//! The plan of an archive: surfaces, pull-off forces, start phases, wander of the baseline.

use super::error::{SimulateError, require};
use super::phases::{PhaseProblem, RecordPlan, Target};
use super::readout_noise::Drift;
use super::recorder::{Microscope, Place, RecordedEvent, Scatter, SimulatedRecord, archive_stream, counted};
use crate::effects::Effects;
use crate::events::EventKind;

/// Size and contents of an archive.
#[derive(Debug, Clone, PartialEq)]
pub struct ArchiveLayout {
    /// Number of records.
    pub records: usize,
    /// Samples per record.
    pub samples: usize,
    /// An event counts if it lies at least this far from both ends of its record and from its neighbours, samples.
    pub margin_samples: usize,
    /// Totals of counted events.
    pub target: Target,
    /// Start phases, one per record, instead of solved ones.
    pub phases: Option<Vec<f64>>,
    /// Scatter of the surface.
    pub scatter: Scatter,
    /// Seed.
    pub seed: u64,
}

/// An archive before its records are simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Archive {
    /// Surface and pull-off forces per record.
    pub plans: Vec<RecordPlan>,
    /// Start phase per record.
    pub phases: Vec<f64>,
    layout: ArchiveLayout,
    drift: Drift,
}

impl ArchiveLayout {
    /// Every parameter's range.
    pub fn check(&self) -> Result<(), SimulateError> {
        let positive = |name, value: usize| match value {
            0 => Err(SimulateError::parameter(name, value, "wanted at least 1")),
            _ => Ok(()),
        };
        positive("records", self.records)?;
        positive("samples", self.samples)?;
        if 2 * self.margin_samples >= self.samples {
            let wanted = "wanted less than half of samples: no event could count";
            return Err(SimulateError::parameter("margin_samples", self.margin_samples, wanted));
        }
        require("surface_m", self.scatter.surface_m, true, "wanted a number")?;
        require("surface_std_m", self.scatter.surface_std_m, self.scatter.surface_std_m >= 0.0, "wanted 0 or more")?;
        for &phase in self.phases.iter().flatten() {
            require("phases", phase, (0.0..1.0).contains(&phase), "wanted 0 or more and below 1")?;
        }
        match &self.phases {
            Some(phases) if phases.len() != self.records => {
                Err(SimulateError::parameter("phases", phases.len(), "wanted one per record, or none at all"))
            }
            _ => Ok(()),
        }
    }

    fn place(&self, record: usize) -> Place {
        let Self { records, samples, margin_samples, seed, .. } = *self;
        Place { record, records, samples, margin_samples, seed }
    }
}

impl Archive {
    /// Plans an archive: draws each record's surface and pull-off forces, then solves for the phases.
    ///
    /// # Errors
    /// Parameters out of range; totals out of reach ([`PhaseProblem::solve`]).
    pub fn plan(microscope: &Microscope, layout: &ArchiveLayout) -> Result<Self, SimulateError> {
        microscope.check()?;
        layout.check()?;
        let plans: Vec<RecordPlan> =
            (0..layout.records).map(|record| microscope.plan(layout.scatter, layout.place(record))).collect();
        let mut rng = archive_stream(layout.seed);
        let drift = microscope.noise.drift(&mut rng);
        let problem = PhaseProblem {
            ramp: microscope.ramp,
            contact: microscope.contact,
            stiffness_n_per_m: microscope.lever.stiffness_n_per_m,
            duration_s: layout.samples as f64 / microscope.sample_rate_hz,
            margin_s: layout.margin_samples as f64 / microscope.sample_rate_hz + THERMAL_LEAD_S,
        };
        let phases = match &layout.phases {
            Some(phases) => phases.clone(),
            None => problem.solve(&plans, layout.target, &mut rng)?,
        };
        Ok(Self { plans, phases, layout: layout.clone(), drift })
    }

    /// Simulates one record of the plan. Panics if `record` is not below the number of records.
    pub fn simulate(&self, microscope: &Microscope, record: usize) -> SimulatedRecord {
        self.simulate_with(microscope, record, &Effects::default())
    }

    /// The same with causes hidden in it ([`Microscope::record_with`]).
    pub fn simulate_with(&self, microscope: &Microscope, record: usize, effects: &Effects) -> SimulatedRecord {
        let place = self.layout.place(record);
        microscope.record_with(&self.plans[record], self.phases[record], &self.drift, place, effects)
    }

    /// Checks that the simulated events are as many as asked for.
    pub fn verify(&self, records: &[Vec<RecordedEvent>]) -> Result<(), SimulateError> {
        let target = &self.layout.target;
        for (kind, wanted) in [(EventKind::SnapIn, target.snap_ins), (EventKind::SnapOff, target.snap_offs)] {
            let found = counted(records.iter().map(Vec::as_slice), kind);
            if let Some(wanted) = wanted.filter(|wanted| *wanted != found) {
                return Err(SimulateError::Count { kind: kind.name(), found, wanted });
            }
        }
        Ok(())
    }
}

/// Thermal motion brings events forward by this much at most: the phases keep this clear of the margins.
const THERMAL_LEAD_S: f64 = 5e-4;
