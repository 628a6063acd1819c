//! The free level against the piezo's position: crosstalk and fringes.

use super::basis::{Basis, dot, legendre, norm, span};
use super::fringe::{FringeFit, fit_fringe};
use super::replicates::{mean_and_error, student_two_sided, t_test};
use super::segments::SegmentKind;
use super::sign::{Abstention, RecordSign, gain, value};
use super::slow_lines::SlowLine;
use super::summary::RecordSummary;
use super::yardstick::of_many;
use crate::diagnosis::RunnerUp;

/// Fewest records: replicates for a t test.
const FEWEST_RECORDS: usize = 4;
/// Highest degree in the position that is asked for.
const HIGHEST_DEGREE: usize = 5;
/// A slope can be told from a drift in time if these leave at least this share of the position's variance.
const LEAST_CONTRAST: f64 = 0.02;
/// Wavelengths of the lasers and diodes in use, m: a fringe's natural rival to a straight line.
const LIGHT_M: (f64, f64) = (6.0e-7, 9.0e-7);

/// The free stretches of one record.
pub(super) struct FreeRecord {
    /// Piezo position, m.
    pub position_m: Vec<f64>,
    /// Deflection, V, less what the nuisances explain.
    pub left_v: Vec<f64>,
    /// An offset for each stretch, a drift in time and the slow lines found.
    pub nuisance: Basis,
    stretches: Vec<Range>,
    /// Share of the position's variance that the nuisances leave.
    contrast: f64,
}

/// Where a stretch lies in the record's columns, and what it is.
struct Range {
    kind: SegmentKind,
    start: usize,
    end: usize,
}

impl FreeRecord {
    fn new(record: &RecordSummary, known_hz: &[f64]) -> Option<Self> {
        let (mut position_m, mut deflection, mut time, mut stretches) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for segment in record.segments.iter().filter(|segment| segment.kind != SegmentKind::Contact) {
            let start = position_m.len();
            position_m.extend_from_slice(segment.piezo.as_ref()?);
            deflection.extend_from_slice(&segment.values);
            time.extend((0..segment.values.len()).map(|k| (segment.first + k) as f64 * record.block_s));
            stretches.push(Range { kind: segment.kind, start, end: position_m.len() });
        }
        let mut nuisance = Basis::default();
        for stretch in &stretches {
            let inside = |k: usize| f64::from(u8::from((stretch.start..stretch.end).contains(&k)));
            nuisance.push((0..time.len()).map(inside).collect());
        }
        let spread = norm(&nuisance.residual(&position_m));
        nuisance.push(time.clone());
        let contrast = (norm(&nuisance.residual(&position_m)) / spread).powi(2);
        for f in known_hz {
            let phase = |t: &f64| (std::f64::consts::TAU * f * t).sin_cos();
            nuisance.push(time.iter().map(|t| phase(t).0).collect());
            nuisance.push(time.iter().map(|t| phase(t).1).collect());
        }
        let left_v = nuisance.residual(&deflection);
        (contrast.is_finite() && left_v.len() > 24).then_some(Self {
            position_m,
            left_v,
            nuisance,
            stretches,
            contrast,
        })
    }

    /// Least-squares weight of `shape`, less what the nuisances and `lower` shapes explain.
    fn weight(&self, shape: &[f64], lower: &[Vec<f64>]) -> Option<f64> {
        let mut basis = self.nuisance.clone();
        for column in lower {
            basis.push(column.clone());
        }
        let alone = basis.residual(shape);
        let size = dot(&alone, &alone);
        (size > 1e-8 * dot(shape, shape)).then(|| dot(&alone, &self.left_v) / size)
    }

    /// Slope of the stretches of one kind, V/m; the mean where there are several.
    fn slope(&self, kind: SegmentKind) -> Option<f64> {
        let (mut xy, mut xx) = (0.0, 0.0);
        for stretch in self.stretches.iter().filter(|stretch| stretch.kind == kind) {
            let z = &self.position_m[stretch.start..stretch.end];
            let mean = z.iter().sum::<f64>() / z.len() as f64;
            let z: Vec<f64> = z.iter().map(|z| z - mean).collect();
            xy += dot(&z, &self.left_v[stretch.start..stretch.end]);
            xx += dot(&z, &z);
        }
        (xx > 0.0).then(|| xy / xx)
    }
}

