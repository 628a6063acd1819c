//! Exact discretisation of a linear stochastic system over one step.

use super::square::Square;

/// `x' = A x + b_h h + b_v h' + noise`, the noise white with two-sided intensity `N`; `h` moves at constant speed `h'`.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSystem {
    /// `A`, 1/s.
    pub dynamics: Square,
    /// `b_h`: what the height `h` drives.
    pub height_input: Vec<f64>,
    /// `b_v`: what its velocity drives.
    pub velocity_input: Vec<f64>,
    /// `N`: `<noise(t) noise(t')^T> = N delta(t - t')`.
    pub noise_intensity: Square,
}

/// One step of a [`LinearSystem`]: `x -> Phi x + gamma_h h + gamma_v h' + L xi`, `xi` standard normal.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Length, s.
    pub duration_s: f64,
    /// `Phi = exp(A duration)`.
    pub transition: Square,
    /// `gamma_h`, for the height at the start of the step.
    pub height_gain: Vec<f64>,
    /// `gamma_v`.
    pub velocity_gain: Vec<f64>,
    /// `L`, lower triangular, `L L^T` the covariance that the noise adds over the step.
    pub noise_factor: Square,
}

impl LinearSystem {
    /// The step of length `duration_s`.
    ///
    /// # Method
    /// The inputs by an augmented exponential (`h' = const` exactly, so there is no hold error); the noise covariance
    /// `int_0^T e^{As} N e^{A^T s} ds` by Van Loan's block exponential.
    ///
    /// # Accuracy
    /// Rounding alone: about 1e-13 relative for the transition, 1e-12 for the covariance's large entries.
    ///
    /// # Source
    /// C. F. Van Loan, Computing integrals involving the matrix exponential, IEEE Trans. Automat. Contr. 23 (1978) 395.
    pub fn step(&self, duration_s: f64) -> Step {
        let n = self.dynamics.size;
        let mut augmented = Square::zeros(n + 2);
        for i in 0..n {
            for j in 0..n {
                augmented[(i, j)] = self.dynamics[(i, j)] * duration_s;
            }
            augmented[(i, n)] = self.height_input[i] * duration_s;
            augmented[(i, n + 1)] = self.velocity_input[i] * duration_s;
        }
        augmented[(n, n + 1)] = duration_s;
        let exponential = augmented.exponential();
        let mut transition = Square::zeros(n);
        for i in 0..n {
            for j in 0..n {
                transition[(i, j)] = exponential[(i, j)];
            }
        }
        Step {
            duration_s,
            transition,
            height_gain: (0..n).map(|i| exponential[(i, n)]).collect(),
            velocity_gain: (0..n).map(|i| exponential[(i, n + 1)]).collect(),
            noise_factor: self.noise_covariance(duration_s).semidefinite_cholesky(),
        }
    }

    /// The covariance that the noise adds over `duration_s`.
    pub fn noise_covariance(&self, duration_s: f64) -> Square {
        let n = self.dynamics.size;
        if self.noise_intensity.norm() == 0.0 {
            return Square::zeros(n);
        }
        let mut block = Square::zeros(2 * n);
        for i in 0..n {
            for j in 0..n {
                block[(i, j)] = -self.dynamics[(i, j)] * duration_s;
                block[(n + i, n + j)] = self.dynamics[(j, i)] * duration_s;
                // the exponential is linear in this block: its scale is free, so keep the norm that of A
                block[(i, n + j)] = self.noise_intensity[(i, j)] / self.noise_intensity.norm();
            }
        }
        let exponential = block.exponential();
        let mut covariance = Square::zeros(n);
        for i in 0..n {
            for j in 0..n {
                // Phi * (upper right), Phi = (lower right)^T
                let sum: f64 = (0..n).map(|k| exponential[(n + k, n + i)] * exponential[(k, n + j)]).sum();
                covariance[(i, j)] = sum * duration_s * self.noise_intensity.norm();
            }
        }
        symmetric_part(&covariance)
    }

