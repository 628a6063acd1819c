//! What recordings look like: snap-offs of a lever, free decays, measured input and output, a steady oscillation.

use afmid_kernels::events::decay::{DecaySearch, DecaySearchOptions, FreeDecay, find_decays};
use afmid_kernels::harmonics::{HarmonicOptions, fit_harmonics};
use afmid_kernels::signal::{Detrend, Welch};
use afmid_kernels::spectra::{AveragedDensity, Fitted, SeenThrough, ThermalFitSettings, thermal_fit};
use afmid_kernels::statistics::median;
use afmid_pipeline::recording::{InputFiles, Reading, open_unpacked, responses as responses_of};

use super::channels::{drives, input_and_output, is_named, named, nothing, sensors, usable};
use super::pipeline::{Wanted, segment_samples};
use super::recordings::Source;
use crate::cli::{Goal, RecordsAre};
use crate::inspect::{Channel, counted, first_samples};
use crate::show::number;

/// Why something cannot be chosen, and what to do.
pub type Question = (String, Option<String>);

/// What a config is written for.
#[derive(Debug)]
pub struct Choice<'a> {
    pub goal: Goal,
    /// The signals; of all goals but decays one.
    pub channels: Vec<&'a Channel>,
    /// The measured inputs; of input and output alone.
    pub inputs: Vec<&'a Channel>,
    /// Whether the input is a hammer's: short against the record.
    pub struck: bool,
    /// Samples of a block of several hits.
    pub block_samples: Option<usize>,
    /// What files and channels are, where the stage's default is not meant.
    pub records_are: Option<RecordsAre>,
    /// Why, for a comment in the config; empty where the user chose.
    pub why: String,
}

/// Least step of the level, in peaks of the ringing, that a snap-off has: it lets the whole load go.
const STEP: f64 = 0.5;

/// Standard errors that width and height of a resonance in noise have at least: noise alone has as much once in a thousand
/// spectra.
const KNOWN: f64 = 3.29;
/// Least quality factor of a resonance: below it the density has no maximum.
const LEAST_QUALITY: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Chooses by what the first file holds, as far as the user has not. Errors: what is not known, and how to say it.
pub fn choose<'a>(source: &'a Source, wanted: &Wanted<'_>) -> Result<Choice<'a>, Question> {
    match wanted.goal {
        Some(Goal::Decay) => decay(source, wanted, false),
        Some(goal @ Goal::InputOutput) => input_output(source, wanted, Some(goal)),
        Some(Goal::Frf) if wanted.inputs.is_empty() && has_responses(source, true) => Ok(responses(source)),
        Some(goal @ Goal::Frf) => input_output(source, wanted, Some(goal)),
        Some(goal) => one_channel(source, wanted, goal, String::new()),
        None if !wanted.inputs.is_empty() => input_output(source, wanted, None),
        None if has_responses(source, false) => Ok(responses(source)),
        None if looks_like_a_lever(source) && !rings_without_a_step(source, wanted) => {
            let why = format!("snap-offs: {} is of a force microscope", source.format);
            one_channel(source, wanted, Goal::Modes, why)
        }
        None if wanted.channels.len() < 2 && has_input(source, wanted) => input_output(source, wanted, None),
        None => decay(source, wanted, true),
    }
}

/// Whether a channel is named as an input and not wanted as the signal.
fn has_input(source: &Source, wanted: &Wanted<'_>) -> bool {
    let signal = |channel: &Channel| wanted.channels.iter().any(|name| is_named(channel, name));
    source.channels.iter().any(|channel| usable(&channel) && drives(channel) && !signal(channel))
}

/// Whether the file holds frequency responses; `guessed`: even if nothing in it says so.
fn has_responses(source: &Source, guessed: bool) -> bool {
    let opened = open_unpacked(&InputFiles::new(), &source.file, &Reading::of("auto", None));
    let found = opened.ok().and_then(|opened| responses_of(&opened.contents, None).ok()).unwrap_or_default();
    !found.is_empty() && (guessed || found.iter().all(|response| !response.guessed))
}

fn responses(source: &Source) -> Choice<'_> {
    let channels = source.channels.iter().take(1).collect();
    let why = format!("frequency responses in {}", name(source));
    Choice { goal: Goal::Frf, channels, inputs: Vec::new(), struck: false, block_samples: None, records_are: None, why }
}

/// Measured input and output: of a hammer's hits the frequency response, else a transfer function.
fn input_output<'a>(source: &'a Source, wanted: &Wanted<'_>, goal: Option<Goal>) -> Result<Choice<'a>, Question> {
    let (inputs, output) = input_and_output(source, wanted)?;
    let force = read_first(source, inputs[0]).unwrap_or_default();
    let struck = is_struck(&force);
    let hits = if struck { hits(&force) } else { Vec::new() };
    let goal = goal.unwrap_or(if struck { Goal::Frf } else { Goal::InputOutput });
    let names: Vec<&str> = inputs.iter().map(|input| input.location.as_str()).collect();
    let short = if struck { ", which is short as a hammer's," } else { "" };
    let why = format!("measured input {}{short} and output {} in {}", names.join(", "), output.location, name(source));
    // a block is as long as the hits are apart, less a twentieth for those that come early
    let apart = hits.windows(2).map(|pair| pair[1] - pair[0]).min().map(|samples| samples - samples / 20);
    Ok(Choice { goal, channels: vec![output], inputs, struck, block_samples: apart, records_are: None, why })
}

