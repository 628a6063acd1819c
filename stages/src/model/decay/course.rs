//! Whether modes keep their frequency and damping while they die away, and the part in which they do.

use std::ops::Range;

use afmid_pipeline::Table;
use serde_json::{Value, json};

use crate::artifacts::Decays;
use afmid_kernels::model::ModelError;
use afmid_kernels::ringdown::{ChannelOptions, ChannelRingdown, Estimate, ModeEstimate, ModesWanted, fit_channels};

/// Modes of a part of the decays.
#[derive(Debug, Clone)]
struct Part {
    name: &'static str,
    /// After the decays' first free samples, s.
    from_s: f64,
    to_s: f64,
    modes: Vec<ModeEstimate>,
}

impl Part {
    const NONE: Self = Self { name: "", from_s: f64::NAN, to_s: f64::NAN, modes: Vec::new() };
}

/// Modes of the first and of the last part.
#[derive(Debug, Clone)]
pub(super) struct Course([Part; 2]);

/// The fit that counts, where it begins, and how the modes got there.
pub(super) struct Followed {
    pub fit: ChannelRingdown,
    /// Samples after the first free ones from which it is fitted.
    pub from: usize,
    /// None where the decays are too short to be cut.
    pub course: Option<Course>,
}

/// Decay times of the strongest mode after which the last part begins: its amplitude has fallen to a quarter.
const LATE: f64 = 1.4;
/// Standard errors of a difference that noise alone yields once in 10,000 modes.
const MOVED: f64 = 4.0;
/// Distance in half widths beyond which two modes are not one that has moved.
const SAME: f64 = 10.0;
/// Change of a frequency in half widths, or of a damping relative to itself, up to which one linear mode stands for all:
/// its phase is then wrong by less than a tenth of a radian while it decays.
const FAR: f64 = 0.1;
/// Relative change below which nobody would call it one.
const LEAST_CHANGE: f64 = 1e-5;

/// Fits the decays, their first and their last part: the last part counts where the modes have moved on by then, unless
/// the `whole` is asked for. Errors: those of the kernel for the whole.
pub(super) fn follow(decays: &Decays<'_>, options: &ChannelOptions, whole: bool) -> Result<Followed, ModelError> {
    let longest = decays.hits.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
    let interval_s = 1.0 / decays.sample_rate_hz;
    let fit = fitted(decays, options, 0..longest)?;
    let uncut = |fit| Ok(Followed { fit, from: 0, course: None });
    let Some(rate) = strongest(&fit) else { return uncut(fit) };
    let cut = ((LATE / (rate * interval_s)) as usize).clamp(1, (longest / 2).max(1));
    let Ok(late) = fitted(decays, options, cut..longest) else { return uncut(fit) };
    let few = ChannelOptions { modes: ModesWanted::AtMost(late.poles.len().max(1)), ..options.clone() };
    let Ok(early) = fitted(decays, &few, 0..cut) else { return uncut(fit) };
    let part = |name, range: Range<usize>, fit: &ChannelRingdown| Part {
        name,
        from_s: range.start as f64 * interval_s,
        to_s: range.end as f64 * interval_s,
        modes: fit.modes(),
    };
    let course = Course([part("first", 0..cut, &early), part("last", cut..longest, &late)]);
    let moved = course.matters(&weighty(&late));
    let (fit, from) = if moved && !whole { (late, cut) } else { (fit, 0) };
    Ok(Followed { fit, from, course: Some(course) })
}

