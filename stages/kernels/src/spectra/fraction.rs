//! A quotient of two low-order polynomials fitted to a few complex values.

use pulp::{Simd, WithSimd};
use rustfft::num_complex::Complex64;

use super::lane_squares::Factored;
use super::lanes::{Complex, Lanes};

/// Orders of the local model `(B(r) + turn(r) T(r)) / A(r)`, `A(0) = 1`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Orders {
    pub numerator: usize,
    pub denominator: usize,
    /// Order of `T`, if there is one.
    pub transient: Option<usize>,
}

impl Orders {
    /// Complex coefficients.
    pub fn count(self) -> usize {
        self.numerator + 1 + self.denominator + self.transient.map_or(0, |t| t + 1)
    }
}

/// Values to fit: offset from the centre (scaled to one), value, weight, and the factor of the transient.
pub(super) struct Points {
    pub offset: Vec<f64>,
    pub value: Vec<Complex64>,
    pub weight: Vec<f64>,
    pub turn: Vec<Complex64>,
}

/// A fitted quotient at the centre.
pub(super) struct Fraction {
    /// `B(0) / A(0)`.
    pub value: Complex64,
    /// Variance of the value when every weighted value has variance one.
    pub unit_variance: f64,
    /// Weighted sum of squared residuals.
    pub squares: f64,
    /// Independent coefficients.
    pub rank: usize,
}

/// Reweighted linear steps: peaks two bins wide settle within four.
const LINEAR_STEPS: usize = 6;
/// Change of the squares, as a share, after which further steps would move the value by less than a thousandth of its
/// standard error.
const SETTLED: f64 = 1e-6;
/// Gauss-Newton steps at most: they end the bias that reweighting leaves in noise.
const NEWTON_STEPS: usize = 8;
/// Lengths that are tried of each.
const HALVINGS: usize = 5;

/// Fits by Levy's linear problem, reweighted (Sanathanan and Koerner 1963), then by Gauss-Newton on the true residual;
/// each of `points`, all of as many values, for itself.
pub(super) fn fit_fractions(points: &[Points], orders: Orders) -> Vec<Fraction> {
    pulp::Arch::new().dispatch(Fit { points, orders })
}

/// Carries fits to the vector units: one per lane.
struct Fit<'a> {
    points: &'a [Points],
    orders: Orders,
}

impl WithSimd for Fit<'_> {
    type Output = Vec<Fraction>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<Fraction> {
        let mut all = Vec::with_capacity(self.points.len());
        for points in self.points.chunks(S::F64_LANES) {
            let (fitted, lanes) = (Local::new(Lanes(simd), points, self.orders).fit(), points.len());
            all.extend((0..lanes).map(|l| {
                let at = |values: &S::f64s| Lanes::<S>::each(values)[l];
                Fraction {
                    value: Complex64::new(at(&fitted.value.re), at(&fitted.value.im)),
                    unit_variance: at(&fitted.unit_variance),
                    squares: at(&fitted.squares),
                    rank: at(&fitted.rank) as usize,
                }
            }));
        }
        all
    }
}

/// What a fit gives, lane by lane.
struct Fitted<S: Simd> {
    value: Complex<S>,
    unit_variance: S::f64s,
    squares: S::f64s,
    rank: S::f64s,
}

/// The points of one fit per lane.
struct Local<S: Simd> {
    lanes: Lanes<S>,
    orders: Orders,
    offset: Vec<S::f64s>,
    value: Vec<Complex<S>>,
    weight: Vec<S::f64s>,
    turn: Vec<Complex<S>>,
}

impl<S: Simd> Local<S> {
    /// Lanes without points of their own get those of the last.
    #[inline(always)]
    fn new(lanes: Lanes<S>, points: &[Points], orders: Orders) -> Self {
        let own = |l: usize| &points[l.min(points.len() - 1)];
        let rows = points.iter().map(|points| points.offset.len()).min().unwrap_or(0);
        let (mut offset, mut weight) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
        let (mut value, mut turn) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
        for i in 0..rows {
            offset.push(lanes.gather(|l| own(l).offset[i]));
            weight.push(lanes.gather(|l| own(l).weight[i]));
            value.push(lanes.gather_complex(|l| own(l).value[i]));
            turn.push(lanes.gather_complex(|l| own(l).turn[i]));
        }
        Self { lanes, orders, offset, value, weight, turn }
    }