/// Share of the largest force that is a hit's.
const HIT: f64 = 0.3;
/// Samples within which a hit is over, at most: what bounces within them is one hit.
const OVER: usize = 256;

/// Samples of the hits' first large forces.
fn hits(force: &[f64]) -> Vec<usize> {
    let level = median(&mut force.to_vec());
    let largest = force.iter().map(|f| (f - level).abs()).fold(0.0, f64::max);
    let mut found: Vec<usize> = Vec::new();
    for (k, f) in force.iter().enumerate() {
        if (f - level).abs() > HIT * largest && found.last().is_none_or(|last| k - last > OVER) {
            found.push(k);
        }
    }
    found
}

/// Share of the samples in which a hammer's force has half of its energy, at most.
const SHORT: usize = 100;

/// Whether half of a force's energy about its median lies within a hundredth of the samples.
fn is_struck(force: &[f64]) -> bool {
    let level = median(&mut force.to_vec());
    let mut squares: Vec<f64> = force.iter().map(|f| (f - level).powi(2)).collect();
    squares.sort_by(|a, b| b.total_cmp(a));
    let largest: f64 = squares.iter().take(squares.len().div_ceil(SHORT)).sum();
    2.0 * largest > squares.iter().sum()
}

/// A channel's first samples.
fn read_first(source: &Source, channel: &Channel) -> Result<Vec<f64>, Question> {
    let plain = |problem: String| (format!("{}: {problem}", source.file.display()), None);
    let opened = open_unpacked(&InputFiles::new(), &source.file, &Reading::of("auto", None))
        .map_err(|error| plain(error.to_string()))?;
    let found = opened.contents.channels.iter().find(|found| found.location == channel.location);
    let found = found.ok_or_else(|| plain(format!("there is no channel {}", channel.location)))?;
    first_samples(found).map_err(|error| plain(error.to_string()))
}

fn one_channel<'a>(source: &'a Source, wanted: &Wanted<'_>, goal: Goal, why: String) -> Result<Choice<'a>, Question> {
    let channel = match wanted.channels {
        [] => source.best.and_then(|index| source.channels.get(index)).ok_or_else(|| nothing(source))?,
        [one] => named(source, one)?,
        [_, second, ..] => {
            let help = "several sensors go with --goal decay".to_owned();
            return Err((format!("one channel was wanted, --channel {second} is another"), Some(help)));
        }
    };
    Ok(Choice {
        goal,
        channels: vec![channel],
        inputs: Vec::new(),
        struck: false,
        block_samples: None,
        records_are: None,
        why,
    })
}

/// Formats of force microscopes, and afmid's own; or a channel that is named as a deflection.
fn looks_like_a_lever(source: &Source) -> bool {
    let format = source.format.to_lowercase();
    let of_microscope = ["native", "jpk", "nanoscope", "igor"].iter().any(|name| format.contains(name));
    let named = source.channels.iter().any(|channel| channel.location.to_lowercase().contains("defl"));
    named || of_microscope
}

/// Whether the best channel rings down from about the level that it rings round: nothing was let go.
fn rings_without_a_step(source: &Source, wanted: &Wanted<'_>) -> bool {
    let piezo = source.channels.iter().any(|channel| channel.location.to_lowercase().contains("piezo"));
    let best = source.best.and_then(|index| source.channels.get(index));
    let (Some(channel), false) = (best, piezo) else { return false };
    let Ok((values, found)) = search(source, &[channel], wanted) else { return false };
    let level = |decay: &FreeDecay| {
        let tail = &values[0][decay.range.start + decay.range.len() / 2..decay.range.end];
        tail.iter().sum::<f64>() / tail.len().max(1) as f64
    };
    let steps = found.decays.iter().filter(|decay| {
        let before = decay.channels.first().and_then(|channel| channel.level_before);
        let peak = decay.channels.first().map_or(f64::NAN, |channel| channel.peak.abs());
        before.is_none_or(|before| (before - level(decay)).abs() > STEP * peak)
    });
    2 * steps.count() < found.decays.len()
}

