//! Small complex least squares, one problem per lane of the vector units.
//!
//! Plain loops throughout: a closure is a function of its own, compiled without the vector units that its caller was
//! dispatched to.

use pulp::Simd;

use super::lanes::{Complex, Lanes};

/// Factored columns `C = Q R`; dependent columns are left out, lane by lane: theirs are zeros in Q.
pub(super) struct Factored<S: Simd> {
    rows: usize,
    /// Orthonormal columns, one after the other.
    q: Vec<Complex<S>>,
    /// Row by row; what stands for a left-out column does not matter.
    r: Vec<Complex<S>>,
    /// One over the diagonal; zero where a column is left out.
    inverse: Vec<S::f64s>,
}

/// A column counts as dependent when less than this share of it lies outside the columns before.
const DEPENDENT: f64 = 1e-9;

/// A column that keeps more than this share of its length outside the columns before is orthogonal to them within ten
/// roundings; shorter ones are made so once more.
const CLOSE: f64 = 0.1;

impl<S: Simd> Factored<S> {
    /// Gram-Schmidt, twice where a column of any lane is close to those before, in the order given: the columns that
    /// matter most come first.
    #[inline(always)]
    pub fn new(lanes: Lanes<S>, mut columns: Vec<Complex<S>>, rows: usize) -> Self {
        let simd = lanes.0;
        let count = columns.len() / rows.max(1);
        let mut r = vec![lanes.real(0.0); count * count];
        let mut inverse = Vec::with_capacity(count);
        let [zero, one] = [0.0, 1.0].map(|value| simd.splat_f64s(value));
        for number in 0..count {
            let (before, own) = columns.split_at_mut(number * rows);
            let own = &mut own[..rows];
            let size = simd.sqrt_f64s(lanes.squares(own));
            let least = simd.mul_f64s(size, simd.splat_f64s(DEPENDENT));
            let close = simd.mul_f64s(size, simd.splat_f64s(CLOSE));
            let mut rest = size;
            for _ in 0..if number == 0 { 0 } else { 2 } {
                for (j, q) in before.chunks_exact(rows).enumerate() {
                    let share = lanes.inner(q, own);
                    r[j * count + number] = lanes.add(r[j * count + number], share);
                    for (own, q) in own.iter_mut().zip(q) {
                        *own = lanes.less_product(*own, share, *q);
                    }
                }
                rest = simd.sqrt_f64s(lanes.squares(own));
                let again = simd.and_m64s(simd.less_than_f64s(least, rest), simd.less_than_f64s(rest, close));
                if !lanes.any(again) {
                    break;
                }
            }
            let kept = simd.less_than_f64s(least, rest);
            let factor = simd.select_f64s(kept, simd.div_f64s(one, rest), zero);
            for own in own {
                *own = lanes.scale(*own, factor);
            }
            inverse.push(factor);
        }
        Self { rows, q: columns, r, inverse }
    }

    /// Coefficients that minimise `|C x - b|`; zero for columns that were left out.
    #[inline(always)]
    pub fn solve(&self, lanes: Lanes<S>, b: &[Complex<S>]) -> Vec<Complex<S>> {
        let count = self.inverse.len();
        let mut x = Vec::with_capacity(count);
        for q in self.q.chunks_exact(self.rows) {
            x.push(lanes.inner(q, b));
        }
        for j in (0..count).rev() {
            x[j] = lanes.scale(x[j], self.inverse[j]);
            for i in 0..j {
                x[i] = lanes.less_product(x[i], x[j], self.r[i * count + j]);
            }
        }
        for (x, inverse) in x.iter_mut().zip(&self.inverse) {
            let kept = lanes.0.less_than_f64s(lanes.0.splat_f64s(0.0), *inverse);
            *x = lanes.select(kept, *x, lanes.real(0.0));
        }
        x
    }

    /// Variance of the first coefficient when every row of `b` has variance one: the first diagonal element of `(C^H
    /// C)^-1`.
    #[inline(always)]
    pub fn first_variance(&self, lanes: Lanes<S>) -> S::f64s {
        let count = self.inverse.len();
        // R^T z = e1, forward
        let mut z: Vec<Complex<S>> = Vec::with_capacity(count);
        for (j, inverse) in self.inverse.iter().enumerate() {
            let mut own = lanes.real(if j == 0 { 1.0 } else { 0.0 });
            for (i, z) in z.iter().enumerate() {
                own = lanes.less_product(own, *z, self.r[i * count + j]);
            }
            z.push(lanes.scale(own, *inverse));
        }
        lanes.squares(&z)
    }

