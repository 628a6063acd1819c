//! The stage `model.harmonics`.

use afmid_pipeline::{
    Channel, Context, Document, Example, Port, Ports, Record, Recording, Spec, Stage, StageError, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::artifacts::{PIEZO, RateError};
use afmid_kernels::harmonics::{Harmonic, HarmonicFit, HarmonicOptions, fit_harmonics};

/// Fits a steady oscillation: its frequency, its harmonics, and whether it is steady.
///
/// Model: y(t) = c + sum_h (a_h cos(h w t) + b_h sin(h w t)) + e(t), one w for each record and channel.
/// Method: least squares by Gauss and Newton in w, all else linear; the noise at each harmonic is the residual's density
/// around it. Parts of the record are compared in amplitude and phase. Of a long record the first samples are used.
/// Shapes: `harmonics` a row per record, channel and harmonic.
/// Units: Hz, rad; amplitudes in the channels' own, peak.
/// Accuracy: the Cramer-Rao bound; where the phase wanders, the error of the mean frequency by the scatter of the parts.
/// Errors: no record; a channel without a line; noise alone, in one record of a thousand taken for an oscillation; samples
/// that are missing.
/// Source: IEEE Std 1057-2017; D. C. Rife, R. R. Boorstyn, IEEE Trans. Inf. Theory 20 (1974) 591.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Harmonics {
    /// Samples of a record that are used, from the first on. Why: four million know a frequency to 1e-9 of it.
    #[schemars(range(min = 32, max = 16_777_216))]
    pub most_samples: usize,
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: HarmonicOptions,
}

impl Default for Harmonics {
    fn default() -> Self {
        Self { most_samples: 1 << 22, fit: HarmonicOptions::default() }
    }
}

pub(super) const RECORDS: Port<Recording> = Port::new("records", "records", "the records, all channels but `piezo`");
const HARMONICS: Port<Table> = Port::new("harmonics", "harmonics", "a row per record, channel and harmonic");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "frequency, amplitude, distortion and steadiness of each record and channel");

/// Chance below which parts of a record that agree are said to differ. Why: one in a thousand records.
const FALSE_ALARM: f64 = 1e-3;

impl Stage for Harmonics {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.harmonics",
        version: 4,
        summary: "fits a steady oscillation: frequency, harmonics, and whether it is steady",
        inputs: &[RECORDS.spec()],
        outputs: &[HARMONICS.spec(), SUMMARY.spec()],
        source: "IEEE Std 1057-2017",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let signals: Vec<(&Record, &Channel)> = records
            .iter()
            .flat_map(|record| record.channels.iter().filter(|c| c.role != PIEZO).map(move |c| (record, c)))
            .collect();
        if signals.is_empty() {
            return Err(StageError::new("there is no record"));
        }
        cx.expect(signals.len());
        let fits: Vec<Fitted> = signals
            .into_par_iter()
            .map(|(record, channel)| {
                let fit = self.fitted(record, channel);
                cx.tick();
                fit
            })
            .collect::<Result<_, StageError>>()?;
        let (fits, none): (Vec<Fitted>, Vec<Fitted>) =
            fits.into_iter().partition(|fitted| fitted.fit.chance < FALSE_ALARM);
        if let (true, Some(first)) = (fits.is_empty(), none.first()) {
            let help = "`afmid new pipeline FILE --goal thermal` looks for a resonance in noise; `near_hz` searches fewer \
                        frequencies";
            return Err(StageError::new(first.is_none()).help(help));
        }
        none.iter().for_each(|fitted| cx.warn(fitted.is_none()));
        fits.iter().flat_map(Fitted::warnings).for_each(|warning| cx.warn(warning));
        let rows: Vec<(&Fitted, &Harmonic)> =
            fits.iter().flat_map(|fitted| fitted.fit.harmonics.iter().map(move |h| (fitted, h))).collect();
        let summary = json!({ "oscillations": fits.iter().map(Fitted::document).collect::<Vec<Value>>() });
        Ok(Ports::new().with(&HARMONICS, table(&rows)).with(&SUMMARY, Document::new(&summary)?))
    }

    fn examples() -> Vec<Example> {
        super::harmonics_example::examples()
    }
}

