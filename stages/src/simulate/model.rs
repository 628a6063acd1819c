//! The stage `simulate.model`.

use std::path::PathBuf;

use afmid_pipeline::{Caching, Context, Document, Example, Faults, Port, Ports, Recording, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::afm::Afm;
use super::lever_model::{LeverModel, MODEL};

/// Simulates force curves with a diagnosed lever and writes them as native records.
///
/// # Model
/// That of `simulate.afm`. Lever, detector, causes, loads, noise and sample rate come from the port `model` alone:
/// there are no parameters for them. Shares of the tip's displacement, which no detector shows, are a uniform beam's;
/// the temperature gives the first mode the thermal motion that was seen.
/// # Method
/// That of `simulate.afm`: exact propagation, causes integrated in time.
/// # Shapes
/// As `simulate.afm`: `records` files in the folder `out`, the truth in `out`.truth.json.
/// # Units
/// SI; channels in volts. Newtons and metres are those of the stiffness and sensitivity given: in volts they cancel.
/// # Accuracy
/// That of `simulate.afm`. Parameters of causes that no data determine (phases of lines) are zero, with a warning.
/// # Errors
/// A model without loads, causes that the catalogue does not hold, and all of `simulate.afm`.
/// # Source
/// Stark et al., Rev. Sci. Instrum. 2005, Fig. 1 and section Setup; C. F. Van Loan, IEEE Trans. Automat. Contr. 23
/// (1978) 395.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AfmOfModel {
    /// Folder for the records, relative to the config; created if missing. The truth is written beside it as
    /// `NAME.truth.json`.
    pub out: PathBuf,
    /// Number of records; absent: as many as were diagnosed.
    #[schemars(range(min = 1))]
    pub records: Option<usize>,
    /// Samples per record. Why: 40 ms at 5 MS/s, a part of a cycle with one release.
    #[schemars(range(min = 1))]
    pub samples: usize,
    /// Total number of counted snap-offs; absent: one per record.
    pub snap_offs: Option<usize>,
    /// An event counts if it lies at least this far from both ends of its record and from other events, samples. Why:
    /// as in `simulate.afm`.
    pub margin_samples: usize,
    /// Static stiffness of the lever at its tip in N/m. Why: the paper's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness_n_per_m: f64,
    /// Optical lever sensitivity in V per m of static tip deflection.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sensitivity_v_per_m: f64,
    /// Mean height of the surface on the ramp's scale (0 in its middle) in m. Why: room for strong loads above it.
    pub surface_m: f64,
    /// Cycles of the ramp per second in Hz. Why: with the range the paper's speed.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub ramp_hz: f64,
    /// Range of the ramp in m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub ramp_m: f64,
    /// Wander of the baseline over the archive in V, not negative. Why: as in `simulate.afm`.
    pub drift_v: f64,
    /// Bits of the converter. Why: the paper's.
    #[schemars(range(min = 2, max = 16))]
    pub adc_bits: u32,
    /// Volts per code. Why: the paper's.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub lsb_v: f64,
    /// Deflate level of the files, 0 (raw) to 9.
    pub compression: u8,
    /// Seed of all random numbers; absent: the pipeline's and the stage's id.
    pub seed: Option<u64>,
}

impl Default for AfmOfModel {
    fn default() -> Self {
        let afm = Afm::default();
        Self {
            out: PathBuf::from("resimulated"),
            records: None,
            samples: 200_000,
            snap_offs: None,
            margin_samples: afm.margin_samples,
            stiffness_n_per_m: afm.stiffness_n_per_m,
            sensitivity_v_per_m: afm.sensitivity_v_per_m,
            surface_m: -100e-9,
            ramp_hz: 2.79,
            ramp_m: 400e-9,
            drift_v: afm.drift_v,
            adc_bits: afm.adc_bits,
            lsb_v: afm.lsb_v,
            compression: afm.compression,
            seed: None,
        }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records, channels `deflection` and `piezo`");
const TRUTH: Port<Document> = Port::new("truth", "truth", "parameters, start phases and every event of the archive");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "how many events the archive holds");

impl Stage for AfmOfModel {
    const SPEC: Spec = Spec {
        name: "simulate.model",
        version: 2,
        summary: "simulates force curves with a diagnosed lever, its causes included, and writes them as native records",
        inputs: &[MODEL.spec()],
        outputs: &[RECORDS.spec(), TRUTH.spec(), SUMMARY.spec()],
        caching: Caching::Always,
        seeded: true,
        source: "Stark et al., Rev. Sci. Instrum. 2005, Fig. 1; C. F. Van Loan, IEEE Trans. Automat. Contr. 23 (1978) 395",
    };

    fn check(&self, faults: &mut Faults) {
        // with the paper's lever in the place of the model's
        self.afm(self.records.unwrap_or(1)).check(faults);
    }

    fn depends_on(&self) -> Vec<String> {
        crate::causes::added()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let model = LeverModel::read(inputs.get(&MODEL)?)?;
        for cause in model.causes.iter().filter(|cause| !cause.assumed.is_empty()) {
            cx.warn(format!("{} of `{}` is not known and simulated as zero", cause.assumed.join(", "), cause.id));
        }
        let afm = self.afm(self.records.unwrap_or(model.records)).of_model(&model)?;
        let afm = caught(afm);
        afmid_pipeline::stage::check(&afm).map_err(|error| {
            StageError::new(format!("with this model: {error}")).help("`afmid stages simulate.afm` lists the ranges")
        })?;
        let afm = Afm { seed: Some(self.seed.unwrap_or_else(|| cx.seed())), ..afm };
        afm.run(&Ports::new(), cx)
    }

    fn location_params() -> &'static [&'static str] {
        &["out"]
    }

    fn examples() -> Vec<Example> {
        super::model_example::examples()
    }
}

impl AfmOfModel {
    fn afm(&self, records: usize) -> Afm {
        Afm {
            out: self.out.clone(),
            records,
            samples: self.samples,
            snap_offs: Some(self.snap_offs.unwrap_or(records)),
            margin_samples: self.margin_samples,
            stiffness_n_per_m: self.stiffness_n_per_m,
            sensitivity_v_per_m: self.sensitivity_v_per_m,
            surface_m: self.surface_m,
            ramp_hz: self.ramp_hz,
            ramp_m: self.ramp_m,
            drift_v: self.drift_v,
            adc_bits: self.adc_bits,
            lsb_v: self.lsb_v,
            compression: self.compression,
            seed: self.seed,
            ..Afm::default()
        }
    }
}

/// With a catch that the weakest load survives: a gap that half of it closes.
fn caught(afm: Afm) -> Afm {
    let weakest_n = afm.adhesion_n * (1.0 - afmid_kernels::simulate::ADHESION_CUT * afm.adhesion_scatter);
    let gap_m = (0.5 * weakest_n / afm.contact_stiffness_n_per_m).min(afm.snap_in_gap_m);
    Afm { snap_in_gap_m: gap_m, ..afm }
}
