//! Which of the grouped modes ring in the record at all.

use faer::c64;

use super::{PhysicalMode, Stabilisation, proposed};
use crate::model::ModelError;
use crate::modes::{ModeCriteria, poles};
use crate::pem::{Experiment, PemOptions, with_poles};

/// Real poles beside the modes: fast decays of a detector, whatever their rates, lie close to what these three span.
const DETECTOR: [f64; 3] = [0.1, 0.4, 0.7];

impl Stabilisation {
    /// Without the modes whose ringing in `experiment` is below `min_significance` standard errors.
    ///
    /// Noise has poles that stay, too: one record's noise is the same at every order. What sets a mode apart is its
    /// amplitude. The simulation with all modes' median poles, and three real ones, is fitted by least squares; the
    /// amplitude's error allows for a coloured residual. Errors: as [`with_poles`].
    pub fn established(
        mut self,
        experiment: Experiment<'_>,
        sample_time_s: f64,
        min_significance: f64,
    ) -> Result<Self, ModelError> {
        if self.modes.is_empty() {
            return Ok(self);
        }
        let found = significances(&self.modes, experiment, sample_time_s)?;
        self.modes.iter_mut().zip(found).for_each(|(mode, found)| mode.significance = found);
        let kept: Vec<bool> = self.modes.iter().map(|mode| mode.significance >= min_significance).collect();
        let renumbered = |mode: usize| kept[mode].then(|| kept[..mode].iter().filter(|kept| **kept).count());
        self.poles.iter_mut().for_each(|pole| pole.mode = pole.mode.and_then(renumbered));
        self.modes.retain(|mode| mode.significance >= min_significance);
        self.order = proposed(&self.poles, &self.orders, self.modes.len());
        Ok(self)
    }
}

/// Amplitude over standard error of each mode, all fitted together.
fn significances(
    modes: &[PhysicalMode],
    experiment: Experiment<'_>,
    sample_time_s: f64,
) -> Result<Vec<f64>, ModelError> {
    let upper = |mode: &PhysicalMode| {
        let w = std::f64::consts::TAU * mode.frequency_hz;
        let s = c64::new(-mode.damping * w, w * (1.0 - mode.damping * mode.damping).sqrt());
        (s * sample_time_s).exp()
    };
    let wanted: Vec<c64> = modes.iter().map(upper).collect();
    let all: Vec<c64> =
        wanted.iter().flat_map(|z| [*z, z.conj()]).chain(DETECTOR.into_iter().map(|z| c64::new(z, 0.0))).collect();
    let options = PemOptions { block_rows: all.len() + 1, ..PemOptions::default() };
    let fit = with_poles(&[experiment], sample_time_s, &all, &options)?;
    let found = poles(&fit.model, &fit.covariance, &ModeCriteria::default())?;
    let own = |z: &c64| {
        let distance = |pole: &&crate::modes::Pole| (pole.root.z - z).norm();
        found.iter().min_by(|x, y| distance(x).total_cmp(&distance(y))).map_or(0.0, |pole| pole.significance)
    };
    Ok(wanted.iter().map(own).collect())
}
