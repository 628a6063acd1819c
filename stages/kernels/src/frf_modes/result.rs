//! Modes, shapes and errors of a fit.

use faer::{Mat, c64};

use super::data::Indicator;
use super::fit::Fitted;
use super::in_common::InCommon;
use super::lack::Lack;
use super::model::width;
use super::polynomial::Diagram;
use super::scatter::Scatter;
use super::selection::Search;
use super::{FrfModel, FrfModesOptions, FrfQuantity};
use crate::linear_algebra::symmetric_inverse;
use crate::model::ModelError;
use crate::ringdown::internals::mode;
use crate::ringdown::{Estimate, ModeEstimate, ModeShape, OrderTried, RankOne, RingdownVerdict, ShapePoint};
use crate::stabilisation::Stabilisation;

/// One mode of the responses.
#[derive(Debug, Clone, PartialEq)]
pub struct FrfMode {
    /// Frequency and quality factor.
    pub estimate: ModeEstimate,
    /// Shape over the responses; its one amplitude is the residue at the reference.
    pub shape: ModeShape,
    /// Residue in each response with the covariance of real and imaginary part.
    pub residues: Vec<ShapePoint>,
    /// Modal phase collinearity: 1 for a normal mode, whose points move in phase or against it.
    pub phase_collinearity: f64,
    /// Shape at unit modal mass, for a driving point of the quantities with a force; a real number per response.
    pub mass_normalised: Option<Vec<Estimate>>,
    /// Square of that at the driving point, with the sign that the data give it: a passive structure's is positive.
    pub modal_constant: Option<Estimate>,
    /// Weighted squares of the residual around the mode over degrees of freedom: 1 where the model holds.
    pub lack_of_fit: f64,
    /// Factor on variances for residuals of which neighbours are alike; 1 where they are independent.
    pub correlation: f64,
}

/// Modes fitted to frequency responses.
#[derive(Debug, Clone)]
pub struct FrfModes {
    /// The fitted model.
    pub model: FrfModel,
    /// The modes, ascending in frequency.
    pub modes: Vec<FrfMode>,
    /// Covariance of Re and Im of each mode's pole, rad^2/s^2: 2 modes x 2 modes.
    pub covariance: Mat<f64>,
    /// Lines that were fitted, Hz: of more than 4000 means where no pole is near.
    pub frequency_hz: Vec<f64>,
    /// Variance of a single line's values there; infinite where they were left out. Responses x lines.
    pub variance: Vec<Vec<f64>>,
    /// Weighted squares over degrees of freedom: 1 by construction where the variance was estimated.
    pub reduced_chi_square: f64,
    /// All responses at once.
    pub indicator: Indicator,
    /// Poles by order; `mode` numbers the modes of the fit.
    pub diagram: Stabilisation,
    /// How the search for the poles ended.
    pub verdict: RingdownVerdict,
    /// Every further mode that was tried.
    pub tried: Vec<OrderTried>,
}

impl FrfModes {
    /// Modal assurance criteria between the shapes: modes x modes.
    pub fn mac(&self) -> Mat<f64> {
        let of = |i: usize, j: usize| self.modes[i].shape.mac(&self.modes[j].shape);
        Mat::from_fn(self.modes.len(), self.modes.len(), of)
    }

