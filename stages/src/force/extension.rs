//! The extended model of a diagnosis as the model of a reconstruction.

use afmid_pipeline::{Matrix, StageError, StateSpace};

use crate::simulate::{Afm, LeverModel};
use afmid_kernels::effects::Effects;
use afmid_kernels::simulate::AfmSystem;

/// Lever, detector and linear causes as a discrete model, maps of the detector to be inverted, and what is left as it
/// is.
pub(super) struct Extension {
    /// From force (V of static deflection, held between samples) to response.
    pub model: StateSpace,
    effects: Effects,
    /// Causes that are not undone, and why.
    pub remaining: Vec<String>,
}

impl Extension {
    /// # Model
    /// Modes, poles, further modes, sections and feedthrough in continuous time; exact under a held force. Causes in
    /// the force itself (tails, slow ruptures) are what is reconstructed.
    /// # Errors
    /// Causes that are unknown or out of their limits.
    pub fn new(model: &LeverModel) -> Result<Self, StageError> {
        let microscope = Afm::default().with_lever(model, &model.extended).microscope();
        let effects = model.effects()?;
        let lever = &microscope.lever;
        let system = AfmSystem::with_effects(lever, &microscope.contact, &microscope.detector, 0.0, &effects);
        let step = system.loaded.step(1.0 / model.sample_rate_hz);
        let n = system.size();
        let newtons_per_m = lever.stiffness_n_per_m;
        // states in volts: those of the system times the sensitivity; a volt of force is k / sensitivity newtons
        let state_space = StateSpace {
            a: Matrix::new(n, n, (0..n * n).map(|ij| step.transition[(ij / n, ij % n)]).collect())?,
            b: Matrix::column(step.height_gain.iter().map(|gain| gain * newtons_per_m).collect()),
            c: Matrix::row(system.signal_weights.clone()),
            d: Matrix::row(vec![system.signal_direct_m_per_n * newtons_per_m]),
            k: Matrix::column(vec![0.0; n]),
            x0: vec![0.0; n],
            sample_time_s: 1.0 / model.sample_rate_hz,
            innovation_variance: model.noise.white_v2,
            ..StateSpace::default()
        };
        Ok(Self { model: state_space, effects, remaining: remaining(model)? })
    }

    /// Turns what the detector shows of an event, above its free line, into what a straight detector would have shown.
    ///
    /// # Method
    /// The map is inverted behind the poles. Map and poles change places but for `(f / pole)^2` of what the map adds: a
    /// delay is the same on either side.
    /// # Errors
    /// A value that the map does not reach.
    pub fn straighten(&self, volts: &mut [f64]) -> Result<(), StageError> {
        if self.effects.optics.is_empty() {
            return Ok(());
        }
        for v in volts {
            *v = inverse(|s| self.effects.seen(s), *v).ok_or_else(|| {
                StageError::new(format!("the detector's map never shows {v} V: it cannot be inverted there"))
                    .help("leave the cause out of the diagnosis (`without`), or look at its value")
            })?;
        }
        Ok(())
    }
}

/// Where `map` is `value`, by Newton's method from `value` on; none where it does not arrive.
fn inverse(map: impl Fn(f64) -> f64, value: f64) -> Option<f64> {
    const STEPS: usize = 40;
    let scale = value.abs().max(1e-3);
    let mut at = value;
    for _ in 0..STEPS {
        let miss = map(at) - value;
        // a nanovolt per volt lies below every noise
        if miss.abs() <= 1e-9 * scale {
            return Some(at);
        }
        let h = 1e-6 * scale;
        let slope = (map(at + h) - map(at - h)) / (2.0 * h);
        if slope.is_nan() || slope <= 0.0 {
            return None;
        }
        at -= miss / slope;
    }
    None
}

/// What each cause leaves in the force.
fn remaining(model: &LeverModel) -> Result<Vec<String>, StageError> {
    let mut out = Vec::new();
    for entry in model.hidden()? {
        let (cause, values) = entry.resolve()?;
        let mut own = Effects::default();
        cause.add(&values, &mut own);
        let id = cause.about().id;
        for (there, why) in [
            (!own.modal_force.is_empty(), "a nonlinear lever: its force on the modes shows as a force on the tip"),
            (!own.frequency.is_empty(), "modes that change along the archive: the model has their mean"),
            (!own.added.is_empty(), "volts added to the record: only what is constant goes, with the free line"),
            (own.limits.is_some(), "clipped values are lost: the force there follows the limit"),
            (own.jitter_s != 0.0 || own.intensity != 0.0 || !own.lost.is_empty(), "it has no inverse"),
        ] {
            if there {
                out.push(format!("`{id}` is not undone: {why}"));
            }
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_inverted_and_folds_are_refused() {
        let bend = |s: f64| s + 0.1 * s * s;
        for s in [-0.9, -1e-4, 0.0, 0.3, 2.0] {
            // a nanovolt per volt, over a slope of at least 0.8
            assert!((inverse(bend, bend(s)).unwrap() - s).abs() < 2e-9 * s.abs().max(1e-3));
        }
        // the parabola's bottom is -2.5 V
        assert_eq!(inverse(bend, -2.6), None);
    }
}
