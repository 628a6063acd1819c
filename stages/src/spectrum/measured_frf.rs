//! The stage `spectrum.measured_frf`.

use afmid_pipeline::recording::unit_ratio;
use afmid_pipeline::{Array, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError};
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::joined::Joining;
use crate::artifacts::{DataSet, NewFrf, Pair, Point, Quantity, RateError, ResponseOf, Understood, rows_of};
use crate::io::{FRF, Roving, same_values, varies};
use afmid_kernels::spectra::{
    Block, BlockKind, Estimator, MeasuredResponse, ResponseSettings, common_hit_samples, frequency_response,
    hit_spacing, hits, period_samples, periods, segments, with_hits,
};

/// Frequency response from measured input and output, averaged over hits or segments.
///
/// # Model
/// The system is linear; noise of the output (`h1`), of the input (`h2`) or of both (`hv`) is independent of the input.
/// # Method
/// Auto and cross spectra over blocks: half-overlapping Hann segments of the record, periods of an input that repeats itself,
/// or hits of a hammer. `h1` is
/// `Syu / Suu`, `h2` is `Syy / Suy`, `hv` their geometric mean; several inputs: `h1 = Syu Suu^-1`. Offsets are removed.
/// The band in which the input has power is found and kept. Of several records (`files` of `io.columns`) the blocks of each
/// are averaged, none over the end of one; a record without a hit is left out. Two responses with equal values are one
/// recording, which a warning says.
/// # Shapes
/// A row for each input of the pair, output after output, over the bins of the band, under the names of the channels; zero
/// hertz is left out. Rows of `before` come first, over the bins that both have: responses of a structure that was
/// measured point by point, a file each.
/// # Units
/// Displacement, velocity and acceleration over force in m, m/s and m/s^2 per N; else output over input in the pair's
/// units.
/// # Accuracy
/// `variance` is that of `(1 - g) abs(H)^2 / (g (n - 1))` for n independent blocks and the coherence g, its noise a mean
/// over as many neighbouring bins as give 160 degrees of freedom, of `h1` that of the output and of the input parted by
/// the response. `input_noise` is the part that responses have in common. A single hit has neither coherence nor variance.
/// Segments bias responses whose resonances are narrower than about four bins.
/// # Errors
/// A record that is shorter than a block, samples that are missing, an input that is zero throughout, no hit; another
/// rate, block, quantity, unit or added decay than that of `before`.
/// # Source
/// J. S. Bendat, A. G. Piersol, Random Data, 2010, ch. 6, 7 and 9; D. J. Ewins, Modal Testing, 2000, section 3.8.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MeasuredFrf {
    /// What is averaged: `segments` of a steady excitation, `periods` of one that repeats itself, or `hits` of a hammer. Why:
    /// a record from columns is most often of the first kind.
    pub blocks: BlocksAre,
    /// Samples of a block. Absent: an eighth of the record for segments (15 of them: a coherence good to a tenth), the
    /// period that the inputs show, as many as hits are apart at least, the whole record for a single hit, to the end of the
    /// shortest for a record each. With `before`, as many as its blocks have.
    #[schemars(range(min = 8))]
    pub block_samples: Option<usize>,
    /// Samples of a hit before the force comes to a tenth of its largest value. Why: a pulse has risen from nothing
    /// within 32 samples at any rate that resolves it.
    pub before_samples: usize,
    /// `h1`, `h2` or `hv`. Why: the sensor of the output has the smaller signal, and so the larger share of noise.
    pub estimator: EstimatorIs,
    /// Time on either side of a hit's largest force beyond which the force is set to zero, in s. Absent: the force is left
    /// as it is. Why: cutting what is no noise biases the estimate.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub force_window_s: Option<f64>,
    /// Rate d of an exponential window `exp(-d t)` on force and response of hits, in 1/s. It adds d to the decay rate of
    /// every mode, which is stated with the result so that fits subtract it. Why 0: only responses that ring beyond
    /// their block need it.
    #[schemars(range(min = 0.0))]
    pub added_decay_per_s: f64,
    /// Lowest and highest frequency that is kept, in Hz. Absent: the band in which each input has power.
    pub band_hz: Option<[f64; 2]>,
    /// Power of an input, as a share of its largest, down to which it counts as excited. Why 0.01: the error's variance
    /// goes with one over the power, at 20 dB below the largest it is a hundredfold.
    #[schemars(extend("exclusiveMinimum" = 0.0), extend("exclusiveMaximum" = 1.0))]
    pub excited_share: f64,
    /// What output over input is. Absent: what the units say, a `transfer` if they say nothing.
    pub quantity: Option<Quantity>,
    /// Number (from 1) of the response whose input acts where and as its output is measured: with one output the number
    /// of the input, with one input that of the output. Absent: none, or that of `before`.
    #[schemars(range(min = 1))]
    pub driving_point: Option<usize>,
    /// Name of the point that was struck, or where the sensor was, by `roving`. Absent: the channel's name. Why: files of
    /// one point each name their channels alike.
    pub point: Option<String>,
    /// What is at `point`: the `hammer` (the sensor stays) or the `sensor`. Why: with one sensor it is the hammer that is
    /// easier to move.
    pub roving: Roving,
}

