//! The law by which reference and output make the drive.

use std::ops::Range;

use super::blocks::{BlockedRegression, jackknife};
use super::data::{ClosedLoop, NotClosedLoop, deviation};

/// Blocks that are held out in turn: enough for a standard error of a fifth of itself.
const BLOCKS: usize = 16;
/// Most lags of reference, output and drive that are tried: a controller of second order with a delay of one sample.
const MOST: [usize; 3] = [3, 4, 2];
/// A structure is as good as the best up to this ratio of residuals.
const AS_GOOD: f64 = 1.1;
/// Share of the drive that is rounding wherever it was computed: single precision.
const ROUNDING: f64 = 1e-6;
/// Largest share of the drive's deviation that the law may leave; noise of the measured drive is rarely more.
const LEFT: f64 = 0.05;
/// How many times worse the drive is predicted without reference or output, where both make it. A channel that does not
/// make it changes nothing (1.0); noise of a hundredth on the measured drive leaves less than ten.
const NEEDED: f64 = 3.0;
/// How many times better the law is to be than past drives: the mean of two past ones predicts a drive that is measured
/// with white noise to 1.22 times that noise.
const BETTER_THAN_PAST: f64 = 1.2;
/// Standard errors beyond which an extra channel is part of the drive: one chance in a thousand with 15 degrees.
const SIGNIFICANT: f64 = 4.0;
/// Columns: reference and its differences, output and its, past drive and its, constant, extra channel.
const OUTPUT: usize = MOST[0];
const PAST: usize = OUTPUT + MOST[1];
const CONSTANT: usize = PAST + MOST[2];
const EXTRA: usize = CONSTANT + 1;
/// First sample with all lags.
const LAGS: usize = 3;

/// A number with its standard error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Coefficient {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub std: f64,
}

/// `u_k = sum_i reference_i r_(k-i) + sum_j output_j y_(k-j) + sum_l past_l u_(k-1-l) + extra p_k + constant`, clipped.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// On the reference, lag 0 first.
    pub reference: Vec<Coefficient>,
    /// On the output, lag 0 first.
    pub output: Vec<Coefficient>,
    /// On the drive, lag 1 first.
    pub past: Vec<Coefficient>,
    /// On the extra channel, where it is added to the drive.
    pub extra: Option<Coefficient>,
    /// Constant.
    pub constant: Coefficient,
    /// Least and largest drive, where the record shows them.
    pub limits: (Option<f64>, Option<f64>),
    /// Held-out residual over the drive's deviation.
    pub residual_share: f64,
    /// How many times worse the drive is predicted without the reference, and without the output.
    pub worse_without: (f64, f64),
    /// `sum reference + sum output` and its standard error: 0 where the law sees their difference at rest.
    pub at_rest: Coefficient,
}

impl Controller {
    /// Lags that have to be known before the first simulated sample.
    pub(super) fn lags(&self) -> usize {
        LAGS
    }

    /// Drive of sample k from the past.
    pub(super) fn drive(&self, k: usize, r: &[f64], y: &[f64], u: &[f64], p: Option<&[f64]>) -> f64 {
        let sum = |c: &[Coefficient], x: &[f64], first: usize| -> f64 {
            let at = |i: usize| k.checked_sub(first + i).and_then(|k| x.get(k)).copied().unwrap_or(0.0);
            c.iter().enumerate().map(|(i, c)| c.value * at(i)).sum()
        };
        let extra = self.extra.zip(p).and_then(|(c, p)| Some(c.value * p.get(k)?)).unwrap_or(0.0);
        let all = sum(&self.reference, r, 0) + sum(&self.output, y, 0) + sum(&self.past, u, 1);
        self.clipped(all + extra + self.constant.value)
    }

    fn clipped(&self, u: f64) -> f64 {
        let u = self.limits.0.map_or(u, |least| u.max(least));
        self.limits.1.map_or(u, |most| u.min(most))
    }
}

/// Identifies the controller. Errors: the drive is no function of both reference and output.
pub(super) fn identify(measured: &ClosedLoop<'_>, training: &Range<usize>) -> Result<Controller, NotClosedLoop> {
    let limits = limits(measured.drive, training);
    let limited = fit(measured, training, limits);
    let true_limits = limited.as_ref().map_or((None, None), |law| beyond(law, measured, training));
    if true_limits == limits { limited } else { fit(measured, training, true_limits) }
}

