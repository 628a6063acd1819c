//! A quotient of two low-order polynomials fitted to a few complex values.

use rustfft::num_complex::Complex64;

use super::least_squares::{Columns, Factored};

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

const ONE: Complex64 = Complex64::new(1.0, 0.0);
/// Reweighted linear steps: peaks two bins wide settle within four.
const LINEAR_STEPS: usize = 6;
/// Change of the squares, as a share, after which further steps would move the value by less than a thousandth of its standard error.
const SETTLED: f64 = 1e-6;
/// Gauss-Newton steps at most: they end the bias that reweighting leaves in noise.
const NEWTON_STEPS: usize = 8;

/// Fits by Levy's linear problem, reweighted (Sanathanan and Koerner 1963), then by Gauss-Newton on the true residual.
pub(super) fn fit_fraction(points: &Points, orders: Orders) -> Fraction {
    let mut best = vec![Complex64::new(0.0, 0.0); orders.count()];
    let mut squares = residual(points, orders, &best).1;
    let mut previous = vec![ONE; points.offset.len()];
    let mut last = f64::INFINITY;
    for _ in 0..if orders.denominator == 0 { 1 } else { LINEAR_STEPS } {
        let theta = linear_step(points, orders, &previous);
        previous = points.offset.iter().map(|&r| denominator(orders, &theta, r)).collect();
        let now = residual(points, orders, &theta).1;
        if now < squares {
            (best, squares) = (theta, now);
        }
        if previous.iter().any(|a| a.norm_sqr() == 0.0) || (last - now).abs() <= SETTLED * now {
            break;
        }
        last = now;
    }
    if orders.denominator > 0 {
        for _ in 0..NEWTON_STEPS {
            let (step, _) = newton_step(points, orders, &best);
            let Some((theta, now)) = shorten(points, orders, &best, &step, squares) else { break };
            let gain = squares - now;
            (best, squares) = (theta, now);
            if gain <= SETTLED * squares {
                break;
            }
        }
    }
    let (_, factored) = newton_step(points, orders, &best);
    let mut gradient = vec![Complex64::new(0.0, 0.0); orders.count()];
    gradient[0] = ONE;
    Fraction { value: best[0], unit_variance: factored.variance(&gradient), squares, rank: factored.rank() }
}

/// Rows of one column per coefficient: numerator, transient, denominator (as a factor of `value`).
fn columns(points: &Points, orders: Orders, scale: &[Complex64], value: &[Complex64]) -> Columns {
    let mut all = Columns::new(points.offset.len(), orders.count());
    let mut powers = |first: &mut dyn Iterator<Item = Complex64>, count: usize| {
        all.push(first);
        (1..count).for_each(|_| all.push_last_times(&points.offset));
    };
    powers(&mut scale.iter().copied(), orders.numerator + 1);
    if let Some(t) = orders.transient {
        powers(&mut scale.iter().zip(&points.turn).map(|(s, turn)| s * turn), t + 1);
    }
    if orders.denominator > 0 {
        let of_value = scale.iter().zip(value).zip(&points.offset).map(|((s, g), r)| -(s * g) * r);
        powers(&mut of_value.into_iter(), orders.denominator);
    }
    all
}

fn linear_step(points: &Points, orders: Orders, previous: &[Complex64]) -> Vec<Complex64> {
    let scale: Vec<Complex64> = points.weight.iter().zip(previous).map(|(w, a)| ONE * (w / a.norm())).collect();
    let right: Vec<Complex64> = points.value.iter().zip(&scale).map(|(g, s)| g * s).collect();
    Factored::new(&columns(points, orders, &scale, &points.value)).solve(&right)
}

fn newton_step(points: &Points, orders: Orders, theta: &[Complex64]) -> (Vec<Complex64>, Factored) {
    let a: Vec<Complex64> = points.offset.iter().map(|&r| denominator(orders, theta, r)).collect();
    let scale: Vec<Complex64> = points.weight.iter().zip(&a).map(|(w, a)| w / a).collect();
    let (model, _) = residual(points, orders, theta);
    let right: Vec<Complex64> =
        points.value.iter().zip(&model).zip(&points.weight).map(|((g, m), w)| (g - m) * w).collect();
    let factored = Factored::new(&columns(points, orders, &scale, &model));
    (factored.solve(&right), factored)
}

/// The step, halved until the residual falls.
fn shorten(
    points: &Points,
    orders: Orders,
    from: &[Complex64],
    step: &[Complex64],
    squares: f64,
) -> Option<(Vec<Complex64>, f64)> {
    (0..5).find_map(|halvings| {
        let length = 0.5f64.powi(halvings);
        let theta: Vec<Complex64> = from.iter().zip(step).map(|(t, s)| t + s * length).collect();
        let now = residual(points, orders, &theta).1;
        (now < squares).then_some((theta, now))
    })
}

fn polynomial(coefficients: &[Complex64], r: f64) -> Complex64 {
    coefficients.iter().rev().fold(Complex64::new(0.0, 0.0), |sum, c| sum * r + c)
}

fn denominator(orders: Orders, theta: &[Complex64], r: f64) -> Complex64 {
    ONE + polynomial(&theta[theta.len() - orders.denominator..], r) * r
}

/// Model values and the weighted sum of squared residuals.
fn residual(points: &Points, orders: Orders, theta: &[Complex64]) -> (Vec<Complex64>, f64) {
    let (b, rest) = theta.split_at(orders.numerator + 1);
    let t = &rest[..orders.transient.map_or(0, |t| t + 1)];
    let model: Vec<Complex64> = points
        .offset
        .iter()
        .zip(&points.turn)
        .map(|(&r, turn)| (polynomial(b, r) + polynomial(t, r) * turn) / denominator(orders, theta, r))
        .collect();
    let squares =
        model.iter().zip(&points.value).zip(&points.weight).map(|((m, g), w)| (g - m).norm_sqr() * w * w).sum::<f64>();
    (model, if squares.is_finite() { squares } else { f64::INFINITY })
}