/// A record's channel and its oscillation.
struct Fitted {
    record: String,
    channel: String,
    unit: String,
    fit: HarmonicFit,
}

impl Harmonics {
    fn fitted(&self, record: &Record, channel: &Channel) -> Result<Fitted, StageError> {
        let values = channel.read(0, channel.samples.min(self.most_samples))?;
        let mut fit = fit_harmonics(&values, record.sample_rate_hz, &self.fit)
            .map_err(|error| StageError::from_error(error).at(&record.path))?;
        let rate_error = RateError { relative_std: record.rate_relative_std };
        fit.frequency_std_hz = rate_error.widened(fit.frequency_hz, fit.frequency_std_hz);
        Ok(Fitted { record: record.name.clone(), channel: channel.location.clone(), unit: channel.unit.clone(), fit })
    }
}

impl Fitted {
    /// That noise alone has such a line.
    fn is_none(&self) -> String {
        let Self { record, channel, fit, .. } = self;
        let often = match fit.chance < 1.0 {
            true => format!(" in {:.2} % of such records", 100.0 * fit.chance),
            false => String::new(),
        };
        format!(
            "{record}, {channel}: no oscillation: of all frequencies searched the strongest, {:.6} Hz, has an amplitude that \
             noise alone has{often}",
            fit.frequency_hz
        )
    }

    fn warnings(&self) -> Vec<String> {
        let Self { record, channel, fit, .. } = self;
        let mut said = Vec::new();
        if fit.amplitude.p_value < FALSE_ALARM {
            let wander = 100.0 * fit.amplitude.wander;
            said.push(format!("{record}, {channel}: the amplitude is not steady, {wander:.2} % rms beyond the noise"));
        }
        if fit.phase.p_value < FALSE_ALARM {
            let wander = fit.phase.wander;
            said.push(format!(
                "{record}, {channel}: the frequency is not steady, the phase wanders by {wander:.2e} rad rms; its error \
                 is that of the mean"
            ));
        }
        said
    }

    fn document(&self) -> Value {
        let HarmonicFit { frequency_hz, frequency_std_hz, offset, distortion, residual_rms, amplitude, phase, .. } =
            &self.fit;
        json!({
            "record": self.record,
            "channel": self.channel,
            "unit": self.unit,
            "frequency_hz": frequency_hz,
            "frequency_std_hz": frequency_std_hz,
            "amplitude": self.fit.harmonics.first().map(|first| first.amplitude),
            "amplitude_std": self.fit.harmonics.first().map(|first| first.amplitude_std),
            "offset": offset,
            "distortion": distortion,
            "residual_rms": residual_rms,
            "amplitude_steady": { "p_value": amplitude.p_value, "wander": amplitude.wander },
            "phase_steady": { "p_value": phase.p_value, "wander_rad": phase.wander },
        })
    }
}

fn table(rows: &[(&Fitted, &Harmonic)]) -> Table {
    Table::of(rows)
        .with("record", "", "file name of the record", |(fitted, _)| fitted.record.clone())
        .with("channel", "", "the channel", |(fitted, _)| fitted.channel.clone())
        .with("harmonic", "1", "1 for the fundamental", |(_, h)| h.number)
        .with_std(["frequency_hz", "frequency_std_hz"], "Hz", "frequency", |(fitted, h)| {
            let number = h.number as f64;
            (number * fitted.fit.frequency_hz, number * fitted.fit.frequency_std_hz)
        })
        .with_std(["amplitude", "amplitude_std"], "", "peak amplitude, in the channel's unit", |(_, h)| {
            (h.amplitude, h.amplitude_std)
        })
        .with_std(["phase", "phase_std"], "rad", "phase of the cosine at the first sample", |(_, h)| {
            (h.phase_rad, h.phase_std_rad)
        })
        .with("p_value", "1", "chance of such an amplitude in noise alone", |(_, h)| h.p_value)
        .table()
}
