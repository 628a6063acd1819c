//! Which given lines are one: poles that a linear fit needs for a mode that moves lie within its width.

use std::f64::consts::TAU;

use crate::ringdown::moving::follow::{Exponential, Line};

/// Distance of two frequencies, in the sum of the half widths, up to which lines are looked at as one: two linear modes
/// there interfere, and a mode that moves by its width needs several poles. So are those that the records do not resolve.
const ONE_LINE: f64 = 2.5;

impl Line {
    /// Its slowest pole.
    pub(crate) fn main(&self) -> Option<Exponential> {
        self.poles.iter().copied().min_by(|a, b| a.rate_per_s.total_cmp(&b.rate_per_s))
    }
}

/// Lines joined, each with the numbers of those that it is made of; `longest_s`: the longest record.
pub fn joined(lines: &[Line], longest_s: f64) -> Vec<(Line, Vec<usize>)> {
    let resolution = TAU / longest_s;
    let near = |i: &usize, j: usize| match (lines[*i].main(), lines[j].main()) {
        (Some(a), Some(b)) => {
            let apart = (a.turn_rad_per_s - b.turn_rad_per_s).abs();
            apart < (ONE_LINE * (a.rate_per_s + b.rate_per_s)).max(resolution)
        }
        _ => false,
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for j in 0..lines.len() {
        let (with, mut others): (Vec<_>, Vec<_>) =
            groups.into_iter().partition(|group| group.iter().any(|i| near(i, j)));
        let mut all: Vec<usize> = with.into_iter().flatten().chain([j]).collect();
        all.sort_unstable();
        others.push(all);
        groups = others;
    }
    groups.sort();
    let line = |group: Vec<usize>| {
        let poles = group.iter().flat_map(|i| lines[*i].poles.iter().copied()).collect();
        (Line { poles }, group)
    };
    groups.into_iter().map(line).collect()
}
