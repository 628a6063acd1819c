//! Whether modes keep their frequency and damping while they die away.

use afmid_pipeline::Table;
use serde_json::{Value, json};

use crate::artifacts::Decays;
use afmid_kernels::ringdown::{ChannelOptions, ChannelRingdown, ModesWanted, fit_channels};
use afmid_kernels::ringdown::{Estimate, ModeEstimate};

/// Modes of a part of the decays.
#[derive(Debug, Clone)]
struct Part {
    name: &'static str,
    /// Of the decays' first free samples, s.
    from_s: f64,
    to_s: f64,
    modes: Vec<ModeEstimate>,
}

/// Modes of the first and of the last part, as far as either has them.
#[derive(Debug, Clone, Default)]
pub(super) struct Course {
    parts: Vec<Part>,
    /// Per mode of the whole fit its place in each part.
    places: Vec<[Option<usize>; 2]>,
}

/// Decay times of the slowest mode after which the last part begins: its amplitude has fallen to a quarter.
const LATE: f64 = 1.4;
/// Standard errors of a difference that noise alone yields once in 10,000 modes.
const MOVED: f64 = 4.0;
/// Relative change below which nobody would call it one.
const LEAST_CHANGE: f64 = 1e-5;

impl Course {
    /// Fits both parts by themselves. What cannot be fitted is left out.
    pub fn of(decays: &Decays<'_>, options: &ChannelOptions, fit: &ChannelRingdown) -> Self {
        let whole = fit.modes();
        let slowest = fit.poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min);
        let interval_s = 1.0 / decays.sample_rate_hz;
        let longest = decays.hits.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
        let cut = ((LATE / (slowest * interval_s)) as usize).min(longest / 2);
        let part = |name, from: usize, to: usize| {
            let inside = |row: &&[f64]| row.len() > from;
            let hits: Vec<Vec<&[f64]>> = decays
                .hits
                .iter()
                .filter(|hit| hit.iter().all(inside))
                .map(|hit| hit.iter().map(|row| &row[from..to.min(row.len())]).collect())
                .collect();
            let missing = decays.missing();
            let kept = decays.hits.iter().zip(missing).filter(|(hit, _)| hit.iter().all(inside));
            let shifted = |gap: std::ops::Range<usize>| gap.start.max(from) - from..gap.end.min(to).max(from) - from;
            let missing = kept
                .map(|(_, rows)| {
                    let row = |gaps: Vec<std::ops::Range<usize>>| {
                        gaps.into_iter().map(shifted).filter(|gap| !gap.is_empty()).collect()
                    };
                    rows.into_iter().map(row).collect()
                })
                .collect();
            let options = ChannelOptions { modes: ModesWanted::AtMost(whole.len().max(1)), missing, ..options.clone() };
            let modes = fit_channels(&hits, &decays.quiet, interval_s, &options).ok()?.modes();
            Some(Part { name, from_s: from as f64 * interval_s, to_s: to.min(longest) as f64 * interval_s, modes })
        };
        let parts: Vec<Part> = [part("first", 0, cut), part("last", cut, longest)].into_iter().flatten().collect();
        let nearest = |part: Option<&Part>, mode: &ModeEstimate| {
            let modes = &part?.modes;
            let f = mode.frequency_hz.value;
            let distance = |other: &ModeEstimate| (other.frequency_hz.value / f).ln().abs();
            let best = (0..modes.len()).min_by(|&a, &b| distance(&modes[a]).total_cmp(&distance(&modes[b])))?;
            // another mode of the whole fit is nearer: it is that one's
            let own = whole.iter().all(|other| {
                (modes[best].frequency_hz.value / other.frequency_hz.value).ln().abs() >= distance(&modes[best])
            });
            own.then_some(best)
        };
        let places = if parts.len() == 2 {
            whole.iter().map(|mode| [0, 1].map(|i| nearest(parts.get(i), mode))).collect()
        } else {
            Vec::new()
        };
        Self { parts, places }
    }

    /// Pairs of the same mode in both parts, by the number of the mode.
    fn pairs(&self) -> Vec<(usize, [&ModeEstimate; 2])> {
        let pair = |(number, places): (usize, &[Option<usize>; 2])| {
            let [first, last] = [0, 1].map(|i| places[i].and_then(|k| self.parts.get(i)?.modes.get(k)));
            Some((number, [first?, last?]))
        };
        self.places.iter().enumerate().filter_map(pair).collect()
    }

    pub fn table(&self) -> Table {
        let pairs = self.pairs();
        let rows: Vec<(usize, &Part, &ModeEstimate)> = pairs
            .iter()
            .flat_map(|(number, modes)| self.parts.iter().zip(modes).map(move |(part, mode)| (*number, part, *mode)))
            .collect();
        Table::of(&rows)
            .with("mode", "1", "number of the mode", |(number, ..)| number + 1)
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
        let pair = |(number, [first, last]): &(usize, [&ModeEstimate; 2])| {
            let end = |mode: &ModeEstimate| {
                let damping = mode.damping_ratio();
                json!({
                    "frequency_hz": mode.frequency_hz.value,
                    "frequency_std_hz": mode.frequency_hz.std,
                    "damping_ratio": damping.value,
                    "damping_ratio_std": damping.std,
                })
            };
            json!({ "mode": number + 1, "first": end(first), "last": end(last), "moves": moves(first, last) })
        };
        self.pairs().iter().map(pair).collect::<Vec<Value>>().into()
    }

    /// One for each mode that moves.
    pub fn warnings(&self) -> Vec<String> {
        let warning = |(number, [first, last]): (usize, [&ModeEstimate; 2])| {
            let (before, after) = (first.damping_ratio(), last.damping_ratio());
            moves(first, last).then(|| {
                format!(
                    "mode {} moves while it dies away: {:.7} to {:.7} Hz, damping ratio {:.4} to {:.4} %: not linear, and \
                     its errors above are too small (`course` has both ends)",
                    number + 1,
                    first.frequency_hz.value,
                    last.frequency_hz.value,
                    100.0 * before.value,
                    100.0 * after.value
                )
            })
        };
        self.pairs().into_iter().filter_map(warning).collect()
    }
}

/// Whether frequency or damping differ by more than noise allows.
fn moves(first: &ModeEstimate, last: &ModeEstimate) -> bool {
    let differ = |a: Estimate, b: Estimate| {
        let change = (a.value - b.value).abs();
        change > MOVED * a.std.hypot(b.std) && change > LEAST_CHANGE * a.value.abs()
    };
    differ(first.frequency_hz, last.frequency_hz) || differ(first.damping_ratio(), last.damping_ratio())
}
