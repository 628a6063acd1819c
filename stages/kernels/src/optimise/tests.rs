use std::convert::Infallible;

use faer::Mat;

use super::*;
use crate::linear_algebra::Svd;

/// Rosenbrock's valley as a sum of two squares, the hardest of the small ones: `10 (y - x^2)` and `1 - x`.
struct Valley {
    trials: usize,
    promised: bool,
    forbidden: bool,
}

impl Valley {
    const NEW: Self = Self { trials: 0, promised: false, forbidden: false };

    fn residual(p: &[f64; 2]) -> [f64; 2] {
        [10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]]
    }
}

impl Objective for Valley {
    type Point = [f64; 2];
    type Local = (Mat<f64>, Vec<f64>);
    type Step = f64;
    type Error = Infallible;

    fn cost(&self, p: &[f64; 2]) -> f64 {
        Self::residual(p).iter().map(|r| r * r).sum()
    }

    fn exact(&self, p: &[f64; 2]) -> bool {
        self.cost(p) == 0.0
    }

    fn local(&mut self, p: &mut [f64; 2]) -> Result<Option<Self::Local>, Infallible> {
        let slope = [[-20.0 * p[0], 10.0], [-1.0, 0.0]];
        let r = Self::residual(p);
        let gradient: Vec<f64> = (0..2).map(|j| -(slope[0][j] * r[0] + slope[1][j] * r[1])).collect();
        let information = Mat::from_fn(2, 2, |i, j| slope[0][i] * slope[0][j] + slope[1][i] * slope[1][j]);
        let arrived = gradient.iter().all(|g| g.abs() < 1e-13);
        Ok((!arrived).then_some((information, gradient)))
    }

    fn trial(&mut self, p: &[f64; 2], (f, g): &Self::Local, damping: f64) -> Result<Trial<[f64; 2], f64>, Infallible> {
        self.trials += 1;
        let (d, _) = damped_step(f, g, damping);
        let quadratic: f64 = (0..2).map(|i| (0..2).map(|j| d[i] * f[(i, j)] * d[j]).sum::<f64>()).sum();
        let promised = 2.0 * (d[0] * g[0] + d[1] * g[1]) - quadratic;
        let next = [p[0] + d[0], p[1] + d[1]];
        Ok((!self.forbidden).then_some((next, promised)))
    }

    fn taken(&mut self, from: &[f64; 2], _: &Self::Local, promised: f64, to: &mut [f64; 2]) -> Taken {
        let fall = self.cost(from) - self.cost(to);
        Taken { kept: self.promised.then_some(fall / promised), ending: None }
    }
}

fn found(valley: &mut Valley, rule: Damping, limits: Limits) -> (Descent<[f64; 2]>, f64) {
    let mut damping = 1e-3;
    (descend(valley, [-1.2, 1.0], &mut damping, rule, limits).unwrap_or_else(|never| match never {}), damping)
}

#[test]
fn the_valley_is_followed_to_its_minimum_by_either_rule() {
    for rule in [Damping::STANDARD, Damping::FAST_RISE] {
        for promised in [false, true] {
            let (descent, damping) = found(&mut Valley { promised, ..Valley::NEW }, rule, Limits::NONE);
            assert!(matches!(descent.ending, Ending::Minimum | Ending::Exact), "{descent:?}");
            // a gradient of 1e-13 over the least curvature of the information, 0.002
            assert!(descent.point.iter().all(|p| (p - 1.0).abs() < 1e-10), "{descent:?}");
            assert!(descent.steps < 60 && damping < 1e-3, "{descent:?} {damping}");
        }
    }
}

#[test]
fn limits_end_a_search_and_say_so() {
    let (descent, _) = found(&mut Valley { ..Valley::NEW }, Damping::STANDARD, Limits { steps: 3, ..Limits::NONE });
    assert_eq!((descent.steps, descent.ending), (3, Ending::IterationLimit));
    let mut valley = Valley::NEW;
    let (descent, _) = found(&mut valley, Damping::STANDARD, Limits { trials: 5, ..Limits::NONE });
    assert_eq!((valley.trials, descent.ending), (5, Ending::IterationLimit));
    let none = found(&mut Valley { ..Valley::NEW }, Damping::STANDARD, Limits { steps: 0, ..Limits::NONE }).0;
    assert_eq!((none.point, none.steps), ([-1.2, 1.0], 0));
}

