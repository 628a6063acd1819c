//! A record reduced to the means of short blocks, chunk by chunk.

/// A stored sample: a converter's code or a value.
pub trait Sample: Copy {
    /// What blocks are summed in; exact for codes.
    type Sum: Copy + Default + std::ops::AddAssign;
    /// The sum of a block's samples.
    fn sum(block: &[Self]) -> Self::Sum;
    /// The sum as a number.
    fn number(sum: Self::Sum) -> f64;
    /// The sample as a number.
    fn value(self) -> f64;
}

macro_rules! sample {
    ($($kind:ty => $sum:ty),*) => {$(
        impl Sample for $kind {
            type Sum = $sum;
            fn sum(block: &[Self]) -> $sum {
                block.iter().map(|&sample| <$sum>::from(sample)).sum()
            }
            fn number(sum: $sum) -> f64 {
                sum as f64
            }
            fn value(self) -> f64 {
                f64::from(self)
            }
        }
    )*};
}
sample!(i16 => i32, i32 => i64, f32 => f64, f64 => f64);

/// Means of consecutive blocks of one record, in the channel's unit without its offset.
///
/// # Method
/// Integer sums of `block_samples` codes (at most 32768, so that an `i32` holds them), scaled once per block. Missing
/// samples (NaN, infinities, the file's fill code) are left out; a block without any other repeats the block before it,
/// so that a gap makes no step.
/// # Units
/// The channel's.
/// Cost: one addition per sample; memory 4 bytes per block.
#[derive(Debug, Clone)]
pub struct BlockMeans {
    block_samples: usize,
    scale: f64,
    fill: Option<f64>,
    means: Vec<f32>,
    pending: Vec<f64>,
    samples: usize,
    missing: usize,
}

impl BlockMeans {
    /// Empty means of blocks of `block_samples` (taken as 1 to 32768), for codes of `scale` units each.
    pub fn new(block_samples: usize, scale: f64, fill: Option<f64>) -> Self {
        let block_samples = block_samples.clamp(1, 1 << 15);
        Self { block_samples, scale, fill, means: Vec::new(), pending: Vec::new(), samples: 0, missing: 0 }
    }

    /// Makes room for the means of `samples` more samples; for a million means at most, as a file may claim anything.
    pub fn reserve(&mut self, samples: usize) {
        self.means.reserve((samples / self.block_samples).min(1 << 20));
    }

    /// Adds the next chunk, of any length.
    pub fn push<S: Sample>(&mut self, chunk: &[S]) {
        self.samples += chunk.len();
        let mut rest = chunk;
        if !self.pending.is_empty() {
            let (head, tail) = chunk.split_at(chunk.len().min(self.block_samples - self.pending.len()));
            self.pending.extend(head.iter().map(|sample| sample.value()));
            rest = tail;
            if self.pending.len() == self.block_samples {
                let block = std::mem::take(&mut self.pending);
                self.push_careful(&block);
            }
        }
        let blocks = rest.chunks_exact(self.block_samples);
        self.pending.extend(blocks.remainder().iter().map(|sample| sample.value()));
        let factor = self.scale / self.block_samples as f64;
        for block in blocks {
            let sum = S::number(S::sum(block));
            if self.fill.is_none() && sum.is_finite() {
                self.means.push((sum * factor) as f32);
            } else {
                self.push_careful(block);
            }
        }
    }

    fn push_careful<S: Sample>(&mut self, block: &[S]) {
        let valid = |value: &f64| value.is_finite() && Some(*value) != self.fill;
        let (mut sum, mut count) = (0.0, 0usize);
        for value in block.iter().map(|sample| sample.value()).filter(valid) {
            sum += value;
            count += 1;
        }
        self.missing += block.len() - count;
        let mean = match count {
            0 => self.means.last().copied().unwrap_or(0.0),
            _ => (sum / count as f64 * self.scale) as f32,
        };
        self.means.push(mean);
    }

    /// The means of the whole blocks so far.
    pub fn means(&self) -> &[f32] {
        &self.means
    }

    /// Samples in a block.
    pub fn block_samples(&self) -> usize {
        self.block_samples
    }

    /// Samples pushed so far, those of an unfinished block included.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Samples that were left out of whole blocks as missing.
    pub fn missing(&self) -> usize {
        self.missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_do_not_depend_on_how_the_record_is_cut() {
        let codes: Vec<i16> = (0..1003).map(|k: i32| (k * 7919 % 4001 - 2000) as i16).collect();
        let mut whole = BlockMeans::new(16, 0.5, None);
        whole.push(&codes);
        for cut in [1, 5, 16, 17, 300] {
            let mut pieces = BlockMeans::new(16, 0.5, None);
            codes.chunks(cut).for_each(|chunk| pieces.push(chunk));
            assert_eq!(pieces.means(), whole.means());
            assert_eq!(pieces.samples(), 1003);
        }
        let slow: f64 = codes[32..48].iter().map(|&code| 0.5 * f64::from(code)).sum::<f64>() / 16.0;
        // half a unit in the last place of an f32 near 2000
        assert!((f64::from(whole.means()[2]) - slow).abs() < 1e-4);
    }

    #[test]
    fn extreme_codes_do_not_overflow() {
        let mut means = BlockMeans::new(1 << 20, 1.0, None);
        means.push(&vec![i16::MIN; 1 << 16]);
        assert_eq!(means.means(), &[-32768.0, -32768.0]);
    }

    #[test]
    fn missing_samples_make_no_step() {
        let mut values = vec![2.0f64; 64];
        values[3] = f64::NAN;
        values[16..32].fill(f64::NAN);
        let mut means = BlockMeans::new(16, 1.0, None);
        means.push(&values);
        assert_eq!((means.means(), means.missing()), (&[2.0f32; 4][..], 17));
        let mut codes = vec![5i16; 64];
        codes[20..50].fill(-32768);
        let mut means = BlockMeans::new(16, 1.0, Some(-32768.0));
        means.push(&codes);
        assert_eq!((means.means(), means.missing()), (&[5.0f32; 4][..], 30));
    }
}
