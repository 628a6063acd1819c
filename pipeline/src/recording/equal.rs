//! Channels with equal samples: one recording under several names, formats or attributes.
//!
//! What was measured twice differs by its noise in the first samples; what is equal there is read on, block by block,
//! as long as it stays so. So different recordings cost a thousand samples each, and nothing is held.

use std::collections::HashMap;

use rayon::prelude::*;

use super::Channel;

/// Samples up to which equal ones are no sign of one recording. Why: short rows repeat by chance, in codes of few bits
/// and where nothing happens.
const MOST_SAMPLES_BY_CHANCE: usize = 100;

/// Samples of the first block.
const FIRST_SAMPLES: usize = 1 << 10;

/// Samples of every further block.
const BLOCK_SAMPLES: usize = 1 << 16;

/// A hash of samples so far.
type Hash = [u8; blake3::OUT_LEN];

/// What a channel's samples hashed to, as far as they were read.
#[derive(Debug, Clone)]
pub struct SamplePrint {
    channel: Channel,
    read: usize,
    /// Of the numbers as they are stored, whatever their type: another unit or scale factor changes nothing.
    stored: Hash,
    /// Of the values in the channel's unit: another type of stored number changes nothing.
    values: Hash,
    first: Option<f64>,
    varies: bool,
    unreadable: bool,
}

impl SamplePrint {
    /// Of a channel of which nothing is read yet.
    pub fn new(channel: &Channel) -> Self {
        Self {
            channel: channel.clone(),
            read: 0,
            stored: Hash::default(),
            values: Hash::default(),
            first: None,
            varies: false,
            unreadable: false,
        }
    }

    /// Of a channel whose first samples are read now: while a file that had to be parsed is still at hand.
    pub fn begun(channel: &Channel) -> Self {
        let mut print = Self::new(channel);
        print.read_on();
        print
    }

    /// Reads the next block. A channel that cannot be read is equal to none: who needs its samples says why.
    fn read_on(&mut self) {
        let block = if self.read == 0 { FIRST_SAMPLES } else { BLOCK_SAMPLES };
        let count = block.min(self.channel.samples - self.read);
        let Ok(raw) = self.channel.read_raw(self.read, count) else {
            self.unreadable = true;
            return;
        };
        let mut values = Vec::with_capacity(count);
        raw.scale_into(self.channel.scale_factor, self.channel.add_offset, &mut values);
        let stored = raw.widened();
        let first = *self.first.get_or_insert(stored.first().copied().unwrap_or_default());
        self.varies |= stored.iter().any(|number| *number != first);
        self.stored = continued(&self.stored, &stored);
        self.values = continued(&self.values, &values);
        self.read += count;
    }

    fn samples(&self) -> usize {
        self.channel.samples
    }

    fn is_whole(&self) -> bool {
        self.read == self.samples()
    }

    /// What equal channels have in common: as stored, in their units.
    fn keys(&self) -> [Key; 2] {
        let key = |kind, hash| Key { kind, samples: self.samples(), read: self.read, hash };
        [key(Kind::Stored, self.stored), key(Kind::Values, self.values)]
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Stored,
    Values,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    kind: Kind,
    samples: usize,
    read: usize,
    hash: Hash,
}

/// The hash of what was hashed before and these numbers. Zeros of either sign are equal, and so are all NaN.
fn continued(before: &Hash, numbers: &[f64]) -> Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(before);
    let bits = |number: &f64| match number.is_nan() {
        true => f64::NAN.to_bits(),
        false => (number + 0.0).to_bits(),
    };
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| bits(number).to_le_bytes()).collect();
    hasher.update(&bytes);
    *hasher.finalize().as_bytes()
}

/// For each channel the first one before it with the same samples, if there is one: as many, more than a hundred, not
/// all of one value, equal as they are stored or in the channels' units. Reads in parallel, and no more than it takes to
/// distinguish them.
pub fn equal_samples(prints: &mut [SamplePrint]) -> Vec<Option<usize>> {
    loop {
        let shared = shared(prints);
        let of = |index: usize, print: &SamplePrint| shared.get(index) == Some(&true) && !print.is_whole();
        if !prints.iter().enumerate().any(|(index, print)| of(index, print)) {
            break;
        }
        prints
            .par_iter_mut()
            .enumerate()
            .filter(|(index, print)| of(*index, print))
            .for_each(|(_, print)| print.read_on());
    }
    let mut first: HashMap<Key, usize> = HashMap::new();
    let whole = |print: &SamplePrint| print.is_whole() && print.varies && print.samples() > MOST_SAMPLES_BY_CHANCE;
    let mut found = Vec::with_capacity(prints.len());
    for (index, print) in prints.iter().enumerate() {
        let known = print.keys().iter().filter_map(|key| first.get(key)).min().copied();
        found.push(known.filter(|_| whole(print)));
        if whole(print) {
            print.keys().into_iter().for_each(|key| {
                first.entry(key).or_insert(index);
            });
        }
    }
    found
}

