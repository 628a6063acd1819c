//! Frequency response by auto and cross spectra.

use faer::Mat;
use num_complex::Complex64;

use super::blocks::{Block, BlockKind, Prepared, check};
use super::noise::{Pair, of_both, pooled, shared, width};
use crate::linear_algebra::definite_inverse;
use crate::spectra::SpectrumError;
use crate::spectra::error::positive;
use crate::spectra::{bin_frequencies, transform};

/// Which noise an estimate is free of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// That of the output: `Syu / Suu`.
    H1,
    /// That of the input: `Syy / Suy`.
    H2,
    /// The geometric mean of both: noise of both, in proportion to their signals.
    Hv,
}

impl Estimator {
    /// Its value over `H1`'s and its relative variance over `H1`'s, at an ordinary coherence.
    fn over_h1(self, coherence: f64) -> (f64, f64) {
        match self {
            Self::H1 => (1.0, 1.0),
            Self::H2 => (1.0 / coherence, 1.0),
            // magnitude (1 - g) / (2 n) and phase (1 - g) / (2 g n), of (1 - g) / (g n)
            Self::Hv => (1.0 / coherence.sqrt(), 0.5 * (1.0 + coherence)),
        }
    }
}

/// Settings of the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseSettings {
    /// Sample rate.
    pub sample_rate_hz: f64,
    /// Which noise it is free of.
    pub estimator: Estimator,
    /// What blocks are.
    pub kind: BlockKind,
    /// Power of an input, as a share of its largest, down to which a bin counts as excited.
    pub excited_share: f64,
}

/// Frequency responses.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredResponse {
    /// Bins in hertz.
    pub frequency_hz: Vec<f64>,
    /// Response of output `o` to input `i` at row `o * inputs + i`; NaN where an input has no power.
    pub transfer: Vec<Vec<Complex64>>,
    /// Expected squared error of each value, likewise; none of a single block per input.
    pub variance: Option<Vec<Vec<f64>>>,
    /// Expected squared error, relative to the response, that all outputs have in common since it is the input's noise:
    /// of `H1` of one input to several outputs; none else.
    pub input_noise: Option<Vec<f64>>,
    /// Share of each output's power that all inputs explain (with one input: the ordinary coherence); none likewise.
    pub coherence: Option<Vec<Vec<f64>>>,
    /// Independent blocks that the averages are worth.
    pub averages: f64,
    /// Lowest and highest bin, in hertz, of the band around each input's strongest one in which it is excited.
    pub excited_hz: Vec<[f64; 2]>,
    /// Of a periodic input whether each bin is one of its lines, of all inputs; none of other blocks.
    pub lines: Option<Vec<bool>>,
    /// Whether inputs were under a force window when they were recorded: the same number for half of the samples.
    pub windowed_before: bool,
}

