//! Contact stiffness and damping from coupled poles.

use crate::linear_algebra::{cholesky, product, solve};
use faer::{Mat, c64};

use super::coupled::{CoupledPoles, coupled_poles};
use super::lever::FreeLever;
use crate::model::ModelError;
use crate::ringdown::Estimate;
use crate::statistics::chi_square_tail;

/// What one pole says by itself, and what it counts in the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoleContact {
    /// The measured pole, rad/s.
    pub pole: c64,
    /// Where the estimated contact puts it, rad/s.
    pub fitted: c64,
    /// `Re kappa - eta Re s` of this pole alone, N/m.
    pub stiffness_n_per_m: Estimate,
    /// `Im kappa / Im s` of this pole alone, N s/m.
    pub damping_n_s_per_m: Estimate,
    /// Its weight in the stiffness; all weights sum to one.
    pub stiffness_weight: f64,
    /// Its weight in the damping; all weights sum to one.
    pub damping_weight: f64,
}

/// Standard errors of the contact stiffness by origin, N/m; their squares sum to that of the whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBudget {
    /// Coupled poles.
    pub poles: f64,
    /// Stiffness of the lever.
    pub stiffness: f64,
    /// Frequencies and quality factors of the free lever.
    pub free_modes: f64,
    /// Tip shares.
    pub tip_shares: f64,
}

/// The contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactEstimate {
    /// Contact stiffness, N/m.
    pub stiffness_n_per_m: Estimate,
    /// Contact damping, N s/m.
    pub damping_n_s_per_m: Estimate,
    /// Correlation of the two.
    pub correlation: f64,
    /// What each pole says.
    pub poles: Vec<PoleContact>,
    /// Weighted square distance of the poles from where the estimated contact puts them.
    pub chi_square: f64,
    /// Its degrees of freedom: two per pole, less two.
    pub freedom: usize,
    /// Probability of a larger one where the model holds; NaN for a single pole.
    pub p_value: f64,
    /// Where the error of the stiffness comes from.
    pub budget: ErrorBudget,
}

/// Gauss-Newton steps: from a start that one pole gives it takes five.
const STEPS: usize = 60;
/// Halvings of a step.
const HALVINGS: usize = 30;
/// A step below this share of a standard error has arrived.
const ARRIVED: f64 = 1e-9;

/// Contact stiffness and damping from the poles that the contact moves.
///
/// # Model
/// A lever of `N` modes on a linear contact at its tip: `kappa(s) = k_c + eta s = -1 / G(s)` at every pole `s` of the
/// two together. Free lever, contact and readout are otherwise arbitrary: neither detector nor excitation enters the
/// poles.
/// # Method
/// Each pole alone gives `eta = Im kappa / Im s`, `k_c = Re kappa - eta Re s`. Together: generalised least squares of
/// the measured poles against
/// [`coupled_poles`], Gauss-Newton with halved steps, weighted by the covariance of the poles plus that of the lever's own
/// parameters carried to the poles by implicit derivatives, at the present estimate.
/// # Shapes
/// `M >= 1` poles of a lever of `N` modes, `M <= N` (and one more where the shares leave a rest).
/// # Units
/// rad/s, N/m, N s/m.
/// # Accuracy
/// Standard errors to first order; 50 simulated archives: docs/results/contact.md. **Bias**: modes beyond the free
/// lever's act as a static compliance only (what the shares leave of one); a pole near the highest free mode feels the
/// first one that is missing. Errors of frequencies and quality factors of the free lever are taken as independent of
/// each other and of the coupled poles. Wrong shares bias every pole differently: the chi square shows it,
/// `tip_share_error` counts it.
/// # Errors
/// No pole, a covariance of another size, values that are not finite, poles that no contact on this lever gives.
/// # Source
/// U. Rabe, K. Janser, W. Arnold, Rev. Sci. Instrum. 67 (1996) 3281 (contact resonances);
/// A. C. Aitken, Proc. R. Soc. Edinb. 55 (1936) 42 (generalised least squares).
pub fn contact_stiffness(lever: &FreeLever, measured: &CoupledPoles) -> Result<ContactEstimate, ModelError> {
    check(measured)?;
    let single: Vec<Single> = (0..measured.poles.len()).map(|j| Single::of(lever, measured, j)).collect();
    let mut best = start(lever, measured, &single)?;
    for _ in 0..STEPS {
        let step = best.step();
        let size = best.in_errors(step);
        let mut shorter = 1.0;
        let better = (0..HALVINGS).find_map(|_| {
            let trial = [best.contact[0] + shorter * step[0], best.contact[1] + shorter * step[1]];
            shorter *= 0.5;
            // compared under the weights of the start of the step: they change with the estimate
            let poles = coupled_poles(lever, trial, &measured.poles)?;
            let distance = square(&whitened(&best.factor, &residuals(measured, &poles)));
            (distance < best.chi_square).then_some((trial, poles))
        });
        let Some((contact, poles)) = better else { break };
        best = Linear::at(lever, measured, contact, poles);
        if size < ARRIVED {
            break;
        }
    }
    if best.in_errors(best.step()) > 1e-3 {
        return Err(ModelError::Degenerate("the search for the contact did not arrive at a minimum"));
    }
    Ok(best.result(measured, &single))
}

