//! Seeded halves.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::EnsembleError;

/// Two disjoint sets of events that together hold every event, each ascending.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// Events that models are fitted to; holds the odd one.
    pub identification: Vec<usize>,
    /// Events kept back.
    pub verification: Vec<usize>,
}

/// Fewest events that can be split: each half needs two for a variance.
pub const LEAST_EVENTS: usize = 4;

/// Splits `count` events at random into halves.
///
/// # Method
/// Fisher-Yates shuffle by ChaCha8 from `seed`; the first half, the larger for an odd count, identifies.
///
/// # Errors
/// Fewer than four events: each half needs two for a variance.
///
/// # Source
/// Stark et al. 2005, "randomly split into an identification data set and a verification data set".
pub fn split_halves(count: usize, seed: u64) -> Result<Split, EnsembleError> {
    if count < LEAST_EVENTS {
        return Err(EnsembleError::TooFewEvents { got: count, wanted: LEAST_EVENTS, purpose: "a split into halves" });
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let mut verification = order.split_off(count.div_ceil(2));
    order.sort_unstable();
    verification.sort_unstable();
    Ok(Split { identification: order, verification })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_hold_every_event_once_and_follow_the_seed() {
        for count in 4..40 {
            let split = split_halves(count, 5).unwrap();
            assert_eq!(split.identification.len() - split.verification.len(), count % 2);
            let mut all = [split.identification.clone(), split.verification.clone()].concat();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<_>>());
            assert_eq!(split, split_halves(count, 5).unwrap());
        }
        assert_ne!(split_halves(30, 1).unwrap(), split_halves(30, 2).unwrap());
        assert!(split_halves(3, 1).is_err());
    }
}
