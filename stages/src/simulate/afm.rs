//! The stage `simulate.afm`.

use std::path::{Path, PathBuf};

use afmid_pipeline::error::StoreError;
use afmid_pipeline::files::{FilledFolder, read_regular, sweep_beside};
use afmid_pipeline::recording::{
    Codes, InputFiles, NativeChannel, NativeRecord, RecordStorage, Wanted, open_native, write_native_in,
};
use afmid_pipeline::{
    Caching, Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::hidden::{Hidden, effects};
use afmid_kernels::simulate::{
    Adc, Archive, ArchiveLayout, Contact, Detector, Microscope, ModalLever, Mode, PiezoMonitor, ReadoutNoise,
    RecordedEvent, Scatter, SimulatedRecord, Target, TriangleRamp, Truth, counts, record_truth,
};

/// Simulates force curves of an atomic force microscope in the time domain and writes them as native records.
///
/// # Model
/// A modal lever (point force at the tip), a piezo ramp, a tip-sample contact with adhesion as nonlinear output
/// feedback, thermal force on every mode, detector poles and delay, white, 1/f and slowly wandering noise of the
/// readout, a converter.
/// # Method
/// Between events the system is linear: exact propagation by matrix exponentials with exact noise covariances; events
/// are located to 1e-8 of a sample. Start phases of the ramp are solved for, so that the archive holds the stated
/// numbers of events. Hidden causes are integrated in time: loads on straight lines between exact steps, modal forces
/// by Strang splitting, maps of the optics on eight points per sample.
/// # Shapes
/// `records` files of `samples` samples in the folder `out`, channels `deflection` and `piezo`; the truth in
/// `out`.truth.json.
/// # Units
/// SI; channels in volts. Deflection away from the sample is positive.
/// # Accuracy
/// No integration error with nothing hidden, below 1 % of a hidden effect otherwise. The inertia of the moving base is
/// left out; crossings of a threshold and back within one sample are missed.
/// # Errors
/// Parameters out of range, an unknown cause, event totals out of reach, a folder that holds other records already,
/// or files of the same names that are not in its list `.afmid-files` and not the same.
/// # Source
/// Stark et al., Rev. Sci. Instrum. 2005, Fig. 1 and section Setup; C. F. Van Loan, IEEE Trans. Automat. Contr. 23
/// (1978) 395.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Afm {
    /// Folder for the records, relative to the config; created if missing. The truth is written beside it as
    /// `NAME.truth.json`.
    pub out: PathBuf,
    /// Number of records.
    #[schemars(range(min = 1))]
    pub records: usize,
    /// Samples per record. Why: one cycle of the ramp at 5 MS/s.
    #[schemars(range(min = 1))]
    pub samples: usize,
    /// Sample rate in Hz, above twice the highest mode. Why: the paper's.
    #[schemars(range(min = 1e-9, max = 1e15))]
    pub sample_rate_hz: f64,
    /// Total number of counted snap-ins; absent: as the phases come.
    pub snap_ins: Option<usize>,
    /// Total number of counted snap-offs; absent: as the phases come.
    pub snap_offs: Option<usize>,
    /// Cycle position of the ramp at the start of each record, 0 (top, far away) to 1; absent: drawn and solved for the
    /// totals.
    pub phases: Option<Vec<f64>>,
    /// An event counts if it lies at least this far from both ends of its record and from other events, samples; solved
    /// phases keep all events out of this margin. Why: more than two windows of the paper.
    pub margin_samples: usize,
    /// Static stiffness of the lever at its tip in N/m. Why: the paper's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness_n_per_m: f64,
    /// Undamped natural frequencies of the modes in Hz, any number, above 0. Why: the paper's Table I.
    pub frequencies_hz: Vec<f64>,
    /// Quality factors, one per mode, above 0.5. Why: the paper's Table I.
    pub quality_factors: Vec<f64>,
    /// Shares of the static tip displacement, one per mode, above 0, sum 1. Why: a beam loaded at its end.
    pub tip_shares: Vec<f64>,
    /// Shares of the static detector signal, one per mode, sum 1. Why: the slope near the end of that beam.
    pub detector_shares: Vec<f64>,
    /// Contact stiffness in N/m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub contact_stiffness_n_per_m: f64,
    /// Viscous damping of the contact in N s/m, not negative. Why: the ringing against the sample dies in tens of
    /// microseconds.
    pub contact_damping_n_s_per_m: f64,
    /// Gap at which the tip is caught in m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub snap_in_gap_m: f64,
    /// Mean pull-off force in N; less three standard deviations it must exceed the catch, `contact_stiffness_n_per_m *
    /// snap_in_gap_m`. Why: the paper's.
    pub adhesion_n: f64,
    /// Relative standard deviation of the pull-off force from event to event; normal, cut at three.
    #[schemars(range(min = 0.0, max = 0.3))]
    pub adhesion_scatter: f64,
    /// Mean height of the surface on the ramp's scale (0 in its middle) in m. Why: room for the pull-off above it.
    pub surface_m: f64,
    /// Standard deviation of the surface's height from record to record in m, not negative.
    pub surface_std_m: f64,
    /// Cycles of the ramp per second in Hz. Why: the paper's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub ramp_hz: f64,
    /// Range of the ramp in m. Why: the paper's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub ramp_m: f64,
    /// Travel per monitored volt in m/V.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub piezo_m_per_v: f64,
    /// Volts per code of the piezo monitor. Why: 20 V over 12 bit.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub piezo_lsb_v: f64,
    /// White noise of the piezo monitor in V, not negative.
    pub piezo_white_v: f64,
    /// Optical lever sensitivity in V per m of static tip deflection. Why: 0.87 V at 330 nN.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sensitivity_v_per_m: f64,
    /// Real poles of the detector in Hz, any number, above 0.
    pub detector_poles_hz: Vec<f64>,
    /// Delay of the deflection channel in s, not negative.
    pub delay_s: f64,
    /// Temperature in K, not negative; 0 switches thermal motion off.
    pub temperature_k: f64,
    /// White noise of the readout in V, not negative.
    pub white_v: f64,
    /// 1/f noise of the readout between 1 Hz and the Nyquist frequency in V, not negative.
    pub pink_v: f64,
    /// Wander of the baseline over the archive in V, not negative.
    pub drift_v: f64,
    /// Bits of the converter. Why: the paper's.
    #[schemars(range(min = 2, max = 16))]
    pub adc_bits: u32,
    /// Volts per code. Why: the paper's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub lsb_v: f64,
    /// Deflate level of the files, 0 (raw) to 9.
    #[schemars(range(min = 0, max = 9))]
    pub compression: u8,
    /// Causes hidden in the simulation, each a table with the id of a cause (`afmid causes`) and all its parameters
    /// within their limits, as in `{ cause = "quadratic-detector", a2 = 0.012 }`; they are integrated in time and add
    /// up. None: the linear microscope.
    pub hidden: Vec<Hidden>,
    /// Seed of all random numbers; absent: the pipeline's and the stage's id.
    pub seed: Option<u64>,
}

