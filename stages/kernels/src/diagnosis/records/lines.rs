//! Lines in free and loaded stretches, faster than the slow channel sees.

use super::judge::JudgeOptions;
use super::replicates::jackknife;
use super::sign::{RecordSign, gain, value};
use super::spectra::{LineSpectra, Spectrum};
use super::summary::RecordSummary;
use super::yardstick::{Yardstick, of_many};

/// Bins of a line: Hann's main lobe.
const LOBE: usize = 1;
/// Neighbours on either side that a line is compared with: beyond its lobe, nearer than the spectrum bends.
const NEAR: (usize, usize) = (4, 11);
/// Independent powers among the neighbours over those in the lobe. Hann's bins correlate by 4/9 and 1/36 at one and two
/// bins: the mean of three has 0.537 of one bin's variance, that of two times eight 0.114.
const NEIGHBOURS: f64 = 0.537 / 0.114;
/// First bin looked at: below, the spectrum is too steep (and the slow channel sees it).
const FIRST_BIN: usize = 12;
/// Width of a resonance, in bins, from which nothing of it is as narrow as the window: a quarter of the length still
/// resolves it.
const BROAD: f64 = 16.0;
/// Lines looked at before giving up: resonances among them are passed over.
const MOST_PEAKS: usize = 64;
/// A resonance's excess over its neighbours that still counts as a line's at the short length. A line's density falls
/// to a quarter there.
const QUARTER: f64 = 0.25;

/// The spectra of an archive, each scaled by its own median level.
struct Archive<'a> {
    spectra: Vec<&'a LineSpectra>,
    levels: Vec<f64>,
    interval_s: f64,
}

/// A line found.
struct Line {
    bin: usize,
    p: f64,
    ratio: f64,
}

/// The strongest line that is none of a resonance's.
///
/// # Method
/// Per record the mean Hann periodogram of its stretches, over its median; averaged over records, each as much as it
/// has windows. Three bins against the sixteen at 4 to 11 bins on either side; the law of that ratio from all bins. A
/// line is as narrow as the window: nothing is left two and three bins off, and at a quarter of the length its density
/// falls to a quarter, while that of a resonance stays.
pub(super) fn judge_lines(records: &[RecordSummary], slow_hz: &[f64], options: &JudgeOptions) -> Option<RecordSign> {
    let archive = Archive::new(records)?;
    let long = archive.mean(|spectra| &spectra.long, |_| true);
    let short = archive.mean(|spectra| &spectra.short, |_| true);
    let ratios: Vec<f64> = (0..long.len()).map(|k| ratio(&long, k)).collect();
    let searched = FIRST_BIN..long.len().saturating_sub(NEAR.1 + 1);
    let yardstick = Yardstick::new(ratios.get(searched.clone())?, NEIGHBOURS)?;
    let of_short: Vec<f64> = (0..short.len()).map(|k| ratio(&short, k)).collect();
    let yardstick_short =
        Yardstick::new(of_short.get(FIRST_BIN / 4..short.len().saturating_sub(NEAR.1 + 1))?, NEIGHBOURS)?;
    let mut order: Vec<usize> = searched.clone().filter(|&k| ratios[k].is_finite()).collect();
    order.sort_by(|&a, &b| ratios[b].total_cmp(&ratios[a]).then(a.cmp(&b)));
    let mut passed: Vec<usize> = Vec::new();
    let mut found: Vec<Line> = Vec::new();
    for k in order {
        let p = of_many(yardstick.tail(ratios[k]), searched.len());
        if p.is_nan() || p >= options.false_alarm_rate || passed.len() >= MOST_PEAKS {
            break;
        }
        let shadowed = passed.iter().any(|&peak| k.abs_diff(peak) <= NEAR.1 + 1)
            || found.iter().any(|line| leaks(line, k, ratios[k]));
        if shadowed {
            continue;
        }
        passed.push(k);
        let narrow = is_narrow(&long, &short, k, &yardstick, &yardstick_short);
        if narrow && !archive.excluded(k, slow_hz, options) {
            found.push(Line { bin: k, p, ratio: ratios[k] });
        }
    }
    let strongest = found.iter().min_by(|a, b| a.p.total_cmp(&b.p).then(b.ratio.total_cmp(&a.ratio)))?;
    Some(archive.sign(strongest, found.len() - 1))
}

/// Mean of the lobe over the mean of the neighbours on both sides.
fn ratio(density: &[f64], k: usize) -> f64 {
    match background(density, k) {
        Some(level) if level > 0.0 => lobe(density, k) / level,
        _ => f64::NAN,
    }
}

