//! Every so many samples of long decays: causes are chosen on them, all samples fit what was chosen.

use super::{Record, Stretch};

/// Samples that are kept of each period of the highest mode: its fourth harmonic is still seen.
const A_PERIOD: f64 = 10.0;

/// Records of which every so many samples are kept.
pub(in crate::diagnosis) struct Thinned {
    outputs: Vec<Vec<Vec<f64>>>,
    /// Stretches that are learnt from.
    pub stretches: Vec<Stretch>,
    /// Interval of what is kept, s.
    pub interval_s: f64,
}

impl Thinned {
    /// Decays whose highest mode is known; none where every sample counts, or an input has to be followed.
    pub fn new(records: &[Record<'_>], stretches: &[Stretch], interval_s: f64, highest_hz: f64) -> Option<Self> {
        let every = (1.0 / (A_PERIOD * highest_hz * interval_s)).floor() as usize;
        if every < 2 || records.iter().any(|record| !record.input.is_empty()) {
            return None;
        }
        let thin = |output: &&[f64]| output.iter().step_by(every).copied().collect();
        let cut = |s: &Stretch| Stretch { first: s.first.div_ceil(every), end: s.end.div_ceil(every), ..*s };
        let stretches: Vec<Stretch> = stretches.iter().map(cut).collect();
        if stretches.iter().any(|stretch| stretch.samples() < super::LEAST_SAMPLES) {
            return None;
        }
        Some(Self {
            outputs: records.iter().map(|record| record.outputs.iter().map(thin).collect()).collect(),
            stretches,
            interval_s: every as f64 * interval_s,
        })
    }

    pub fn records(&self) -> Vec<Record<'_>> {
        self.outputs
            .iter()
            .map(|outputs| Record { input: &[], outputs: outputs.iter().map(Vec::as_slice).collect() })
            .collect()
    }
}