/// Whether each is equal to another one as far as it was read. One of which nothing is read yet begins with those that
/// are as long.
fn shared(prints: &[SamplePrint]) -> Vec<bool> {
    let fits = |print: &&SamplePrint| !print.unreadable && print.samples() > MOST_SAMPLES_BY_CHANCE;
    let mut lengths: HashMap<usize, usize> = HashMap::new();
    let mut counts: HashMap<Key, usize> = HashMap::new();
    for print in prints.iter().filter(fits) {
        *lengths.entry(print.samples()).or_default() += 1;
        print.keys().into_iter().for_each(|key| *counts.entry(key).or_default() += 1);
    }
    let several = |print: &SamplePrint| match print.read {
        0 => lengths.get(&print.samples()).is_some_and(|count| *count > 1),
        _ => print.keys().iter().any(|key| counts.get(key).is_some_and(|count| *count > 1)),
    };
    prints.iter().map(|print| fits(&print) && several(print)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::recording::{FormatError, Raw, Source};

    /// Codes in memory, and how many were read.
    #[derive(Debug)]
    struct Counted(Raw, Arc<AtomicUsize>);

    impl Source for Counted {
        fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
            self.1.fetch_add(count, Ordering::Relaxed);
            Ok(match &self.0 {
                Raw::Int16(codes) => Raw::Int16(codes[start..start + count].to_vec()),
                Raw::Float64(codes) => Raw::Float64(codes[start..start + count].to_vec()),
                _ => return Err(FormatError::new("unreadable", "")),
            })
        }
    }

    fn channel(raw: Raw, scale_factor: f64, reads: &Arc<AtomicUsize>) -> Channel {
        Channel {
            role: "deflection".to_owned(),
            location: "/deflection".to_owned(),
            samples: raw.len(),
            unit: "V".to_owned(),
            long_name: String::new(),
            scale_factor,
            add_offset: 0.0,
            fill_code: None,
            source: Arc::new(Counted(raw, Arc::clone(reads))),
        }
    }

    fn codes(samples: usize, seed: usize) -> Vec<i16> {
        (0..samples).map(|k| ((k * 7919 + seed * 104_729) % 4096) as i16 - 2048).collect()
    }

    fn found(channels: Vec<(Raw, f64)>) -> (Vec<Option<usize>>, usize) {
        let reads = Arc::default();
        let prints = channels.into_iter().map(|(raw, scale)| SamplePrint::new(&channel(raw, scale, &reads)));
        let found = equal_samples(&mut prints.collect::<Vec<_>>());
        (found, reads.load(Ordering::Relaxed))
    }

    #[test]
    fn equal_samples_are_found_whatever_their_type_scale_and_place() {
        let long = codes(200_000, 1);
        let values: Vec<f64> = long.iter().map(|&code| f64::from(code) * 0.5).collect();
        let mut other = long.clone();
        other[199_999] += 1;
        let channels = vec![
            (Raw::Int16(long.clone()), 0.5),
            (Raw::Int16(codes(200_000, 2)), 0.5),
            (Raw::Int16(long.clone()), 0.5),
            (Raw::Float64(values), 1.0),
            (Raw::Int16(long.clone()), 7.0),
            (Raw::Int16(other), 0.5),
            (Raw::Int16(long[..199_999].to_vec()), 0.5),
            (Raw::Float32(vec![0.0; 200_000]), 1.0),
        ];
        assert_eq!(found(channels).0, [None, None, Some(0), Some(0), Some(0), None, None, None]);
    }

    #[test]
    fn what_differs_costs_a_thousand_samples_and_another_length_none() {
        let channels = (0..10).map(|seed| (Raw::Int16(codes(500_000, seed)), 1.0)).collect();
        assert_eq!(found(channels), (vec![None; 10], 10 * FIRST_SAMPLES));
        let channels = (0..10).map(|seed| (Raw::Int16(codes(500_000 + seed, 1)), 1.0)).collect();
        assert_eq!(found(channels), (vec![None; 10], 0));
    }

    #[test]
    fn short_and_constant_channels_are_no_copies() {
        let equal = |codes: Vec<i16>| found(vec![(Raw::Int16(codes.clone()), 1.0), (Raw::Int16(codes), 1.0)]).0[1];
        assert_eq!(equal(codes(MOST_SAMPLES_BY_CHANCE, 1)), None);
        assert_eq!(equal(codes(MOST_SAMPLES_BY_CHANCE + 1, 1)), Some(0));
        assert_eq!(equal(vec![7; 200_000]), None);
        // it rests for a while
        let rests: Vec<i16> = std::iter::repeat_n(0, 100_000).chain(codes(100, 1)).collect();
        assert_eq!(equal(rests), Some(0));
    }
}