fn check(measured: &CoupledPoles) -> Result<(), ModelError> {
    let n = 2 * measured.poles.len();
    if n == 0 {
        return Err(ModelError::Parameter { name: "number of coupled poles", found: 0.0, wanted: "at least 1" });
    }
    if measured.covariance.shape() != (n, n) {
        return Err(ModelError::Parameter {
            name: "rows of the poles' covariance",
            found: measured.covariance.nrows() as f64,
            wanted: "two for each pole",
        });
    }
    for (j, pole) in measured.poles.iter().enumerate() {
        if !(pole.re.is_finite() && pole.im.is_finite()) {
            return Err(ModelError::NotFinite { what: "coupled poles", index: j });
        }
        if pole.im <= 0.0 {
            return Err(ModelError::Parameter {
                name: "imaginary part of a coupled pole",
                found: pole.im,
                wanted: "above 0: the upper one of a pair",
            });
        }
    }
    for j in 0..n {
        let variance = measured.covariance[(j, j)];
        if !(variance > 0.0 && (0..n).all(|i| measured.covariance[(i, j)].is_finite())) {
            return Err(ModelError::Parameter {
                name: "variance of a coupled pole",
                found: variance,
                wanted: "above 0 and finite, like all of its covariances",
            });
        }
    }
    Ok(())
}

/// What one pole says alone.
struct Single {
    contact: [f64; 2],
    std: [f64; 2],
}

impl Single {
    fn of(lever: &FreeLever, measured: &CoupledPoles, j: usize) -> Self {
        let s = measured.poles[j];
        let kappa = -c64::new(1.0, 0.0) / lever.compliance(s).value;
        let eta = kappa.im / s.im;
        let contact = [kappa.re - eta * s.re, eta];
        let block = Mat::from_fn(2, 2, |a, b| measured.covariance[(2 * j + a, 2 * j + b)]);
        let own = CoupledPoles { poles: vec![s], covariance: block };
        let covariance = Linear::at(lever, &own, contact, vec![s]).covariance();
        Self { contact, std: [covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt()] }
    }
}

/// Stiffness and damping from each pole alone.
pub(super) fn single_poles(lever: &FreeLever, measured: &CoupledPoles) -> Vec<[Estimate; 2]> {
    (0..measured.poles.len())
        .map(|j| {
            let one = Single::of(lever, measured, j);
            [0, 1].map(|i| Estimate { value: one.contact[i], std: one.std[i] })
        })
        .collect()
}

/// The best of what single poles say, and of their weighted mean.
fn start(lever: &FreeLever, measured: &CoupledPoles, single: &[Single]) -> Result<Linear, ModelError> {
    let mean = [0, 1].map(|i| {
        let weight = |one: &Single| one.std[i].powi(-2);
        single.iter().map(|one| weight(one) * one.contact[i]).sum::<f64>() / single.iter().map(weight).sum::<f64>()
    });
    single
        .iter()
        .map(|one| one.contact)
        .chain([mean])
        .filter(|contact| contact.iter().all(|v| v.is_finite()))
        .filter_map(|contact| {
            coupled_poles(lever, contact, &measured.poles).map(|poles| Linear::at(lever, measured, contact, poles))
        })
        .filter(|linear| linear.chi_square.is_finite())
        .min_by(|a, b| a.chi_square.total_cmp(&b.chi_square))
        .ok_or(ModelError::Degenerate("no linear contact on this lever has as many poles near the measured ones"))
}

/// The model, linear round one contact.
struct Linear {
    contact: [f64; 2],
    poles: Vec<c64>,
    /// Poles by contact: 2 M x 2.
    slope: Mat<f64>,
    /// Poles by the lever's parameters, each times its standard error: 2 M x P.
    lever: Mat<f64>,
    /// Lower Cholesky factor of the covariance of the residuals.
    factor: Mat<f64>,
    residuals: Mat<f64>,
    chi_square: f64,
}

impl Linear {
    fn at(lever: &FreeLever, measured: &CoupledPoles, contact: [f64; 2], poles: Vec<c64>) -> Self {
        let std = lever.parameter_std();
        let rows = 2 * poles.len();
        let (mut slope, mut own) = (Mat::zeros(rows, 2), Mat::zeros(rows, std.len()));
        for (j, &s) in poles.iter().enumerate() {
            let g = lever.compliance(s);
            let kappa = s * contact[1] + contact[0];
            // ds/dp = -(dF/dp) / (dF/ds) of F = 1 + kappa G
            let by_s = g.value * contact[1] + kappa * g.by_s;
            let put = |target: &mut Mat<f64>, column: usize, d: c64| {
                target[(2 * j, column)] = d.re;
                target[(2 * j + 1, column)] = d.im;
            };
            put(&mut slope, 0, -g.value / by_s);
            put(&mut slope, 1, -s * g.value / by_s);
            for (p, d) in g.by_parameter.iter().enumerate() {
                put(&mut own, p, -kappa * d / by_s * std[p]);
            }
        }
        let covariance = &measured.covariance + &own * own.transpose();
        let factor = cholesky(&covariance);
        let residuals = residuals(measured, &poles);
        let chi_square = square(&whitened(&factor, &residuals));
        Self { contact, poles, slope, lever: own, factor, residuals, chi_square }
    }