#[test]
fn a_search_without_a_valid_step_stalls_where_it_began() {
    for rule in [Damping::STANDARD, Damping::FAST_RISE] {
        let mut valley = Valley { forbidden: true, ..Valley::NEW };
        let (descent, damping) = found(&mut valley, rule, Limits::NONE);
        assert_eq!((descent.ending, descent.steps, descent.point), (Ending::Stalled, 0, [-1.2, 1.0]));
        // decades from 1e-3 to 1e12, fewer where the rise grows
        assert!(damping >= rule.most && valley.trials <= 16, "{}", valley.trials);
    }
}

#[test]
fn damping_falls_with_promises_kept_and_rises_with_those_broken() {
    let rule = Damping::STANDARD;
    // kept: as far as it may fall; half kept: as it is; not at all: doubled
    assert_eq!(rule.lowered(1.0, Some(1.0)), 0.1);
    assert_eq!(rule.lowered(1.0, Some(0.5)), 1.0);
    assert_eq!(rule.lowered(1.0, Some(0.0)), 2.0);
    assert_eq!(rule.lowered(1e-12, None), 1e-12);
    assert_eq!(rule.raised(1e-9, 0), 1e-4);
    let fast = Damping::FAST_RISE;
    assert_eq!((fast.raised(1.0, 0), fast.raised(1.0, 1), fast.raised(1.0, 2)), (4.0, 16.0, 64.0));
}

#[test]
fn both_forms_of_a_step_agree_and_shrink_with_damping() {
    let columns = [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]];
    let jacobian = Mat::from_fn(3, 2, |i, j| columns[j][i] + if (i, j) == (2, 1) { 0.01 } else { 0.0 });
    let unit = |j: usize| jacobian.col(j).norm_l2();
    let scaled = Mat::from_fn(3, 2, |i, j| jacobian[(i, j)] / unit(j));
    let residual = [0.3, -0.2, 0.5];
    let information = Mat::from_fn(2, 2, |i, j| (0..3).map(|k| scaled[(k, i)] * scaled[(k, j)]).sum::<f64>());
    let gradient: Vec<f64> = (0..2).map(|j| (0..3).map(|k| scaled[(k, j)] * residual[k]).sum()).collect();
    let svd = Svd::new(&scaled).expect("finite");
    let along: Vec<f64> = (0..2).map(|k| (0..3).map(|i| svd.u[(i, k)] * residual[i]).sum()).collect();
    let mut last = f64::INFINITY;
    for damping in [0.0, 1e-3, 1.0, 1e3] {
        let (normal, _) = damped_step(&information, &gradient, damping);
        let singular = damped_svd_step(&svd, &along, damping / svd.s[0].powi(2), 1e-12);
        // columns of unit length: the diagonal is the unit matrix, so both dampings are the same
        for (a, b) in normal.iter().zip(&singular) {
            assert!((a - b).abs() < 1e-13, "{a} {b}"); // rounding
        }
        let length = normal.iter().map(|s| s * s).sum::<f64>();
        assert!(length < last);
        last = length;
    }
}

#[test]
fn directions_without_information_are_held() {
    let svd = Svd::new(&Mat::from_fn(3, 2, |i, _| if i == 0 { 1.0 } else { 0.0 })).expect("finite");
    let step = damped_svd_step(&svd, &[1.0, 1.0], 0.0, 1e-9);
    // the columns are equal: their sum is determined, their difference is not
    assert!((step[0] - step[1]).abs() < 1e-15);
    let (step, _) = damped_step(&Mat::from_fn(2, 2, |i, j| if (i, j) == (0, 0) { 4.0 } else { 0.0 }), &[2.0, 1.0], 0.0);
    assert_eq!(step, [0.5, 0.0]);
    assert_eq!(shortened(vec![3.0, -6.0], 2.0), [1.0, -2.0]);
    assert_eq!(shortened(vec![0.5, -1.0], 2.0), [0.5, -1.0]);
}