/// Frequency responses of outputs to inputs, averaged over blocks.
///
/// # Model
/// `Y_b = G U_b + E_b` in each block `b`, with `E` independent of `U` and between blocks. `H1` takes inputs for free of
/// noise, `H2` outputs.
///
/// # Method
/// Means over blocks of `U U*`, `Y U*` and `|Y|^2`. One input: `H1 = Syu / Suu`, `H2 = Syy / Suy`, `Hv = H1 / abs(gamma)`
/// with `gamma^2 = |Syu|^2 / (Suu Syy)`. Several inputs: `H1 = Syu Suu^-1`. Offsets are removed: a segment's mean, a
/// hit's median (the signal rests for most of it). The exponential window is put on inputs and outputs alike, which moves
/// each pole by `-d` and leaves the ratio exact: a fit subtracts `d` from the decay rates that it finds. Periods are
/// transformed without a window: their lines are exact, what differs between them is noise. The noise of
/// which variances are is smooth over neighbouring bins, as many as give 160 degrees of freedom: of `H1` of hits that of
/// the output and the square of the response times that of the input, which the peaks show, else its mean share of the
/// power. So weights and intervals of fits are right with few blocks, too. Errors of several outputs to one input have the input's
/// noise in common: what is left of the outputs' cross spectra along the product of their responses.
///
/// # Shapes
/// Blocks of equal length N; results `[N/2 + 1]`, a row for each output and input.
///
/// # Units
/// Output over input.
///
/// # Accuracy
/// With `n` independent blocks and `p` inputs, `E|error|^2 = (1 - g) Syy / (n - p) (Suu^-1)_ii`: of one input
/// `(1 - g) |H|^2 / (g (n - 1))` with the estimated coherence `g`, unbiased for `H1`, half of it in each of real and
/// imaginary part (Bendat and Piersol, whose `n` is `n - 1` here since `g` is estimated from the same blocks). The
/// magnitude of `Hv` has the relative variance `(1 - g) / (2 n)`, its phase `(1 - g) / (2 g n)`. Noise of the input biases
/// `H1` by the factor `1 / (1 + noise / signal)`, noise of the output `H2` by the inverse. Half-overlapping Hann segments
/// are worth `S^2 / (S + P / 18)`, with `P` pairs of neighbours. What rings beyond a segment's end biases `H` near
/// resonances narrower than about four bins and is counted as noise by the coherence. One block has no coherence. Noise
/// that is far from smooth over some `80 / (n - p)` bins (of segments twice as many) has a variance that is not its own.
///
/// # Errors
/// No block, unequal lengths, values not finite, inputs that are zero throughout or (several) not independent, fewer
/// blocks than inputs, `H2` or `Hv` of several inputs.
///
/// # Source
/// J. S. Bendat, A. G. Piersol, Random Data, 2010, Eqs. 6.38, 7.87 and 9.52; D. J. Ewins, Modal Testing, 2000, section
/// 3.8; P. D. Welch, IEEE Trans. AU-15 (1967) 70.
pub fn frequency_response(blocks: &[Block<'_>], settings: ResponseSettings) -> Result<MeasuredResponse, SpectrumError> {
    positive("sample_rate_hz", settings.sample_rate_hz)?;
    let samples = check_blocks(blocks, settings)?;
    let sums = Sums::over(blocks, settings)?;
    if sums.power.iter().any(|power| power.iter().all(|bin| bin.re == 0.0)) {
        return Err(SpectrumError::NoInput);
    }
    let frequency_hz = bin_frequencies(samples, settings.sample_rate_hz);
    let count = blocks.len() as f64;
    let averages = match settings.kind {
        BlockKind::Segments => count * count / (count + (count - 1.0) / 18.0),
        BlockKind::Hits { .. } | BlockKind::Periods => count,
    };
    let (inputs, outputs) = (sums.inputs, sums.outputs);
    let bins = frequency_hz.len();
    let mut found = MeasuredResponse {
        transfer: vec![Vec::with_capacity(bins); inputs * outputs],
        variance: (blocks.len() > inputs).then(|| vec![Vec::with_capacity(bins); inputs * outputs]),
        input_noise: None,
        coherence: (blocks.len() > inputs).then(|| vec![Vec::with_capacity(bins); outputs]),
        averages,
        excited_hz: sums.excited(&frequency_hz, settings.excited_share),
        lines: None,
        windowed_before: sums.windowed_before,
        frequency_hz,
    };
    if settings.kind == BlockKind::Periods {
        let lines = sums.lines(settings.excited_share);
        if let Some(bands) = bands(&lines, &found.frequency_hz) {
            found.excited_hz = vec![bands; inputs];
        }
        found.lines = Some(lines);
    }
    let is_line = |bin: usize, found: &MeasuredResponse| found.lines.as_ref().is_none_or(|lines| lines[bin]);
    let mut noise = vec![Vec::with_capacity(bins); outputs];
    let mut gain = vec![Vec::with_capacity(bins); outputs];
    let mut scale = vec![Vec::with_capacity(bins); inputs * outputs];
    for bin in 0..bins {
        let inverse = sums.inverse(bin);
        for output in 0..outputs {
            let at = At { sums: &sums, inverse: inverse.as_deref(), bin, output };
            let own = at.put(settings.estimator, &mut found, &mut scale);
            // between the lines is what the system adds to them, too
            noise[output].push(if is_line(bin, &found) { own } else { f64::NAN });
            let own = &found.transfer[output * inputs..(output + 1) * inputs];
            gain[output].push(own.iter().map(|row| row[bin].norm_sqr()).sum());
        }
    }
    if let Some(variance) = &mut found.variance {
        let freedom = averages - inputs as f64;
        let width = width(settings.kind, freedom);
        // segments leave what rings beyond their ends, which is no noise of the input
        let smooth = |(noise, gain): (&Vec<f64>, &Vec<f64>)| match (settings.estimator, settings.kind) {
            (Estimator::H1, BlockKind::Hits { .. }) => of_both(noise, gain, width),
            _ => pooled(noise, width),
        };
        let noise: Vec<Vec<f64>> = noise.iter().zip(&gain).map(smooth).collect();
        for (row, scale) in scale.iter().enumerate() {
            let own = noise[row / inputs].iter().zip(scale);
            variance[row] = own.map(|(noise, scale)| noise * scale / freedom).collect();
        }
        if with_pairs(inputs, settings) && outputs > 1 {
            let common = shared(&sums.left(&found.transfer, &noise), width);
            let power = sums.power.first().into_iter().flatten();
            found.input_noise = Some(common.iter().zip(power).map(|(c, power)| c / (power.re * freedom)).collect());
        }
    }
    Ok(found)
}

/// Lowest and highest frequency of the lines; none of none.
fn bands(lines: &[bool], frequency_hz: &[f64]) -> Option<[f64; 2]> {
    let at = |bin: Option<usize>| bin.and_then(|bin| frequency_hz.get(bin).copied());
    Some([at(lines.iter().position(|line| *line))?, at(lines.iter().rposition(|line| *line))?])
}

/// Least share of an output's power that no input explains: what rounding leaves of the sums.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

fn check_blocks(blocks: &[Block<'_>], settings: ResponseSettings) -> Result<usize, SpectrumError> {
    let Some(first) = blocks.first() else { return Err(SpectrumError::TooShort { got: 0, wanted: 8 }) };
    let samples = check(first)?;
    let inputs = first.inputs.len();
    for block in blocks {
        let got = check(block)?;
        let series = [block.inputs.len(), block.outputs.len()];
        if got != samples || series != [inputs, first.outputs.len()] {
            return Err(SpectrumError::Lengths { name: "a block", got, wanted: samples });
        }
    }
    if inputs > 1 && settings.estimator != Estimator::H1 {
        let wanted = "one where the estimator is H2 or Hv: several inputs have H1 alone";
        return Err(SpectrumError::Setting { name: "the number of inputs", got: inputs as f64, wanted });
    }
    if blocks.len() < inputs {
        let wanted = "at least as many as inputs";
        return Err(SpectrumError::Setting { name: "the number of blocks", got: blocks.len() as f64, wanted });
    }
    Ok(samples)
}

/// Sums of spectra over blocks, each over bins.
struct Sums {
    inputs: usize,
    outputs: usize,
    /// `U_i U_j*` at row `i * inputs + j`.
    power: Vec<Vec<Complex64>>,
    /// `Y_o U_i*` at row `o * inputs + i`.
    cross: Vec<Vec<Complex64>>,
    /// `|Y_o|^2`.
    output: Vec<Vec<f64>>,
    /// `Y_o Y_p*` of all pairs, the first output with each later one, then the second.
    outputs_cross: Vec<Vec<Complex64>>,
    windowed_before: bool,
}

impl Sums {
    fn over(blocks: &[Block<'_>], settings: ResponseSettings) -> Result<Self, SpectrumError> {
        let (inputs, outputs) = blocks.first().map_or((0, 0), |block| (block.inputs.len(), block.outputs.len()));
        let mut sums = Self {
            inputs,
            outputs,
            power: vec![Vec::new(); inputs * inputs],
            cross: vec![Vec::new(); outputs * inputs],
            output: vec![Vec::new(); outputs],
            outputs_cross: vec![Vec::new(); if with_pairs(inputs, settings) { pairs(outputs).count() } else { 0 }],
            windowed_before: true,
        };
        for block in blocks {
            let prepared = Prepared::of(block, settings.kind, settings.sample_rate_hz);
            sums.windowed_before &= prepared.windowed_before;
            let series: Vec<&[f64]> = prepared.inputs.iter().chain(&prepared.outputs).map(Vec::as_slice).collect();
            let spectra = transform(&series)?;
            let (u, y) = spectra.split_at(inputs);
            for (row, sum) in sums.power.iter_mut().enumerate() {
                add(sum, u[row / inputs].iter().zip(&u[row % inputs]).map(|(a, b)| a * b.conj()));
            }
            for (row, sum) in sums.cross.iter_mut().enumerate() {
                add(sum, y[row / inputs].iter().zip(&u[row % inputs]).map(|(a, b)| a * b.conj()));
            }
            for (sum, y) in sums.output.iter_mut().zip(y) {
                add(sum, y.iter().map(Complex64::norm_sqr));
            }
            for (sum, (o, p)) in sums.outputs_cross.iter_mut().zip(pairs(outputs)) {
                add(sum, y[o].iter().zip(&y[p]).map(|(a, b)| a * b.conj()));
            }
        }
        Ok(sums)
    }

    /// The band around each input's strongest bin in which its power stays above a share of that bin's.
    fn excited(&self, frequency_hz: &[f64], share: f64) -> Vec<[f64; 2]> {
        let band = |input: usize| {
            let power: Vec<f64> = self.power[input * self.inputs + input].iter().map(|bin| bin.re).collect();
            // zero hertz holds what is left of the offset
            let peak = (1..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b])).unwrap_or(0);
            let excited = |k: &usize| power[*k] >= share * power[peak];
            let low = (0..=peak).rev().take_while(excited).last().unwrap_or(peak);
            let high = (peak..power.len()).take_while(excited).last().unwrap_or(peak);
            [frequency_hz[low], frequency_hz[high]]
        };
        (0..self.inputs).map(band).collect()
    }

    /// Whether each bin has the share of the power of the strongest one of every input; not zero hertz, which holds what is
    /// left of the offset.
    fn lines(&self, share: f64) -> Vec<bool> {
        let own = |input: usize| self.power[input * self.inputs + input].iter().map(|bin| bin.re).collect::<Vec<f64>>();
        let powers: Vec<Vec<f64>> = (0..self.inputs).map(own).collect();
        let peaks: Vec<f64> = powers.iter().map(|power| power.iter().skip(1).copied().fold(0.0, f64::max)).collect();
        let bins = powers.first().map_or(0, Vec::len);
        let is_line = |bin: usize| bin > 0 && powers.iter().zip(&peaks).all(|(power, peak)| power[bin] >= share * peak);
        (0..bins).map(is_line).collect()
    }

    /// What one input leaves of each pair of outputs: `Y_o Y_p* - H_o H_p* |U|^2`.
    fn left<'a>(&self, transfer: &'a [Vec<Complex64>], noise: &'a [Vec<f64>]) -> Vec<Pair<'a>> {
        let power = self.power.first().map_or(&[][..], Vec::as_slice);
        let of = |(cross, (o, p)): (&Vec<Complex64>, (usize, usize))| {
            let explained = transfer[o].iter().zip(&transfer[p]).zip(power).map(|((a, b), u)| a * b.conj() * u.re);
            Pair {
                left: cross.iter().zip(explained).map(|(all, explained)| all - explained).collect(),
                responses: [&transfer[o], &transfer[p]],
                noise: [&noise[o], &noise[p]],
            }
        };
        self.outputs_cross.iter().zip(pairs(self.outputs)).map(of).collect()
    }

    /// The inverse of the inputs' power in a bin; none where it has none.
    fn inverse(&self, bin: usize) -> Option<Vec<Complex64>> {
        let p = self.inputs;
        let at = |i: usize, j: usize| self.power[i * p + j][bin];
        if p == 1 {
            let power = at(0, 0).re;
            return (power > 0.0).then(|| vec![Complex64::new(1.0 / power, 0.0)]);
        }
        // a complex matrix as a real one of twice the size
        let real = Mat::from_fn(2 * p, 2 * p, |i, j| match (i < p, j < p) {
            (true, true) | (false, false) => at(i % p, j % p).re,
            (true, false) => -at(i, j - p).im,
            (false, true) => at(i - p, j).im,
        });
        let inverse = definite_inverse(&real)?;
        let finite = (0..2 * p).all(|i| inverse[(i, i)].is_finite());
        finite
            .then(|| (0..p * p).map(|k| Complex64::new(inverse[(k / p, k % p)], inverse[(k / p + p, k % p)])).collect())
    }
}

/// Whether the noise that outputs have in common is sought.
fn with_pairs(inputs: usize, settings: ResponseSettings) -> bool {
    inputs == 1 && settings.estimator == Estimator::H1 && matches!(settings.kind, BlockKind::Hits { .. })
}

/// Pairs of different outputs.
fn pairs(outputs: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..outputs).flat_map(move |o| (o + 1..outputs).map(move |p| (o, p)))
}