    /// Errors: no mode, no finite covariance.
    pub(super) fn of(
        search: Search<'_>,
        fitted: &Fitted,
        diagram: Diagram,
        seen: Indicator,
    ) -> Result<Self, ModelError> {
        let Search { ref lines, options, .. } = search;
        let is_mode = |s: c64| search.is_mode(s);
        let order = ascending(&fitted.at.poles, &is_mode);
        let count = fitted.at.poles.iter().filter(|s| is_mode(**s)).count();
        if count == 0 {
            return Err(ModelError::Degenerate("no mode stands out of the noise"));
        }
        let left = fitted.at.left(lines, options);
        let lacks: Vec<Lack> =
            fitted.at.poles.iter().map(|s| Lack::around(lines, &left, &fitted.at.poles, *s)).collect();
        let spread = Spread::new(fitted, &lacks, InCommon::new(lines, &fitted.at, &left, options));
        if order[..count].iter().flat_map(|j| [2 * j, 2 * j + 1]).any(|i| !spread.known(i)) {
            return Err(ModelError::Degenerate("no finite covariance of the modes"));
        }
        let model = model(fitted, &order, options);
        let all = order[..count].iter().map(|&j| spread.mode(fitted, j, &lacks[j], options)).collect::<Vec<FrfMode>>();
        let place = |i: usize| 2 * order[i / 2] + i % 2;
        Ok(Self {
            covariance: Mat::from_fn(2 * count, 2 * count, |i, j| spread.poles[(place(i), place(j))]),
            diagram: numbered(diagram, &model.poles[..count]),
            model,
            modes: all,
            frequency_hz: lines.frequency_hz.clone(),
            variance: lines.weight.iter().map(|row| single(row, &lines.merged)).collect(),
            reduced_chi_square: fitted.at.energy() / fitted.at.freedom(lines),
            indicator: seen,
            verdict: fitted.verdict,
            tried: search.tried,
        })
    }
}

/// Variance of single lines.
fn single(weight: &[f64], merged: &[f64]) -> Vec<f64> {
    weight.iter().zip(merged).map(|(w, merged)| 2.0 * merged / w).collect()
}

/// Places of the poles: modes by frequency, then the others.
fn ascending(poles: &[c64], is_mode: &dyn Fn(c64) -> bool) -> Vec<usize> {
    let mut order: Vec<usize> = (0..poles.len()).collect();
    let rank = |i: usize| (!is_mode(poles[i]), poles[i].norm());
    order.sort_by(|&a, &b| rank(a).0.cmp(&rank(b).0).then(rank(a).1.total_cmp(&rank(b).1)));
    order
}

fn model(fitted: &Fitted, order: &[usize], options: &FrfModesOptions) -> FrfModel {
    let rows = 0..fitted.at.solved.len();
    let residues = |r: usize| {
        let own = fitted.at.residues(r);
        order.iter().map(|&j| own[j]).collect()
    };
    let poles: usize = fitted.at.poles.iter().map(|s| width(*s)).sum();
    let rest = |r: usize, wanted: bool, place: usize| {
        if wanted { fitted.at.solved[r].linear.get(poles + place).copied().unwrap_or(0.0) } else { 0.0 }
    };
    FrfModel {
        poles: order.iter().map(|&j| fitted.at.poles[j]).collect(),
        residues: rows.clone().map(residues).collect(),
        lower: rows.clone().map(|r| rest(r, options.lower_residual, 0)).collect(),
        upper: rows.map(|r| rest(r, options.upper_residual, usize::from(options.lower_residual))).collect(),
        quantity: options.quantity,
        added_decay_per_s: options.added_decay_per_s,
    }
}

/// The diagram with its poles numbered by the modes of the fit: stable ones within a half width of the frequency, theirs
/// or the mode's.
fn numbered(diagram: Diagram, poles: &[c64]) -> Stabilisation {
    let Diagram { mut found, poles: own } = diagram;
    for (pole, (_, s)) in found.poles.iter_mut().zip(own) {
        let distance = |j: usize| (s.im - poles[j].im).abs();
        let near = |j: &usize| distance(*j) < poles[*j].re.abs().max(s.re.abs());
        let nearest = (0..poles.len()).filter(near).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        pole.mode = nearest.filter(|_| pole.stable());
    }
    found
}

/// Covariances, widened by what the fit leaves around each mode.
struct Spread {
    /// Of the poles' real parameters.
    poles: Mat<f64>,
    /// Of the poles' real parameters, were errors independent and of the size that weights say.
    inverse: Mat<f64>,
    /// Factor on standard errors of each real parameter.
    wide: Vec<f64>,
    /// Errors that responses share.
    in_common: InCommon,
}

