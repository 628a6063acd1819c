//! Lever, contact and detector as two linear systems: free and attached.

use super::contact::Contact;
use super::detector::Detector;
use super::discretisation::LinearSystem;
use super::lever::ModalLever;
use super::square::Square;
use std::f64::consts::TAU;

/// Boltzmann constant, J/K (exact in the SI).
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

/// The two regimes of the piecewise-linear microscope and the read-outs of their common state.
///
/// # Model
/// State: per mode `q_n` and `p_n = q_n' / w_n` (both m), then the detector's poles in series (m of static deflection).
/// `q_n' = w_n p_n`, `p_n' = -w_n q_n - (w_n/Q_n) p_n + (w_n/k_n) F`; `d_1' = w_1 (s - d_1)`, `d_i' = w_i (d_{i-1} - d_i)`.
/// Free: `F = 0`. Attached: `F = -k_c (h + sum q) - eta (h' + sum w_n p_n)`, `h` the base above the surface.
/// Noise intensities: `2 k_B T w_n / (Q_n k_n)` on `p_n`; attached, the damper's `2 k_B T eta` through `w_n/k_n` on all.
///
/// # Accuracy
/// Exact: fluctuation and dissipation are paired, so either regime's stationary state is the Boltzmann distribution.
#[derive(Debug, Clone)]
pub struct AfmSystem {
    /// Tip apart from the sample.
    pub free: LinearSystem,
    /// Tip held by the contact.
    pub attached: LinearSystem,
    /// Tip displacement `sum q_n`, as weights on the state.
    pub tip_weights: Vec<f64>,
    /// Tip velocity `sum w_n p_n`.
    pub tip_velocity_weights: Vec<f64>,
    /// Detector output before volts (m).
    pub signal_weights: Vec<f64>,
    contact: Contact,
}

impl AfmSystem {
    /// Builds both regimes at a temperature (K); zero means no thermal motion.
    pub fn new(lever: &ModalLever, contact: &Contact, detector: &Detector, temperature_k: f64) -> Self {
        let modes = lever.modes.len();
        let size = 2 * modes + detector.pole_hz.len();
        let mut tip_weights = vec![0.0; size];
        let mut tip_velocity_weights = vec![0.0; size];
        let mut slope_weights = vec![0.0; size];
        let mut force_input = vec![0.0; size];
        let mut dynamics = Square::zeros(size);
        let mut noise = Square::zeros(size);
        for (i, mode) in lever.modes.iter().enumerate() {
            let (q, p) = (2 * i, 2 * i + 1);
            let w = TAU * mode.frequency_hz;
            let stiffness = lever.modal_stiffness_n_per_m(mode);
            dynamics[(q, p)] = w;
            dynamics[(p, q)] = -w;
            dynamics[(p, p)] = -w / mode.quality_factor;
            noise[(p, p)] = 2.0 * BOLTZMANN_J_PER_K * temperature_k * w / (mode.quality_factor * stiffness);
            force_input[p] = w / stiffness;
            tip_weights[q] = 1.0;
            tip_velocity_weights[p] = w;
            slope_weights[q] = mode.detector_share / mode.tip_share;
        }
        let mut signal_weights = slope_weights;
        for (i, pole_hz) in detector.pole_hz.iter().enumerate() {
            let (d, w) = (2 * modes + i, TAU * pole_hz);
            for (j, weight) in signal_weights.iter().enumerate() {
                dynamics[(d, j)] += w * weight;
            }
            dynamics[(d, d)] -= w;
            signal_weights = vec![0.0; size];
            signal_weights[d] = 1.0;
        }
        let zeros = vec![0.0; size];
        let free = LinearSystem {
            dynamics: dynamics.clone(),
            height_input: zeros.clone(),
            velocity_input: zeros,
            noise_intensity: noise.clone(),
        };
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
        Self { free, attached, tip_weights, tip_velocity_weights, signal_weights, contact: *contact }
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
        state.iter_mut().skip(2 * lever.modes.len()).for_each(|d| *d = deflection);
        state
    }
}

/// Weighted sum of a state.
pub(super) fn dot(weights: &[f64], state: &[f64]) -> f64 {
    weights.iter().zip(state).map(|(w, x)| w * x).sum()
}