fn lobe(density: &[f64], k: usize) -> f64 {
    density[k - LOBE..=k + LOBE].iter().sum::<f64>() / (2 * LOBE + 1) as f64
}

fn background(density: &[f64], k: usize) -> Option<f64> {
    let (near, far) = NEAR;
    if k < far + 1 || k + far >= density.len() {
        return None;
    }
    let sum: f64 = density[k - far..=k - near].iter().chain(&density[k + near..=k + far]).sum();
    Some(sum / (2 * (far - near + 1)) as f64)
}

/// Whether the window's side lobes of a line reach that bin: amplitude `1 / (pi d^3)` at `d` bins (F. J. Harris, Proc.
/// IEEE 66 (1978) 51).
fn leaks(line: &Line, k: usize, ratio: f64) -> bool {
    let d = k.abs_diff(line.bin) as f64;
    ratio < 10.0 * 3.0 * line.ratio / (std::f64::consts::PI * d.powi(3)).powi(2) + 1.0
}

/// Whether a peak is as narrow as the window at both lengths.
fn is_narrow(long: &[f64], short: &[f64], k: usize, of_long: &Yardstick, of_short: &Yardstick) -> bool {
    let Some(level) = background(long, k) else { return false };
    let excess = lobe(long, k) - level;
    // skirt: two bins off by up to half a bin's offset (Hann: 3 % of the peak), and three; four bins have 3/4 of a
    // lobe's variance
    let skirt = (long[k - 3] + long[k - 2] + long[k + 2] + long[k + 3]) / 4.0 - level;
    if skirt > 0.1 * excess + 4.0 * of_long.spread() * level {
        return false;
    }
    let at = (k + 2) / 4;
    match background(short, at) {
        Some(level_short) => {
            let excess_short = lobe(short, at) - level_short;
            // the offset from the short length's bin loses or gains a tenth
            excess_short <= 1.3 * QUARTER * excess + 3.0 * of_short.spread() * level_short
        }
        // too low for the short length: its skirt has decided
        None => true,
    }
}

impl<'a> Archive<'a> {
    /// The records whose spectra have the commonest length and interval.
    fn new(records: &'a [RecordSummary]) -> Option<Self> {
        let key =
            |record: &RecordSummary| record.spectra.as_ref().map(|s| (s.long.length, record.interval_s.to_bits()));
        let mut keys: Vec<_> = records.iter().filter_map(key).collect();
        keys.sort_unstable();
        let commonest = keys.chunk_by(|a, b| a == b).max_by_key(|run| run.len())?[0];
        let level = |spectra: &LineSpectra| {
            let mut bins: Vec<f64> = spectra.long.density.iter().map(|&d| f64::from(d)).collect();
            // median over mean of a chi-square variable of two degrees for each window (E. B. Wilson, M. M. Hilferty,
            // PNAS 17 (1931) 684)
            crate::statistics::median(&mut bins) / (1.0 - 1.0 / (9.0 * spectra.long.windows.max(1) as f64)).powi(3)
        };
        let same = records.iter().filter(|record| key(record) == Some(commonest)).filter_map(|r| r.spectra.as_ref());
        let (spectra, levels): (Vec<_>, Vec<_>) =
            same.map(|spectra| (spectra, level(spectra))).filter(|(_, level)| *level > 0.0).unzip();
        (!spectra.is_empty()).then_some(Self { spectra, levels, interval_s: f64::from_bits(commonest.1) })
    }

    /// Mean over the chosen records' windows of the spectra over their levels.
    fn mean(&self, which: impl Fn(&LineSpectra) -> &Spectrum, wanted: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut sum = Vec::new();
        let mut count = 0.0;
        for (k, (spectra, level)) in self.spectra.iter().zip(&self.levels).enumerate() {
            if !wanted(k) {
                continue;
            }
            let density = &which(spectra).density;
            sum.resize(density.len(), 0.0);
            // weights as the windows': otherwise a record of one window would lend the mean its heavy tail
            let weight = which(spectra).windows as f64;
            sum.iter_mut().zip(density).for_each(|(sum, d): (&mut f64, _)| *sum += weight * f64::from(*d) / level);
            count += weight;
        }
        sum.iter_mut().for_each(|sum| *sum /= count);
        sum
    }

    fn bin_hz(&self) -> f64 {
        1.0 / (self.spectra[0].long.length as f64 * self.interval_s)
    }

