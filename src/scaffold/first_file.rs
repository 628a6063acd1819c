//! The samples of the file that stands for all of its kind.

use std::cell::OnceCell;
use std::path::PathBuf;

use afmid_kernels::events::decay::{DecaySearch, DecaySearchOptions, DecayTrigger, find_decays};
use afmid_kernels::harmonics::find_decays_beside_lines;
use afmid_kernels::spectra::{half_energy_samples, is_impulsive};
use afmid_pipeline::recording::{
    Contents, FoundChannel, FoundResponse, Measurement, Reading, UnpackedContents, begun_together, contradiction,
    gains_without_phase, mean_rate, open_unpacked, put_together, responses, says_frequencies,
};

use super::channels::{inputs, some_of, usable};
use super::choice::Question;
use super::pipeline::Wanted;
use super::recordings::Source;
use super::stated::missing;
use crate::inspect::{Channel, first_samples};
use crate::show::number;

/// How many times as many samples as a hammer's pulse ringing has half of its energy in, at least: the pulse takes half a
/// period or less of what it excites, half of its energy a sixth; of ringing of Q = 5 or more it is a third or more.
const RINGS: usize = 2;

/// The first file, opened once it is asked for.
#[derive(Debug)]
pub struct FirstFile<'a> {
    pub source: &'a Source,
    opened: OnceCell<Result<Opened, String>>,
}

/// One file, or several of one measurement.
#[derive(Debug)]
enum Opened {
    File(UnpackedContents),
    Files(Measurement),
}

impl<'a> FirstFile<'a> {
    pub const fn new(source: &'a Source) -> Self {
        Self { source, opened: OnceCell::new() }
    }

    fn contents(&self) -> Result<&Contents, String> {
        let open = || {
            let (files, reading) = (&self.source.opened, Reading::of("auto", None).resampled(self.source.resample));
            let opened = if self.source.joined.is_empty() {
                open_unpacked(files, &self.source.file, &reading).map(Opened::File)
            } else {
                let paths: Vec<PathBuf> = [&self.source.file].into_iter().chain(&self.source.joined).cloned().collect();
                Measurement::open(files, &paths, &reading).map(Opened::Files)
            };
            opened.map_err(|error| error.to_string())
        };
        match self.opened.get_or_init(open) {
            Ok(Opened::File(file)) => Ok(&file.contents),
            Ok(Opened::Files(files)) => Ok(files.contents()),
            Err(problem) => Err(problem.clone()),
        }
    }

    /// Whether it holds frequency responses; `guessed`: even if nothing in it says so.
    pub fn has_responses(&self, guessed: bool) -> bool {
        self.contents().is_ok_and(|contents| holds_responses(contents, guessed))
    }

    /// Why a file over frequencies holds no responses; none where it holds some, or nothing says that it has frequencies.
    pub fn no_responses(&self) -> Option<Question> {
        let contents = self.contents().ok()?;
        contents.channels.iter().find(|channel| says_frequencies(channel))?;
        let error = responses(contents, None).err()?;
        Some((format!("{}: {}", self.source.file.display(), error.problem), error.help))
    }

    /// That the file holds spectra and no record over time, and what reads them; none where it holds a record.
    pub fn spectrum(&self) -> Option<Question> {
        let contents = self.contents().ok()?;
        if let Some(Err(error)) =
            contents.responses.first().map(|response| response.frequency_channel(&contents.channels))
        {
            return Some((format!("{}: {}", self.source.file.display(), error.problem), error.help));
        }
        let (axis, spectra) = self.spectra(false)?;
        let file = self.source.file.display();
        let gains = gains_without_phase(contents);
        if !gains.is_empty() {
            let problem = format!("{file}: {} over {axis} without a phase: no frequency response", some_of(&gains));
            let help = "write the phase with it, as a column such as «Phase (deg)»: modes need both";
            return Some((problem, Some(help.to_owned())));
        }
        let problem =
            format!("{file}: {} over the frequencies {axis}: a spectrum, no record over time", some_of(&spectra));
        let responses = "--goal frf reads complex numbers, real and imaginary part, amplitude and phase of responses";
        let density = match &spectra[..] {
            [only] => format!("--goal thermal takes {only} for a power density"),
            _ => "--goal thermal --channel NAME takes one of them for a power density".to_owned(),
        };
        Some((problem, Some(format!("{responses}; {density}"))))
    }