/// The fit of a part of all decays that reach into it.
fn fitted(decays: &Decays<'_>, options: &ChannelOptions, part: Range<usize>) -> Result<ChannelRingdown, ModelError> {
    let (mut hits, mut missing) = (Vec::new(), Vec::new());
    for (hit, gaps) in decays.hits.iter().zip(decays.missing()) {
        let length = hit.first().map_or(0, |row| row.len());
        if length <= part.start {
            continue;
        }
        let end = part.end.min(length);
        hits.push(hit.iter().map(|row| &row[part.start..end]).collect::<Vec<&[f64]>>());
        let inside = |gap: Range<usize>| {
            gap.start.clamp(part.start, end) - part.start..gap.end.clamp(part.start, end) - part.start
        };
        let row = |gaps: Vec<Range<usize>>| gaps.into_iter().map(inside).filter(|gap| !gap.is_empty()).collect();
        missing.push(gaps.into_iter().map(row).collect());
    }
    let fit = |modes| {
        let options = ChannelOptions { modes, missing: missing.clone(), ..options.clone() };
        fit_channels(&hits, &decays.quiet, 1.0 / decays.sample_rate_hz, &options)
    };
    let mut found = fit(options.modes)?;
    // what does not die away is a line, no mode: the others are fitted without it
    while let (ModesWanted::AtMost(_), count) = (options.modes, determined(&found))
        && count < found.poles.len()
        && count > 0
    {
        found = fit(ModesWanted::Fixed(count))?;
    }
    Ok(found)
}

/// Standard errors of its damping that a mode must have, and most of half its width that its frequency's error may be.
const DETERMINED: (f64, f64) = (3.0, 1.0);
/// Share of the energy of a stronger mode, within whose width it lies, below which a mode is that one's lack of fit.
const COMPANION: f64 = 0.01;
/// Share of all energy from which on it matters whether a mode moves.
const WEIGHTY: f64 = 0.01;

/// How many modes die away by more than chance, at frequencies that are known to their width, and are no companions of
/// stronger ones.
fn determined(fit: &ChannelRingdown) -> usize {
    let (modes, energy) = (fit.modes(), energies(fit));
    let known = |j: usize| {
        let (f, damping) = (modes[j].frequency_hz, modes[j].damping_ratio());
        damping.value > DETERMINED.0 * damping.std && f.std < DETERMINED.1 * f.value * damping.value
    };
    let companion = |j: usize| {
        let f = |k: usize| modes[k].frequency_hz.value;
        let width = |k: usize| f(k) * modes[k].damping_ratio().value;
        (0..modes.len()).any(|k| energy[j] < COMPANION * energy[k] && (f(j) - f(k)).abs() < width(j).max(width(k)))
    };
    (0..modes.len()).filter(|&j| known(j) && !companion(j)).count()
}

/// Energy of each mode over all hits and channels, in units of their own.
fn energies(fit: &ChannelRingdown) -> Vec<f64> {
    let energy = |(j, pole): (usize, &faer::c64)| {
        let all: f64 = fit.records.iter().filter_map(|record| record.residues.get(j)).map(|r| r.norm_sqr()).sum();
        all / -pole.re
    };
    fit.poles.iter().enumerate().map(energy).collect()
}

/// Decay rate of the mode with the most energy, 1/s.
fn strongest(fit: &ChannelRingdown) -> Option<f64> {
    let energy = energies(fit);
    (0..energy.len()).max_by(|&a, &b| energy[a].total_cmp(&energy[b])).map(|j| -fit.poles[j].re)
}

/// The modes with a fair share of all energy.
fn weighty(fit: &ChannelRingdown) -> Vec<ModeEstimate> {
    let energy = energies(fit);
    let all: f64 = energy.iter().sum();
    fit.modes().into_iter().zip(energy).filter(|(_, own)| *own > WEIGHTY * all).map(|(mode, _)| mode).collect()
}

impl Course {
    /// Of decays that are too short to be cut.
    pub const EMPTY: Self = Self([Part::NONE, Part::NONE]);