    /// Near a known resonance that could look like a line, or a slow line that is already taken.
    fn excluded(&self, k: usize, slow_hz: &[f64], options: &JudgeOptions) -> bool {
        let (bin, f) = (self.bin_hz(), k as f64 * self.bin_hz());
        let lever = |r: &super::judge::Resonance| {
            let width = r.frequency_hz / r.quality_factor.max(1.0);
            width < BROAD * bin && (f - r.frequency_hz).abs() < 3.0 * width + 2.0 * bin
        };
        options.resonances.iter().any(lever) || slow_hz.iter().any(|slow| (f - slow).abs() < 3.0 * bin)
    }

    /// Amplitude in V and frequency in Hz of the line at that bin, from some records.
    fn measure(&self, k: usize, wanted: impl Fn(usize) -> bool + Copy) -> (f64, f64) {
        let density = self.mean(|spectra| &spectra.long, wanted);
        let level = background(&density, k).unwrap_or(0.0);
        let excess = |j: usize| (density[j] - level).max(0.0);
        let levels: Vec<f64> = self.levels.iter().enumerate().filter(|(j, _)| wanted(*j)).map(|(_, l)| *l).collect();
        let scale = levels.iter().sum::<f64>() / levels.len() as f64;
        // five bins hold all of a line's power to 1e-3: A^2 / 2
        let power = (density[k - 2..=k + 2].iter().sum::<f64>() - 5.0 * level).max(0.0) * scale * self.bin_hz();
        // of the lobe's bins the largest and its larger neighbour give the offset, Hann: (2 a - 1) / (a + 1)
        let peak = (k - 1..=k + 1).max_by(|&a, &b| density[a].total_cmp(&density[b])).unwrap_or(k);
        let (side, other) = if density[peak + 1] >= density[peak - 1] { (1.0, peak + 1) } else { (-1.0, peak - 1) };
        let a = (excess(other) / excess(peak).max(f64::MIN_POSITIVE)).sqrt();
        let offset = ((2.0 * a - 1.0) / (a + 1.0)).clamp(-0.5, 0.5);
        ((2.0 * power).sqrt(), (peak as f64 + side * offset) * self.bin_hz())
    }

    fn sign(&self, line: &Line, others: usize) -> RecordSign {
        let count = self.spectra.len();
        let (amplitude, frequency) = self.measure(line.bin, |_| true);
        let left_out: Vec<(f64, f64)> = match count {
            1 => Vec::new(),
            _ => (0..count).map(|out| self.measure(line.bin, |k| k != out)).collect(),
        };
        let errors = (
            jackknife(&left_out.iter().map(|l| l.0).collect::<Vec<_>>()),
            jackknife(&left_out.iter().map(|l| l.1).collect::<Vec<_>>()),
        );
        let (before, after) = self.held_out(line.bin);
        RecordSign {
            id: "spurious-line",
            p_value: line.p,
            parameters: vec![
                ("amplitude", value(amplitude, errors.0, "V")),
                ("frequency_hz", value(frequency, errors.1, "Hz")),
            ],
            evidence: format!(
                "a line at {frequency:.0} Hz in free and loaded stretches, {:.1} times its neighbours and as narrow as the window at two lengths{}",
                line.ratio,
                if others > 0 { format!("; {others} more of the kind") } else { String::new() }
            ),
            gain: gain(before, after, "the other half of the records: amplitude from one half, phase free in each"),
            runner_up: None,
            tied: false,
        }
    }

    /// Rms of all stretches, V, without and with the line: what the other half's amplitude, at a free phase, takes from
    /// (or, where it is too large, leaves in) the power at its bin.
    fn held_out(&self, k: usize) -> (f64, f64) {
        if self.spectra.len() < 2 {
            return (f64::NAN, f64::NAN);
        }
        let (mut before, mut after) = (0.0, 0.0);
        for parity in 0..2 {
            let held = self.mean(|spectra| &spectra.long, |j| j % 2 == parity);
            let levels: Vec<f64> = self.levels.iter().skip(parity).step_by(2).copied().collect();
            let scale = levels.iter().sum::<f64>() / levels.len() as f64 * self.bin_hz();
            let (fitted, own) = (self.measure(k, |j| j % 2 != parity).0, self.measure(k, |j| j % 2 == parity).0);
            let total = held.iter().sum::<f64>() * scale;
            before += 0.5 * total;
            after += 0.5 * (total - 0.5 * own * own + 0.5 * (own - fitted).powi(2));
        }
        (before.sqrt(), after.max(0.0).sqrt())
    }
}
