//! The stage `events.correlation`.

use afmid_pipeline::{
    Array, Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError, Table, Values,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::extraction::{ExtractionSettings, extract};
use super::listing::{Listed, ensemble_array, events_table, summary};
use super::segments::{Searched, Segments, Stretch};
use super::window::{WindowSettings, Windows, cut_windows, quality_outliers};
use crate::artifacts::{NewEnsemble, RateError, deflection};
use afmid_kernels::events::{Aligned, AveragingSettings, EventKind, Misfit, correlation_average};

/// Finds snap-off or snap-to-contact events in records and aligns them by iterative correlation averaging.
///
/// # Model
/// An event is a sudden change of level of a deflection that is otherwise piecewise straight, with hum, drift and
/// noise; all events of a kind have one shape, each with its amplitude and offset.
/// # Method
/// Block means of each record, jumps of level that stand out from the record's own noise and drift, the onset as the
/// first sustained departure, correlation averaging to a fraction of a sample, windows by band-limited interpolation. A
/// record without an event is listed with the reason.
/// # Shapes
/// `ensemble` is events x window samples, the onset of the average at sample `onset_sample` of every window.
/// # Units
/// The channel's.
/// # Accuracy
/// Alignment to 0.006 samples rms for 0.9 V releases in 1.2 mV of noise, 0.02 for snaps to contact of 40 mV (simulated
/// archives); interpolation adds 5e-5 of the jump at the onset, 1e-6 elsewhere. The rupture itself lies one to three
/// samples before the onset, the same in all events.
/// # Errors
/// No event in any record; a record that cannot be read.
/// # Source
/// Stark et al. 2005, section Data processing; Woody, Med. Biol. Eng. 5 (1967) 539.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Correlation {
    /// `snap-off` (the contact ruptures) or `snap-in` (also `snap-to-contact`).
    pub kind: EventKind,
    /// Length of the aligned windows. Why: the paper's.
    #[schemars(range(min = 256, max = 4_194_304))]
    pub window_samples: usize,
    /// Share of the window before the onset. Why: twice what a Tukey window of alpha 0.1 tapers and more.
    #[schemars(range(min = 0.01, max = 0.9))]
    pub pre_share: f64,
    /// Samples in a block of the scan. Why: shorter than half a period of the slowest mode.
    #[schemars(range(min = 1, max = 1024))]
    pub block_samples: usize,
    /// Samples on either side of a step that the level is taken from, at least 16 blocks. Why: some periods of the
    /// slowest mode.
    #[schemars(range(min = 16, max = 4_194_304))]
    pub level_samples: usize,
    /// How many robust standard deviations a step, and a jump of level, must exceed. Why: at 5, noise alone makes a
    /// step in thirty records of a million samples.
    #[schemars(range(min = 5.0, max = 1000.0))]
    pub significance: f64,
    /// How events are aligned.
    #[serde(flatten)]
    pub averaging: AveragingSettings,
    /// Events are rejected whose residual against the others is this many times the median one (and 6 robust deviations
    /// above it).
    #[schemars(range(min = 1.0, max = 1e9))]
    pub max_residual_ratio: f64,
    /// Keep events with samples at the end of the converter's range instead of rejecting them.
    pub keep_saturated: bool,
}

impl Default for Correlation {
    fn default() -> Self {
        Self {
            kind: EventKind::SnapOff,
            window_samples: 8192,
            pre_share: 0.125,
            block_samples: 16,
            level_samples: 1024,
            significance: 8.0,
            averaging: AveragingSettings::default(),
            max_residual_ratio: 3.0,
            keep_saturated: false,
        }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records; their channel `deflection` is searched");
const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "aligned events: signal over event and time");
const EVENTS: Port<Table> =
    Port::new("events", "events", "every event that was seen, with its place and quality, or why it was rejected");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "how many events were found, and what was rejected");

/// How far the onset of the average may lie from the detected ones.
const MAX_ONSET_SAMPLES: usize = 16;