/// What is averaged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BlocksAre {
    /// Half-overlapping segments under a Hann window.
    #[default]
    Segments,
    /// Hits, each with what rings after it.
    Hits,
    /// Periods of an input that repeats itself, without a window; the first of three and more is left out, for the response
    /// settles in it. Only the input's lines are kept.
    Periods,
}

/// Which noise the estimate is free of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorIs {
    /// That of the output.
    #[default]
    H1,
    /// That of the input.
    H2,
    /// Both, in proportion to their signals.
    Hv,
}

impl EstimatorIs {
    fn kernel(self) -> Estimator {
        match self {
            Self::H1 => Estimator::H1,
            Self::H2 => Estimator::H2,
            Self::Hv => Estimator::Hv,
        }
    }
}

impl Default for MeasuredFrf {
    fn default() -> Self {
        Self {
            blocks: BlocksAre::Segments,
            block_samples: None,
            before_samples: 32,
            estimator: EstimatorIs::H1,
            force_window_s: None,
            added_decay_per_s: 0.0,
            band_hz: None,
            excited_share: 0.01,
            quantity: None,
            driving_point: None,
            point: None,
            roving: Roving::Hammer,
        }
    }
}

/// Records that lie in a row, each from its first sample on; of none the whole.
fn apart<'a>(record: &Block<'a>, starts: &[usize]) -> Vec<Block<'a>> {
    let whole = record.outputs.first().map_or(0, |output| output.len());
    if starts.len() < 2 {
        return vec![record.clone()];
    }
    let ends = starts.iter().skip(1).copied().chain([whole]);
    let cut = |series: &[&'a [f64]], from: usize, end: usize| {
        series.iter().map(|values| values.get(from..end).unwrap_or_default()).collect()
    };
    let block = |(from, end): (usize, usize)| Block {
        inputs: cut(&record.inputs, from, end),
        outputs: cut(&record.outputs, from, end),
    };
    starts.iter().copied().zip(ends).map(block).collect()
}

/// Says of the first row with the values of an earlier one (more than a hundred, not all equal) that both are one
/// recording, named as two channels or two points.
fn remark_on_copies(frf: &NewFrf) -> Option<String> {
    let rows = rows_of(&frf.frf, frf.responses.len());
    let same = |copy: usize| (0..copy).find(|of| varies(rows[copy]) && same_values(rows[copy], rows[*of]));
    let (copy, of) = (0..rows.len()).find_map(|copy| Some((copy, same(copy)?)))?;
    Some(format!(
        "responses {} and {} have equal values: they are one recording, and count as two, so that errors of what is fitted \
         to both are too small; measure the second one, or leave it out",
        of + 1,
        copy + 1
    ))
}

/// Share of the largest force from which a hit is one.
const HIT: f64 = 0.1;
/// Segments in a record, if they did not overlap: see `block_samples`.
const EIGHTH: usize = 8;

pub(super) const PAIR: Port<Array> = Port::new("pair", "pair", "measured inputs and output over time");
pub(super) const BEFORE: Port<Array> = Port::optional("before", "frf", "responses of other points, measured alike");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "blocks, the excited band, coherence, windows that were found or put on");