    /// The stationary covariance of a stable system.
    ///
    /// # Method
    /// Doubling: with `P_T` the covariance accumulated over `T`, `P_2T = P_T + Phi_T P_T Phi_T^T` and `Phi_2T =
    /// Phi_T^2`, until the slowest pole has decayed by `exp(-40)`.
    ///
    /// # Accuracy
    /// About 1e-12 relative.
    pub fn stationary_covariance(&self, start_s: f64) -> Square {
        let mut covariance = self.noise_covariance(start_s);
        let mut transition = self.dynamics.scaled(start_s).exponential();
        for _ in 0..60 {
            covariance = covariance.plus(&transition.times(&covariance).times(&transition.transposed()));
            transition = transition.times(&transition);
            if transition.norm() < 1e-17 {
                break;
            }
        }
        symmetric_part(&covariance)
    }
}

fn symmetric_part(matrix: &Square) -> Square {
    matrix.plus(&matrix.transposed()).scaled(0.5)
}

impl Step {
    /// One step: the new state, from the state, the height and velocity at the start and `deviates`, one per state.
    pub fn advance(&self, state: &[f64], height_m: f64, velocity_m_per_s: f64, deviates: &[f64]) -> Vec<f64> {
        let n = self.transition.size;
        (0..n)
            .map(|i| {
                let mut sum = self.height_gain[i] * height_m + self.velocity_gain[i] * velocity_m_per_s;
                sum += state.iter().take(n).enumerate().map(|(j, x)| self.transition[(i, j)] * x).sum::<f64>();
                sum +=
                    deviates.iter().take(i + 1).enumerate().map(|(j, xi)| self.noise_factor[(i, j)] * xi).sum::<f64>();
                sum
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oscillator(frequency_hz: f64, quality_factor: f64) -> LinearSystem {
        let w = std::f64::consts::TAU * frequency_hz;
        let mut dynamics = Square::zeros(2);
        dynamics[(0, 1)] = w;
        dynamics[(1, 0)] = -w;
        dynamics[(1, 1)] = -w / quality_factor;
        let mut noise_intensity = Square::zeros(2);
        noise_intensity[(1, 1)] = 2.0 * w / quality_factor;
        LinearSystem { dynamics, height_input: vec![0.0, w], velocity_input: vec![0.0, 0.0], noise_intensity }
    }

    #[test]
    fn two_half_steps_are_one_step() {
        let system = oscillator(1e6, 5.0);
        let (whole, half) = (system.step(2e-7), system.step(1e-7));
        let twice = half.transition.times(&half.transition);
        let covariance = |step: &Step| step.noise_factor.times(&step.noise_factor.transposed());
        let accumulated =
            covariance(&half).plus(&half.transition.times(&covariance(&half)).times(&half.transition.transposed()));
        for i in 0..2 {
            for j in 0..2 {
                // rounding of entries of order one
                assert!((twice[(i, j)] - whole.transition[(i, j)]).abs() < 1e-13);
                assert!((accumulated[(i, j)] - covariance(&whole)[(i, j)]).abs() < 1e-13);
            }
        }
        let (h, v) = (0.3, 1e5);
        let middle = half.advance(&[0.2, -0.1], h, v, &[0.0; 2]);
        let end = half.advance(&middle, h + v * 1e-7, v, &[0.0; 2]);
        let direct = whole.advance(&[0.2, -0.1], h, v, &[0.0; 2]);
        assert!((end[0] - direct[0]).abs() < 1e-13 && (end[1] - direct[1]).abs() < 1e-13);
    }

    #[test]
    fn stationary_covariance_is_equipartition() {
        for quality_factor in [0.6, 40.0, 500.0] {
            let covariance = oscillator(46e3, quality_factor).stationary_covariance(2e-7);
            // doubling accumulates rounding over up to 30 squarings: 30 * 1e-14
            assert!((covariance[(0, 0)] - 1.0).abs() < 1e-11, "{quality_factor}");
            assert!((covariance[(1, 1)] - 1.0).abs() < 1e-11);
            assert!(covariance[(0, 1)].abs() < 1e-11);
        }
    }
}
