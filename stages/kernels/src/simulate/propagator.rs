//! The per-sample step in a layout for speed.

use super::discretisation::Step;

/// Lanes that one block of the inner loop handles.
const LANES: usize = 4;

/// A [`Step`] compiled to padded columns, and the random step it performs in place.
///
/// # Accuracy
/// The sums run in another order than in [`Step::advance`]: equal to rounding (tested).
#[derive(Debug, Clone)]
pub struct Propagator {
    width: usize,
    /// Transition columns, then noise columns.
    columns: Vec<f64>,
    height_gain: Vec<f64>,
    velocity_gain: Vec<f64>,
    /// States whose noise column is not zero: the deviates that matter.
    noisy: Vec<usize>,
}

impl Propagator {
    /// Compiles `step`.
    pub fn new(step: &Step) -> Self {
        let n = step.transition.size;
        let width = n.div_ceil(LANES) * LANES;
        let padded =
            |gain: &[f64]| gain.iter().copied().chain(std::iter::repeat_n(0.0, width - n)).collect::<Vec<f64>>();
        let mut columns = Vec::with_capacity(2 * n * width);
        for j in 0..n {
            columns.extend(padded(&(0..n).map(|i| step.transition[(i, j)]).collect::<Vec<f64>>()));
        }
        let noisy: Vec<usize> = (0..n).filter(|&j| step.noise_factor[(j, j)] > 0.0).collect();
        for &j in &noisy {
            columns.extend(padded(&(0..n).map(|i| step.noise_factor[(i, j)]).collect::<Vec<f64>>()));
        }
        Self {
            width,
            columns,
            height_gain: padded(&step.height_gain),
            velocity_gain: padded(&step.velocity_gain),
            noisy,
        }
    }

    /// Length of a padded state.
    pub fn width(&self) -> usize {
        self.width
    }

    /// `next = Phi state + gamma_h h + gamma_v h' + L deviates`; `state`, `next`: padded to [`Self::width`].
    pub fn advance(&self, state: &[f64], height_m: f64, velocity_m_per_s: f64, deviates: &[f64], next: &mut [f64]) {
        for ((out, h), v) in next.iter_mut().zip(&self.height_gain).zip(&self.velocity_gain) {
            *out = h * height_m + v * velocity_m_per_s;
        }
        let transition_columns = self.columns.len() / self.width - self.noisy.len();
        let factors = state.iter().take(transition_columns);
        let noise = self.noisy.iter().map(|&j| &deviates[j]);
        for (column, &factor) in self.columns.chunks_exact(self.width).zip(factors.chain(noise)) {
            for (out, c) in next.chunks_exact_mut(LANES).zip(column.chunks_exact(LANES)) {
                for lane in 0..LANES {
                    out[lane] += c[lane] * factor;
                }
            }
        }
    }
}
