//! Spikes taken out of block means.

/// Replaces outliers of one or two blocks by the line between their neighbours; returns their first blocks (crests of a
/// ringing may be among them).
///
/// # Method
/// One or two blocks that differ from the line between their neighbours by more than `threshold`, in one direction,
/// while those neighbours agree within it. An edge is kept: its sides differ.
/// # Shapes
/// `means` is changed in place.
/// # Units
/// `threshold` as `means`.
pub fn despike(means: &mut [f32], threshold: f64) -> Vec<usize> {
    let mut spikes = Vec::new();
    let mut k = 1;
    while k + 1 < means.len() {
        // a step to the next block comes first: nearly all blocks stop here
        if f64::from((means[k] - means[k - 1]).abs()) <= threshold {
            k += 1;
            continue;
        }
        let width = (1..=2).find(|&width| is_spike(means, k, width, threshold));
        if let Some(width) = width {
            let (left, right) = (means[k - 1], means[k + width]);
            for step in 0..width {
                means[k + step] = left + (right - left) * (step + 1) as f32 / (width + 1) as f32;
            }
            spikes.push(k);
        }
        k += width.unwrap_or(1);
    }
    spikes
}

fn is_spike(means: &[f32], k: usize, width: usize, threshold: f64) -> bool {
    let Some(&right) = means.get(k + width) else { return false };
    let left = means[k - 1];
    let off = |mean: &f32| f64::from(*mean) - 0.5 * (f64::from(left) + f64::from(right));
    let side = off(&means[k]).signum();
    f64::from((right - left).abs()) <= threshold && means[k..k + width].iter().all(|mean| off(mean) * side > threshold)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spikes_go_and_edges_stay() {
        let mut means = vec![1.0f32; 40];
        means[5] = 9.0;
        means[12] = -4.0;
        means[13] = -7.0;
        means[20..].fill(6.0);
        let mut wanted = vec![1.0f32; 40];
        wanted[20..].fill(6.0);
        assert_eq!(despike(&mut means, 0.5), vec![5, 12]);
        assert_eq!(means, wanted);
        assert!(despike(&mut means, 0.5).is_empty());
    }

    #[test]
    fn short_records_and_ends_are_left_alone() {
        for n in 0..4 {
            let mut means = vec![0.0f32; n];
            if let Some(last) = means.last_mut() {
                *last = 5.0;
            }
            let before = means.clone();
            assert!(despike(&mut means, 1.0).is_empty());
            assert_eq!(means, before);
        }
    }
}