impl Spread {
    fn new(fitted: &Fitted, lacks: &[Lack], in_common: InCommon) -> Self {
        let (information, _) = fitted.at.normal();
        let inverse = symmetric_inverse(&information);
        let n = inverse.nrows();
        let scatter = Scatter::new(&fitted.at, &inverse);
        let plain = &inverse + &inverse * in_common.scores() * &inverse;
        let mut first = 0;
        let mut wide = Vec::with_capacity(n);
        for (s, lack) in fitted.at.poles.iter().zip(lacks) {
            let own = first..first + width(*s);
            first = own.end;
            let factor = scatter.factor(own.clone(), lack.factor());
            wide.extend(vec![factor.sqrt(); own.len()]);
        }
        Self { poles: Mat::from_fn(n, n, |i, j| wide[i] * wide[j] * plain[(i, j)]), wide, inverse, in_common }
    }

    /// Whether a parameter has a finite error.
    fn known(&self, i: usize) -> bool {
        self.poles[(i, i)].is_finite() && self.poles[(i, i)] > 0.0
    }

    /// Change of the residue of pole `j` with the poles' parameters: 2 x parameters.
    fn coupling(&self, fitted: &Fitted, response: usize, j: usize) -> Mat<f64> {
        let k = &fitted.at.solved[response].eliminated.coupling;
        Mat::from_fn(2, self.poles.nrows(), |a, b| -k[(2 * j + a, b)])
    }

    /// Covariance of the residue at given poles.
    fn own(&self, fitted: &Fitted, response: usize, j: usize) -> Mat<f64> {
        let inverse = &fitted.at.solved[response].eliminated.own_inverse;
        let factor = self.wide[2 * j].powi(2);
        Mat::from_fn(2, 2, |a, b| factor * inverse[(2 * j + a, 2 * j + b)])
    }

    /// Covariance of a sum of the residues of pole `j` in two responses, each times a matrix.
    fn sum(&self, fitted: &Fitted, j: usize, parts: [(usize, Mat<f64>); 2]) -> Mat<f64> {
        let n = self.poles.nrows();
        let (mut all, mut moved, mut together) = (Mat::zeros(2, 2), Mat::zeros(2, n), Mat::zeros(2, n));
        for (r, factor) in &parts {
            all += factor * self.own(fitted, *r, j) * factor.transpose();
            moved += factor * self.coupling(fitted, *r, j);
            together += factor * self.in_common.with_scores(*r, j);
        }
        let [(r, first), (s, second)] = &parts;
        let cross = first * self.in_common.residues(*r, *s, j) * second.transpose()
            + together * &self.inverse * moved.transpose();
        all + &moved * &self.poles * moved.transpose() + &cross + cross.transpose()
    }

    fn mode(&self, fitted: &Fitted, j: usize, lack: &Lack, options: &FrfModesOptions) -> FrfMode {
        let count = fitted.at.solved.len();
        let s = fitted.at.poles[j];
        let values: Vec<c64> = (0..count).map(|r| fitted.at.residues(r)[j]).collect();
        let reference = (0..count).max_by(|&a, &b| values[a].norm().total_cmp(&values[b].norm())).unwrap_or(0);
        let residues: Vec<ShapePoint> = (0..count)
            .map(|r| {
                let all = self.sum(fitted, j, [(r, times(c64::new(1.0, 0.0))), (r, Mat::zeros(2, 2))]);
                ShapePoint { value: values[r], covariance: [all[(0, 0)], all[(0, 1)], all[(1, 1)]] }
            })
            .collect();
        let points: Vec<ShapePoint> = (0..count).map(|r| self.relative(fitted, j, &values, r, reference)).collect();
        let shape: Vec<c64> = points.iter().map(|point| point.value).collect();
        // a plain transfer has no mass
        let driving = options.driving_point.filter(|_| options.quantity != FrfQuantity::Transfer);
        // Re(2 i w A)
        let constant = |a: &ShapePoint| Estimate { value: -2.0 * s.im * a.value.im, std: 2.0 * s.im * a.im_std() };
        FrfMode {
            modal_constant: driving.map(|d| constant(&residues[d])),
            estimate: mode(s, &self.poles, 2 * j),
            shape: ModeShape {
                reference,
                points,
                amplitudes: vec![values[reference]],
                rank_one: RankOne { chi_square: 0.0, degrees: 0, p_value: 1.0 },
            },
            residues,
            phase_collinearity: collinearity(&shape),
            mass_normalised: driving.map(|d| self.normalised(fitted, j, &values, d)),
            lack_of_fit: lack.level,
            correlation: lack.correlation,
        }
    }