impl Stage for Correlation {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "events.correlation",
        version: 5,
        summary: "finds snap-off or snap-to-contact events and aligns them by iterative correlation averaging",
        inputs: &[RECORDS.spec()],
        outputs: &[ENSEMBLE.spec(), EVENTS.spec(), SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Data processing; Woody, Med. Biol. Eng. 5 (1967) 539",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (level, least) = (self.level_samples, 16 * self.block_samples);
        faults.require(level >= least, || format!("`level_samples` is {level}, wanted {least} to 4194304"));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let rate = common_rate(records)?;
        cx.expect(records.len());
        let extraction = self.extraction();
        let stretch = Stretch::new(&self.averaging, extraction.before, extraction.after);
        let segments = Segments::new(cx.row_writer(extraction.before + extraction.after), stretch);
        let searched = records
            .par_iter()
            .map(|record| {
                let searched = extract(deflection(record)?, &extraction).and_then(|found| segments.put(found));
                cx.tick();
                searched.map_err(|error| if error.place.is_none() { error.at(&record.path) } else { error })
            })
            .collect::<Result<Vec<Searched>, StageError>>()?;
        let (listed, signal) = self.align(records, searched, &segments.finish(), stretch, cx)?;
        let unit = records.first().map_or("V", |record| record.channels.first().map_or("V", |channel| &channel.unit));
        let ensemble = NewEnsemble {
            signal,
            events: listed.kept(),
            samples: self.window_samples,
            sample_rate_hz: rate,
            rate_error: RateError::of_records(records),
            onset_sample: self.pre_samples(),
            kind: Some(self.kind),
            unit,
        };
        Ok(Ports::new()
            .with(&ENSEMBLE, ensemble_array(&listed, ensemble))
            .with(&EVENTS, events_table(&listed, records, rate, unit))
            .with(&SUMMARY, summary(&listed, records, rate, self.kind)?))
    }

    fn examples() -> Vec<Example> {
        super::example::examples()
    }
}

impl Correlation {
    fn pre_samples(&self) -> usize {
        (self.window_samples as f64 * self.pre_share).round() as usize
    }

    fn window(&self) -> WindowSettings {
        WindowSettings {
            window_samples: self.window_samples,
            pre_samples: self.pre_samples(),
            max_onset_samples: MAX_ONSET_SAMPLES,
            noise_floor: 0.0,
        }
    }

    fn extraction(&self) -> ExtractionSettings {
        let (window, averaging) = (self.window().margins(self.averaging.max_shift_samples), self.averaging.margins());
        ExtractionSettings {
            kind: self.kind,
            block_samples: self.block_samples,
            level_samples: self.level_samples,
            significance: self.significance,
            before: window.0.max(averaging.0),
            after: window.1.max(averaging.1),
            keep_saturated: self.keep_saturated,
        }
    }

    /// Aligns what was found, rejects what does not belong, and lists all.
    fn align(
        &self,
        records: &[Record],
        searched: Vec<Searched>,
        segments: &Values,
        stretch: Stretch,
        cx: &Context,
    ) -> Result<(Listed, Values), StageError> {
        let onset = self.extraction().before;
        let mut listed = Listed::default();
        let (mut places, mut numbers, mut stretches) = (Vec::new(), Vec::new(), Vec::new());
        for (record, searched) in searched.into_iter().enumerate() {
            listed.refused.extend(searched.refused.into_iter().map(|refused| (record, refused)));
            for seen in searched.seen {
                places.push((record, seen.start, seen.saturated));
                numbers.push(seen.segment);
                stretches.push(seen.stretch);
            }
        }
        if stretches.is_empty() {
            return Err(nothing_found(&listed, records));
        }
        let averaging = correlation_average(&stretches, stretch.onset, &self.averaging);
        drop(stretches);
        if averaging.last_change_samples > self.averaging.tolerance_samples {
            cx.warn(format!(
                "the alignment still moved events by {:.4} samples after {} iterations, wanted {}: raise max_iterations",
                averaging.last_change_samples, averaging.iterations, self.averaging.tolerance_samples
            ));
        }
        let mut kept: Vec<(usize, Aligned)> = Vec::new();
        for (index, event) in averaging.events.iter().enumerate() {
            match event {
                Ok(aligned) => kept.push((index, *aligned)),
                Err(misfit) => listed.reject(places[index], onset, self.misfit_reason(misfit)),
            }
        }
        let windows_of = |kept: &[(usize, Aligned)]| {
            let chosen: Vec<(usize, Aligned)> = kept.iter().map(|&(index, event)| (numbers[index], event)).collect();
            self.windows(segments, &chosen, cx)
        };
        let mut windows = windows_of(&kept)?;
        let qualities: Vec<f64> = windows.events.iter().map(|event| event.quality).collect();
        let outliers = quality_outliers(&qualities, 6.0, self.max_residual_ratio);
        for &outlier in outliers.iter().rev() {
            let (index, _) = kept.remove(outlier);
            let reason = format!(
                "unlike the others: it leaves {:.1} times the noise, the median is {:.1}",
                qualities[outlier],
                middle(&qualities)
            );
            listed.reject(places[index], onset, reason);
        }
        if !outliers.is_empty() {
            windows = windows_of(&kept)?;
        }
        if kept.is_empty() {
            return Err(nothing_found(&listed, records));
        }
        for ((index, _), event) in kept.iter().zip(windows.events) {
            listed.keep(places[*index], event);
        }
        listed.iterations = averaging.iterations;
        Ok((listed, windows.values))
    }

