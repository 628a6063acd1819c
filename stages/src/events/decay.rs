//! The stage `events.decay`.

use std::collections::HashSet;
use std::ops::Range;

use afmid_pipeline::recording::{SamplePrint, equal_samples, lane_names};
use afmid_pipeline::{
    Array, Channel, Context, Document, Example, Port, Ports, Record, Recording, Spec, Stage, StageError, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::decay_rows::{Row, all_noise, nothing_found, summary, table};
use crate::artifacts::{FORCE, PIEZO, RateError, Sensor, decay_array};
use crate::io::{CopyOf, warn_of_copies};
use afmid_kernels::events::decay::{DecaySearch, DecaySearchOptions, DecayTrigger, DismissedReason, FreeDecay};
use afmid_kernels::harmonics::find_decays_beside_lines;

/// Finds free decays in records: after a hit, a release, a pulse, or the end of a drive.
///
/// Model: quiet, an event, free ringing of any number of modes that dies away in noise; the same again. What does not
/// die away is a steady oscillation, which has no quality factor to be had.
/// Method: the energy of all channels over a period against the noise's; starts refined to the first departure from the
/// quiet line before, hits into ringing by where its prediction fails; the end is where the ringing is smaller than the
/// noise, or half a period before the next start; the first free sample is the one from which later samples foretell the
/// earlier ones backwards. Clipped samples are missing. Where a steady line
/// hides all decays (hum), they are sought in what is left without it and its harmonics; the line stays in the decays, as
/// one of the lines that `model.decay` fits beside the modes. A hit with the samples of an earlier one, and a sensor
/// with those of another in every record, count once (more than 100 samples, not all of one value); a warning names
/// them.
/// Shapes: `decays` has a row per hit and channel, whose samples follow each other, and likewise the last 16,384 that
/// were quiet before each hit; `events` a row per decay, steady oscillation and start that is neither.
/// Units: the channels' own; Hz; s.
/// Accuracy: in all but one of a hundred decays the first free sample is no more than a sixteenth of a period early and
/// half a period late, and the end within three quarters of the decay time (docs/results/decay.md).
/// A decay is larger than the excursions that stationary noise of its band has in one record of a thousand.
/// Errors: no free decay in any record; stationary noise; records of different rates or numbers of channels; samples that
/// are missing.
/// Source: R. V. Allen, Bull. Seismol. Soc. Am. 68 (1978) 1521; G. R. B. de Prony, J. Ec. Polytech. 1 (1795) 24.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Decay {
    /// What files and channels are: `auto` (a file is a hit, its channels are sensors), `hits` (each channel of each
    /// file is a hit) or `sensors` (all files and channels saw the same hits).
    #[serde(rename = "as")]
    pub records_are: RecordsAre,
    /// How decays are searched.
    #[serde(flatten)]
    pub search: DecaySearchOptions,
}

/// What files and channels are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RecordsAre {
    /// A file is a hit, its channels are sensors.
    #[default]
    Auto,
    /// Each channel of each file is a hit.
    Hits,
    /// All files and channels saw the same hits.
    Sensors,
}

pub(super) const RECORDS: Port<Recording> = Port::new("records", "records", "records with one or several channels");
pub(crate) const DECAYS: Port<Array> = Port::new("decays", "decays", "free decays, a row for each channel of each hit");
pub(super) const EVENTS: Port<Table> =
    Port::new("events", "decay-events", "decays and what was refused, by record and time");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "how many hits, steady oscillations, what was refused");

/// Longest record that is searched: half a gigabyte a channel.
const LONGEST: usize = 1 << 26;

/// Samples of a quiet stretch that are kept, the nearest to the hit. Why: noise is known to half a per cent from them.
const MOST_QUIET: usize = 1 << 14;

