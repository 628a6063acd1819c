//! The static curve: a natural cubic spline.

use faer::Mat;
use serde::{Deserialize, Serialize};

use crate::linear_algebra::solve;

/// One sample of so many lies beyond either end of a curve's knots.
const BEYOND: usize = 2000;

/// A cubic spline on equally spaced knots, given by its values there; straight beyond its ends, where the second
/// derivative is zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    first: f64,
    step: f64,
    values: Vec<f64>,
}

/// Where an abscissa lies: the knot before it and the weights of the values and second derivatives of both neighbours.
struct Place {
    knot: usize,
    values: [f64; 2],
    bends: [f64; 2],
}

impl Curve {
    /// The curve through `values`, at least three, at the knots `first`, `first + step`, ...
    pub(super) fn new(first: f64, step: f64, values: Vec<f64>) -> Self {
        Self { first, step, values }
    }

    /// A curve of zeros on `knots` knots over the range of `x` but its outermost samples: a spline on knots that only a
    /// few of them reach would follow their noise.
    pub(super) fn over(x: &[f64], knots: usize) -> Self {
        let mut sorted = x.to_vec();
        let beyond = x.len() / BEYOND;
        let mut at = |place: usize| sorted.select_nth_unstable_by(place, f64::total_cmp).1.to_owned();
        let (low, high) = (at(beyond), at(x.len() - 1 - beyond));
        let step = ((high - low) / (knots - 1) as f64).max(f64::MIN_POSITIVE);
        Self::new(low, step, vec![0.0; knots])
    }

    /// Whether the knots lie within the range of `x`, give or take half a step.
    pub(super) fn covers_no_more_than(&self, x: &[f64]) -> bool {
        let own = Self::over(x, self.values.len());
        let last = |curve: &Self| curve.first + (curve.values.len() - 1) as f64 * curve.step;
        self.first > own.first - 0.5 * self.step && last(self) < last(&own) + 0.5 * self.step
    }

    /// The abscissas of the knots.
    pub fn knots(&self) -> Vec<f64> {
        (0..self.values.len()).map(|k| self.first + k as f64 * self.step).collect()
    }

    /// The values at the knots: the curve's parameters.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The curve with these values at the same knots; values that are missing stay.
    pub fn at(&self, values: &[f64]) -> Self {
        let mut moved = self.clone();
        moved.values.iter_mut().zip(values).for_each(|(own, value)| *own = *value);
        moved
    }

    /// The curve at every `x`.
    pub fn of(&self, x: &[f64]) -> Vec<f64> {
        let bends = self.bends();
        let at = |x: &f64| {
            let Place { knot: k, values: a, bends: c } = self.place(*x);
            a[0] * self.values[k] + a[1] * self.values[k + 1] + c[0] * bends[k] + c[1] * bends[k + 1]
        };
        x.iter().map(at).collect()
    }

    /// Its derivative at every `x`.
    pub fn slope_of(&self, x: &[f64]) -> Vec<f64> {
        let bends = self.bends();
        let (h, last) = (self.step, self.values.len() - 1);
        let at = |x: &f64| {
            let place = ((x - self.first) / h).clamp(0.0, last as f64);
            let k = (place as usize).min(last - 1);
            let (b, a) = (place - k as f64, 1.0 - (place - k as f64));
            let chord = (self.values[k + 1] - self.values[k]) / h;
            chord + h / 6.0 * ((3.0 * b * b - 1.0) * bends[k + 1] - (3.0 * a * a - 1.0) * bends[k])
        };
        x.iter().map(at).collect()
    }

    /// Derivatives of the curve at every `x` to its values: a column each.
    pub(super) fn basis(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let count = self.values.len();
        let unit = bends_of_values(count, self.step);
        let rows: Vec<Vec<f64>> = (0..count).map(|i| (0..count).map(|k| unit[(i, k)]).collect()).collect();
        let mut columns = vec![vec![0.0; x.len()]; count];
        for (t, x) in x.iter().enumerate() {
            let Place { knot, values, bends } = self.place(*x);
            let (left, right) = (&rows[knot], &rows[knot + 1]);
            for (column, (left, right)) in columns.iter_mut().zip(left.iter().zip(right)) {
                column[t] = bends[0] * left + bends[1] * right;
            }
            columns[knot][t] += values[0];
            columns[knot + 1][t] += values[1];
        }
        columns
    }

    /// The same curve of an abscissa that is `factor` times as large.
    pub(super) fn stretched(&self, factor: f64) -> Self {
        let mut values = self.values.clone();
        let last = self.first + (values.len() - 1) as f64 * self.step;
        if factor < 0.0 {
            values.reverse();
        }
        Self::new((self.first * factor).min(last * factor), self.step * factor.abs(), values)
    }

    /// The same curve with `factor` times its values.
    pub(super) fn scaled(mut self, factor: f64) -> Self {
        self.values.iter_mut().for_each(|value| *value *= factor);
        self
    }

    /// Second derivatives at the knots.
    fn bends(&self) -> Vec<f64> {
        let unit = bends_of_values(self.values.len(), self.step);
        let at = |i: usize| self.values.iter().enumerate().map(|(k, value)| unit[(i, k)] * value).sum();
        (0..self.values.len()).map(at).collect()
    }

    fn place(&self, x: f64) -> Place {
        let last = self.values.len() - 1;
        let at = (x - self.first) / self.step;
        let knot = (at.max(0.0) as usize).min(last - 1);
        let b = at - knot as f64;
        let a = 1.0 - b;
        let sixth = self.step * self.step / 6.0;
        // beyond an end the tangent there: the cubic terms become their slopes times the distance
        let bends = if at < 0.0 {
            [-2.0 * sixth * b, -sixth * b]
        } else if b > 1.0 {
            [sixth * (b - 1.0), 2.0 * sixth * (b - 1.0)]
        } else {
            [sixth * (a * a * a - a), sixth * (b * b * b - b)]
        };
        Place { knot, values: [a, b], bends }
    }
}

/// Second derivatives at `count` knots of the natural splines through one value of one and zeros: a column each.
fn bends_of_values(count: usize, step: f64) -> Mat<f64> {
    let inner = count - 2;
    let matrix = Mat::from_fn(inner, inner, |i, j| match i.abs_diff(j) {
        0 => 4.0,
        1 => 1.0,
        _ => 0.0,
    });
    let weight = 6.0 / (step * step);
    let differences = Mat::from_fn(inner, count, |i, k| match k as isize - i as isize {
        0 | 2 => weight,
        1 => -2.0 * weight,
        _ => 0.0,
    });
    let solved = solve(matrix, &differences);
    Mat::from_fn(count, count, |i, k| if i == 0 || i == count - 1 { 0.0 } else { solved[(i - 1, k)] })
}