    /// Rows that make estimates from residuals: `(J' C^-1 J)^-1 J' C^-1`, 2 x 2 M.
    fn gain(&self) -> Mat<f64> {
        let white = whitened(&self.factor, &self.slope);
        let inner = solve_scaled(&white);
        // J' C^-1 = (L^-1 J)' L^-1
        let rows = self.slope.nrows();
        let identity = Mat::from_fn(rows, rows, |i, j| if i == j { 1.0 } else { 0.0 });
        let inverse = whitened(&self.factor, &identity);
        &inner * (white.transpose() * &inverse)
    }

    fn covariance(&self) -> Mat<f64> {
        solve_scaled(&whitened(&self.factor, &self.slope))
    }

    fn step(&self) -> [f64; 2] {
        let step = self.gain() * &self.residuals;
        [step[(0, 0)], step[(1, 0)]]
    }

    /// Length of a step in standard errors.
    fn in_errors(&self, step: [f64; 2]) -> f64 {
        let step = Mat::from_fn(2, 1, |i, _| step[i]);
        square(&whitened(&self.factor, &(&self.slope * step))).sqrt()
    }

    fn result(self, measured: &CoupledPoles, single: &[Single]) -> ContactEstimate {
        let (covariance, gain) = (self.covariance(), self.gain());
        let std = [covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt()];
        let poles = single.iter().enumerate().map(|(j, one)| {
            let weight = |i: usize| (2 * j..2 * j + 2).map(|row| gain[(i, row)] * self.slope[(row, i)]).sum();
            PoleContact {
                pole: measured.poles[j],
                fitted: self.poles[j],
                stiffness_n_per_m: Estimate { value: one.contact[0], std: one.std[0] },
                damping_n_s_per_m: Estimate { value: one.contact[1], std: one.std[1] },
                stiffness_weight: weight(0),
                damping_weight: weight(1),
            }
        });
        let poles: Vec<PoleContact> = poles.collect();
        let freedom = 2 * poles.len() - 2;
        ContactEstimate {
            stiffness_n_per_m: Estimate { value: self.contact[0], std: std[0] },
            damping_n_s_per_m: Estimate { value: self.contact[1], std: std[1] },
            correlation: covariance[(0, 1)] / (std[0] * std[1]),
            poles,
            chi_square: self.chi_square,
            freedom,
            p_value: chi_square_tail(self.chi_square, freedom),
            budget: self.budget(measured, &gain),
        }
    }

    fn budget(&self, measured: &CoupledPoles, gain: &Mat<f64>) -> ErrorBudget {
        let poles = gain * &measured.covariance * gain.transpose();
        let own = gain * &self.lever;
        let part =
            |columns: &mut dyn Iterator<Item = usize>| columns.map(|p| own[(0, p)] * own[(0, p)]).sum::<f64>().sqrt();
        let count = own.ncols();
        ErrorBudget {
            poles: poles[(0, 0)].max(0.0).sqrt(),
            stiffness: part(&mut (0..1)),
            free_modes: part(&mut (1..count).filter(|p| p % 3 != 0)),
            tip_shares: part(&mut (1..count).filter(|p| p % 3 == 0)),
        }
    }
}

fn residuals(measured: &CoupledPoles, poles: &[c64]) -> Mat<f64> {
    Mat::from_fn(2 * poles.len(), 1, |i, _| {
        let d = measured.poles[i / 2] - poles[i / 2];
        if i % 2 == 0 { d.re } else { d.im }
    })
}

/// `factor^-1 matrix` for a lower triangle.
pub(super) fn whitened(factor: &Mat<f64>, matrix: &Mat<f64>) -> Mat<f64> {
    let mut out = matrix.clone();
    for j in 0..out.ncols() {
        for i in 0..out.nrows() {
            let known: f64 = (0..i).map(|k| factor[(i, k)] * out[(k, j)]).sum();
            out[(i, j)] = (out[(i, j)] - known) / factor[(i, i)];
        }
    }
    out
}

fn square(column: &Mat<f64>) -> f64 {
    (0..column.nrows()).map(|i| column[(i, 0)] * column[(i, 0)]).sum()
}

/// `(A' A)^-1` of two columns, each scaled to unit length first: N/m and N s/m are six orders apart.
fn solve_scaled(columns: &Mat<f64>) -> Mat<f64> {
    let norm = [0, 1].map(|j| columns.col(j).iter().map(|v| v * v).sum::<f64>().sqrt());
    let scaled = Mat::from_fn(columns.nrows(), 2, |i, j| columns[(i, j)] / norm[j]);
    let identity = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 0.0 });
    let inverse = solve(product(scaled.transpose(), scaled.as_ref()), &identity);
    Mat::from_fn(2, 2, |i, j| inverse[(i, j)] / (norm[i] * norm[j]))
}
