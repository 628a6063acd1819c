//! How many modes there are: one more as long as it lowers the weighted squares by more than chance, one less where a
//! mode is not established in the end.

use faer::{Mat, c64};

use super::FrfModesOptions;
use super::candidates::{of_residual, same};
use super::data::Lines;
use super::fit::{COARSE, Effort, FINE, Fitted, fitted};
use super::in_common::InCommon;
use super::lack::{Lack, correlation};
use super::model::width;
use super::noise::from_residual;
use super::projection::Projection;
use crate::linear_algebra::symmetric_inverse;
use crate::model::ModelError;
use crate::ringdown::{ModesWanted, OrderTried};
use crate::statistics::f_tail;

/// Times that the variance is estimated from what a fit leaves. Why: the second changes it by less than its error.
const ROUNDS: usize = 2;
/// Candidates in a row that may fail before the search ends. Why: what a start gains by itself ranks it to a factor of
/// some two, and each costs a fit.
const FAILURES: usize = 4;
/// Half widths from a pole of the fit within which a start is that pole. Why: beside it, its gain is rounding.
const TAKEN: f64 = 0.05;
/// Widths that a mode at a line may have, as many as differ visibly: a factor of two each, three decades.
const WIDTHS: f64 = 10.0;
/// Most that the fit of a start gains over what the start does by itself, of few responses and of more. Why: half a width
/// off it gains 80 %, but beside a mode the others give way. Of 600 close pairs in one response 16 finds 483, 4 three
/// fewer; shapes of several responses tell near modes apart at once.
const HOPE: (f64, f64) = (16.0, 4.0);
/// Responses from which on shapes tell near modes apart.
const SEVERAL: usize = 4;
/// Pairs beside the modes of the band at most: they stand for what lies beyond it.
const SPARE: usize = 3;
/// Standard errors of its damping that a mode must have, and most of its half width that its frequency's error may be.
const DETERMINED: (f64, f64) = (3.0, 1.0);
/// Share of the energy of a stronger mode within whose width it lies below which a mode is that one's lack of fit,
/// where the fit does not reach the noise there. Why: a pole that moves by a tenth of its width leaves a hundredth.
const COMPANION: f64 = 0.01;

/// Half widths from the band's ends within which a pole is not a mode of the band: its half-power points are not seen.
const EDGE: f64 = 1.0;

/// A search over numbers of modes.
pub(super) struct Search<'a> {
    /// The lines, weighted by what the last fit leaves where no variance was given.
    pub lines: Lines,
    pub options: &'a FrfModesOptions,
    pub tried: Vec<OrderTried>,
    /// What the fit with the most modes leaves, over its lines: how far neighbours are alike where no mode is missing.
    most: Option<(Lines, Vec<Vec<c64>>)>,
}

impl<'a> Search<'a> {
    /// From these poles. Errors: those of the fit.
    pub fn new(lines: Lines, poles: &[c64], options: &'a FrfModesOptions) -> Result<(Self, Fitted), ModelError> {
        let fit = fitted(&lines, poles, options, COARSE)?;
        let mut search = Self { lines, options, tried: Vec::new(), most: None };
        let fit = search.reweighted(fit, COARSE)?;
        Ok((search, fit))
    }

    /// The same search over other lines, from its fit. Errors: those of the fit.
    pub fn continued(self, lines: Lines, fit: &Fitted) -> Result<(Self, Fitted), ModelError> {
        let (search, fit) = Self::new(lines, &fit.at.poles, self.options)?;
        Ok((Self { tried: self.tried, most: self.most, ..search }, fit))
    }

    /// The fit with the variance of what it leaves, where none was given. Errors: those of the fit.
    pub fn reweighted(&mut self, fit: Fitted, effort: Effort) -> Result<Fitted, ModelError> {
        if self.lines.known {
            return Ok(fit);
        }
        let weight = from_residual(&self.lines, &fit.at, &fit.at.left(&self.lines, self.options));
        self.lines = self.lines.weighted(weight);
        fitted(&self.lines, &fit.at.poles, self.options, effort)
    }