fn free_records(records: &[RecordSummary], slow: &[SlowLine]) -> Vec<FreeRecord> {
    let known: Vec<f64> = slow.iter().map(|line| line.frequency_hz.0).collect();
    records.iter().filter_map(|record| FreeRecord::new(record, &known)).collect()
}

/// Why position can't be judged.
pub(super) fn cannot_judge(records: &[RecordSummary]) -> Vec<Abstention> {
    let free = free_records(records, &[]);
    let both = |reason: String| {
        ["piezo-crosstalk", "interference-fringe"].map(|id| Abstention { id, reason: reason.clone() }).to_vec()
    };
    if free.len() < FEWEST_RECORDS {
        return both(format!(
            "{} records have a free stretch and a piezo channel; wanted at least {FEWEST_RECORDS}, for the scatter between them",
            free.len()
        ));
    }
    if free.iter().filter(|record| record.contrast >= LEAST_CONTRAST).count() < FEWEST_RECORDS {
        let reason = "the free stretches run one way: a slope against position is one against time; wanted the free lever on the way in and out";
        return vec![Abstention { id: "piezo-crosstalk", reason: reason.to_owned() }];
    }
    Vec::new()
}

/// Crosstalk or fringe, if the free level depends on the position.
///
/// # Method
/// Per record the free level, less an offset for each stretch, a drift in time and the slow lines, on Legendre polynomials of the position; t tests
/// over records. A bend (degrees 2 to 5) is a fringe's; a slope without one is crosstalk's, if it is the same before contact and after the rupture.
/// A fringe of common light that fits the held-out records as well as the straight line is a tie, and said to be one.
pub(super) fn judge_position(records: &[RecordSummary], slow: &[SlowLine], false_alarm_rate: f64) -> Vec<RecordSign> {
    let free = free_records(records, slow);
    if free.len() < FEWEST_RECORDS {
        return Vec::new();
    }
    let track = free.iter().map(|record| span(&record.position_m));
    let common = track.fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let degrees: Vec<f64> = (2..=HIGHEST_DEGREE).map(|degree| bend_p(&free, common, degree)).collect();
    let bend = of_many(degrees.iter().copied().fold(1.0, f64::min), degrees.len());
    // each of the two causes gets half of the channel's rate
    let p_bend = (2.0 * bend).min(1.0);
    let slopes: Vec<f64> = free
        .iter()
        .filter(|record| record.contrast >= LEAST_CONTRAST)
        .filter_map(|record| record.weight(&record.position_m, &[]))
        .collect();
    let p_slope = if slopes.len() < FEWEST_RECORDS { 1.0 } else { (2.0 * t_test(&slopes)).min(1.0) };
    if p_bend < false_alarm_rate {
        let Some(fit) = fit_fringe(&free, None) else { return Vec::new() };
        return vec![fringe_sign(&free, &fit, p_bend)];
    }
    if p_slope < false_alarm_rate {
        return crosstalk_sign(&free, &slopes, p_slope).into_iter().collect();
    }
    Vec::new()
}

fn bend_p(free: &[FreeRecord], common: (f64, f64), degree: usize) -> f64 {
    let weight = |record: &FreeRecord| {
        let lower: Vec<Vec<f64>> = (1..degree).map(|d| legendre(&record.position_m, common, d)).collect();
        record.weight(&legendre(&record.position_m, common, degree), &lower)
    };
    t_test(&free.iter().filter_map(weight).collect::<Vec<_>>())
}

/// Sums of squares of every record, without a shape and with the one that the records of the other parity show.
fn held_out(free: &[FreeRecord], shape: impl Fn(usize, &FreeRecord) -> Option<Vec<f64>>) -> Vec<(f64, f64)> {
    let one = |(k, record): (usize, &FreeRecord)| {
        let shape = record.nuisance.residual(&shape(k % 2, record)?);
        let left: Vec<f64> = record.left_v.iter().zip(&shape).map(|(v, s)| v - s).collect();
        Some((dot(&record.left_v, &record.left_v), dot(&left, &left)))
    };
    free.iter().enumerate().filter_map(one).collect()
}

fn rms(free: &[FreeRecord], sums: &[(f64, f64)]) -> (f64, f64) {
    let n: usize = free.iter().map(|record| record.left_v.len()).sum();
    let total = |pick: fn(&(f64, f64)) -> f64| (sums.iter().map(pick).sum::<f64>() / n as f64).sqrt();
    (total(|s| s.0), total(|s| s.1))
}

