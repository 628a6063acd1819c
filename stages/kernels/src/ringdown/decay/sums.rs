//! Sums over samples that never touch a sample: powers of exponentials by doubling.

use faer::c64;

/// `sum_{k = first}^{first + count - 1} k^m w^k` for m = 0, 1, 2.
///
/// # Method
/// Binary expansion of `count`: a sum of `2n` terms is one of `n` plus the same shifted by `n`. `log2(count)` steps,
/// and no difference of large numbers, unlike the closed form near `w = 1`.
pub(super) fn power_sums(w: c64, first: usize, count: usize) -> [c64; 3] {
    let mut total = [c64::new(0.0, 0.0); 3];
    let mut counted = 0usize;
    // sums of the first `size` terms, and w^size
    let (mut block, mut size, mut power) = ([c64::new(1.0, 0.0), c64::new(0.0, 0.0), c64::new(0.0, 0.0)], 1usize, w);
    let mut before = c64::new(1.0, 0.0);
    while size <= count {
        if count & size != 0 {
            let next = shifted(&block, counted as f64, before);
            (0..3).for_each(|m| total[m] += next[m]);
            counted += size;
            before *= power;
        }
        let upper = shifted(&block, size as f64, power);
        (0..3).for_each(|m| block[m] += upper[m]);
        power *= power;
        size *= 2;
    }
    shifted(&total, first as f64, power_of(w, first))
}

/// The same sums with every k raised by `by`, whose power of w is `factor`.
fn shifted(sums: &[c64; 3], by: f64, factor: c64) -> [c64; 3] {
    [
        sums[0] * factor,
        (sums[1] + sums[0] * by) * factor,
        (sums[2] + sums[1] * (2.0 * by) + sums[0] * (by * by)) * factor,
    ]
}

/// `w^count` by squaring.
pub(super) fn power_of(w: c64, count: usize) -> c64 {
    let (mut out, mut square, mut left) = (c64::new(1.0, 0.0), w, count);
    while left > 0 {
        if left & 1 == 1 {
            out *= square;
        }
        square *= square;
        left >>= 1;
    }
    out
}

/// `1, w, w^2, ..`, `count` of them.
pub(super) fn powers(w: c64, count: usize) -> impl Iterator<Item = c64> {
    std::iter::successors(Some(c64::new(1.0, 0.0)), move |z| Some(z * w)).take(count)
}