impl Stage for Decay {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "events.decay",
        version: 13,
        summary: "finds free decays in records: where they begin, where they drown in the noise",
        inputs: &[RECORDS.spec()],
        outputs: &[DECAYS.spec(), EVENTS.spec(), SUMMARY.spec()],
        source: "R. V. Allen, Bull. Seismol. Soc. Am. 68 (1978) 1521",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let rate = super::correlation::common_rate(records)?;
        let groups = self.each_once(self.groups(records)?, cx);
        let sensors = sensors(&groups)?;
        cx.expect(groups.len());
        let searched = groups
            .par_iter()
            .map(|group| {
                let searched = group.search(rate, &self.search).map_err(|error| error.at(&group.records[0].path));
                cx.tick();
                searched
            })
            .collect::<Result<Vec<Searched>, StageError>>()?;
        let sensors: Vec<Sensor> = searched
            .first()
            .map(|first| first.found.channels.iter().filter_map(|&channel| sensors.get(channel).cloned()).collect())
            .unwrap_or_default();
        let hits: Vec<Vec<Vec<f64>>> = searched.iter().flat_map(Searched::hits).collect();
        let rows: Vec<Row> = searched.iter().zip(&groups).flat_map(|(searched, group)| searched.rows(group)).collect();
        if hits.is_empty() {
            let noise: Option<Vec<String>> = searched.iter().map(|one| one.found.noise()).collect();
            return Err(match (noise, groups.first()) {
                (Some(noise), Some(first)) => all_noise(&noise, &first.records[0].name, first.channels.len()),
                _ => nothing_found(&rows, groups.len()),
            });
        }
        // beside a decay a steady stretch is a fact, which the table and the summary state
        let decays: HashSet<&str> =
            rows.iter().filter(|row| row.rejected.is_empty()).map(|row| row.record.as_str()).collect();
        for row in rows.iter().filter(|row| row.steady && !decays.contains(row.record.as_str())) {
            cx.warn(format!("{}: {}", row.record, row.rejected));
        }
        let clipped: usize = rows.iter().map(|row| row.clipped).sum();
        if clipped > 0 {
            cx.warn(format!(
                "{clipped} samples lie at an end of their channel's range, cut off or at rest, and are left out (column \
                 `clipped` of `events`)"
            ));
        }
        let quiet: Vec<Vec<Vec<f64>>> = searched.iter().flat_map(Searched::quiet).collect();
        let rate_error = RateError::of_records(records);
        let summary = summary(&rows, hits.len(), &sensors, rate)?;
        Ok(Ports::new()
            .with(&DECAYS, rate_error.stated_by(decay_array(&hits, &quiet, &sensors, rate)?))
            .with(&EVENTS, table(&rows, rate))
            .with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::decay_example::examples()
    }
}

/// Channels that saw the same hits.
struct Group<'a> {
    /// The record of each channel.
    records: Vec<&'a Record>,
    channels: Vec<&'a Channel>,
}

/// What was found in a group.
struct Searched {
    values: Vec<Vec<f64>>,
    found: DecaySearch,
}

impl Decay {
    fn groups<'a>(&self, records: &'a [Record]) -> Result<Vec<Group<'a>>, StageError> {
        let by_force = matches!(self.search.trigger, DecayTrigger::Force { .. });
        let searched = move |channel: &&Channel| match channel.role.as_str() {
            PIEZO => false,
            FORCE => by_force,
            _ => true,
        };
        let all = |record: &'a Record| record.channels.iter().filter(searched).map(move |channel| (record, channel));
        let group = |pairs: Vec<(&'a Record, &'a Channel)>| {
            let (records, channels) = pairs.into_iter().unzip();
            Group { records, channels }
        };
        Ok(match self.records_are {
            RecordsAre::Auto => records.iter().map(|record| group(all(record).collect())).collect(),
            RecordsAre::Hits => records.iter().flat_map(all).map(|pair| group(vec![pair])).collect(),
            RecordsAre::Sensors => {
                // a file each may have recorded the force of the same hits
                let mut forces = 0;
                let first_force = |(_, channel): &(&Record, &Channel)| {
                    forces += usize::from(channel.role == FORCE);
                    channel.role != FORCE || forces == 1
                };
                vec![group(records.iter().flat_map(all).filter(first_force).collect())]
            }
        })
    }
}

impl Decay {
    /// The groups with what was recorded once in them once: of hits those that have the samples of an earlier one are
    /// left out, of sensors those that have them in every group. Says which.
    fn each_once<'a>(&self, mut groups: Vec<Group<'a>>, cx: &Context) -> Vec<Group<'a>> {
        if self.records_are == RecordsAre::Hits {
            let mut prints: Vec<SamplePrint> = groups.iter().filter_map(|group| group.print(0)).collect();
            let equal = if prints.len() == groups.len() { equal_samples(&mut prints) } else { Vec::new() };
            let copy =
                |(copy, of): (usize, &Option<usize>)| Some((groups.get(copy)?.name(0), groups.get((*of)?)?.name(0)));
            let copies: Vec<CopyOf> = equal.iter().enumerate().filter_map(copy).collect();
            warn_of_copies(cx, &copies, "all their samples are equal");
            let mut stay = equal.iter().map(Option::is_none);
            groups.retain(|_| stay.next().unwrap_or(true));
            return groups;
        }
        let Some(first) = groups.first().filter(|first| first.channels.len() > 1) else { return groups };
        let mut common: Vec<Option<usize>> = first.equal_channels();
        for group in &groups[1..] {
            if common.iter().all(Option::is_none) {
                return groups;
            }
            let own = group.equal_channels();
            common.iter_mut().zip(&own).filter(|(of, own)| of != own).for_each(|(of, _)| *of = None);
        }
        let copy = |(copy, of): (usize, &Option<usize>)| of.map(|of| (first.name(copy), first.name(of)));
        let copies: Vec<CopyOf> = common.iter().enumerate().filter_map(copy).collect();
        warn_of_copies(cx, &copies, "all their samples are equal in every record");
        groups.iter_mut().for_each(|group| group.keep(&common));
        groups
    }
}