impl Stage for MeasuredFrf {
    const SPEC: Spec = Spec {
        name: "spectrum.measured_frf",
        version: 8,
        summary: "estimates the frequency response from measured input and output with coherence and variance",
        inputs: &[PAIR.spec(), BEFORE.spec()],
        outputs: &[FRF.spec(), SUMMARY.spec()],
        source: "J. S. Bendat, A. G. Piersol, Random Data, 2010",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let of_hits = self.force_window_s.is_some() || self.added_decay_per_s != 0.0;
        faults.require(self.blocks == BlocksAre::Hits || !of_hits, || {
            "`force_window_s` and `added_decay_per_s` are for `blocks = \"hits\"`: segments are under a Hann window, \
             periods under none"
                .to_owned()
        });
        if let Some([low, high]) = self.band_hz {
            faults.require(low >= 0.0 && low < high, || {
                format!("`band_hz` is [{low}, {high}], wanted the lowest and the highest frequency")
            });
        }
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let pair = Pair::new(inputs.get(&PAIR)?);
        let rate = pair.sample_rate_hz()?;
        let before = inputs.find(&BEFORE)?.map(|array| Joining::new(array, rate)).transpose()?;
        let [inputs, outputs] = pair.channels(DataSet::All)?;
        let record = Block { inputs, outputs };
        let records = apart(&record, &pair.record_starts());
        let samples = self.block_samples.or(before.as_ref().map(Joining::block_samples));
        let (blocks, left_out) = self.cut(&records, samples)?;
        left_out.into_iter().for_each(|reason| cx.warn(reason));
        let found = frequency_response(&blocks, self.settings(rate)).map_err(StageError::from_error)?;
        if found.coherence.is_none() {
            cx.warn("a single block: neither coherence nor variance is known");
        }
        let kept = self.kept(&found)?;
        let [force_unit, response_unit] = pair.units()?;
        let understood = Understood::new(self.quantity, &unit_ratio(response_unit, force_unit))?;
        understood.remark.iter().for_each(|remark| cx.warn(remark));
        let summary = self.summary(&found, &kept, blocks.len())?;
        let responses = self.responses(pair.channel_names(record.inputs.len(), record.outputs.len()))?;
        let mut frf = self.frf(found, &kept, responses, understood, (rate, pair.rate_error()))?;
        if let Some(before) = before {
            frf = before.join(frf)?;
            before.remark(&frf).into_iter().for_each(|remark| cx.warn(remark));
        }
        remark_on_copies(&frf).into_iter().for_each(|remark| cx.warn(remark));
        Ok(Ports::new().with(&FRF, frf.array()?).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::measured_example::examples()
    }
}

impl MeasuredFrf {
    /// The blocks of all records, and what is left out of several.
    fn cut<'a>(
        &self,
        records: &[Block<'a>],
        samples: Option<usize>,
    ) -> Result<(Vec<Block<'a>>, Option<String>), StageError> {
        let length = |record: &Block<'_>| record.outputs.first().map_or(0, |output| output.len());
        let all = |found: Result<Vec<Vec<Block<'a>>>, _>| found.map_err(StageError::from_error);
        if self.blocks == BlocksAre::Periods {
            let samples = match samples {
                Some(samples) => samples,
                None => self.period(records)?,
            };
            let found = all(records.iter().map(|record| periods(record, samples)).collect())?;
            return Ok((found.concat(), None));
        }
        if self.blocks == BlocksAre::Segments {
            let samples = samples.unwrap_or_else(|| records.iter().map(length).min().unwrap_or(0) / EIGHTH);
            let found = all(records.iter().map(|record| segments(record, samples)).collect())?;
            return Ok((found.concat(), None));
        }
        let struck: Vec<Block<'a>> = match records {
            [_] => records.to_vec(),
            _ => records.iter().zip(with_hits(records, HIT)).filter(|(_, hit)| *hit).map(|(r, _)| r.clone()).collect(),
        };
        let force = struck.first().and_then(|record| record.inputs.first().copied()).unwrap_or_default();
        let found = match samples.or_else(|| match &struck[..] {
            [_] => hit_spacing(force, self.before_samples),
            _ => common_hit_samples(&struck, self.before_samples, HIT),
        }) {
            None => vec![struck],
            Some(samples) => {
                all(struck.iter().map(|record| hits(record, samples, self.before_samples, HIT)).collect())?
            }
        };
        if found.iter().all(Vec::is_empty) {
            return Err(StageError::new("no hit lies whole in the record: the force has none, or blocks are too long"));
        }
        let used = found.iter().filter(|blocks| !blocks.is_empty()).count();
        let left_out = (records.len() > 1 && used < records.len()).then(|| {
            format!(
                "{} of {} records are left out: their force stays below {HIT} of the largest, or fewer than \
                 `before_samples` = {} lie before the hit",
                records.len() - used,
                records.len(),
                self.before_samples
            )
        });
        Ok((found.concat(), left_out))
    }