    /// Adds candidates to a fit, the one with the largest gain first, then what its residual shows, and drops what is not
    /// established. Errors: those of the fit.
    pub fn run(&mut self, start: Fitted, candidates: &[c64]) -> Result<Fitted, ModelError> {
        let mut fit = self.added(start, candidates.to_vec())?;
        // what the diagram has missed is in the residual
        loop {
            let before = fit.at.poles.len();
            let further = of_residual(&self.lines, &fit.at.left(&self.lines, self.options), self.options);
            fit = self.added(fit, further)?;
            if fit.at.poles.len() == before {
                return self.pruned(fit);
            }
        }
    }

    /// Adds candidates alone, and drops what is not established. Errors: those of the fit.
    pub fn with_candidates(&mut self, start: Fitted, candidates: &[c64]) -> Result<Fitted, ModelError> {
        let fit = self.added(start, candidates.to_vec())?;
        self.pruned(fit)
    }

    /// The last fit, the variance from what it leaves; what is not established then is dropped, too. Errors: those of
    /// the fit.
    pub fn finished(&mut self, mut fit: Fitted) -> Result<Fitted, ModelError> {
        loop {
            for _ in 0..ROUNDS {
                fit = self.reweighted(fit, FINE)?;
            }
            fit = fitted(&self.lines, &fit.at.poles, self.options, FINE)?;
            let weakest = match self.options.modes {
                ModesWanted::Fixed(_) => None,
                ModesWanted::AtMost(_) => self.weakest(&fit),
            };
            let Some(weakest) = weakest else { return Ok(fit) };
            let mut poles = fit.at.poles;
            poles.remove(weakest);
            fit = fitted(&self.lines, &poles, self.options, COARSE)?;
        }
    }

    /// Modes of the band among the poles.
    fn count(&self, fit: &Fitted) -> usize {
        fit.at.poles.iter().filter(|s| self.is_mode(**s)).count()
    }

    fn added(&mut self, mut fit: Fitted, candidates: Vec<c64>) -> Result<Fitted, ModelError> {
        let mut failures = 0;
        let mut ranked = self.ranked(&fit, candidates);
        while failures < FAILURES && self.room(&fit) {
            let Some((gain, s)) = ranked.pop() else { break };
            if self.hopeless(&fit, gain) {
                // as are all others: they gain less
                break;
            }
            match self.with(&fit, s)? {
                Some(next) => {
                    fit = self.reweighted(next, COARSE)?;
                    ranked = self.ranked(&fit, ranked.into_iter().map(|(_, s)| s).collect());
                    failures = 0;
                }
                None => {
                    failures += 1;
                    ranked.retain(|(_, t)| !same(s, *t));
                }
            }
        }
        Ok(fit)
    }

    /// Candidates with what each gains by itself, the largest last; those that the fit has already are left out.
    fn ranked(&self, fit: &Fitted, mut candidates: Vec<c64>) -> Vec<(f64, c64)> {
        candidates.retain(|s| !fit.at.poles.iter().any(|t| (s - t).norm() < TAKEN * t.re.abs()));
        let gains = fit.at.gains(&self.lines, self.options, &candidates);
        let mut all: Vec<(f64, c64)> = gains.into_iter().zip(candidates).collect();
        all.sort_by(|x, y| x.0.total_cmp(&y.0));
        all
    }

    /// Whether no fit of a start that gains so much by itself would be kept.
    fn hopeless(&self, fit: &Fitted, gain: f64) -> bool {
        let hope = if self.lines.responses() < SEVERAL { HOPE.0 } else { HOPE.1 };
        matches!(self.options.modes, ModesWanted::AtMost(_)) && !self.significant(fit, hope * gain, 1.0, 1.0)
    }