fn decay<'a>(source: &'a Source, wanted: &Wanted<'_>, guessed: bool) -> Result<Choice<'a>, Question> {
    if wanted.records_are == Some(RecordsAre::Points) {
        let help = "points go with frequency responses, --goal frf; free decays are of hits or sensors";
        return Err((
            "--as points: decays without a measured force have no common scale".to_owned(),
            Some(help.to_owned()),
        ));
    }
    let channels = match wanted.channels {
        [] => sensors(source)?,
        names => names.iter().map(|name| named(source, name)).collect::<Result<Vec<_>, _>>()?,
    };
    let cells = channels.len() > 1 && channels.iter().all(|channel| channel.location.ends_with('}'));
    let records_are = wanted.records_are.or(cells.then_some(RecordsAre::Hits));
    // cells are hits of their own: one is enough to see what they are
    let seen = if records_are == Some(RecordsAre::Hits) { &channels[..1] } else { &channels[..] };
    let (values, found) = search(source, seen, wanted)?;
    let record = name(source);
    let other = |goal, why| {
        let channel = channels[0];
        Ok(Choice {
            goal,
            channels: vec![channel],
            inputs: Vec::new(),
            struck: false,
            block_samples: None,
            records_are: None,
            why,
        })
    };
    let why = match (found.decays.first(), found.reason()) {
        (Some(_), _) if guessed && found.random => {
            return other(Goal::Thermal, format!("{record}: rises and falls of a random vibration, no free decays"));
        }
        (Some(first), _) => {
            let time_s = first.range.start as f64 / rate(source, seen[0], wanted)?;
            let from = format!("from {} s on, at {} Hz", number(time_s), number(first.frequency_hz));
            format!("{record}: {} {from}", counted(found.decays.len()))
        }
        (None, Some(reason)) if guessed && !found.steady.is_empty() && is_coherent(&values[0]) => {
            return other(Goal::Steady, format!("{record}: {reason}"));
        }
        (None, Some(_)) if guessed && has_resonance(&values[0]) => {
            return other(Goal::Thermal, format!("{record}: noise with a resonance in it"));
        }
        (None, Some(reason)) if guessed => {
            let help = "look at it with `afmid inspect`; --channel names the signal, --goal says what to find";
            return Err((format!("{}: no free decay, {reason}", source.file.display()), Some(help.to_owned())));
        }
        (None, reason) => format!("--goal decay; in {record}: {}", reason.unwrap_or_default()),
    };
    Ok(Choice { goal: Goal::Decay, channels, inputs: Vec::new(), struck: false, block_samples: None, records_are, why })
}

/// Whether one oscillation has most of the power, of the signal or of its differences, in which drift has none: the narrow
/// band of a resonance in noise has a phase that wanders.
fn is_coherent(values: &[f64]) -> bool {
    let most = |values: &[f64]| {
        fit_harmonics(values, 1.0, &HarmonicOptions::default()).is_ok_and(|fit| {
            let amplitude = fit.harmonics.first().map_or(0.0, |first| first.amplitude);
            0.5 * amplitude.powi(2) > fit.residual_rms.powi(2)
        })
    };
    most(values) || most(&values.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>())
}

/// Whether the spectrum of noise has a resonance: it is fitted, and stands above the floor.
fn has_resonance(values: &[f64]) -> bool {
    let segment = segment_samples(values.len());
    let spectrum = Welch::new(segment, 1.0, Detrend::Mean).and_then(|mut welch| {
        welch.push(values);
        Ok((welch.average()?, 1.0 / segment as f64))
    });
    let Ok((average, bin)) = spectrum else { return false };
    // the removed mean and the fold
    let inner = 4..average.density.len().saturating_sub(4);
    let frequency: Vec<f64> = inner.clone().map(|k| k as f64 * bin).collect();
    let density = AveragedDensity {
        frequency_hz: &frequency,
        density: average.density.get(inner).unwrap_or_default(),
        averages: average.independent_segments(),
        through: Some(SeenThrough::Hann),
    };
    thermal_fit(density, ThermalFitSettings::default()).is_ok_and(|fit| {
        // a fit to white noise has a width or a height that is within its error
        let known = |fitted: Fitted| fitted.value > KNOWN * fitted.std.max(fitted.robust_std);
        let at_peak =
            std::f64::consts::FRAC_2_PI * fit.variance.value * fit.quality_factor.value / fit.frequency_hz.value;
        let shown = at_peak > fit.white.value && fit.quality_factor.value > LEAST_QUALITY;
        shown && known(fit.quality_factor) && known(fit.variance)
    })
}

fn name(source: &Source) -> String {
    source.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The rate that the file states or the user. Errors: neither.
fn rate(source: &Source, channel: &Channel, wanted: &Wanted<'_>) -> Result<f64, Question> {
    channel.sample_rate_hz.or(wanted.rate_hz).ok_or_else(|| {
        let help = "say how many samples a second with --rate HZ".to_owned();
        (format!("{} states no sample rate", source.file.display()), Some(help))
    })
}

/// The channels' samples, and the decays in them. Errors: they cannot be read, or are of different lengths.
fn search(
    source: &Source,
    channels: &[&Channel],
    wanted: &Wanted<'_>,
) -> Result<(Vec<Vec<f64>>, DecaySearch), Question> {
    let rate = rate(source, channels[0], wanted)?;
    let plain = |problem: String| (format!("{}: {problem}", source.file.display()), None);
    let values: Vec<Vec<f64>> =
        channels.iter().map(|channel| read_first(source, channel)).collect::<Result<_, Question>>()?;
    let slices: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
    let found = find_decays(&slices, rate, &DecaySearchOptions::default());
    let found = found.map_err(|error| plain(error.to_string()))?;
    Ok((values, found))
}