fn add<T: Copy + std::ops::AddAssign>(sum: &mut Vec<T>, values: impl Iterator<Item = T>) {
    if sum.is_empty() {
        sum.extend(values);
    } else {
        sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
}

/// An output in a bin.
struct At<'a> {
    sums: &'a Sums,
    inverse: Option<&'a [Complex64]>,
    bin: usize,
    output: usize,
}

impl At<'_> {
    /// Appends values and coherence, and the `scale` of variances; the noise that they are of.
    fn put(&self, estimator: Estimator, found: &mut MeasuredResponse, scale: &mut [Vec<f64>]) -> f64 {
        let p = self.sums.inputs;
        let cross = |i: usize| self.sums.cross[self.output * p + i][self.bin];
        let power = self.sums.output[self.output][self.bin];
        let h1: Vec<Complex64> = (0..p)
            .map(|i| match self.inverse {
                Some(inverse) => (0..p).map(|j| cross(j) * inverse[j * p + i]).sum(),
                None => Complex64::new(f64::NAN, f64::NAN),
            })
            .collect();
        let explained: f64 = (0..p).map(|i| (h1[i] * cross(i).conj()).re).sum();
        let coherence = if power > 0.0 { (explained / power).clamp(0.0, 1.0) } else { f64::NAN };
        // of sums, over blocks of which some are correlated: their number cancels, the independent ones count
        let rest = (1.0 - coherence).max(ROUNDING);
        let of_output = estimator == Estimator::H1;
        for i in 0..p {
            let row = self.output * p + i;
            let of_input = self.inverse.map_or(f64::NAN, |inverse| inverse[i * p + i].re);
            let (factor, spread) = estimator.over_h1(coherence);
            found.transfer[row].push(h1[i] * factor);
            scale[row].push(if of_output { 1.0 } else { power } * of_input * factor * factor * spread);
        }
        if let Some(rows) = &mut found.coherence {
            rows[self.output].push(coherence);
        }
        if of_output { power * rest } else { rest }
    }
}
