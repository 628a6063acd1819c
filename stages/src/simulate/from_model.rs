//! The microscope of a diagnosed lever.

use afmid_pipeline::StageError;

use super::afm::Afm;
use super::lever_model::{LeverModel, LinearPart};
use afmid_kernels::simulate::{BOLTZMANN_J_PER_K, PINK_LOWEST_HZ};

impl Afm {
    /// These parameters with lever, detector and sample rate of a part of `model`.
    ///
    /// # Model
    /// Displacements of the tip are not seen: their shares are a uniform beam's, inversely as the square of the
    /// frequency. They set the thermal motion and the motion against the contact, not the release.
    pub fn with_lever(self, model: &LeverModel, part: &LinearPart) -> Self {
        let frequencies_hz: Vec<f64> = part.modes.iter().map(|mode| mode.frequency_hz.value).collect();
        let weights: Vec<f64> = frequencies_hz.iter().map(|f| f.powi(-2)).collect();
        let sum: f64 = weights.iter().sum();
        Self {
            sample_rate_hz: model.sample_rate_hz,
            tip_shares: weights.iter().map(|weight| weight / sum).collect(),
            frequencies_hz,
            quality_factors: part.modes.iter().map(|mode| mode.quality_factor.value).collect(),
            detector_shares: part.modes.iter().map(|mode| mode.share.value).collect(),
            detector_poles_hz: part.detector_poles_hz.iter().map(|pole| pole.value).collect(),
            ..self
        }
    }

    /// These parameters with everything that `model` says: extended lever, causes, noise, loads.
    ///
    /// # Model
    /// Newtons are those of this stiffness and sensitivity. The temperature is what gives the first mode the thermal
    /// motion that was seen; white noise is less the converter's rounding, `lsb^2 / 12`; 1/f noise has per decade what
    /// the model's has on average.
    ///
    /// # Errors
    /// Causes that are unknown or out of their limits.
    pub fn of_model(self, model: &LeverModel) -> Result<Self, StageError> {
        let afm = self.with_lever(model, &model.extended);
        let newtons_per_volt = afm.stiffness_n_per_m / afm.sensitivity_v_per_m;
        let scatter = model.amplitude.scatter_v / model.amplitude.mean_v.abs().max(f64::MIN_POSITIVE);
        Ok(Self {
            hidden: model.hidden()?,
            adhesion_n: model.amplitude.mean_v.abs() * newtons_per_volt,
            adhesion_scatter: scatter.min(MOST_SCATTER),
            temperature_k: temperature_k(&afm, model),
            white_v: (model.noise.white_v2 - afm.lsb_v * afm.lsb_v / 12.0).max(0.0).sqrt(),
            pink_v: pink_v(model),
            ..afm
        })
    }
}

/// Scatter of the loads that the simulator still takes.
const MOST_SCATTER: f64 = 0.29;

/// `variance = k_B T / k (S c_slope)^2 / c_tip` of the first mode, solved for T.
fn temperature_k(afm: &Afm, model: &LeverModel) -> f64 {
    let first = afm.frequencies_hz.first().copied().unwrap_or(0.0);
    let near = |a: f64, b: f64| (a - first).abs().total_cmp(&(b - first).abs());
    let seen = model.noise.thermal.iter().min_by(|a, b| near(a.frequency_hz, b.frequency_hz));
    let (Some(seen), Some(tip), Some(slope)) = (seen, afm.tip_shares.first(), afm.detector_shares.first()) else {
        return 0.0;
    };
    let per_metre = afm.sensitivity_v_per_m * slope;
    seen.variance_v2.max(0.0) * afm.stiffness_n_per_m * tip / (BOLTZMANN_J_PER_K * per_metre * per_metre)
}

/// Standard deviation over all decades from the mean variance per decade.
fn pink_v(model: &LeverModel) -> f64 {
    let wander = &model.noise.wander;
    if wander.is_empty() {
        return 0.0;
    }
    let per_decade = wander.iter().map(|part| part.variance_v2).sum::<f64>() / wander.len() as f64;
    let decades = (0.5 * model.sample_rate_hz / PINK_LOWEST_HZ).log10().max(0.0);
    (per_decade * decades).max(0.0).sqrt()
}
