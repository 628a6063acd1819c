//! What the input does between its samples, chosen by the data.

use rayon::prelude::*;

use super::columns::{Series, visit};
use super::evaluation::{Evaluation, Problem};
use super::fit::mask_for;
use super::fractions::Fractions;
use super::options::GreyOptions;
use super::point::Point;
use super::search::{Found, search};
use crate::effects::Intersample;
use crate::model::ModelError;
use crate::pem::{largest_order, least_bic, levinson};

/// Twice the difference of log likelihood above which two inputs between samples are distinguishable: the 95 % point of
/// chi-square with one degree of freedom.
///
/// Two models of equally many parameters whose responses differ by d standard errors: the wrong one's advantage is
/// normal with mean `-d^2` and standard deviation `2 d`, so that it exceeds c with probability `Q((c + d^2) / 2d)`, at
/// most `Q(sqrt c)` = 2.5 %, whatever d.
pub const DISTINGUISHABLE: f64 = 3.841_459;

/// One kind of input between samples, fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntersampleFit {
    /// The kind.
    pub kind: Intersample,
    /// Twice its log likelihood over that of the held input; NaN where no fit was found.
    pub advantage: f64,
}

/// How the input between samples was chosen.
///
/// # Model
/// Held, linear and band-limited input have equally many parameters: log likelihoods are compared as they are, of the
/// same samples (those that count for all three). The noise is Gaussian and autoregressive, its order the one with the
/// least BIC for the held input's residual; order 0 is white noise.
/// # Method
/// Each is fitted by least squares from the held input's minimum; where the delay is estimated, linear and band-limited
/// input begin half a sample later, which is what holding delays. `2 ln L = -N ln(variance of the innovations)`.
/// # Accuracy
/// Where the modes and the noise model hold, a wrong kind is called distinguishable in at most 2.5 % of cases for each
/// that is wrong ([`DISTINGUISHABLE`]), and one that is taken instead of a true held input in as few. Where held is out
/// of the question and linear and band-limited are not distinguishable, the likelier is taken: up to half of the time the
/// wrong one of these two, whose responses then differ by less than the noise lets see. What the modes cannot follow
/// counts as noise: see the whiteness of the residual.
/// # Source
/// L. Ljung, System Identification (1999), section 16.4; Q. H. Vuong, Econometrica 57 (1989) 307 (models that do not
/// contain each other).
#[derive(Debug, Clone, PartialEq)]
pub struct IntersampleChoice {
    /// Held, linear, band-limited.
    pub fits: Vec<IntersampleFit>,
    /// The one that the model is fitted with: the likeliest, unless its advantage over held is less than
    /// [`DISTINGUISHABLE`].
    pub chosen: Intersample,
    /// Twice the log likelihood of the likeliest over that of the next; NaN where no other has a fit.
    pub lead: f64,
    /// Order of the noise model.
    pub noise_order: usize,
    /// Samples that are compared.
    pub samples: usize,
}

impl IntersampleChoice {
    /// The likeliest.
    pub fn likeliest(&self) -> Intersample {
        let known = self.fits.iter().filter(|fit| fit.advantage.is_finite());
        known.max_by(|a, b| a.advantage.total_cmp(&b.advantage)).map_or(Intersample::Held, |fit| fit.kind)
    }

    /// Whether the likeliest is distinguishable from the next.
    pub fn distinguishable(&self) -> bool {
        self.lead >= DISTINGUISHABLE
    }
}

