//! Results from the last fit.

use std::f64::consts::TAU;

use crate::ringdown::Estimate;
use crate::ringdown::moving::alternatives::{OfLine, Search};
use crate::ringdown::moving::average::{Weighed, averaged};
use crate::ringdown::moving::blocks::{Compressed, Hit};
use crate::ringdown::moving::dense::Square;
use crate::ringdown::moving::model::{MOST_DAMPING, Mode};
use crate::ringdown::moving::path::path;
use crate::ringdown::moving::result::{CoursePoint, FollowedLine, FollowedMode, LocalPole, Moving, known_or};
use crate::ringdown::moving::search::Fit;
use crate::ringdown::moving::signal::residuals;
use crate::ringdown::moving::terms::{Law, Term};

/// Standard deviations of the noise per sample that an amplitude is above the noise from.
pub const ABOVE_NOISE: f64 = 4.0;
/// Periods before the end of a record at which an amplitude counts as reached: an extrapolation by none.
const LAST_PERIODS: f64 = 6.0;

impl Search<'_> {
    pub(crate) fn result(
        &self,
        events: &[Vec<&[f64]>],
        interval_s: f64,
        variances: &[f64],
        found: Fit,
        of_lines: Vec<OfLine>,
    ) -> Moving {
        let data = self.problem.data;
        let rows: usize = data.records.iter().map(|r| r.rows).sum();
        let parameters = found.parameters() + 2 * data.records.len();
        let outside: f64 = data.records.iter().map(|r| r.outside.0 / variances[r.channel]).sum();
        let samples: Vec<usize> = data.records.iter().map(|r| r.rows + r.outside.1 as usize).collect();
        let logs: f64 =
            data.records.iter().zip(&samples).map(|(r, n)| *n as f64 * (TAU * variances[r.channel]).ln()).sum();
        let log_likelihood = -0.5 * (found.normal.chi_square + outside + logs);
        let total: usize = samples.iter().sum();
        let covariance = found.covariance();
        let models = self.models(found.clone());
        let of_line = |of: &OfLine| {
            let (follows, lack) = self.follows(&found, of);
            let mode = |&n: &usize| self.mode(&found, covariance.as_ref(), n, lack.factor, variances, &models);
            let modes = of.modes.iter().map(mode).collect();
            FollowedLine { follows, given: Vec::new(), modes, lack, bic_difference: of.bic_difference }
        };
        let lines = of_lines.iter().map(of_line).collect();
        Moving {
            lines,
            noise_variance: variances.to_vec(),
            chi_square: (found.normal.chi_square, rows as f64 - parameters as f64),
            log_likelihood,
            bic: -2.0 * log_likelihood + parameters as f64 * (total.max(2) as f64).ln(),
            parameters,
            converged: found.converged,
            residuals: residuals(data, &found.modes, events, interval_s),
        }
    }

    fn mode(
        &self,
        found: &Fit,
        covariance: Option<&Square>,
        number: usize,
        factor: f64,
        variances: &[f64],
        models: &[Weighed],
    ) -> FollowedMode {
        let mode = &found.modes[number];
        let carrier = self.problem.data.carriers[mode.carrier];
        let laws = mode.damping.terms.len() + mode.frequency.terms.len();
        let base = found.base(number) + mode.laws_at();
        let mut block = Square::zeros(laws);
        for i in 0..laws {
            for j in 0..laws {
                // undetermined: an error as large as the value squared of anything
                let unknown = if i == j { (0.1 * carrier).powi(2) } else { 0.0 };
                *block.at_mut(i, j) = covariance.map_or(unknown, |c| factor * c.at(base + i, base + j));
            }
        }
        let (low, high) = amplitudes(self.problem.data, mode, variances);
        let course = (0..self.options.course_points.max(2))
            .map(|i| {
                let share = i as f64 / (self.options.course_points.max(2) - 1) as f64;
                let a = low * (high / low).powf(share);
                let (frequency_hz, damping_ratio) = averaged(models, number, carrier, factor, a);
                let (frequency_hz, damping_ratio) =
                    (known_or(frequency_hz, carrier / TAU), known_or(damping_ratio, 0.5));
                CoursePoint { amplitude: a * mode.unit, frequency_hz, damping_ratio }
            })
            .collect::<Vec<CoursePoint>>();
        let (frequency_hz, ratio) = (course[0].frequency_hz, course[0].damping_ratio);
        // of a damping that is not above zero: a quality factor of which a lower bound is known
        let least = ratio.value.max(0.3 * ratio.std).max(1e-9);
        let quality = Estimate { value: 0.5 / least, std: 0.5 * ratio.std / (least * least) };
        let quality_factor = known_or(quality, quality.value);
        let term = |i: usize| block.at(i, i).max(0.0).sqrt();
        let count = mode.damping.terms.len();
        let listed = |law: &Law, from: usize, add: f64| {
            let of = |(i, (t, c)): (usize, (&Term, &f64))| {
                let value = c + if i == 0 { add } else { 0.0 };
                (*t, known_or(Estimate { value, std: term(from + i) }, carrier))
            };
            law.terms.iter().zip(&law.coefficients).enumerate().map(of).collect()
        };
        FollowedMode {
            frequency_hz,
            quality_factor,
            amplitudes: (low * mode.unit, high * mode.unit),
            course,
            damping_terms: listed(&mode.damping, 0, 0.0),
            frequency_terms: listed(&mode.frequency, count, carrier),
            unit: mode.unit,
            reference: mode.reference,
            shape: mode.shape.clone(),
            starts: mode.starts.iter().map(|s| (mode.unit * s.0.exp(), s.1.rem_euclid(TAU))).collect(),
            harmonics: mode.harmonics.clone(),
        }
    }
}

/// Relative amplitudes: the least that is above the noise, or is reached [`LAST_PERIODS`] before the records end, and
/// the largest.
fn amplitudes(data: &Compressed, mode: &Mode, variances: &[f64]) -> (f64, f64) {
    let high = mode.starts.iter().map(|s| s.0.exp()).fold(1e-12, f64::max);
    let end = |(hit, start): (&Hit, &(f64, f64))| {
        let time = (hit.duration_s - LAST_PERIODS * TAU / mode.turn).max(0.5 * hit.duration_s);
        path(&mode.laws(), *start, &[time]).map_or(high, |p| p.nodes[0].exp())
    };
    let ends = data.hits.iter().zip(&mode.starts).map(end).fold(high, f64::min);
    let noise = ABOVE_NOISE * variances[mode.reference].sqrt() / mode.unit;
    let mut low = ends.max(noise).max(1e-9).min(high);
    let too_fast = |a: f64| LocalPole::at(mode, a).damping_ratio_alone() > MOST_DAMPING;
    while low < high && too_fast(low) && !too_fast(high) {
        low = (1.05 * low).min(high);
    }
    (low, high)
}