    /// The axis of frequencies, and what lies over it; none where the file holds a record. `guessed`: even if the axis
    /// does not say that it is one of frequencies.
    pub fn spectra(&self, guessed: bool) -> Option<(String, Vec<String>)> {
        let contents = self.contents().ok()?;
        let untimed = |channel: &&FoundChannel| channel.is_axis && mean_rate(&contents.channels, channel).is_none();
        let said = contents.channels.iter().find(|channel| says_frequencies(channel));
        let axis = said.or_else(|| contents.channels.iter().find(untimed).filter(|_| guessed))?;
        let over = |channel: &&FoundChannel| !channel.is_axis && channel.sample_rate_hz.is_none();
        let of_length = |channel: &&FoundChannel| over(channel) && channel.samples == axis.samples;
        let spectra: Vec<String> = contents.channels.iter().filter(of_length).map(|c| c.location.clone()).collect();
        let timed = contents.channels.iter().any(|channel| !channel.is_axis && channel.sample_rate_hz.is_some());
        (!timed && !spectra.is_empty()).then(|| (axis.location.clone(), spectra))
    }

    /// Whether free decays are in a channel, each of its samples taken as one of time.
    pub fn rings(&self, channel: &Channel) -> bool {
        let Ok(values) = self.samples(channel) else { return false };
        let rate = channel.sample_rate_hz.unwrap_or(1.0);
        let found = find_decays(&[&values], rate, &DecaySearchOptions::default());
        found.is_ok_and(|found| !found.decays.is_empty())
    }

    /// That the rate which the user gives is not that of the times beside a channel.
    pub fn contradicted_rate(&self, channel: &Channel, wanted: &Wanted<'_>) -> Option<String> {
        let channels = &self.contents().ok()?.channels;
        let found = channels.iter().find(|found| found.location == channel.location)?;
        contradiction(channels, found, wanted.rate_hz?)
    }

    /// The mean rate of the times beside a channel that give none.
    pub fn mean_rate(&self, channel: &Channel) -> Option<String> {
        let channels = &self.contents().ok()?.channels;
        let found = channels.iter().find(|found| found.location == channel.location)?;
        let (rate, axis) = mean_rate(channels, found)?;
        Some(format!("the times in {axis} have {} samples a second on average", number(rate)))
    }

    /// A channel's first samples. Errors: they cannot be read.
    pub fn samples(&self, channel: &Channel) -> Result<Vec<f64>, Question> {
        let channels = &self.contents().map_err(|problem| self.plain(&problem))?.channels;
        let found = channels.iter().find(|found| found.location == channel.location);
        let found = found.ok_or_else(|| self.plain(&format!("there is no channel {}", channel.location)))?;
        first_samples(found).map_err(|error| self.plain(&error.to_string()))
    }

    /// Samples that channels have together, as `io.columns` takes them, and those before which one was interrupted. Errors:
    /// they cannot be read; clocks that do not agree.
    pub fn together(&self, channels: &[&Channel], wanted: &Wanted<'_>) -> Result<(usize, Vec<usize>), Question> {
        let all = &self.contents().map_err(|problem| self.plain(&problem))?.channels;
        let of = |channel: &&Channel| all.iter().find(|found| found.location == channel.location);
        let found: Vec<&FoundChannel> = channels.iter().filter_map(of).collect();
        let moved = match self.source.joined.is_empty() {
            true => begun_together(&found).map(|moved| moved.map(|(moved, _)| moved)),
            false => put_together(&found, wanted.rate_hz.is_some()).map(|(moved, _)| Some(moved)),
        };
        let moved = moved.map_err(|error| (error.problem, error.help))?;
        let moved = moved.unwrap_or_else(|| found.into_iter().cloned().collect());
        let samples = moved.iter().map(|channel| channel.samples).min().unwrap_or(0);
        Ok((samples, moved.iter().flat_map(|channel| channel.gaps.iter().copied()).collect()))
    }