    #[inline(always)]
    fn fit(&self) -> Fitted<S> {
        let (lanes, simd) = (self.lanes, self.lanes.0);
        let [zero, one, settled] = [0.0, 1.0, SETTLED].map(|value| simd.splat_f64s(value));
        let mut best = vec![lanes.real(0.0); self.orders.count()];
        let mut squares = self.residual(&best).1;
        // a lane that has come to its end keeps what it has
        let mut active = simd.less_than_f64s(zero, one);
        let mut previous = vec![one; self.offset.len()];
        let mut last = simd.splat_f64s(f64::INFINITY);
        for _ in 0..if self.orders.denominator == 0 { 1 } else { LINEAR_STEPS } {
            let theta = self.linear_step(&previous);
            let mut least = one;
            for (previous, r) in previous.iter_mut().zip(&self.offset) {
                *previous = simd.sqrt_f64s(lanes.square(self.denominator(&theta, *r)));
                least = simd.min_f64s(least, *previous);
            }
            let now = self.residual(&theta).1;
            let better = simd.and_m64s(active, simd.less_than_f64s(now, squares));
            self.keep(better, &mut best, &theta);
            squares = simd.select_f64s(better, now, squares);
            let moves = simd.less_than_f64s(simd.mul_f64s(settled, now), simd.abs_f64s(simd.sub_f64s(last, now)));
            active = simd.and_m64s(active, simd.and_m64s(moves, simd.less_than_f64s(zero, least)));
            if !lanes.any(active) {
                break;
            }
            last = now;
        }
        if self.orders.denominator > 0 {
            self.descend(&mut best, &mut squares);
        }
        let (_, factored) = self.newton_step(&best);
        Fitted { value: best[0], unit_variance: factored.first_variance(lanes), squares, rank: factored.rank(lanes) }
    }

    /// Gauss-Newton, each step halved until the residual falls.
    #[inline(always)]
    fn descend(&self, best: &mut [Complex<S>], squares: &mut S::f64s) {
        let (lanes, simd) = (self.lanes, self.lanes.0);
        let [zero, one, half, settled] = [0.0, 1.0, 0.5, SETTLED].map(|value| simd.splat_f64s(value));
        let mut active = simd.less_than_f64s(zero, one);
        for _ in 0..NEWTON_STEPS {
            let (step, _) = self.newton_step(best);
            let from = best.to_vec();
            let mut theta = from.clone();
            let (mut length, mut gain, mut waiting) = (one, zero, active);
            for _ in 0..HALVINGS {
                for ((theta, from), step) in theta.iter_mut().zip(&from).zip(&step) {
                    *theta = lanes.add(*from, lanes.scale(*step, length));
                }
                let now = self.residual(&theta).1;
                let fallen = simd.and_m64s(waiting, simd.less_than_f64s(now, *squares));
                self.keep(fallen, best, &theta);
                gain = simd.select_f64s(fallen, simd.sub_f64s(*squares, now), gain);
                *squares = simd.select_f64s(fallen, now, *squares);
                waiting = simd.and_m64s(waiting, simd.not_m64s(fallen));
                if !lanes.any(waiting) {
                    break;
                }
                length = simd.mul_f64s(length, half);
            }
            // a lane whose step was no good gained nothing
            active = simd.and_m64s(active, simd.less_than_f64s(simd.mul_f64s(settled, *squares), gain));
            if !lanes.any(active) {
                break;
            }
        }
    }

    #[inline(always)]
    fn keep(&self, mask: S::m64s, best: &mut [Complex<S>], theta: &[Complex<S>]) {
        for (best, theta) in best.iter_mut().zip(theta) {
            *best = self.lanes.select(mask, *theta, *best);
        }
    }

    /// Rows of one column per coefficient: numerator, transient, denominator (as a factor of `value`).
    #[inline(always)]
    fn columns(&self, scale: &[Complex<S>], value: &[Complex<S>]) -> Vec<Complex<S>> {
        let (lanes, simd) = (self.lanes, self.lanes.0);
        let mut all: Vec<Complex<S>> = Vec::with_capacity(self.orders.count() * self.offset.len());
        all.extend_from_slice(scale);
        self.powers(&mut all, self.orders.numerator);
        if let Some(t) = self.orders.transient {
            for (scale, turn) in scale.iter().zip(&self.turn) {
                all.push(lanes.multiply(*scale, *turn));
            }
            self.powers(&mut all, t);
        }
        if self.orders.denominator > 0 {
            for ((scale, value), r) in scale.iter().zip(value).zip(&self.offset) {
                all.push(lanes.scale(lanes.multiply(*scale, *value), simd.neg_f64s(*r)));
            }
            self.powers(&mut all, self.orders.denominator - 1);
        }
        all
    }