    /// A residue over that of the reference, by the delta method: `d(A/B) = (dA - A/B dB) / B`.
    fn relative(&self, fitted: &Fitted, j: usize, values: &[c64], r: usize, reference: usize) -> ShapePoint {
        let base = values[reference];
        let value = values[r] / base;
        if r == reference {
            return ShapePoint { value: c64::new(1.0, 0.0), covariance: [0.0; 3] };
        }
        let (over, less) = (times(base.inv()), times(-value / base));
        let all = self.sum(fitted, j, [(r, over), (reference, less)]);
        ShapePoint { value, covariance: [all[(0, 0)], all[(0, 1)], all[(1, 1)]] }
    }

    /// Shape at unit modal mass: `A_r = phi_r phi_d / (2 i w_d)` of a normal mode, `phi_d` positive, whatever the sign
    /// of the modal constant.
    fn normalised(&self, fitted: &Fitted, j: usize, values: &[c64], driving: usize) -> Vec<Estimate> {
        let scale = c64::new(0.0, 2.0 * fitted.at.poles[j].im);
        let sign = if (values[driving] * scale).re < 0.0 { -1.0 } else { 1.0 };
        let own = (values[driving] * scale).re.abs();
        let of = |r: usize| {
            let value = sign * (values[r] * scale).re / own.sqrt();
            // phi_r = a_r / sqrt(a_d): d phi_r = (d a_r - phi_r / (2 phi_d) d a_d) / phi_d; of a_d itself half
            let share = if r == driving { 0.0 } else { -0.5 * value / own.sqrt() };
            let first = if r == driving { 0.5 } else { 1.0 };
            let to = |factor: f64| times(scale * (factor * sign / own.sqrt()));
            let (mine, drive) = (to(first), to(share));
            let all = self.sum(fitted, j, [(r, mine), (driving, drive)]);
            Estimate { value, std: all[(0, 0)].max(0.0).sqrt() }
        };
        (0..values.len()).map(of).collect()
    }
}

/// Multiplication by a complex number, as a matrix on real and imaginary part.
fn times(factor: c64) -> Mat<f64> {
    let rows = [[factor.re, -factor.im], [factor.im, factor.re]];
    Mat::from_fn(2, 2, |i, j| rows[i][j])
}

/// Modal phase collinearity: `((S_xx - S_yy)^2 + 4 S_xy^2) / (S_xx + S_yy)^2`.
///
/// Source: R. S. Pappa, K. B. Elliott, A. Schenk, NASA TM 107607 (1992).
fn collinearity(shape: &[c64]) -> f64 {
    let sum = |of: fn(&c64) -> f64| shape.iter().map(of).sum::<f64>();
    let (xx, yy, xy) = (sum(|z| z.re * z.re), sum(|z| z.im * z.im), sum(|z| z.re * z.im));
    ((xx - yy).powi(2) + 4.0 * xy * xy) / (xx + yy).powi(2).max(f64::MIN_POSITIVE)
}