fn straight_held_out(free: &[FreeRecord]) -> Vec<(f64, f64)> {
    let slope = [0, 1].map(|parity| {
        let others = free.iter().enumerate().filter(|(k, _)| k % 2 != parity);
        let slopes: Vec<f64> = others.filter_map(|(_, record)| record.weight(&record.position_m, &[])).collect();
        mean_and_error(&slopes).0
    });
    held_out(free, |parity, record| Some(record.position_m.iter().map(|z| slope[parity] * z).collect()))
}

fn fringe_held_out(free: &[FreeRecord], light: Option<(f64, f64)>) -> Vec<(f64, f64)> {
    let fits = [0, 1].map(|parity| {
        let others: Vec<&FreeRecord> =
            free.iter().enumerate().filter(|(k, _)| k % 2 != parity).map(|(_, r)| r).collect();
        fit_fringe(others, light)
    });
    held_out(free, |parity, record| fits[parity].as_ref().map(|fit| fit.shape(&record.position_m)))
}

fn gained(sums: &[(f64, f64)]) -> f64 {
    sums.iter().map(|(before, after)| before - after).sum()
}

fn fringe_sign(free: &[FreeRecord], fit: &FringeFit, p_value: f64) -> RecordSign {
    let (fringe, straight) = (fringe_held_out(free, None), straight_held_out(free));
    let (before, after) = rms(free, &fringe);
    RecordSign {
        id: "interference-fringe",
        p_value,
        parameters: vec![
            ("amplitude_v", value(fit.amplitude_v.0, fit.amplitude_v.1, "V")),
            ("wavelength_m", value(fit.wavelength_m.0, fit.wavelength_m.1, "m")),
            ("phase", value(fit.phase.0, fit.phase.1, "rad")),
        ],
        evidence: format!(
            "the free level waves with the piezo position, by {:.2e} V, alike in {} records; a straight line explains {:.0} % of it",
            fit.amplitude_v.0,
            free.len(),
            100.0 * (gained(&straight) / gained(&fringe)).clamp(0.0, 1.0)
        ),
        gain: gain(before, after, "free stretches of the other half of the records"),
        runner_up: Some(RunnerUp { id: "piezo-crosstalk".to_owned(), share_of_gain: share(&straight, &fringe) }),
        tied: false,
    }
}

fn share(runner_up: &[(f64, f64)], named: &[(f64, f64)]) -> Option<f64> {
    let share = gained(runner_up) / gained(named);
    (share.is_finite() && gained(named) > 0.0).then_some(share)
}

fn crosstalk_sign(free: &[FreeRecord], slopes: &[f64], p_value: f64) -> Option<RecordSign> {
    let of = |kind| free.iter().filter_map(|record| record.slope(kind)).collect::<Vec<_>>();
    let (before, after) = (mean_and_error(&of(SegmentKind::Approach)), mean_and_error(&of(SegmentKind::Retract)));
    let (kappa, error) = mean_and_error(slopes);
    // the nuisances took a part of either slope: what is left of them must have the slope's sign and lie within 3 errors of one another
    let apart = (before.0 - after.0) / before.1.hypot(after.1);
    if student_two_sided(apart, slopes.len() as f64 - 1.0) < 0.003 && before.0 * after.0 <= 0.0 {
        return None;
    }
    let (straight, light) = (straight_held_out(free), fringe_held_out(free, Some(LIGHT_M)));
    let rivals: Vec<f64> = straight.iter().zip(&light).map(|(s, l)| l.1 - s.1).collect();
    let (ahead, scatter) = mean_and_error(&rivals);
    let (rms_before, rms_after) = rms(free, &straight);
    Some(RecordSign {
        id: "piezo-crosstalk",
        p_value,
        parameters: vec![("kappa_v_per_m", value(kappa, error, "V/m"))],
        evidence: format!(
            "the free level follows the piezo position, {:.3e} V/m before contact and {:.3e} V/m after the rupture, alike in {} records",
            before.0,
            after.0,
            free.len()
        ),
        gain: gain(rms_before, rms_after, "free stretches of the other half of the records"),
        runner_up: Some(RunnerUp { id: "interference-fringe".to_owned(), share_of_gain: share(&light, &straight) }),
        tied: ahead < 2.0 * scatter,
    })
}
