//! Lever, contact and detector as two linear systems: free and attached.

use super::chain::{Tap, append};
use super::contact::Contact;
use super::detector::Detector;
use super::discretisation::LinearSystem;
use super::lever::{ModalLever, Mode};
use super::square::Square;
use crate::effects::{Effects, ExtraMode};
use crate::linear_algebra::dot;
use std::f64::consts::TAU;

/// Boltzmann constant, J/K (exact in the SI).
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

/// The two regimes of the piecewise-linear microscope and the read-outs of their common state.
///
/// # Model
/// State: per mode `q_n` and `p_n = q_n' / w_n` (both m), then the detector's poles in series (m of static deflection).
/// `q_n' = w_n p_n`, `p_n' = -w_n q_n - (w_n/Q_n) p_n + (w_n/k_n) F`; `d_1' = w_1 (s - d_1)`, `d_i' = w_i (d_{i-1} -
/// d_i)`. Free: `F = 0`. Attached: `F = -k_c (h + sum q) - eta (h' + sum w_n p_n)`, `h` the base above the surface.
/// Noise intensities: `2 k_B T w_n / (Q_n k_n)` on `p_n`; attached, the damper's `2 k_B T eta` through `w_n/k_n` on
/// all. What is hidden in it: a further mode of share `g` is a mode of stiffness `k / |g|` that the tip's force drives
/// and whose `q` the detector sees with the sign of `g`, but that does not move the tip; sections follow the poles;
/// feedthrough adds `d0 F / k` to `s`.
///
/// # Accuracy
/// Exact: fluctuation and dissipation are paired, so either regime's stationary state is the Boltzmann distribution.
#[derive(Debug, Clone)]
pub struct AfmSystem {
    /// Tip apart from the sample.
    pub free: LinearSystem,
    /// Tip held by the contact.
    pub attached: LinearSystem,
    /// Tip apart from the sample under a force (N) in the place of the height, its rate in that of the velocity.
    pub loaded: LinearSystem,
    /// Tip displacement `sum q_n`, as weights on the state.
    pub tip_weights: Vec<f64>,
    /// Tip velocity `sum w_n p_n`.
    pub tip_velocity_weights: Vec<f64>,
    /// What the detector sees before its poles (m).
    pub lever_weights: Vec<f64>,
    /// Detector output before volts (m).
    pub signal_weights: Vec<f64>,
    /// Share of the tip's force that reaches the output without any state, m/N.
    pub signal_direct_m_per_n: f64,
    contact: Contact,
    /// States of the lever's own modes and of further ones; the detector's follow.
    mechanical: usize,
    /// Share of each state in a static deflection, behind those of the lever's own modes.
    static_gain: Vec<f64>,
}

impl AfmSystem {
    /// Builds both regimes at a temperature (K); zero means no thermal motion.
    pub fn new(lever: &ModalLever, contact: &Contact, detector: &Detector, temperature_k: f64) -> Self {
        Self::with_effects(lever, contact, detector, temperature_k, &Effects::default())
    }