    /// The modes that both parts have: each the other's nearest.
    fn pairs(&self) -> Vec<[&ModeEstimate; 2]> {
        let distance = |a: &ModeEstimate, b: &ModeEstimate| (a.frequency_hz.value / b.frequency_hz.value).ln().abs();
        fn nearest<'a>(
            to: &ModeEstimate,
            among: &'a [ModeEstimate],
            distance: impl Fn(&ModeEstimate, &ModeEstimate) -> f64,
        ) -> Option<&'a ModeEstimate> {
            among.iter().min_by(|a, b| distance(a, to).total_cmp(&distance(b, to)))
        }
        let [first, last] = &self.0;
        let pair = |late: &'_ ModeEstimate| {
            let early = nearest(late, &first.modes, distance)?;
            let back = nearest(early, &last.modes, distance)?;
            let width = early.damping_ratio().value.max(late.damping_ratio().value);
            (back == late && distance(early, late) < SAME * width).then_some(*early)
        };
        last.modes
            .iter()
            .filter_map(|late| {
                let early = pair(late)?;
                Some([first.modes.iter().find(|mode| **mode == early)?, late])
            })
            .collect()
    }

    /// Whether one of these modes of the last part has moved so far that one linear mode cannot stand for both.
    fn matters(&self, weighty: &[ModeEstimate]) -> bool {
        let matters = |[first, last]: [&ModeEstimate; 2]| {
            let (damping, early) = (last.damping_ratio().value, first.damping_ratio().value);
            let shift = (first.frequency_hz.value / last.frequency_hz.value - 1.0).abs();
            shift > FAR * damping || (early / damping - 1.0).abs() > FAR
        };
        self.pairs().into_iter().any(|pair| weighty.contains(pair[1]) && moves(pair) && matters(pair))
    }

    pub fn table(&self) -> Table {
        let pairs = self.pairs();
        let rows: Vec<(usize, &Part, &ModeEstimate)> = (1..)
            .zip(&pairs)
            .flat_map(|(number, modes)| self.0.iter().zip(modes).map(move |(part, mode)| (number, part, *mode)))
            .collect();
        Table::of(&rows)
            .with("mode", "1", "number among the modes that both parts have", |(number, ..)| *number)
            .with("part", "", "part of the decays", |(_, part, _)| part.name)
            .with("from_s", "s", "its begin after the first free sample", |(_, part, _)| part.from_s)
            .with("to_s", "s", "its end", |(_, part, _)| part.to_s)
            .with_std(["frequency_hz", "frequency_std_hz"], "Hz", "frequency there", |(.., mode)| mode.frequency_hz)
            .with_std(["damping_ratio", "damping_ratio_std"], "1", "damping ratio there", |(.., mode)| {
                mode.damping_ratio()
            })
            .table()
    }

    pub fn document(&self) -> Value {
        let end = |part: &Part, mode: &ModeEstimate| {
            let damping = mode.damping_ratio();
            json!({
                "from_s": part.from_s,
                "to_s": part.to_s,
                "frequency_hz": mode.frequency_hz.value,
                "frequency_std_hz": mode.frequency_hz.std,
                "damping_ratio": damping.value,
                "damping_ratio_std": damping.std,
            })
        };
        let pair = |pair: [&ModeEstimate; 2]| json!({ "first": end(&self.0[0], pair[0]), "last": end(&self.0[1], pair[1]), "moves": moves(pair) });
        self.pairs().into_iter().map(pair).collect::<Vec<Value>>().into()
    }

    /// Frequencies, Hz, of modes of the first part that the last one does not have.
    pub fn gone(&self) -> Vec<f64> {
        let pairs = self.pairs();
        let gone = self.0[0].modes.iter().filter(|mode| !pairs.iter().any(|pair| pair[0] == *mode));
        gone.map(|mode| mode.frequency_hz.value).collect()
    }

    /// One for each mode that moves.
    pub fn warnings(&self) -> Vec<String> {
        let warning = |[first, last]: [&ModeEstimate; 2]| {
            let (before, after) = (first.damping_ratio(), last.damping_ratio());
            let [early, late] = &self.0;
            format!(
                "a mode moves while it dies away: {:.7} Hz and a damping ratio of {:.4} % from {:.4} to {:.4} s, {:.7} Hz \
                 and {:.4} % from {:.4} to {:.4} s: not linear",
                first.frequency_hz.value,
                100.0 * before.value,
                early.from_s,
                early.to_s,
                last.frequency_hz.value,
                100.0 * after.value,
                late.from_s,
                late.to_s
            )
        };
        self.pairs().into_iter().filter(|pair| moves(*pair)).map(warning).collect()
    }
}

/// Whether frequency or damping differ by more than noise allows.
fn moves([first, last]: [&ModeEstimate; 2]) -> bool {
    let differ = |a: Estimate, b: Estimate| {
        let change = (a.value - b.value).abs();
        change > MOVED * a.std.hypot(b.std) && change > LEAST_CHANGE * a.value.abs()
    };
    differ(first.frequency_hz, last.frequency_hz) || differ(first.damping_ratio(), last.damping_ratio())
}