    /// The rate that the file states or the user. Errors: neither.
    pub fn rate(&self, channel: &Channel, wanted: &Wanted<'_>) -> Result<f64, Question> {
        let rate = wanted.rate_hz.or(channel.sample_rate_hz);
        rate.ok_or_else(|| {
            let (problem, help) = missing(self.source, channel, wanted, true);
            let more = self.mean_rate(channel).into_iter().chain(self.hammer());
            (problem, Some(help.into_iter().chain(more).collect::<Vec<_>>().join("; ")))
        })
    }

    /// The channels' samples, and the decays in them: those of the hits of a `force`, if there is one. Errors: they cannot
    /// be read, or are of different lengths.
    pub fn search(
        &self,
        channels: &[&Channel],
        force: Option<&Channel>,
        wanted: &Wanted<'_>,
    ) -> Result<(Vec<Vec<f64>>, DecaySearch), Question> {
        let rate = self.rate(channels[0], wanted)?;
        let values: Vec<Vec<f64>> = channels
            .iter()
            .copied()
            .chain(force)
            .map(|channel| self.samples(channel))
            .collect::<Result<_, Question>>()?;
        let slices: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let trigger = match force {
            Some(_) => DecayTrigger::Force { channel: channels.len() },
            None => DecayTrigger::default(),
        };
        let options = DecaySearchOptions { trigger, ..DecaySearchOptions::default() };
        let found = find_decays_beside_lines(&slices, rate, &options);
        Ok((values, found.map_err(|error| self.plain(&error.to_string()))?))
    }

    /// The measured force of hits that the channels answer; none where there is none or another length.
    pub fn hitting(&self, channels: &[&Channel], wanted: &Wanted<'_>) -> Option<&'a Channel> {
        let inputs = inputs(self.source, wanted).ok()?;
        let [force] = inputs[..] else { return None };
        let beside = channels.iter().all(|one| one.samples == force.samples && one.location != force.location);
        let hits = |values: Vec<f64>| is_impulsive(&values);
        (beside && self.samples(force).is_ok_and(hits)).then_some(force)
    }

    /// That a channel is short as a hammer's force, and much shorter than all others.
    pub fn hammer(&self) -> Option<String> {
        let signals = self.source.channels.iter().filter(usable);
        let read = |channel| Some((channel, self.samples(channel).ok()?));
        let mut found: Vec<(&Channel, usize, bool)> = signals
            .filter_map(read)
            .map(|(channel, values)| (channel, half_energy_samples(&values), is_impulsive(&values)))
            .collect();
        found.sort_by_key(|(_, samples, _)| *samples);
        match found[..] {
            [(force, samples, true), (_, others, _), ..] if RINGS * samples <= others => {
                Some(format!("{0} is short as a hammer's force: --input {0} if it is one", force.location))
            }
            _ => None,
        }
    }

    fn plain(&self, problem: &str) -> Question {
        (format!("{}: {problem}", self.source.file.display()), None)
    }
}

/// Whether a file holds frequency responses; `guessed`: even if nothing in it says so.
pub fn holds_responses(contents: &Contents, guessed: bool) -> bool {
    let found = responses(contents, None).unwrap_or_default();
    let has_frequencies = |response: &FoundResponse| response.frequency_channel(&contents.channels).is_ok();
    !found.is_empty()
        && found.iter().all(has_frequencies)
        && (guessed || found.iter().all(|response| !response.guessed))
}