    /// Whether a further mode may join: the number of modes, and values for its parameters. Where the variance is
    /// estimated, half of the values are left for it.
    fn room(&self, fit: &Fitted) -> bool {
        let largest = self.options.largest();
        let parameters = fit.at.parameters() as f64 + self.parameters();
        let needed = if self.lines.known { parameters + 1.0 } else { 2.0 * parameters };
        let enough = self.lines.values() as f64 >= needed;
        enough && self.count(fit) < largest && modes(&fit.at.poles) < largest + SPARE
    }

    /// Real parameters of a mode.
    fn parameters(&self) -> f64 {
        (2 * self.lines.responses() + 2) as f64
    }

    /// Level of the residual around a pole, at least that of the weights: chance that made it small there is no reason
    /// to believe a mode.
    fn level(&self, fit: &Fitted, s: c64) -> f64 {
        let left = fit.at.left(&self.lines, self.options);
        Lack::around(&self.lines, &left, &fit.at.poles, s).level.max(1.0)
    }

    /// The fit with a further mode, if it is established.
    fn with(&mut self, fit: &Fitted, s: c64) -> Result<Option<Fitted>, ModelError> {
        let mut poles = fit.at.poles.clone();
        poles.insert(modes(&poles), s);
        let next = fitted(&self.lines, &poles, self.options, COARSE)?;
        let gain = fit.at.energy() - next.at.energy();
        let kept = match self.options.modes {
            ModesWanted::Fixed(_) => gain > 0.0,
            ModesWanted::AtMost(_) => self.significant(&next, gain, 1.0, 1.0),
        };
        let kept = kept && self.one_on_each_side(&next.at.poles);
        self.tried.push(OrderTried { modes: modes(&poles), gain, kept });
        Ok(kept.then_some(next))
    }

    /// Whether at most one pair lies below the band and one above: of two the band knows only a sum.
    fn one_on_each_side(&self, poles: &[c64]) -> bool {
        let (first, last) = (self.lines.p[0].norm(), self.lines.p[self.lines.len() - 1].norm());
        let pairs = || poles.iter().filter(|s| width(**s) == 2);
        pairs().filter(|s| s.norm() < first).count() <= 1 && pairs().filter(|s| s.norm() > last).count() <= 1
    }

    /// F test of a mode that lowers the weighted squares by `gain`: its parameters against the `level` of the residual.
    /// Each line, merged or not, may hold one of some widths, so the probability is multiplied by their number.
    fn significant(&self, fit: &Fitted, gain: f64, level: f64, correlation: f64) -> bool {
        let f = gain / self.parameters() / (level * correlation).max(f64::MIN_POSITIVE);
        let degrees = fit.at.freedom(&self.lines) / correlation;
        let trials = WIDTHS * self.lines.merged.iter().sum::<f64>();
        f_tail(f, self.parameters(), degrees) * trials < self.options.false_alarm
    }

    /// Drops modes one by one that are not established, the least first; none where their number was given.
    fn pruned(&mut self, mut fit: Fitted) -> Result<Fitted, ModelError> {
        if matches!(self.options.modes, ModesWanted::Fixed(_)) {
            return Ok(fit);
        }
        self.most = Some((self.lines.clone(), fit.at.left(&self.lines, self.options)));
        while let Some(weakest) = self.weakest(&fit) {
            let mut poles = fit.at.poles.clone();
            poles.remove(weakest);
            let left = fitted(&self.lines, &poles, self.options, COARSE)?;
            fit = self.reweighted(left, COARSE)?;
        }
        Ok(fit)
    }

