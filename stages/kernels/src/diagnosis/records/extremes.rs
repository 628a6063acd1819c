//! The ends of the histogram of a record's values.

/// Distinct values kept at either end.
const KEPT: usize = 5;

/// The extreme values at one end, and how often each was taken.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// Distinct values, the extreme one first, and their counts.
    pub values: Vec<(f64, usize)>,
    /// Longest run of consecutive samples at the extreme value.
    pub longest_run: usize,
}

/// Both ends.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extremes {
    /// The lowest values.
    pub low: Tally,
    /// The highest.
    pub high: Tally,
}

/// The five extreme values at either end, in one pass. Equal codes must be equal values; NaN and infinities are left
/// out.
pub(super) fn extremes(samples: &[f64]) -> Extremes {
    let high = tally(samples.iter().copied());
    let mut low = tally(samples.iter().map(|value| -value));
    low.values.iter_mut().for_each(|(value, _)| *value = -*value);
    Extremes { low, high }
}

fn tally(samples: impl Iterator<Item = f64>) -> Tally {
    let mut tally = Tally::default();
    let (mut least, mut run) = (f64::NEG_INFINITY, 0);
    for value in samples {
        let top = tally.values.first().map(|&(top, _)| top);
        if top == Some(value) {
            run += 1;
            tally.longest_run = tally.longest_run.max(run);
            tally.values[0].1 += 1;
            continue;
        }
        run = 0;
        if value >= least && value.is_finite() {
            if top.is_none_or(|top| value > top) {
                (run, tally.longest_run) = (1, 1);
            }
            tally.add(value, 1);
            least = if tally.values.len() == KEPT { tally.values[KEPT - 1].0 } else { f64::NEG_INFINITY };
        }
    }
    tally
}

impl Tally {
    /// Counts a value of the upper end, which keeps its five highest.
    fn add(&mut self, value: f64, count: usize) {
        match self.values.iter().position(|&(own, _)| own <= value) {
            Some(place) if self.values[place].0 == value => self.values[place].1 += count,
            Some(place) => self.values.insert(place, (value, count)),
            None => self.values.push((value, count)),
        }
        self.values.truncate(KEPT);
    }

    /// The tallies of several records as one; `sign` is 1 for upper ends and -1 for lower ones.
    pub(super) fn merged<'a>(tallies: impl Iterator<Item = &'a Tally>, sign: f64) -> Tally {
        let mut all = Tally::default();
        for tally in tallies {
            for &(value, count) in &tally.values {
                all.add(sign * value, count);
            }
        }
        all.values.iter_mut().for_each(|(value, _)| *value *= sign);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_counted_as_by_sorting() {
        let samples: Vec<f64> = (0..1000).map(|k: i32| f64::from((k * 7919) % 37)).chain([f64::NAN]).collect();
        let found = extremes(&samples);
        for (rank, &(value, count)) in found.high.values.iter().enumerate() {
            assert_eq!(value, 36.0 - rank as f64);
            assert_eq!(count, samples.iter().filter(|&&sample| sample == value).count());
        }
        assert_eq!(found.low.values.iter().map(|(value, _)| *value).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(extremes(&[1.0, 2.0, 2.0, 2.0, 1.0, 2.0]).high.longest_run, 3);
        assert_eq!(extremes(&[]).high, Tally::default());
    }

    #[test]
    fn merged_ends_are_those_of_the_joined_records() {
        let (a, b) = ([1.0, 5.0, 5.0, 2.0, 7.0], [5.0, 7.0, 3.0, 9.0]);
        let joined: Vec<f64> = a.iter().chain(&b).copied().collect();
        let (one, two) = (extremes(&a), extremes(&b));
        assert_eq!(Tally::merged([&one.high, &two.high].into_iter(), 1.0).values, extremes(&joined).high.values);
        assert_eq!(Tally::merged([&one.low, &two.low].into_iter(), -1.0).values, extremes(&joined).low.values);
    }
}
