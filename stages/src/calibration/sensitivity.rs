//! The stage `calibration.sensitivity`.

use afmid_pipeline::{
    Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::free_rule::FreeSettings;
use super::reading::{common_rate, read_blocks, read_free};
use crate::artifacts::{PIEZO, length_m};
use afmid_kernels::calibration::{
    ContactSlope, Estimate, Sensitivity, SlopeGauge, SlopeStretch, contact_slope, contact_stretches, sensitivity,
};

/// Optical lever sensitivity from the slope of the deflection against the piezo while the tip is in contact.
///
/// # Model
/// Lever and contact share the piezo's travel: the slope reads `S k_c / (k + k_c)`. 60 N/m under 3.8 N/m read 6 % low;
/// a spring constant taken from that sensitivity is 12 % low and must be multiplied by 1.13. Where both stiffnesses are
/// given, the slope is corrected.
/// # Method
/// Straight contact stretches by local slopes, without their ends (turning point, ringing); approach and retract apart;
/// a line through each; mean weighted by travel squared.
/// # Shapes
/// `slopes`: one row per stretch.
/// # Units
/// V/m; the slope in V of deflection per unit of the piezo's channel, a volt of its monitor or a length.
/// # Accuracy
/// Standard error from the scatter of the stretches and the piezo's own uncertainty: 0.03 % for the paper's archive.
/// Not covered: a contact that is softer than stated, and a detector that is not linear over its range.
/// # Errors
/// No piezo channel, or one of a monitor whose travel per volt is not stated; fewer than two straight stretches.
/// # Source
/// H.-J. Butt, B. Cappella and M. Kappl, Surf. Sci. Rep. 59 (2005) 1, section on calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Sensitivity")]
pub struct SlopeSensitivity {
    /// Travel of the piezo per monitored volt in m/V; absent of a channel in a unit of length alone.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub piezo_m_per_v: Option<f64>,
    /// Its standard uncertainty in m/V, not negative. 0: not known, left out.
    #[schemars(range(min = 0.0))]
    pub piezo_m_per_v_std: f64,
    /// Stiffness of the contact in N/m; absent: rigid as far as is known.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub contact_stiffness_n_per_m: Option<f64>,
    /// Stiffness of the lever in N/m, for the correction; absent: no correction here (`calibration.stiffness` corrects
    /// both together).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness_n_per_m: Option<f64>,
    /// What counts as a free stretch.
    pub free: FreeSettings,
}

impl Default for SlopeSensitivity {
    fn default() -> Self {
        Self {
            piezo_m_per_v: None,
            piezo_m_per_v_std: 0.0,
            contact_stiffness_n_per_m: None,
            stiffness_n_per_m: None,
            free: FreeSettings::default(),
        }
    }
}

/// Volts of each unit of the piezo's monitor; one that is not stated is a volt.
const VOLTS: [(&str, f64); 5] = [("", 1.0), ("V", 1.0), ("mV", 1e-3), ("uV", 1e-6), ("kV", 1e3)];

const RECORDS: Port<Recording> = Port::new("records", "records", "the records; channels `deflection` and `piezo`");
const SLOPES: Port<Table> = Port::new("slopes", "slopes", "every straight contact stretch and its slope");
const SUMMARY: Port<Document> =
    Port::new("summary", "sensitivity", "the sensitivity, as the slope reads and corrected, with standard errors");

/// What `summary` holds: the sensitivity with all that made it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SensitivitySummary {
    /// The sensitivity to use, V/m: corrected where the stiffnesses are known.
    pub sensitivity_v_per_m: Estimate,
    /// As the slope reads, V/m.
    pub apparent_v_per_m: Estimate,
    /// `1 + k / k_contact`; 1 without correction.
    pub contact_factor: f64,
    /// Whether the contact's compliance was corrected.
    pub corrected: bool,
    /// The contact stiffness that was given, N/m.
    pub contact_stiffness_n_per_m: Option<f64>,
    /// Slope, V of deflection per V of piezo.
    pub slope_v_per_v: Estimate,
    /// On approach alone.
    pub approach_v_per_v: Option<f64>,
    /// On retract alone.
    pub retract_v_per_v: Option<f64>,
    /// (approach - retract) / mean.
    pub hysteresis: Option<Estimate>,
    /// Number of straight stretches.
    pub stretches: usize,
    /// Records without any.
    pub records_without_contact: Vec<String>,
}

