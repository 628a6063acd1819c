//! Clipped samples: the pile-up of codes at an end of their range.

/// How many samples sit at an end of the range, if they pile up there; 0 if not.
///
/// # Model
/// A converter or amplifier that runs out of range returns its last code again and again, while a signal that merely
/// turns there takes its extreme code about as often as the codes next to it.
/// # Method
/// At either end, the count of the extreme value must be 8 or more and over four times that of each of the next four
/// values. Limits: a limit that acts before the noise is added gives no pile-up and is not seen; a noise-free constant
/// stretch at the extreme is.
/// # Shapes
/// One window of values; equal codes must be equal values. NaN are ignored. Cost: one to five passes.
pub fn saturated_samples(values: &[f64]) -> usize {
    saturated_ends(values).into_iter().sum()
}

/// The same at either end: how many pile up at the least value and at the largest one.
pub fn saturated_ends(values: &[f64]) -> [usize; 2] {
    [pile_up(values.iter().map(|value| -value)), pile_up(values.iter().copied())]
}

pub(super) fn pile_up(values: impl Iterator<Item = f64> + Clone) -> usize {
    let mut limit = f64::INFINITY;
    let mut counts = [0usize; 5];
    for (rank, count) in counts.iter_mut().enumerate() {
        let mut top = f64::NEG_INFINITY;
        for value in values.clone().filter(|&value| value < limit) {
            if value > top {
                top = value;
                *count = 1;
            } else if value == top {
                *count += 1;
            }
        }
        limit = top;
        // nothing to look for further in: the commonest case, after one pass
        if rank == 0 && *count < 8 {
            return 0;
        }
    }
    let [extreme, inner @ ..] = counts;
    let constant = inner.iter().all(|&count| count == 0);
    if extreme >= 8 && !constant && inner.iter().all(|&count| extreme > 4 * count) { extreme } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};

    fn codes(limit: f64, seed: u64) -> Vec<f64> {
        let signal = Lever::paper().release(8192, 1024.0, -0.9);
        let noise = white_noise(8192, 1.2e-3, seed);
        signal.iter().zip(noise).map(|(y, e)| ((y + e).clamp(-1.0, limit) / 0.977e-3).round() * 0.977e-3).collect()
    }

    #[test]
    fn a_clipped_crest_is_seen_and_a_whole_one_is_not() {
        for seed in 0..10 {
            assert_eq!(saturated_samples(&codes(2.0, seed)), 0);
            assert!(saturated_samples(&codes(0.5, seed)) > 50);
            assert!(saturated_samples(&codes(0.75, seed)) >= 8);
        }
    }

    #[test]
    fn nothing_piles_up_in_a_constant_or_in_nothing() {
        assert_eq!(saturated_samples(&[1.5; 100]), 0);
        assert_eq!(saturated_samples(&[f64::NAN; 100]), 0);
        assert_eq!(saturated_samples(&[]), 0);
    }
}
