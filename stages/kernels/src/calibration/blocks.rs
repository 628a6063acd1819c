//! Block statistics: a record reduced to what levels and slopes need.

/// Means and variances over consecutive blocks of samples.
///
/// # Shapes
/// One value per whole block; the rest of a record that fills no block is left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Blocks {
    /// Samples per block.
    pub length: usize,
    /// Mean of the deflection per block, V.
    pub mean_v: Vec<f64>,
    /// Variance of the deflection within each block, V^2.
    pub variance_v2: Vec<f64>,
    /// Mean of the piezo monitor per block, V; empty where there is none.
    pub piezo_v: Vec<f64>,
}

impl Blocks {
    /// No blocks yet.
    pub fn new(length: usize) -> Self {
        Self { length: length.max(1), ..Self::default() }
    }

    /// Adds the whole blocks of a chunk; `piezo` is empty or as long as `deflection`. Feed chunks of a multiple of the
    /// block's length, so that nothing is lost between them.
    pub fn push(&mut self, deflection: &[f64], piezo: &[f64]) {
        for block in deflection.chunks_exact(self.length) {
            let (mean, variance) = moments(block);
            self.mean_v.push(mean);
            self.variance_v2.push(variance);
        }
        if piezo.len() == deflection.len() {
            self.piezo_v.extend(piezo.chunks_exact(self.length).map(|block| moments(block).0));
        }
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.mean_v.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.mean_v.is_empty()
    }
}

fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n)
}