impl Default for Afm {
    fn default() -> Self {
        Self {
            out: PathBuf::from("simulated"),
            records: 12,
            samples: 900_000,
            sample_rate_hz: 5e6,
            snap_ins: None,
            snap_offs: None,
            phases: None,
            margin_samples: 20_000,
            stiffness_n_per_m: 3.8,
            frequencies_hz: vec![46.3e3, 247.4e3, 580.8e3, 1051.2e3],
            quality_factors: vec![40.8, 193.2, 358.0, 503.8],
            tip_shares: vec![0.9713, 0.0247, 0.0032, 0.0008],
            detector_shares: vec![0.8979, 0.0794, 0.0166, 0.0061],
            contact_stiffness_n_per_m: 60.0,
            contact_damping_n_s_per_m: 8e-6,
            snap_in_gap_m: 4e-9,
            adhesion_n: 330e-9,
            adhesion_scatter: 0.06,
            surface_m: -22e-9,
            surface_std_m: 3e-9,
            ramp_hz: 5.58,
            ramp_m: 200e-9,
            piezo_m_per_v: 25e-9,
            piezo_lsb_v: 4.88e-3,
            piezo_white_v: 5e-4,
            sensitivity_v_per_m: 1e7,
            detector_poles_hz: vec![1.3e6, 1.9e6, 2.4e6],
            delay_s: 0.0,
            temperature_k: 295.0,
            white_v: 1.2e-3,
            pink_v: 3e-4,
            drift_v: 4e-3,
            adc_bits: 12,
            lsb_v: 0.977e-3,
            compression: 4,
            hidden: Vec::new(),
            seed: None,
        }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records, channels `deflection` and `piezo`");
const TRUTH: Port<Document> = Port::new("truth", "truth", "parameters, start phases and every event of the archive");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "how many events the archive holds");

impl Stage for Afm {
    const SPEC: Spec = Spec {
        name: "simulate.afm",
        version: 2,
        summary: "simulates force curves with snap-in, adhesion and snap-off, and writes them as native records",
        inputs: &[],
        outputs: &[RECORDS.spec(), TRUTH.spec(), SUMMARY.spec()],
        caching: Caching::Always,
        seeded: true,
        source: "Stark et al., Rev. Sci. Instrum. 2005, Fig. 1; C. F. Van Loan, IEEE Trans. Automat. Contr. 23 (1978) 395",
    };