/// Extremes of the drive, which may be its limits.
fn limits(drive: &[f64], training: &Range<usize>) -> (Option<f64>, Option<f64>) {
    let used = drive.get(training.clone()).unwrap_or_default();
    let least = used.iter().copied().fold(f64::INFINITY, f64::min);
    let most = used.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let near = 1e-9 * (most - least);
    let stays = |limit: f64| {
        let count = used.iter().filter(|&&u| (u - limit).abs() <= near).count();
        // a drive that is at its extremes most of the time is a relay, not a law with limits
        (2 * count < used.len()).then_some(limit)
    };
    (stays(least), stays(most))
}

fn at_limit(u: f64, limits: (Option<f64>, Option<f64>)) -> bool {
    let near = 1e-9 * u.abs();
    limits.0.is_some_and(|least| u <= least + near) || limits.1.is_some_and(|most| u >= most - near)
}

/// The limits beyond which the law leads where the drive is at them; the peak of a smooth drive is the law's own.
fn beyond(law: &Controller, measured: &ClosedLoop<'_>, training: &Range<usize>) -> (Option<f64>, Option<f64>) {
    let clear = (3.0 * law.residual_share + ROUNDING) * deviation(measured.drive);
    let free = Controller { limits: (None, None), ..law.clone() };
    let extra = measured.extra.map(|(_, p)| p);
    let side = |limit: Option<f64>, only: (Option<f64>, Option<f64>), sign: f64| {
        let at: Vec<usize> =
            (training.start.max(LAGS)..training.end).filter(|&k| at_limit(measured.drive[k], only)).collect();
        let leads = |&&k: &&usize| {
            let drive = free.drive(k, measured.reference, measured.output, measured.drive, extra);
            sign * (drive - measured.drive[k]) > clear
        };
        limit.filter(|_| 2 * at.iter().filter(leads).count() > at.len())
    };
    let (least, most) = law.limits;
    (side(least, (least, None), -1.0), side(most, (None, most), 1.0))
}

fn differences(x: &[f64], rows: &Range<usize>, first: usize, count: usize) -> Vec<Vec<f64>> {
    let binomial = [[1.0, 0.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0], [1.0, -2.0, 1.0, 0.0], [1.0, -3.0, 3.0, -1.0]];
    let row = |d: usize, k: usize| (0..=d).map(|i| binomial[d][i] * x[k - first - i]).sum();
    (0..count).map(|d| rows.clone().map(|k| row(d, k)).collect()).collect()
}

/// Coefficients of lags from those of differences.
fn lags(differences: &[f64]) -> Vec<f64> {
    let binomial = [[1.0, 0.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0], [1.0, -2.0, 1.0, 0.0], [1.0, -3.0, 3.0, -1.0]];
    let one = |i: usize| differences.iter().zip(binomial).map(|(b, row)| b * row[i]).sum();
    (0..differences.len()).map(one).collect()
}

/// Columns of a structure.
fn places([nr, ny, nu]: [usize; 3], extra: bool) -> Vec<usize> {
    let past = PAST..PAST + nu;
    (0..nr).chain(OUTPUT..OUTPUT + ny).chain(past).chain([CONSTANT]).chain(extra.then_some(EXTRA)).collect()
}

