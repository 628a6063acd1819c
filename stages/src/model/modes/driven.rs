//! Modes that the measured input does not drive.

use afmid_kernels::modes::{Pole, PoleClass};
use afmid_kernels::spectra::{Block, chance_coherence};
use afmid_pipeline::{Array, Context, StageError};

use crate::artifacts::{DataSet, Pair};

/// Probability of a coherence by chance above which an output does not follow its input.
const CHANCE: f64 = 1e-3;

/// Says which modes are unexcited: the output of a measured record does not follow its inputs there, and the model only
/// makes up for what it lacks elsewhere. Pairs of averaged events, and records too short to say, are left as they are.
pub(super) fn mark_unexcited(found: &mut [Pole], pair: &Array, cx: &Context) -> Result<(), StageError> {
    let pair = Pair::new(pair);
    if pair.has_standard_error(DataSet::All) {
        return Ok(());
    }
    let [inputs, outputs] = pair.channels(DataSet::All)?;
    let listed = |pole: &&mut Pole| matches!(pole.kind, PoleClass::Mechanical | PoleClass::Damped);
    let mut modes: Vec<&mut Pole> = found.iter_mut().filter(listed).collect();
    let half_width = |pole: &Pole| 0.5 * pole.root.frequency_hz / pole.root.quality_factor;
    let centres: Vec<(f64, f64)> = modes.iter().map(|pole| (pole.root.frequency_hz, half_width(pole))).collect();
    // what cannot be tested stays
    let Ok(chance) = chance_coherence(&Block { inputs, outputs }, pair.sample_rate_hz()?, &centres) else {
        return Ok(());
    };
    let mut left_out = Vec::new();
    for (pole, _) in modes.iter_mut().zip(chance).filter(|(_, chance)| *chance > CHANCE) {
        pole.kind = PoleClass::Unexcited;
        left_out.push(format!("{:.4}", pole.root.frequency_hz));
    }
    if !left_out.is_empty() {
        let what = if left_out.len() == 1 { "a pole is" } else { "poles are" };
        cx.warn(format!(
            "{what} no mode, at {} Hz: the response does not follow the input there, which has no power at that frequency \
             or is lost in noise",
            left_out.join(", ")
        ));
    }
    Ok(())
}