    fn check(&self, faults: &mut Faults) {
        let modes = self.frequencies_hz.len();
        let mut each = true;
        for (name, found) in [
            ("quality_factors", self.quality_factors.len()),
            ("tip_shares", self.tip_shares.len()),
            ("detector_shares", self.detector_shares.len()),
        ] {
            each &= found == modes;
            faults.require(found == modes, || {
                format!("`{name}` has {found} values, `frequencies_hz` {modes}: one per mode")
            });
        }
        let hidden = effects(&self.hidden).map(|_| ());
        let possible = each && hidden.is_ok();
        faults.take(hidden);
        // a microscope of as many of everything
        if possible {
            faults.take(self.microscope().check().map_err(StageError::from_error));
            faults.take(self.layout(0).check().map_err(StageError::from_error));
        }
    }

    fn depends_on(&self) -> Vec<String> {
        crate::causes::added()
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let folder = cx.base().join(&self.out);
        let names: Vec<String> = (0..self.records).map(|record| format!("record_{record:04}.h5")).collect();
        let seed = self.seed.unwrap_or_else(|| cx.seed());
        let parameters = serde_json::to_value(self)
            .map_err(|error| StageError::new(format!("parameters cannot be written as JSON: {error}")))?;
        let filled = prepare(&folder, &names, &parameters, seed)?;
        let (microscope, layout) = (self.microscope(), self.layout(seed));
        let effects = effects(&self.hidden)?;
        let archive = Archive::plan(&microscope, &layout).map_err(StageError::from_error)?;
        cx.expect(self.records);
        let written = names
            .par_iter()
            .enumerate()
            .map(|(record, name)| {
                let simulated = archive.simulate_with(&microscope, record, &effects);
                let written = self.write(&filled, name, record, simulated);
                cx.tick();
                written
            })
            .collect::<Result<Vec<(Record, Vec<RecordedEvent>, usize)>, StageError>>()?;
        let events: Vec<Vec<RecordedEvent>> = written.iter().map(|(_, events, _)| events.clone()).collect();
        archive.verify(&events).map_err(StageError::from_error)?;
        let records = names.iter().zip(&written).enumerate();
        let truth = Truth {
            parameters,
            seed,
            counted_means: format!(
                "at least {} samples from both ends of the record and from any other event",
                self.margin_samples
            ),
            counts: counts(&events),
            records: records
                .map(|(record, (name, (_, events, saturated)))| {
                    record_truth(&archive, record, name.clone(), *saturated, events)
                })
                .collect(),
        };
        let saturated: usize = written.iter().map(|(_, _, saturated)| saturated).sum();
        if saturated > 0 {
            cx.warn(format!(
                "{saturated} deflection codes lie at a limit of the converter: lower sensitivity_v_per_m or raise lsb_v"
            ));
        }
        let summary = serde_json::json!({
            "records": self.records,
            "events": truth.counts,
            "saturated": saturated,
            "out": self.out,
        });
        write_truth(&filled, &truth)?;
        let records = written.into_iter().map(|(record, ..)| record).collect();
        Ok(Ports::new()
            .with(&RECORDS, Recording { records })
            .with(&TRUTH, Document::new(&truth)?)
            .with(&SUMMARY, Document::new(&summary)?))
    }