/// The sensors of all groups. Errors: groups of different numbers of channels, or of different units.
fn sensors(groups: &[Group]) -> Result<Vec<Sensor>, StageError> {
    let Some(first) = groups.first() else { return Err(StageError::new("there is no record")) };
    for group in groups {
        let (found, wanted) = (group.channels.len(), first.channels.len());
        if found != wanted || found == 0 {
            let problem = format!("the record has {found} channels, {} has {wanted}", first.records[0].name);
            return Err(StageError::new(problem).at(&group.records[0].path));
        }
        for (channel, own) in group.channels.iter().zip(&first.channels) {
            if channel.unit != own.unit {
                let problem = format!("{} is in {}, {} in {}", channel.location, channel.unit, own.location, own.unit);
                return Err(StageError::new(problem).at(&group.records[0].path));
            }
        }
    }
    // one file a sensor: the file tells them apart
    let several = first.records.iter().any(|record| record.name != first.records[0].name);
    let lanes =
        lane_names(first.channels.iter().map(|channel| (channel.location.as_str(), channel.long_name.as_str())));
    let name = |(number, (record, channel)): (usize, (&&Record, &&Channel))| match several {
        true => format!("{} {}", record.name, channel.location),
        false => lanes.as_ref().and_then(|names| names.get(number)).unwrap_or(&channel.location).clone(),
    };
    let sensor = |(number, pair): (usize, (&&Record, &&Channel))| Sensor {
        name: name((number, pair)),
        unit: pair.1.unit.clone(),
    };
    Ok(first.records.iter().zip(&first.channels).enumerate().map(sensor).collect())
}

impl Group<'_> {
    /// What the samples of a channel hash to, as far as they are read.
    fn print(&self, number: usize) -> Option<SamplePrint> {
        self.channels.get(number).map(|channel| SamplePrint::new(channel))
    }

    /// For each channel the first one before it with the same samples.
    fn equal_channels(&self) -> Vec<Option<usize>> {
        equal_samples(&mut (0..self.channels.len()).filter_map(|number| self.print(number)).collect::<Vec<_>>())
    }

    /// A channel's name in messages.
    fn name(&self, number: usize) -> String {
        match (self.records.get(number), self.channels.get(number)) {
            (Some(record), Some(channel)) => format!("{} {}", record.name, channel.location),
            _ => String::new(),
        }
    }

    /// Leaves out channels that are copies.
    fn keep(&mut self, copies: &[Option<usize>]) {
        let stays = |number: usize| copies.get(number).copied().flatten().is_none();
        let (mut record, mut channel) = (0.., 0..);
        self.records.retain(|_| record.next().is_none_or(stays));
        self.channels.retain(|_| channel.next().is_none_or(stays));
    }

    fn search(&self, rate: f64, options: &DecaySearchOptions) -> Result<Searched, StageError> {
        let samples = self.channels.first().map_or(0, |channel| channel.samples);
        if samples > LONGEST {
            return Err(StageError::new(format!("{samples} samples, wanted at most {LONGEST}"))
                .help("cut the file into shorter ones"));
        }
        let mut values = Vec::with_capacity(self.channels.len());
        for (channel, record) in self.channels.iter().zip(&self.records) {
            if channel.samples != samples {
                return Err(StageError::new(format!(
                    "{} has {} samples, {} has {samples}: channels of one hit want one length",
                    channel.location, channel.samples, self.channels[0].location
                ))
                .at(&record.path));
            }
            let read = channel.read(0, samples)?;
            if let Some(k) = read.iter().position(|value| !value.is_finite()) {
                return Err(StageError::new(format!("{}: sample {k} is missing", channel.location))
                    .help("cut the file to stretches without gaps"));
            }
            values.push(read);
        }
        let slices: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let mut options = options.clone();
        // the channel that the record says is the force, if it does
        let force = self.channels.iter().position(|channel| channel.role == FORCE);
        if let (DecayTrigger::Force { channel }, Some(force)) = (&mut options.trigger, force) {
            *channel = force;
        }
        let found = find_decays_beside_lines(&slices, rate, &options).map_err(StageError::from_error)?;
        Ok(Searched { values, found })
    }
}