    /// Windows of the chosen segments, by their numbers.
    fn windows(&self, segments: &Values, chosen: &[(usize, Aligned)], cx: &Context) -> Result<Windows, StageError> {
        let ExtractionSettings { before, after, .. } = self.extraction();
        let rows = segments.rows(before + after).ok_or_else(|| StageError::new("segments without samples"))?;
        let writer = cx.row_writer(self.window_samples);
        cut_windows(&rows, before, chosen, self.kind == EventKind::SnapOff, &self.window(), writer)
    }

    fn misfit_reason(&self, misfit: &Misfit) -> String {
        match misfit {
            Misfit::Correlation(value) => {
                format!("unlike the others: correlation {value:.3}, wanted at least {}", self.averaging.min_correlation)
            }
            Misfit::BeyondLimit => {
                format!("its onset does not fit the others' within {} samples", self.averaging.max_shift_samples)
            }
            Misfit::Incomparable => "cannot be compared with the others: constant, or upside down".to_owned(),
        }
    }
}

fn middle(values: &[f64]) -> f64 {
    afmid_kernels::statistics::median(&mut values.to_vec())
}

pub(super) fn common_rate(records: &[Record]) -> Result<f64, StageError> {
    let Some(first) = records.first() else {
        return Err(StageError::new("there is no record"));
    };
    for record in records {
        if record.sample_rate_hz != first.sample_rate_hz {
            return Err(StageError::new(format!(
                "{} has {} samples per second, {} has {}: one ensemble wants one rate",
                first.name, first.sample_rate_hz, record.name, record.sample_rate_hz
            )));
        }
    }
    Ok(first.sample_rate_hz)
}

fn nothing_found(listed: &Listed, records: &[Record]) -> StageError {
    let reasons: Vec<String> = listed
        .refused
        .iter()
        .take(5)
        .map(|(record, refused)| {
            let name = records.get(*record).map_or("?", |record| &record.name);
            format!("{name}: {}", refused.reason)
        })
        .collect();
    let more = listed.refused.len().saturating_sub(reasons.len());
    let more = if more > 0 { format!("; and {more} more") } else { String::new() };
    let rate = records.first().map_or(f64::NAN, |record| record.sample_rate_hz);
    StageError::new(format!("no usable event in {} records: {}{more}", records.len(), reasons.join("; "))).help(
        format!(
            "check the channel, its sign, and `kind`: `afmid inspect` says where a record rings, `io.records` and \
         `io.overview` alone draw one (`afmid report`). The records have {rate} samples per second: a recorder of less \
         than twenty samples a period filters a lever's ringing out. If they are no force curves: `afmid new pipeline` \
         with `--goal decay` takes free decays, with `--goal thermal` thermal noise"
        ),
    )
}

#[cfg(test)]
#[path = "correlation_tests.rs"]
mod tests;
