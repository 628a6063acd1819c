//! Families of lines, fitted to the even blocks and judged by the odd.

use std::f64::consts::LN_2;

use super::families::{Family, families};
use super::findings::Findings;
use super::lines::{Line, crowds, project, take_off};

/// Families that are named: a record has many lines, but few that matter.
const FAMILIES: usize = 3;
/// Lines of a family that are fitted.
const FITTED: usize = 10;
/// Gain of the log likelihood from which a family is named: its sines were fitted to other samples.
const GAIN: f64 = 3.0;

/// A family as blocks that did not fit it see it.
pub(super) struct JudgedFamily {
    pub family: Family,
    /// Sum of squares of the odd blocks' rest before and after, over their samples.
    pub before: f64,
    pub after: f64,
    /// Gain of the log likelihood on them.
    pub gain: f64,
    /// Parts of its strongest lines.
    pub parts: Vec<(Line, [f64; 2])>,
}

impl Findings<'_> {
    /// Finds and judges the families of the lines.
    pub fn judge_families(&mut self) {
        let samples = self.blocks.rest.len();
        let mut found = families(&mut self.lines.foreign, samples);
        crowds(&mut self.lines, samples);
        found.extend(self.lines.foreign.drain(..).map(|line| Family { base: line.frequency, lines: vec![line] }));
        found.sort_by(|a, b| b.power().total_cmp(&a.power()));
        let few = found.len().min(2 * FAMILIES);
        let rest = found.split_off(few);
        let mut families: Vec<JudgedFamily> = found.into_iter().map(|family| self.judge_family(family)).collect();
        let unjudged = |family| JudgedFamily { family, before: 0.0, after: 0.0, gain: 0.0, parts: Vec::new() };
        families.extend(rest.into_iter().map(unjudged));
        self.families = families;
    }

    fn judge_family(&self, family: Family) -> JudgedFamily {
        let length = self.blocks.length;
        let mut rest = self.blocks.rest.clone();
        let odd = |rest: &[f64]| {
            let blocks = rest.chunks(length.max(1)).skip(1).step_by(2);
            let (sum, count) =
                blocks.fold((0.0, 0), |(s, n), part| (s + part.iter().map(|y| y * y).sum::<f64>(), n + part.len()));
            (sum, count.max(1))
        };
        let (first, count) = odd(&rest);
        let (mut before, mut gain) = (first, 0.0);
        let mut parts = Vec::new();
        for line in family.lines.iter().take(FITTED) {
            let fitted = project(&rest, line.frequency, |b| b % 2 == 0, length);
            take_off(&mut rest, line.frequency, fitted);
            let (after, _) = odd(&rest);
            // white noise of variance s has a median Hann amplitude of sqrt(6 s ln(2) / N)
            let variance = line.level.powi(2) * self.blocks.rest.len() as f64 / (6.0 * LN_2);
            gain += 0.5 * (before - after) / variance.max(f64::MIN_POSITIVE);
            before = after;
            parts.push((*line, fitted));
        }
        JudgedFamily { family, before: first / count as f64, after: before / count as f64, gain, parts }
    }

    /// Families that are named: the strongest that even blocks predict in odd ones.
    pub fn named_families(&self) -> Vec<&JudgedFamily> {
        if !self.options.candidates.iter().any(|id| id == "spurious-line") {
            return Vec::new();
        }
        self.families.iter().filter(|family| family.gain > GAIN).take(FAMILIES).collect()
    }
}
