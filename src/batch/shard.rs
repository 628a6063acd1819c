//! Shards: which machine does which data sets.

use std::num::NonZeroU64;
use std::str::FromStr;

/// Part `index` of `count`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: NonZeroU64,
}

impl Shard {
    /// The part that a data set belongs to: by the hash of its name, so that further sets move no other.
    pub fn of(name: &str, count: NonZeroU64) -> Self {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&blake3::hash(name.as_bytes()).as_bytes()[..8]);
        Self { index: u64::from_le_bytes(bytes) % count + 1, count }
    }

    /// Its number, from 1.
    pub fn index(self) -> u64 {
        self.index
    }

    /// Whether a data set belongs here.
    pub fn holds(self, name: &str) -> bool {
        Self::of(name, self.count) == self
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse::<NonZeroU64>().ok()?)));
        match parts {
            Some((index, count)) if index >= 1 && index <= count.get() => Ok(Self { index, count }),
            _ => Err(format!("found `{text}`, wanted i/n with i from 1 to n, such as 2/8")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_is_in_one_shard() {
        let shards: Vec<Shard> = (1..=5).map(|i| format!("{i}/5").parse().unwrap()).collect();
        let mut counts = [0; 5];
        for set in 0..500 {
            let name = format!("set {set}");
            let own: Vec<usize> = (0..5).filter(|&i| shards[i].holds(&name)).collect();
            assert_eq!(own.len(), 1);
            counts[own[0]] += 1;
        }
        // binomial, 100 +- 8.9: five standard deviations
        assert!(counts.iter().all(|&count| (55..=145).contains(&count)), "{counts:?}");
    }

    #[test]
    fn other_forms_are_refused() {
        for text in ["0/3", "4/3", "3", "a/b", "1/0", "-1/2"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
