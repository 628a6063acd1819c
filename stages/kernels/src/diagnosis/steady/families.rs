//! Lines that are multiples of one frequency, as one cause.

use crate::statistics::binomial_tail;

use super::lines::Line;

/// Lines that may begin a family, the strongest.
const STARTS: usize = 30;
/// The strongest lines' places in their family: first to this.
const PLACES: usize = 12;
/// Multiples of a base at most, ten times the place of the line that gave it: its error grows with them.
const REACH: usize = 10;
/// Members of a family at least.
const LEAST: usize = 3;
/// Chance, over all trials, that lines anywhere make such a family.
const CHANCE: f64 = 1e-3;
/// Families that are sought.
const MOST: usize = 8;

/// Lines of one origin, the strongest first.
#[derive(Debug, Clone)]
pub(super) struct Family {
    /// Cycles per sample; of a single line its own frequency.
    pub base: f64,
    pub lines: Vec<Line>,
}

impl Family {
    /// Sum of the squares of the amplitudes.
    pub fn power(&self) -> f64 {
        self.lines.iter().map(|line| line.amplitude.powi(2)).sum()
    }
}

/// Takes families out of these lines, the strongest first.
///
/// # Method
/// Bases are fractions of strong lines. A base counts by the binomial chance that so many of the other lines lie within
/// two bins of its multiples.
pub(super) fn families(lines: &mut Vec<Line>, samples: usize) -> Vec<Family> {
    let bin = 1.0 / samples.max(1) as f64;
    let mut found = Vec::new();
    while found.len() < MOST {
        let Some((base, reach)) = best(lines, bin) else { break };
        let member = |line: &Line| is_member(line, base, reach, bin);
        let members: Vec<Line> = lines.iter().copied().filter(member).collect();
        lines.retain(|line| !member(line));
        // weighted by the multiples, as errors of a bin's fraction are
        let products = members.iter().map(|line| {
            let k = (line.frequency / base).round();
            (k * line.frequency, k * k)
        });
        let (along, square) = products.fold((0.0, 0.0), |(a, s), (p, q)| (a + p, s + q));
        found.push(Family { base: along / square, lines: members });
    }
    found
}

fn is_member(line: &Line, base: f64, reach: usize, bin: f64) -> bool {
    let k = (line.frequency / base).round();
    k >= 1.0 && k <= reach as f64 && (line.frequency - k * base).abs() < 2.0 * bin
}

/// Base and largest multiple of the least likely family.
fn best(lines: &[Line], bin: f64) -> Option<(f64, usize)> {
    let tries = (STARTS.min(lines.len()) * PLACES) as f64;
    let mut best: Option<(f64, f64, usize)> = None;
    for start in lines.iter().take(STARTS) {
        for place in 1..=PLACES {
            let (base, reach) = (start.frequency / place as f64, REACH * place);
            // multiples must be farther apart than their tolerance
            if base < 20.0 * bin {
                break;
            }
            let members = lines.iter().filter(|line| is_member(line, base, reach, bin)).count();
            // lines beyond the reach have no chance to belong
            let within = lines.iter().filter(|line| line.frequency < (reach as f64 + 0.5) * base).count();
            if members < LEAST || within < members {
                continue;
            }
            let chance = tries * binomial_tail(members - 1, within - 1, (4.0 * bin / base).min(1.0));
            if chance < CHANCE && best.is_none_or(|(least, ..)| chance < least) {
                best = Some((chance, base, reach));
            }
        }
    }
    best.map(|(_, base, reach)| (base, reach))
}