    /// The mode that is least established, if one is not.
    fn weakest(&self, fit: &Fitted) -> Option<usize> {
        let count = modes(&fit.at.poles);
        let left = fit.at.left(&self.lines, self.options);
        let quiet = self.lines.weighted(self.lines.quiet.clone());
        let energy = energies(&fit.at, &self.lines);
        let (information, _) = fit.at.normal();
        let inverse = symmetric_inverse(&information);
        let shared = InCommon::new(&self.lines, &fit.at, &left, self.options).scores();
        let covariance = &inverse + &inverse * shared * &inverse;
        let mut worst: Option<(f64, usize)> = None;
        for j in 0..count {
            let s = fit.at.poles[j];
            let lack = Lack::around(&self.lines, &left, &fit.at.poles, s);
            let gain = fit.at.share(j);
            let fails = match self.is_mode(s) {
                true => {
                    let known = self.determined(s, &covariance, 2 * j, lack.factor());
                    let short = Lack::around(&quiet, &left, &fit.at.poles, s).shows();
                    let companion = short && self.is_companion(&fit.at.poles[..count], &energy, j);
                    let alike = self.most.as_ref().map_or(1.0, |(lines, left)| correlation(lines, left, s));
                    !known || companion || !self.significant(fit, gain, self.level(fit, s), alike)
                }
                // what stands for modes beyond the band stays if it gains anything: without it all else fits less
                false => !self.significant(fit, gain, 1.0, 1.0),
            };
            if fails && worst.is_none_or(|(least, _)| gain < least) {
                worst = Some((gain, j));
            }
        }
        worst.map(|(_, j)| j)
    }

    /// Whether a pole is a mode of the band: its half-power points lie in it, and it is
    /// damped weakly enough. Others that are significant stay: they stand for what modes beyond the band leave in it.
    pub fn is_mode(&self, s: c64) -> bool {
        let (f, half) = (s.im / std::f64::consts::TAU, -s.re / std::f64::consts::TAU);
        let (first, last) = (self.lines.frequency_hz[0], self.lines.frequency_hz[self.lines.len() - 1]);
        let inside = f - EDGE * half > first && f + EDGE * half < last;
        width(s) == 2 && inside && s.norm() >= 2.0 * self.options.least_quality_factor * -s.re
    }

    /// Whether damping and frequency are known.
    fn determined(&self, s: c64, covariance: &Mat<f64>, first: usize, factor: f64) -> bool {
        let std = |i: usize| (factor * covariance[(i, i)]).max(0.0).sqrt();
        -s.re > DETERMINED.0 * std(first) && std(first + 1) < -DETERMINED.1 * s.re
    }

    /// Whether a stronger mode is so near that this one may be its lack of fit.
    fn is_companion(&self, poles: &[c64], energy: &[f64], j: usize) -> bool {
        let place = self.lines.frequency_hz.partition_point(|f| *f < poles[j].im / std::f64::consts::TAU);
        let line = std::f64::consts::TAU * self.lines.step_hz[place.min(self.lines.len() - 1)];
        let near = |k: usize| {
            let distance = (poles[j].im - poles[k].im).abs();
            let width = 2.0 * poles[j].re.abs().max(poles[k].re.abs());
            let faint = energy[j] < COMPANION * energy[k];
            self.is_mode(poles[k]) && energy[j] < energy[k] && distance < if faint { width.max(line) } else { line }
        };
        (0..poles.len()).any(near)
    }
}

/// Oscillating poles; they come first.
pub(super) fn modes(poles: &[c64]) -> usize {
    poles.iter().filter(|s| width(**s) == 2).count()
}

/// Energy of each pole over all responses, each weighted by its mean weight.
fn energies(at: &Projection, lines: &Lines) -> Vec<f64> {
    let mean = |weight: &[f64]| weight.iter().sum::<f64>() / weight.len() as f64;
    let of = |r: usize| at.residues(r).into_iter().map(|a| a.norm_sqr() * mean(&lines.weight[r])).collect::<Vec<f64>>();
    let rows: Vec<Vec<f64>> = (0..lines.responses()).map(of).collect();
    at.poles.iter().enumerate().map(|(j, s)| rows.iter().map(|row| row[j]).sum::<f64>() / -s.re).collect()
}