/// Fits with each kind from the held input's minimum; and where to go on, if another is chosen. Errors: the held input
/// cannot be evaluated on the samples that all have.
pub(super) fn choose(
    problem: &Problem<'_>,
    options: &GreyOptions,
    held: &Found,
) -> Result<(IntersampleChoice, Option<Point>), ModelError> {
    let delay = held.best.point.delay;
    let kinds = [Intersample::Held, Intersample::Linear, Intersample::BandLimited];
    let fitted: Vec<Option<(Vec<Vec<f64>>, Point)>> = kinds
        .into_par_iter()
        .map(|kind| {
            let mut own =
                Problem { series: problem.series.clone(), rules: problem.rules.clone(), between: kind, ..*problem };
            mask_for(&mut own, options, Some(delay + 2.0), Intersample::BandLimited);
            let found = fitted(&own, options, &held.best.point)?;
            Some((residuals(&own, &found), found.point))
        })
        .collect();
    let n = samples(problem, options, delay);
    let covariances: Vec<Option<Vec<f64>>> =
        fitted.iter().map(|fit| fit.as_ref().map(|(e, _)| autocovariance(e, largest_order(n)))).collect();
    let none = || ModelError::Degenerate("no finite fit of the samples that all inputs between samples have");
    let order = least_bic(levinson(covariances[0].as_ref().ok_or_else(none)?), n).coefficients.len();
    // noise-free data: rounding is left
    let log = |covariance: &Vec<f64>| {
        let variance = levinson(covariance).get(order).map_or(0.0, |own| own.variance);
        -(n as f64) * variance.max(f64::MIN_POSITIVE).ln()
    };
    let logs: Vec<f64> = covariances.iter().map(|own| own.as_ref().map_or(f64::NAN, log)).collect();
    let fits: Vec<IntersampleFit> =
        kinds.iter().zip(&logs).map(|(&kind, log)| IntersampleFit { kind, advantage: log - logs[0] }).collect();
    let mut choice =
        IntersampleChoice { fits, chosen: Intersample::Held, lead: f64::NAN, noise_order: order, samples: n };
    let mut ranked: Vec<f64> = logs.iter().copied().filter(|log| log.is_finite()).collect();
    ranked.sort_by(|a, b| b.total_cmp(a));
    choice.lead = match ranked[..] {
        [first, second, ..] => first - second,
        _ => f64::NAN,
    };
    let likeliest = kinds.iter().position(|kind| *kind == choice.likeliest()).unwrap_or(0);
    if likeliest == 0 || choice.fits[likeliest].advantage < DISTINGUISHABLE {
        return Ok((choice, None));
    }
    choice.chosen = kinds[likeliest];
    let point = fitted.into_iter().nth(likeliest).flatten().map(|(_, point)| point);
    Ok((choice, point))
}

/// The minimum for the problem's input between samples, from the held input's; none where there is no finite one.
fn fitted(problem: &Problem<'_>, options: &GreyOptions, held: &Point) -> Option<Evaluation> {
    let estimated = problem.rules.free.contains(&(problem.rules.scale.len() - 1));
    let later = if estimated && problem.between != Intersample::Held { 0.5 } else { 0.0 };
    let start = problem.rules.obeyed(&Point { delay: held.delay + later, ..held.clone() }, &options.known);
    let start = problem.evaluate(&start, 0.0).ok()?;
    let variance = problem.variance(&start);
    let start = problem.evaluate(&start.point, variance).ok()?;
    let found = search(problem, start, variance, options.max_iterations).ok()?;
    Some(found.best)
}

/// Samples that count for all kinds.
fn samples(problem: &Problem<'_>, options: &GreyOptions, delay: f64) -> usize {
    let mut own = Problem { series: problem.series.clone(), rules: problem.rules.clone(), ..*problem };
    mask_for(&mut own, options, Some(delay + 2.0), Intersample::BandLimited);
    own.present()
}

/// What is left of each experiment; NaN where a sample does not count.
fn residuals(problem: &Problem<'_>, at: &Evaluation) -> Vec<Vec<f64>> {
    let fractions = Fractions::of(&at.point);
    let own = |(e, series): (usize, &Series<'_>)| {
        let (columns, _) = problem.jacobian(at, &fractions, &[], e);
        let weights = columns.last().map_or(&[][..], Vec::as_slice);
        let mut left = vec![f64::NAN; series.output.len()];
        visit(series, problem.layout, &fractions, at.point.delay, problem.between, |first, block| {
            for row in (0..block.nrows()).filter(|row| series.counts(first + row)) {
                left[first + row] = weights.iter().enumerate().map(|(j, w)| w * block[(row, j)]).sum();
            }
        });
        left
    };
    problem.series.iter().enumerate().map(own).collect()
}

/// At lags 0 to `most`, within experiments, zero where a sample does not count: a positive definite sequence.
fn autocovariance(residuals: &[Vec<f64>], most: usize) -> Vec<f64> {
    let product = |x: &f64, y: &f64| if x.is_nan() || y.is_nan() { 0.0 } else { x * y };
    let at = |lag: usize| {
        let own = |e: &Vec<f64>| e.iter().zip(e.iter().skip(lag)).map(|(x, y)| product(x, y)).sum::<f64>();
        residuals.iter().map(own).sum()
    };
    (0..=most).map(at).collect()
}