impl Stage for SlopeSensitivity {
    const SPEC: Spec = Spec {
        name: "calibration.sensitivity",
        version: 2,
        summary: "optical lever sensitivity from the contact slope, corrected for a soft contact",
        inputs: &[RECORDS.spec()],
        outputs: &[SLOPES.spec(), SUMMARY.spec()],
        source: "H.-J. Butt, B. Cappella and M. Kappl, Surf. Sci. Rep. 59 (2005) 1",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let std = self.piezo_m_per_v_std;
        match self.piezo_m_per_v {
            Some(value) => faults.require(std <= value, || {
                format!("`piezo_m_per_v_std` is {std}, wanted at most `piezo_m_per_v`, {value}")
            }),
            None => faults.require(std == 0.0, || "`piezo_m_per_v_std` is of a travel that is not given".to_owned()),
        }
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let rule = self.free.rule(common_rate(records)?, 0);
        let piezo = self.travel(records)?;
        cx.expect(records.len());
        let per_record = records
            .par_iter()
            .map(|record| {
                let blocks = read_blocks(record, self.free.block_samples)?;
                let free = read_free(record, &blocks, rule)?;
                cx.tick();
                contact_stretches(&blocks, &free).map_err(|error| StageError::from_error(error).at(&record.path))
            })
            .collect::<Result<Vec<Vec<SlopeStretch>>, StageError>>()?;
        let all: Vec<SlopeStretch> = per_record.iter().flatten().copied().collect();
        let slope = contact_slope(&all).map_err(StageError::from_error)?;
        let gauge = SlopeGauge {
            piezo_m_per_v: piezo,
            contact_stiffness_n_per_m: self.contact_stiffness_n_per_m,
            stiffness_n_per_m: self.stiffness_n_per_m,
        };
        let found = sensitivity(&slope, gauge).map_err(StageError::from_error)?;
        if let Some((ratio, std)) = slope.hysteresis.filter(|(ratio, std)| ratio.abs() > (4.0 * std).max(0.01)) {
            cx.warn(format!(
                "approach and retract slopes differ by {:.2} % +- {:.2} %: piezo hysteresis or friction; the mean is used",
                100.0 * ratio,
                100.0 * std
            ));
        }
        let summary = self.summary(&slope, &found, &per_record, records);
        Ok(Ports::new().with(&SLOPES, table(&per_record, records)).with(&SUMMARY, Document::new(&summary)?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "a contact of 60 N/m under 3.8 N/m, corrected",
            params: "piezo_m_per_v = 25e-9\ncontact_stiffness_n_per_m = 60.0\nstiffness_n_per_m = 3.8",
            inputs: super::example::records,
            expect,
        }]
    }
}

fn expect(outputs: &Ports) -> Result<String, String> {
    let summary: SensitivitySummary =
        outputs.get(&SUMMARY).and_then(Document::read).map_err(|error| error.to_string())?;
    let found = summary.sensitivity_v_per_m;
    // five standard errors, and the 0.2 % that four stretches leave unsure
    if (found.value - 1e7).abs() < 5.0 * found.std + 2e4 {
        Ok(format!("{:.4e} +- {:.1e} V/m; truth 1e7", found.value, found.std))
    } else {
        Err(format!("{:.4e} +- {:.1e} V/m, wanted 1e7", found.value, found.std))
    }
}

impl SlopeSensitivity {
    /// Metres of travel per unit of the piezo's channel. Errors: no such channel; neither its unit nor the config says it.
    fn travel(&self, records: &[Record]) -> Result<Estimate, StageError> {
        let Some(record) = records.first() else { return Err(StageError::new("there is no record")) };
        let unit = record.channel(PIEZO)?.unit.trim();
        match (length_m(unit), self.piezo_m_per_v) {
            (None, Some(given)) => match VOLTS.iter().find(|(name, _)| *name == unit) {
                Some((_, volts)) => Ok(Estimate { value: given * volts, std: self.piezo_m_per_v_std * volts }),
                None => Err(StageError::new(format!("the piezo's channel is in {unit}, wanted volts or a length"))
                    .at(&record.path)),
            },
            (Some(length), None) => Ok(Estimate { value: length, std: 0.0 }),
            (Some(_), Some(_)) => Err(StageError::new(format!("the piezo's channel is in {unit} already"))
                .at(&record.path)
                .help("leave `piezo_m_per_v` out")),
            (None, None) => Err(StageError::new(format!(
                "how far the piezo travels is not stated: its channel is in {}",
                if unit.is_empty() { "no unit" } else { unit }
            ))
            .at(&record.path)
            .help("`piezo_m_per_v` in metres a volt of its monitor, from the piezo's own calibration")),
        }
    }

    fn summary(
        &self,
        slope: &ContactSlope,
        found: &Sensitivity,
        per_record: &[Vec<SlopeStretch>],
        records: &[Record],
    ) -> SensitivitySummary {
        let without = records.iter().zip(per_record).filter(|(_, stretches)| stretches.is_empty());
        SensitivitySummary {
            sensitivity_v_per_m: found.corrected_v_per_m,
            apparent_v_per_m: found.apparent_v_per_m,
            contact_factor: found.contact_factor,
            corrected: self.contact_stiffness_n_per_m.is_some() && self.stiffness_n_per_m.is_some(),
            contact_stiffness_n_per_m: self.contact_stiffness_n_per_m,
            slope_v_per_v: Estimate { value: slope.slope_v_per_v, std: slope.slope_std_v_per_v },
            approach_v_per_v: slope.approach_v_per_v,
            retract_v_per_v: slope.retract_v_per_v,
            hysteresis: slope.hysteresis.map(|(value, std)| Estimate { value, std }),
            stretches: per_record.iter().map(Vec::len).sum(),
            records_without_contact: without.map(|(record, _)| record.name.clone()).collect(),
        }
    }
}

fn table(per_record: &[Vec<SlopeStretch>], records: &[Record]) -> Table {
    let rows: Vec<(&Record, &SlopeStretch)> =
        records.iter().zip(per_record).flat_map(|(record, all)| all.iter().map(move |one| (record, one))).collect();
    Table::of(&rows)
        .with("record", "", "file name of the record", |(record, _)| record.name.clone())
        .with("start", "1", "first sample of the stretch", |(_, s)| s.start_sample)
        .with("end", "1", "one past its last sample", |(_, s)| s.end_sample)
        .with("approach", "", "towards the sample", |(_, s)| s.approach)
        .with("slope", "V/V", "deflection against piezo", |(_, s)| s.slope_v_per_v)
        .with("travel", "V", "travel of the piezo monitor", |(_, s)| s.travel_v)
        .with("residual", "V", "root mean square distance from the line", |(_, s)| s.residual_v)
        .table()
}