    /// Samples of the period that all records have. Errors: they do not repeat themselves, or with unlike periods.
    fn period(&self, records: &[Block<'_>]) -> Result<usize, StageError> {
        let found: Vec<Option<usize>> = records.iter().map(|record| period_samples(&record.inputs)).collect();
        let help = "give `block_samples`, the samples of a period, or `blocks = \"segments\"`";
        match found[..] {
            [Some(first), ref rest @ ..] if rest.iter().all(|other| *other == Some(first)) => Ok(first),
            [Some(first), ..] => Err(StageError::new(format!(
                "the input of the first record repeats itself every {first} samples, that of another one does not"
            ))
            .help(help)),
            _ => Err(StageError::new("the input does not repeat itself").help(help)),
        }
    }

    fn settings(&self, sample_rate_hz: f64) -> ResponseSettings {
        let kind = match self.blocks {
            BlocksAre::Segments => BlockKind::Segments,
            BlocksAre::Periods => BlockKind::Periods,
            BlocksAre::Hits => BlockKind::Hits {
                force_window: self.force_window_s.map(|time| (time * sample_rate_hz).round() as usize),
                added_decay_per_s: self.added_decay_per_s,
            },
        };
        let (estimator, excited_share) = (self.estimator.kernel(), self.excited_share);
        ResponseSettings { sample_rate_hz, estimator, kind, excited_share }
    }

    /// Bins that are kept, ascending. Errors: fewer than two.
    fn kept(&self, found: &MeasuredResponse) -> Result<Vec<usize>, StageError> {
        let common = found
            .excited_hz
            .iter()
            .fold([0.0, f64::INFINITY], |[low, high]: [f64; 2], band| [low.max(band[0]), high.min(band[1])]);
        let [low, high] = self.band_hz.unwrap_or(common);
        // zero hertz holds what is left of the offset
        let first = found.frequency_hz.partition_point(|f| *f < low).max(1);
        let end = found.frequency_hz.partition_point(|f| *f <= high);
        let is_line = |bin: &usize| found.lines.as_ref().is_none_or(|lines| lines[*bin]);
        let kept: Vec<usize> = (first..end).filter(is_line).collect();
        match kept.len() >= 2 {
            true => Ok(kept),
            false => Err(StageError::new(format!("no two bins lie between {low} and {high} Hz"))
                .help("give `band_hz`, or longer blocks")),
        }
    }

    /// What each response is from, output after output. Errors: there is no such driving point.
    fn responses(&self, [inputs, outputs]: [Vec<String>; 2]) -> Result<Vec<ResponseOf>, StageError> {
        let count = inputs.len() * outputs.len();
        if let Some(number) = self.driving_point.filter(|number| *number == 0 || *number > count) {
            return Err(StageError::new(format!("`driving_point` is {number}, there are {count} responses")));
        }
        let named = |name: &String, roving: Roving| {
            let point = self.point.as_ref().filter(|_| self.roving == roving);
            Point { name: point.unwrap_or(name).clone(), ..Point::default() }
        };
        let of = |output| {
            let response = move |input| ResponseOf {
                output: named(output, Roving::Sensor),
                input: named(input, Roving::Hammer),
                run: 0,
            };
            inputs.iter().map(response)
        };
        Ok(outputs.iter().flat_map(of).collect())
    }

    fn frf(
        &self,
        found: MeasuredResponse,
        bins: &[usize],
        responses: Vec<ResponseOf>,
        Understood { quantity, unit, factor, .. }: Understood,
        (rate, rate_error): (f64, RateError),
    ) -> Result<NewFrf, StageError> {
        let kept = |rows: Vec<Vec<f64>>, factor: f64| -> Vec<f64> {
            rows.iter().flat_map(|row| bins.iter().map(|&bin| row[bin] * factor)).collect()
        };
        let transfer: Vec<Complex64> =
            found.transfer.iter().flat_map(|row| bins.iter().map(|&bin| row[bin] * factor)).collect();
        // the multiple coherence of an output is that of each input
        let inputs = responses.len() / found.coherence.as_ref().map_or(1, |rows| rows.len().max(1));
        let of_each = |row| std::iter::repeat_n(row, inputs);
        let noise = found.input_noise.map(|row| kept(vec![row; responses.len()], 1.0));
        let coherence = found.coherence.map(|rows| kept(rows.into_iter().flat_map(of_each).collect(), 1.0));
        Ok(NewFrf {
            frequency_hz: bins.iter().map(|&bin| found.frequency_hz[bin]).collect(),
            responses,
            frf: transfer,
            variance: found.variance.map(|rows| kept(rows, factor * factor)),
            coherence,
            input_noise: noise,
            quantity,
            unit,
            driving_point: self.driving_point.map(|number| number - 1),
            sample_rate_hz: Some(rate),
            rate_error,
            averages: Some(found.averages),
            added_decay_per_s: self.added_decay_per_s,
        })
    }

    fn summary(&self, found: &MeasuredResponse, bins: &[usize], blocks: usize) -> Result<Document, StageError> {
        let middle = found.coherence.as_ref().map(|rows| {
            let all = rows.iter().flat_map(|row| bins.iter().map(|&bin| row[bin]));
            let mut values: Vec<f64> = all.filter(|value| value.is_finite()).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        });
        Document::new(&json!({
            "blocks": blocks,
            "averages": found.averages,
            // bins begin at zero hertz
            "bin_width_hz": found.frequency_hz.get(1),
            "lowest_hz": bins.first().map(|&bin| found.frequency_hz[bin]),
            "highest_hz": bins.last().map(|&bin| found.frequency_hz[bin]),
            "excited_hz": found.excited_hz,
            "median_coherence": middle.flatten(),
            "force_window_found": found.windowed_before,
            "added_decay_per_s": self.added_decay_per_s,
        }))
    }
}