impl Searched {
    /// Each decay in every searched channel, clipped samples NaN.
    fn hits(&self) -> Vec<Vec<Vec<f64>>> {
        let hit = |decay: &FreeDecay| {
            let channel = |(&number, seen): (&usize, &_)| self.stretch(number, decay, seen);
            self.found.channels.iter().zip(&decay.channels).map(channel).collect()
        };
        self.found.decays.iter().map(hit).collect()
    }

    fn stretch(
        &self,
        channel: usize,
        decay: &FreeDecay,
        seen: &afmid_kernels::events::decay::ChannelDecay,
    ) -> Vec<f64> {
        let mut values = self.values[channel][decay.range.clone()].to_vec();
        for k in seen.clipped.iter().flat_map(Clone::clone) {
            if let Some(value) = k.checked_sub(decay.range.start).and_then(|k| values.get_mut(k)) {
                *value = f64::NAN;
            }
        }
        values
    }

    /// What was before each hit, where it was quiet.
    fn quiet(&self) -> Vec<Vec<Vec<f64>>> {
        let nearest = |quiet: Range<usize>| quiet.start.max(quiet.end.saturating_sub(MOST_QUIET))..quiet.end;
        let before = self.found.decays.iter().filter_map(|decay| decay.quiet.clone()).map(nearest);
        before
            .map(|range| {
                self.found.channels.iter().map(|&channel| self.values[channel][range.clone()].to_vec()).collect()
            })
            .collect()
    }

    fn rows(&self, group: &Group) -> Vec<Row> {
        let record = &group.records[0].name;
        let mut rows: Vec<Row> = self.found.decays.iter().map(|decay| Row::of_decay(record, decay)).collect();
        rows.extend(self.found.steady.iter().map(|steady| Row {
            onset: steady.range.start,
            first: steady.range.start,
            end: steady.range.end,
            frequency_hz: steady.frequency_hz,
            rate_per_s: (steady.decline.rate_per_s, steady.decline.std_per_s),
            peak: steady.amplitude.first().copied().unwrap_or(f64::NAN),
            steady: true,
            ..Row::refused(record, steady.range.start, steady.statement())
        }));
        rows.extend(self.found.dismissed.iter().map(|dismissed| {
            let reason = match dismissed.reason {
                DismissedReason::TooShort => "less than two periods above the noise".to_owned(),
                DismissedReason::NoRinging => "nothing rings above the noise".to_owned(),
                DismissedReason::Excursion { ratio, limit } => format!(
                    "no larger than stationary noise becomes: {ratio:.1} times the mean energy of its band, of {limit:.0}"
                ),
                DismissedReason::Walk => "part of a random walk".to_owned(),
                DismissedReason::Handling { ratio } => {
                    format!("a few periods before an event of {ratio:.0} times their energy: what was done to make it")
                }
                DismissedReason::Random => "one of many rises and falls of a random vibration".to_owned(),
            };
            Row::refused(record, dismissed.onset, reason)
        }));
        rows.sort_by_key(|row| row.onset);
        if rows.is_empty() {
            rows.push(Row::refused(record, 0, self.found.reason().unwrap_or_default()));
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use afmid_kernels::events::decay::find_decays;

    #[test]
    fn a_long_quiet_stretch_is_kept_from_its_end() {
        let ring =
            |k: usize| if k < 60_000 { 0.0 } else { (-0.004 * (k - 60_000) as f64).exp() * (0.2 * k as f64).sin() };
        let y: Vec<f64> = white_noise(64_000, 1e-3, 1).iter().enumerate().map(|(k, n)| ring(k) + n).collect();
        let found = find_decays(&[&y], 1e4, &DecaySearchOptions::default()).expect("a record");
        let quiet = found.decays[0].quiet.clone().expect("quiet");
        assert!(quiet.len() > MOST_QUIET);
        let searched = Searched { values: vec![y.clone()], found };
        assert_eq!(searched.quiet(), [[&y[quiet.end - MOST_QUIET..quiet.end]]]);
    }
}
