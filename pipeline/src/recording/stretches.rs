//! Uninterrupted stretches of channels that were recorded together.

use std::ops::Range;

/// The stretches between the gaps of any of the channels, of which the longest has `samples`. A gap before the first or
/// behind the last sample interrupts nothing.
pub(super) fn uninterrupted<'a>(samples: usize, gaps: impl Iterator<Item = &'a [usize]>) -> Vec<Range<usize>> {
    let mut cuts: Vec<usize> = gaps.flatten().copied().filter(|&gap| gap > 0 && gap < samples).collect();
    cuts.sort_unstable();
    cuts.dedup();
    let starts = std::iter::once(0).chain(cuts.iter().copied());
    let ends = cuts.iter().copied().chain([samples]);
    starts.zip(ends).map(|(start, end)| start..end).collect()
}

#[cfg(test)]
mod tests {
    use super::uninterrupted;

    #[test]
    fn gaps_of_all_channels_cut() {
        let of = |samples, gaps: &[&[usize]]| -> Vec<(usize, usize)> {
            uninterrupted(samples, gaps.iter().copied()).into_iter().map(|range| (range.start, range.end)).collect()
        };
        assert_eq!(of(10, &[]), [(0, 10)]);
        assert_eq!(of(10, &[&[4], &[4, 7]]), [(0, 4), (4, 7), (7, 10)]);
        assert_eq!(of(10, &[&[0, 10, 12]]), [(0, 10)]);
        assert_eq!(of(0, &[&[3]]), [(0, 0)]);
    }
}