    fn location_params() -> &'static [&'static str] {
        &["out"]
    }

    fn examples() -> Vec<Example> {
        let short = "records = 2\nsamples = 500000\nramp_hz = 10.0\nsnap_offs = 2\nseed = 5";
        let hidden = "records = 2\nsamples = 500000\nramp_hz = 10.0\nsnap_offs = 2\nseed = 5\n\
                      hidden = [{ cause = \"quadratic-detector\", a2 = 0.012 }]";
        let inputs = || Ok(Ports::new());
        vec![
            Example { title: "two short records, each with one snap-off", params: short, inputs, expect },
            Example { title: "the same through a photodiode that bends", params: hidden, inputs, expect },
        ]
    }
}

fn expect(outputs: &Ports) -> Result<String, String> {
    let records = outputs.get(&RECORDS).map_err(|error| error.to_string())?;
    let summary = outputs.get(&SUMMARY).map_err(|error| error.to_string())?;
    let found = summary.0["events"]["snap_off"].as_u64();
    match (records.records.len(), found) {
        (2, Some(2)) => Ok("2 records with 2 snap-offs".to_owned()),
        other => Err(format!("records and snap-offs: {other:?}, wanted 2 and 2")),
    }
}

impl Afm {
    /// The microscope that the parameters describe.
    pub fn microscope(&self) -> Microscope {
        let shares = self.tip_shares.iter().zip(&self.detector_shares);
        let modes = self.frequencies_hz.iter().zip(&self.quality_factors).zip(shares);
        Microscope {
            lever: ModalLever {
                stiffness_n_per_m: self.stiffness_n_per_m,
                modes: modes
                    .map(|((&frequency_hz, &quality_factor), (&tip_share, &detector_share))| Mode {
                        frequency_hz,
                        quality_factor,
                        tip_share,
                        detector_share,
                    })
                    .collect(),
            },
            contact: Contact {
                stiffness_n_per_m: self.contact_stiffness_n_per_m,
                damping_n_s_per_m: self.contact_damping_n_s_per_m,
                snap_in_gap_m: self.snap_in_gap_m,
                adhesion_n: self.adhesion_n,
                adhesion_scatter: self.adhesion_scatter,
            },
            detector: Detector {
                sensitivity_v_per_m: self.sensitivity_v_per_m,
                pole_hz: self.detector_poles_hz.clone(),
                delay_s: self.delay_s,
            },
            noise: ReadoutNoise { white_v: self.white_v, pink_v: self.pink_v, drift_v: self.drift_v },
            adc: Adc { bits: self.adc_bits, lsb_v: self.lsb_v },
            monitor: PiezoMonitor { m_per_v: self.piezo_m_per_v, lsb_v: self.piezo_lsb_v, white_v: self.piezo_white_v },
            ramp: TriangleRamp { frequency_hz: self.ramp_hz, range_m: self.ramp_m, phase: 0.0 },
            temperature_k: self.temperature_k,
            sample_rate_hz: self.sample_rate_hz,
        }
    }

    fn layout(&self, seed: u64) -> ArchiveLayout {
        ArchiveLayout {
            records: self.records,
            samples: self.samples,
            margin_samples: self.margin_samples,
            target: Target { snap_ins: self.snap_ins, snap_offs: self.snap_offs },
            phases: self.phases.clone(),
            scatter: Scatter { surface_m: self.surface_m, surface_std_m: self.surface_std_m },
            seed,
        }
    }

    fn write(
        &self,
        filled: &FilledFolder,
        name: &str,
        number: usize,
        record: SimulatedRecord,
    ) -> Result<(Record, Vec<RecordedEvent>, usize), StageError> {
        let channel = |location: &str, codes: Vec<i16>, scale_factor: f64, long_name: &str| NativeChannel {
            location: location.to_owned(),
            codes: Codes::Int16(codes),
            unit: "V".to_owned(),
            scale_factor,
            add_offset: 0.0,
            long_name: long_name.to_owned(),
        };
        let native = NativeRecord {
            sample_rate_hz: self.sample_rate_hz,
            started_at: started_at(number),
            channels: vec![
                channel("deflection", record.deflection, self.lsb_v, DEFLECTION),
                channel("piezo", record.piezo, self.piezo_lsb_v, PIEZO),
            ],
        };
        let storage = match self.compression {
            0 => RecordStorage::Raw,
            level => RecordStorage::Deflate(level),
        };
        write_native_in(filled, name, &native, storage)?;
        let opened = open_native(&InputFiles::new(), &filled.folder().join(name), &CHANNELS)?;
        Ok((opened, record.events, record.saturated))
    }
}

