//! The points that a fit uses, and weighted least squares over them.

use crate::linear_algebra::{NoConvergence, Qr, least_squares};
use faer::{Mat, c64};

use super::MeasuredResponse;
use super::basis::Poles;
use crate::model::{InnovationsModel, InputGains, ModelError, Section, section_order, sections_of_roots};

/// What is fitted: points on the unit circle with their weights.
pub(super) struct Points {
    pub z: Vec<c64>,
    pub g: Vec<c64>,
    /// One over the standard error of real and imaginary part.
    pub weight: Vec<f64>,
    /// `exp(i w delay)` where a transient is fitted.
    pub turn: Option<Vec<c64>>,
    pub sample_time_s: f64,
}

impl Points {
    /// The points that are defined. Errors: lengths, a frequency outside 0 to half the sample rate.
    pub fn new(
        response: MeasuredResponse<'_>,
        sample_time_s: f64,
        transient_delay_s: Option<f64>,
    ) -> Result<Self, ModelError> {
        let MeasuredResponse { frequency_hz, transfer, variance } = response;
        let wanted = transfer.len();
        for (what, found) in [("frequency", frequency_hz.len()), ("variance", variance.map_or(wanted, <[f64]>::len))] {
            if found != wanted {
                return Err(ModelError::Length { what, found, wanted });
            }
        }
        let turn = |f: f64| std::f64::consts::TAU * f * sample_time_s;
        // half the sample rate, and rounding
        let beyond = |f: &&f64| !(0.0..=0.5 + 1e-9).contains(&(**f * sample_time_s));
        if let Some(&found) = frequency_hz.iter().find(beyond) {
            return Err(ModelError::Parameter { name: "a frequency", found, wanted: "0 to half the sample rate" });
        }
        let known = |k: &usize| transfer[*k].is_finite() && variance.is_none_or(|v| v[*k].is_finite());
        let kept: Vec<usize> = (0..wanted).filter(known).collect();
        let positive = variance.filter(|v| kept.iter().all(|&k| v[k] > 0.0));
        let pick = |value: &dyn Fn(usize) -> c64| kept.iter().map(|&k| value(k)).collect::<Vec<c64>>();
        Ok(Self {
            z: pick(&|k| c64::cis(turn(frequency_hz[k]))),
            g: pick(&|k| transfer[k]),
            // E|e|^2 = v: half of it in either part
            weight: kept.iter().map(|&k| positive.map_or(1.0, |v| (2.0 / v[k]).sqrt())).collect(),
            turn: transient_delay_s.map(|delay| pick(&|k| c64::cis(std::f64::consts::TAU * frequency_hz[k] * delay))),
            sample_time_s,
        })
    }

    pub fn len(&self) -> usize {
        self.z.len()
    }

    /// Free real coefficients of a fit of order n.
    pub fn coefficients(&self, n: usize) -> usize {
        2 * n + 1 + if self.turn.is_some() { n + 1 } else { 0 }
    }

    /// Rows of a real problem: each point's columns, times its weight, real and imaginary parts below each other; then
    /// `extra` rows of zeros.
    pub fn rows(&self, columns: usize, extra: usize, of: impl Fn(usize) -> Vec<c64>) -> Mat<f64> {
        let count = self.len();
        let mut matrix = Mat::zeros(2 * count + extra, columns);
        for k in 0..count {
            for (j, value) in of(k).into_iter().enumerate() {
                matrix[(k, j)] = self.weight[k] * value.re;
                matrix[(count + k, j)] = self.weight[k] * value.im;
            }
        }
        matrix
    }
}

/// Solution of a least-squares problem whose last column is the right-hand side; columns are scaled first. Errors: no
/// finite solution.
pub(super) fn solved(mut stacked: Mat<f64>) -> Result<Vec<f64>, ModelError> {
    let p = stacked.ncols() - 1;
    let scale: Vec<f64> =
        (0..p).map(|j| stacked.col(j).norm_l2()).map(|norm| if norm > 0.0 { norm } else { 1.0 }).collect();
    (0..p).for_each(|j| stacked.col_mut(j).iter_mut().for_each(|value| *value /= scale[j]));
    let r = Qr::new(stacked).r();
    let size = p.min(r.nrows());
    let part = |from: usize, to: usize| r.as_ref().get(..size, from..to).to_owned();
    let x = least_squares(&part(0, p), &part(p, p + 1), f64::EPSILON)?;
    let x: Vec<f64> = (0..p).map(|j| x[(j, 0)] / scale[j]).collect();
    if x.iter().any(|value| !value.is_finite()) {
        return Err(NoConvergence("least squares of the response").into());
    }
    Ok(x)
}

/// A model with its transient.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub model: InnovationsModel,
    pub transient: Option<InputGains>,
}

impl Fitted {
    /// The model whose parameters are `theta`: all a, all b, D; then b and D of the transient.
    pub fn new(order: usize, theta: &[f64], sample_time_s: f64) -> Self {
        let pair = |from: usize, i: usize| {
            [theta[from + 2 * i], if section_order(order, i) == 2 { theta[from + 2 * i + 1] } else { 0.0 }]
        };
        let count = order.div_ceil(2);
        let section =
            |i: usize| Section { order: section_order(order, i), a: pair(0, i), b: pair(order, i), k: [0.0; 2] };
        let sections = (0..count).map(section).collect();
        let model = InnovationsModel { sections, feedthrough: theta[2 * order], sample_time_s };
        let from = 2 * order + 1;
        let transient = (theta.len() > from)
            .then(|| InputGains { b: (0..count).map(|i| pair(from, i)).collect(), feedthrough: theta[from + order] });
        Self { model, transient }
    }

    /// Its parameters, as in [`Fitted::new`].
    pub fn theta(&self) -> Vec<f64> {
        let mut theta = self.model.parameters();
        if let Some(gains) = &self.transient {
            let own = self.model.sections.iter().zip(&gains.b);
            theta.extend(own.flat_map(|(section, b)| b[..section.order].to_vec()));
            theta.push(gains.feedthrough);
        }
        theta
    }

    /// The transient's transfer function as a model.
    pub fn transient_model(&self) -> Result<Option<InnovationsModel>, ModelError> {
        self.transient.as_ref().map(|gains| self.model.from_input(gains)).transpose()
    }
}

/// The closest model of these poles. Errors: no finite one.
pub(super) fn residues(points: &Points, poles: &Poles) -> Result<Fitted, ModelError> {
    let all = poles.all();
    let (order, a) = (all.len(), sections_of_roots(&all));
    let a: Vec<f64> = a.iter().enumerate().flat_map(|(i, a)| a[..section_order(order, i)].to_vec()).collect();
    with_sections(points, &a)
}

/// The closest model of these section coefficients, order many. Errors: no finite one.
pub(super) fn with_sections(points: &Points, a: &[f64]) -> Result<Fitted, ModelError> {
    let order = a.len();
    let mut theta = a.to_vec();
    theta.resize(2 * order + 1, 0.0);
    let sections = Fitted::new(order, &theta, points.sample_time_s).model;
    let columns = points.coefficients(order) - order;
    let stacked = points.rows(columns + 1, 0, |k| {
        let mut row = sections.transfer_sensitivities(points.z[k]).split_off(order);
        if let Some(turn) = &points.turn {
            row.extend(row.clone().into_iter().map(|value| value * turn[k]));
        }
        row.push(points.g[k]);
        row
    });
    theta.truncate(order);
    theta.extend(solved(stacked)?);
    Ok(Fitted::new(order, &theta, points.sample_time_s))
}