    /// Number of independent columns.
    #[inline(always)]
    pub fn rank(&self, lanes: Lanes<S>) -> S::f64s {
        let simd = lanes.0;
        let [zero, one] = [0.0, 1.0].map(|value| simd.splat_f64s(value));
        let mut sum = zero;
        for inverse in &self.inverse {
            sum = simd.add_f64s(sum, simd.select_f64s(simd.less_than_f64s(zero, *inverse), one, zero));
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, WithSimd};
    use rustfft::num_complex::Complex64;

    use super::*;
    use crate::fixture::white_noise;

    fn random(n: usize, seed: u64) -> Vec<Complex64> {
        white_noise(2 * n, 1.0, seed).chunks(2).map(|c| Complex64::new(c[0], c[1])).collect()
    }

    /// Solution, variance of the first coefficient and rank of the first and the last lane: the first has a copy as its
    /// last column, the last has not.
    struct Solved<'a>(&'a [Vec<Complex64>], &'a [Complex64]);

    impl WithSimd for Solved<'_> {
        type Output = [(Vec<Complex64>, f64, f64); 2];

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let (lanes, Self(columns, b)) = (Lanes(simd), self);
            let last = S::F64_LANES - 1;
            let count = columns.len();
            let value = |j: usize, i: usize, l: usize| match (j + 1 == count, l == 0) {
                (true, true) => columns[0][i] + columns[1][i],
                _ => columns[j][i],
            };
            let all = (0..count).flat_map(|j| (0..b.len()).map(move |i| (j, i)));
            let all = all.map(|(j, i)| lanes.gather_complex(|l| value(j, i, l))).collect();
            let factored = Factored::new(lanes, all, b.len());
            let b: Vec<Complex<S>> = b.iter().map(|&b| lanes.gather_complex(|_| b)).collect();
            let (x, variance, rank) = (factored.solve(lanes, &b), factored.first_variance(lanes), factored.rank(lanes));
            [0, last].map(|l| {
                let number = |x: &Complex<S>| Complex64::new(Lanes::<S>::each(&x.re)[l], Lanes::<S>::each(&x.im)[l]);
                (x.iter().map(number).collect(), Lanes::<S>::each(&variance)[l], Lanes::<S>::each(&rank)[l])
            })
        }
    }

    #[test]
    fn coefficients_are_recovered_and_dependent_columns_dropped_lane_by_lane() {
        let columns = [random(20, 1), random(20, 2), random(20, 3)];
        let truth = [Complex64::new(1.0, 2.0), Complex64::new(-0.5, 0.0), Complex64::new(0.0, 3.0)];
        let within = |count: usize| -> Vec<Complex64> {
            (0..20).map(|i| (0..count).map(|j| columns[j][i] * truth[j]).sum()).collect()
        };
        let near = |x: &[Complex64], count: usize| {
            let wanted = truth.iter().enumerate().map(|(j, t)| if j < count { *t } else { Complex64::new(0.0, 0.0) });
            x.iter().zip(wanted).for_each(|(x, t)| assert!((x - t).norm() < 1e-13, "{x} {t}")); // rounding
        };
        let [first, last] = Arch::new().dispatch(Solved(&columns, &within(2)));
        assert_eq!(first.2, 2.0);
        assert_eq!(first.0[2], Complex64::new(0.0, 0.0));
        near(&first.0, 2);
        if last.2 == 3.0 {
            near(&Arch::new().dispatch(Solved(&columns, &within(3)))[1].0, 3);
        } else {
            // a machine with one lane: the first is the last
            assert_eq!(last.2, 2.0);
        }
    }

    #[test]
    fn the_variance_is_the_spread_of_the_solutions() {
        let columns = [random(15, 4), random(15, 5), random(15, 6)];
        let variance = Arch::new().dispatch(Solved(&columns, &random(15, 7)))[1].1;
        let trials = 3000;
        let spread = (0..trials)
            .map(|seed| Arch::new().dispatch(Solved(&columns, &random(15, 100 + seed)))[1].0[0].norm_sqr() / 2.0) // real and imaginary parts of variance one
            .sum::<f64>()
            / trials as f64;
        // exponential: 1 / sqrt(3000) = 1.8 %, four of them
        assert!((spread / variance - 1.0).abs() < 0.075, "{spread} {variance}");
    }
}
