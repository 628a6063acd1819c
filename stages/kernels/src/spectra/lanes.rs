//! Complex numbers side by side in the lanes of the processor's vector units: one small problem per lane.

use pulp::{Simd, bytemuck};
use rustfft::num_complex::Complex64;

/// One complex number per lane.
#[derive(Clone, Copy)]
pub(super) struct Complex<S: Simd> {
    pub re: S::f64s,
    pub im: S::f64s,
}

/// Most lanes of any unit.
const MOST: usize = 8;

/// Arithmetic on all lanes at once.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd>(pub S);

impl<S: Simd> Lanes<S> {
    /// A real number of each lane.
    #[inline(always)]
    pub fn gather(self, lane: impl Fn(usize) -> f64) -> S::f64s {
        let values: [f64; MOST] = std::array::from_fn(|l| if l < S::F64_LANES { lane(l) } else { 0.0 });
        self.0.partial_load_f64s(&values[..S::F64_LANES])
    }

    /// A complex number of each lane.
    #[inline(always)]
    pub fn gather_complex(self, lane: impl Fn(usize) -> Complex64) -> Complex<S> {
        Complex { re: self.gather(|l| lane(l).re), im: self.gather(|l| lane(l).im) }
    }

    /// The numbers of the lanes.
    #[inline(always)]
    pub fn each(values: &S::f64s) -> &[f64] {
        bytemuck::cast_slice(std::slice::from_ref(values))
    }

    /// The same real number in all lanes.
    #[inline(always)]
    pub fn real(self, value: f64) -> Complex<S> {
        Complex { re: self.0.splat_f64s(value), im: self.0.splat_f64s(0.0) }
    }

    #[inline(always)]
    pub fn add(self, a: Complex<S>, b: Complex<S>) -> Complex<S> {
        Complex { re: self.0.add_f64s(a.re, b.re), im: self.0.add_f64s(a.im, b.im) }
    }

    #[inline(always)]
    pub fn subtract(self, a: Complex<S>, b: Complex<S>) -> Complex<S> {
        Complex { re: self.0.sub_f64s(a.re, b.re), im: self.0.sub_f64s(a.im, b.im) }
    }

    /// `a` times the real `b`.
    #[inline(always)]
    pub fn scale(self, a: Complex<S>, b: S::f64s) -> Complex<S> {
        Complex { re: self.0.mul_f64s(a.re, b), im: self.0.mul_f64s(a.im, b) }
    }

    #[inline(always)]
    pub fn multiply(self, a: Complex<S>, b: Complex<S>) -> Complex<S> {
        self.add_product(self.real(0.0), a, b)
    }

    /// `sum + a b`.
    #[inline(always)]
    pub fn add_product(self, sum: Complex<S>, a: Complex<S>, b: Complex<S>) -> Complex<S> {
        let simd = self.0;
        Complex {
            re: simd.negate_mul_add_e_f64s(a.im, b.im, simd.mul_add_e_f64s(a.re, b.re, sum.re)),
            im: simd.mul_add_e_f64s(a.im, b.re, simd.mul_add_e_f64s(a.re, b.im, sum.im)),
        }
    }

    /// `sum - a b`.
    #[inline(always)]
    pub fn less_product(self, sum: Complex<S>, a: Complex<S>, b: Complex<S>) -> Complex<S> {
        let simd = self.0;
        Complex {
            re: simd.mul_add_e_f64s(a.im, b.im, simd.negate_mul_add_e_f64s(a.re, b.re, sum.re)),
            im: simd.negate_mul_add_e_f64s(a.im, b.re, simd.negate_mul_add_e_f64s(a.re, b.im, sum.im)),
        }
    }

    /// `sum conj(a) b` over rows.
    #[inline(always)]
    pub fn inner(self, a: &[Complex<S>], b: &[Complex<S>]) -> Complex<S> {
        let simd = self.0;
        // four sums: each operation waits for its own predecessor only
        let [mut re, mut im, mut across, mut back] = [simd.splat_f64s(0.0); 4];
        for (a, b) in a.iter().zip(b) {
            re = simd.mul_add_e_f64s(a.re, b.re, re);
            im = simd.mul_add_e_f64s(a.im, b.im, im);
            across = simd.mul_add_e_f64s(a.re, b.im, across);
            back = simd.mul_add_e_f64s(a.im, b.re, back);
        }
        Complex { re: simd.add_f64s(re, im), im: simd.sub_f64s(across, back) }
    }

    /// Squared magnitude.
    #[inline(always)]
    pub fn square(self, a: Complex<S>) -> S::f64s {
        self.0.mul_add_e_f64s(a.re, a.re, self.0.mul_f64s(a.im, a.im))
    }

    /// Sum of squared magnitudes over rows.
    #[inline(always)]
    pub fn squares(self, rows: &[Complex<S>]) -> S::f64s {
        let simd = self.0;
        let [mut re, mut im] = [simd.splat_f64s(0.0); 2];
        for row in rows {
            re = simd.mul_add_e_f64s(row.re, row.re, re);
            im = simd.mul_add_e_f64s(row.im, row.im, im);
        }
        simd.add_f64s(re, im)
    }

    /// `1 / a`.
    #[inline(always)]
    pub fn inverse(self, a: Complex<S>) -> Complex<S> {
        let size = self.square(a);
        Complex { re: self.0.div_f64s(a.re, size), im: self.0.div_f64s(self.0.neg_f64s(a.im), size) }
    }

    /// `a` where `mask` holds, `b` elsewhere.
    #[inline(always)]
    pub fn select(self, mask: S::m64s, a: Complex<S>, b: Complex<S>) -> Complex<S> {
        Complex { re: self.0.select_f64s(mask, a.re, b.re), im: self.0.select_f64s(mask, a.im, b.im) }
    }

    /// Whether `mask` holds in any lane.
    #[inline(always)]
    pub fn any(self, mask: S::m64s) -> bool {
        self.0.first_true_m64s(mask) < S::F64_LANES
    }
}