    /// The same with the linear parts of what is hidden: further modes, sections of the electronics, feedthrough.
    pub fn with_effects(
        lever: &ModalLever,
        contact: &Contact,
        detector: &Detector,
        temperature_k: f64,
        effects: &Effects,
    ) -> Self {
        let modes = lever.modes.len();
        let mechanical = 2 * (modes + effects.extra_modes.len());
        let size = mechanical + detector.pole_hz.len() + effects.electronics.len();
        let mut tip_weights = vec![0.0; size];
        let mut tip_velocity_weights = vec![0.0; size];
        let mut slope_weights = vec![0.0; size];
        let mut force_input = vec![0.0; size];
        let mut dynamics = Square::zeros(size);
        let mut noise = Square::zeros(size);
        for (i, mode) in
            lever.modes.iter().chain(&effects.extra_modes.iter().map(as_mode).collect::<Vec<Mode>>()).enumerate()
        {
            let (q, p) = (2 * i, 2 * i + 1);
            let w = TAU * mode.frequency_hz;
            let stiffness = lever.modal_stiffness_n_per_m(mode);
            dynamics[(q, p)] = w;
            dynamics[(p, q)] = -w;
            dynamics[(p, p)] = -w / mode.quality_factor;
            noise[(p, p)] = 2.0 * BOLTZMANN_J_PER_K * temperature_k * w / (mode.quality_factor * stiffness);
            force_input[p] = w / stiffness;
            if i < modes {
                tip_weights[q] = 1.0;
                tip_velocity_weights[p] = w;
            }
            slope_weights[q] = mode.detector_share / mode.tip_share;
        }
        let shares = effects.extra_modes.iter().map(|mode| mode.share);
        let mut static_gain: Vec<f64> = shares.clone().flat_map(|share| [share.abs(), 0.0]).collect();
        let feedthrough = Tap {
            weights: slope_weights.clone(),
            direct: effects.feedthrough / lever.stiffness_n_per_m,
            static_gain: 1.0 + shares.sum::<f64>() + effects.feedthrough,
        };
        let (signal, gains) =
            append(&mut dynamics, &mut force_input, feedthrough, mechanical, &detector.pole_hz, &effects.electronics);
        static_gain.extend(gains);
        let zeros = vec![0.0; size];
        let free = LinearSystem {
            dynamics: dynamics.clone(),
            height_input: zeros.clone(),
            velocity_input: zeros.clone(),
            noise_intensity: noise.clone(),
        };
        let loaded = LinearSystem { height_input: force_input.clone(), ..free.clone() };
        let (k_c, eta) = (contact.stiffness_n_per_m, contact.damping_n_s_per_m);
        for (i, input) in force_input.iter().enumerate() {
            for j in 0..size {
                dynamics[(i, j)] -= input * (k_c * tip_weights[j] + eta * tip_velocity_weights[j]);
                noise[(i, j)] += 2.0 * BOLTZMANN_J_PER_K * temperature_k * eta * input * force_input[j];
            }
        }
        let attached = LinearSystem {
            dynamics,
            height_input: force_input.iter().map(|b| -k_c * b).collect(),
            velocity_input: force_input.iter().map(|b| -eta * b).collect(),
            noise_intensity: noise,
        };
        Self {
            free,
            attached,
            loaded,
            tip_weights,
            tip_velocity_weights,
            lever_weights: slope_weights,
            signal_weights: signal.weights,
            signal_direct_m_per_n: signal.direct,
            contact: *contact,
            mechanical,
            static_gain,
        }
    }

    /// Number of states.
    pub fn size(&self) -> usize {
        self.tip_weights.len()
    }

    /// Gap between tip and surface, m.
    pub fn gap_m(&self, state: &[f64], height_m: f64) -> f64 {
        height_m + dot(&self.tip_weights, state)
    }

    /// Tension of the contact if it were attached, N.
    pub fn tension_n(&self, state: &[f64], height_m: f64, velocity_m_per_s: f64) -> f64 {
        let gap_velocity = velocity_m_per_s + dot(&self.tip_velocity_weights, state);
        self.contact.stiffness_n_per_m * self.gap_m(state, height_m) + self.contact.damping_n_s_per_m * gap_velocity
    }

    /// The state at rest in the attached regime with the base at `height_m`, or in the free one: the static deflection
    /// spread over the modes by their tip shares.
    pub fn rest(&self, lever: &ModalLever, attached_height_m: Option<f64>) -> Vec<f64> {
        let mut state = vec![0.0; self.size()];
        let Some(height) = attached_height_m else { return state };
        let k_c = self.contact.stiffness_n_per_m;
        let deflection = -height * k_c / (k_c + lever.stiffness_n_per_m);
        for (i, mode) in lever.modes.iter().enumerate() {
            state[2 * i] = deflection * mode.tip_share;
        }
        for (x, gain) in state.iter_mut().skip(2 * lever.modes.len()).zip(&self.static_gain) {
            *x = gain * deflection;
        }
        state
    }

    /// Number of states of all modes; the detector's follow.
    pub fn mechanical(&self) -> usize {
        self.mechanical
    }
}

/// A further mode as one of the lever that the detector sees by its share, with the thermal motion of that share.
fn as_mode(extra: &ExtraMode) -> Mode {
    Mode {
        frequency_hz: extra.frequency_hz,
        quality_factor: extra.quality_factor,
        // a share of zero would be a mode of infinite stiffness
        tip_share: extra.share.abs().max(f64::MIN_POSITIVE.sqrt()),
        detector_share: extra.share,
    }
}