fn fit(
    measured: &ClosedLoop<'_>,
    training: &Range<usize>,
    limits: (Option<f64>, Option<f64>),
) -> Result<Controller, NotClosedLoop> {
    let rows = training.start.max(LAGS)..training.end;
    let (r, y, u) = (measured.reference, measured.output, measured.drive);
    let mut columns = differences(r, &rows, 0, MOST[0]);
    columns.extend(differences(y, &rows, 0, MOST[1]));
    columns.extend(differences(u, &rows, 1, MOST[2]));
    columns.push(vec![1.0; rows.len()]);
    let extra = measured.extra.map(|(_, p)| p[rows.clone()].to_vec()).filter(|p| deviation(p) > 0.0);
    let with_extra = extra.is_some();
    columns.extend(extra);
    let target = &u[rows.clone()];
    // a drive at its limit is not the law's, nor is it the past drive that the law remembers
    let keep: Vec<bool> = rows.clone().map(|k| u[k - MOST[2]..=k].iter().all(|&u| !at_limit(u, limits))).collect();
    let kept: Vec<f64> = target.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(u, _)| *u).collect();
    let spread = deviation(&kept) * (kept.len() as f64).sqrt();
    if spread <= 0.0 {
        return Err(NotClosedLoop::Constant { name: "the drive" });
    }
    let blocked = BlockedRegression::new(&columns, target, &keep, BLOCKS);
    let left = |which: &[usize]| blocked.solve(which, None).squares.sqrt() + ROUNDING * spread;

    let structure = smallest(with_extra, left);
    let mut which = places(structure, with_extra);
    let mut left_out = leave_out(&blocked, &which);
    if with_extra {
        let (last, std) = (which.len() - 1, jackknife(&left_out));
        let value = blocked.solve(&which, None).coefficients[last];
        if value.abs() < SIGNIFICANT * std[last] {
            which.pop();
            left_out = leave_out(&blocked, &which);
        }
    }
    let added = which.contains(&EXTRA);
    let share = blocked.held_out(&which).sqrt() / spread;
    // NaN is no law either
    if share.is_nan() || share > LEFT {
        return Err(NotClosedLoop::NoLaw { share, wanted: LEFT });
    }
    let nu = structure[2];
    let law = left(&which);
    let without = |keeps: [usize; 3]| left(&places(keeps, added)) / law;
    let (no_reference, no_output) = (without([0, MOST[1], nu]), without([MOST[0], 0, nu]));
    let past = blocked.solve(&places([0, 0, MOST[2]], added), None).squares.sqrt() / law;
    for (name, ratio, wanted) in [
        ("the reference", no_reference, NEEDED),
        ("the output", no_output, NEEDED),
        ("reference and output", past, BETTER_THAN_PAST),
    ] {
        if ratio < wanted {
            return Err(NotClosedLoop::Independent { name, ratio, wanted });
        }
    }
    let mut law = assembled(&blocked.solve(&which, None).coefficients, &left_out, structure, added);
    (law.limits, law.residual_share, law.worse_without) = (limits, share, (no_reference, no_output));
    Ok(law)
}

/// The structure with the fewest lags that is as good as the best.
fn smallest(extra: bool, left: impl Fn(&[usize]) -> f64) -> [usize; 3] {
    let mut tried: Vec<([usize; 3], f64)> = Vec::new();
    for nr in 1..=MOST[0] {
        for ny in 1..=MOST[1] {
            for nu in 0..=MOST[2] {
                tried.push(([nr, ny, nu], left(&places([nr, ny, nu], extra))));
            }
        }
    }
    let best = tried.iter().map(|(_, left)| *left).fold(f64::INFINITY, f64::min);
    let good = tried.into_iter().filter(|(_, left)| *left <= AS_GOOD * best);
    let order = |a: &([usize; 3], f64), b: &([usize; 3], f64)| {
        a.0.iter().sum::<usize>().cmp(&b.0.iter().sum()).then(a.1.total_cmp(&b.1))
    };
    good.min_by(order).map_or([1, 3, 0], |(structure, _)| structure)
}

fn leave_out(blocked: &BlockedRegression, which: &[usize]) -> Vec<Vec<f64>> {
    (0..blocked.blocks()).map(|b| blocked.solve(which, Some(b)).coefficients).collect()
}

fn assembled(values: &[f64], left_out: &[Vec<f64>], [nr, ny, nu]: [usize; 3], extra: bool) -> Controller {
    let by_lags = |x: &[f64]| -> Vec<f64> {
        let parts = [lags(&x[..nr]), lags(&x[nr..nr + ny]), lags(&x[nr + ny..nr + ny + nu])];
        let rest: f64 = parts[0].iter().chain(&parts[1]).sum();
        parts.into_iter().flatten().chain(x[nr + ny + nu..].iter().copied()).chain([rest]).collect()
    };
    let std = jackknife(&left_out.iter().map(|x| by_lags(x)).collect::<Vec<_>>());
    let all: Vec<Coefficient> =
        by_lags(values).into_iter().zip(std).map(|(value, std)| Coefficient { value, std }).collect();
    let end = nr + ny + nu;
    Controller {
        reference: all[..nr].to_vec(),
        output: all[nr..nr + ny].to_vec(),
        past: all[nr + ny..end].to_vec(),
        constant: all[end],
        extra: extra.then(|| all[end + 1]),
        at_rest: all[all.len() - 1],
        limits: (None, None),
        residual_share: 0.0,
        worse_without: (0.0, 0.0),
    }
}