    /// The last column times the offsets, `count` times over.
    #[inline(always)]
    fn powers(&self, all: &mut Vec<Complex<S>>, count: usize) {
        for _ in 0..count {
            let first = all.len() - self.offset.len();
            for (i, offset) in self.offset.iter().enumerate() {
                all.push(self.lanes.scale(all[first + i], *offset));
            }
        }
    }

    #[inline(always)]
    fn linear_step(&self, previous: &[S::f64s]) -> Vec<Complex<S>> {
        let (lanes, simd) = (self.lanes, self.lanes.0);
        let zero = simd.splat_f64s(0.0);
        let (mut scale, mut right) = (Vec::with_capacity(previous.len()), Vec::with_capacity(previous.len()));
        for ((weight, previous), value) in self.weight.iter().zip(previous).zip(&self.value) {
            let re = simd.div_f64s(*weight, *previous);
            scale.push(Complex { re, im: zero });
            right.push(lanes.scale(*value, re));
        }
        Factored::new(lanes, self.columns(&scale, &self.value), self.offset.len()).solve(lanes, &right)
    }

    #[inline(always)]
    fn newton_step(&self, theta: &[Complex<S>]) -> (Vec<Complex<S>>, Factored<S>) {
        let lanes = self.lanes;
        let (model, _) = self.residual(theta);
        let (mut scale, mut right) = (Vec::with_capacity(model.len()), Vec::with_capacity(model.len()));
        for (((r, weight), value), model) in self.offset.iter().zip(&self.weight).zip(&self.value).zip(&model) {
            scale.push(lanes.scale(lanes.inverse(self.denominator(theta, *r)), *weight));
            right.push(lanes.scale(lanes.subtract(*value, *model), *weight));
        }
        let factored = Factored::new(lanes, self.columns(&scale, &model), self.offset.len());
        (factored.solve(lanes, &right), factored)
    }

    #[inline(always)]
    fn polynomial(&self, coefficients: &[Complex<S>], r: S::f64s) -> Complex<S> {
        let simd = self.lanes.0;
        let mut sum = self.lanes.real(0.0);
        for c in coefficients.iter().rev() {
            sum = Complex { re: simd.mul_add_e_f64s(sum.re, r, c.re), im: simd.mul_add_e_f64s(sum.im, r, c.im) };
        }
        sum
    }

    #[inline(always)]
    fn denominator(&self, theta: &[Complex<S>], r: S::f64s) -> Complex<S> {
        let own = self.polynomial(&theta[theta.len() - self.orders.denominator..], r);
        self.lanes.add(self.lanes.real(1.0), self.lanes.scale(own, r))
    }

    /// Model values and the weighted sum of squared residuals; infinite where that is not a number.
    #[inline(always)]
    fn residual(&self, theta: &[Complex<S>]) -> (Vec<Complex<S>>, S::f64s) {
        let (lanes, simd) = (self.lanes, self.lanes.0);
        let (b, rest) = theta.split_at(self.orders.numerator + 1);
        let t = &rest[..self.orders.transient.map_or(0, |t| t + 1)];
        let mut sum = simd.splat_f64s(0.0);
        let mut model = Vec::with_capacity(self.offset.len());
        for (i, &r) in self.offset.iter().enumerate() {
            let above = lanes.add_product(self.polynomial(b, r), self.polynomial(t, r), self.turn[i]);
            let value = match self.orders.denominator {
                0 => above,
                _ => lanes.multiply(above, lanes.inverse(self.denominator(theta, r))),
            };
            let left = lanes.scale(lanes.subtract(self.value[i], value), self.weight[i]);
            sum = simd.add_f64s(sum, lanes.square(left));
            model.push(value);
        }
        let infinite = simd.splat_f64s(f64::INFINITY);
        (model, simd.select_f64s(simd.less_than_f64s(sum, infinite), sum, infinite))
    }
}