/// A fictitious start, one minute apart; the numbers must not depend on when the simulation ran.
fn started_at(record: usize) -> String {
    let minutes = 600 + record;
    format!("2005-03-{:02}T{:02}:{:02}:00Z", 1 + minutes / 1440 % 31, minutes / 60 % 24, minutes % 60)
}

/// The channels of a simulated record.
const CHANNELS: [Wanted<'static>; 2] = [
    Wanted { role: "deflection", location: "/deflection", required: true },
    Wanted { role: "piezo", location: "/piezo", required: true },
];

/// Whether a file may be a simulated record of this number, by what it says of itself. One that no list knows must have
/// the bytes of the record, too, which are known when it is simulated.
fn is_simulated(path: &Path, number: usize) -> bool {
    let named = |record: &Record, role, name| record.channel(role).is_ok_and(|channel| channel.long_name == name);
    open_native(&InputFiles::new(), path, &CHANNELS).is_ok_and(|record| {
        record.started_at == started_at(number)
            && named(&record, "deflection", DEFLECTION)
            && named(&record, "piezo", PIEZO)
    })
}

const DEFLECTION: &str = "photodiode signal";
const PIEZO: &str = "z piezo monitor";

/// Makes the folder; refuses one that holds records of another archive, which a pattern would pick up together with the
/// new ones, and files under the names of the new ones that this program did not write. Of those that no list knows
/// only that is refused here which cannot be the same: the truth of other `parameters` or another `seed` among them.
fn prepare(folder: &Path, names: &[String], parameters: &Value, seed: u64) -> Result<FilledFolder, StageError> {
    let failed = |error: std::io::Error| StageError::new(format!("the folder cannot be used: {error}")).at(folder);
    std::fs::create_dir_all(folder).map_err(failed)?;
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if name.ends_with(".h5") && !names.contains(&name) {
            return Err(StageError::new(format!("the folder holds `{name}`, which is not of this archive"))
                .at(folder)
                .help("choose another `out`, or remove the old records"));
        }
    }
    let filled = FilledFolder::open(folder)?;
    sweep_beside(&folder.join(truth_name(folder)));
    let own = |error: StoreError| StageError::from(error).help("choose another `out`, or remove the file");
    let numbered: Vec<(usize, &String)> = names.iter().enumerate().collect();
    numbered
        .par_iter()
        .map(|(number, name)| filled.require_own(name, |path| is_simulated(path, *number)).map_err(own))
        .collect::<Result<(), StageError>>()?;
    filled.require_own(&truth_name(folder), |path| is_truth(path, parameters, seed)).map_err(own)?;
    Ok(filled)
}

/// The file of the truth, seen from the folder of the records.
fn truth_name(folder: &Path) -> String {
    let name = folder.file_name().unwrap_or_default();
    format!("../{}.truth.json", name.to_string_lossy())
}

/// Whether a file may be the truth of this archive, by what it holds.
fn is_truth(path: &Path, parameters: &Value, seed: u64) -> bool {
    let json: Option<Value> =
        read_regular(path, MOST_TRUTH_BYTES).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    json.is_some_and(|json| json.get("parameters") == Some(parameters) && json.get("seed") == Some(&seed.into()))
}

/// The largest file that may be a truth: a hundred thousand records with a hundred events each come to less.
const MOST_TRUTH_BYTES: u64 = 1 << 31;

fn write_truth(filled: &FilledFolder, truth: &Truth) -> Result<(), StageError> {
    let mut text = serde_json::to_string_pretty(truth)
        .map_err(|error| StageError::new(format!("the truth cannot be written as JSON: {error}")))?;
    text.push('\n');
    Ok(filled.write_or_same(&truth_name(filled.folder()), text.as_bytes())?)
}

#[cfg(test)]
#[path = "afm_tests.rs"]
mod tests;
