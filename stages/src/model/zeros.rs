//! The stage `model.zeros`.

use afmid_pipeline::{Context, Document, Example, Port, Ports, Spec, Stage, StageError, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::artifacts::{RootRow, roots};
use afmid_kernels::validation::{Frequency, PoleShift, ZeroPair, compare_zeros, pole_shifts};

/// Compares the zeros of the surface-coupled lever with the free lever's, and reports how far the contact moves the
/// poles.
///
/// Model: the contact is a feedback from tip deflection to tip force. It moves the poles up; the zeros belong to the
/// sensor and stay.
/// Method: zeros of the free lever between its lowest and highest mode, each with the coupled lever's nearest in ratio,
/// used once; differences in combined standard errors. Each free mode with the highest coupled resonance below the next
/// free one.
/// Shapes: one row per zero of the free lever (`zeros`), one per mode (`shifts`).
/// Units: Hz; differences relative, and in combined standard errors.
/// Accuracy: both sets of errors are taken as independent. The contact's own nonlinearity is in neither.
/// Errors: a table that holds no mode of the free lever.
/// Source: Stark et al. 2005, Fig. 4 and its text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Zeros {
    /// Least magnitude of the quality factor of a zero that is compared. Why: zeros of lever and tip are as sharp as
    /// its modes.
    #[schemars(range(min = 0.5))]
    pub min_quality_factor: f64,
    /// Largest relative standard error of a zero's frequency. Why: a worse one is compared with nothing.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub max_frequency_error: f64,
}

impl Default for Zeros {
    fn default() -> Self {
        Self { min_quality_factor: 5.0, max_frequency_error: 0.05 }
    }
}

pub(super) const FREE: Port<Table> = Port::new("free", "roots", "poles and zeros of the free lever");
pub(super) const COUPLED: Port<Table> = Port::new("coupled", "roots", "poles and zeros of the surface-coupled lever");
pub(super) const ZEROS: Port<Table> = Port::new("zeros", "zero-comparison", "zeros side by side");
pub(super) const SHIFTS: Port<Table> = Port::new("shifts", "pole-shifts", "where the contact moves each mode");
pub(super) const SUMMARY: Port<Document> = Port::new("summary", "summary", "zeros, differences, pole shifts");

impl Stage for Zeros {
    const SPEC: Spec = Spec {
        name: "model.zeros",
        version: 1,
        summary: "compares the zeros of the surface-coupled lever with the free lever's",
        inputs: &[FREE.spec(), COUPLED.spec()],
        outputs: &[ZEROS.spec(), SHIFTS.spec(), SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Fig. 4",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let (free, coupled) = (inputs.get(&FREE)?, inputs.get(&COUPLED)?);
        let free_modes = self.sharp(free, |root| root.is_mode)?;
        let (Some(lowest), Some(highest)) = (free_modes.first(), free_modes.last()) else {
            return Err(StageError::new("the free lever's table holds no mode, wanted at least one"));
        };
        let band = lowest.value_hz..highest.value_hz;
        let mut free_zeros = self.sharp(free, |root| root.is_zero_pair)?;
        free_zeros.retain(|zero| band.contains(&zero.value_hz));
        let pairs = compare_zeros(&free_zeros, &self.sharp(coupled, |root| root.is_zero_pair)?);
        let shifts = pole_shifts(&free_modes, &self.sharp(coupled, |root| root.is_mode)?);
        for pair in pairs.iter().filter(|pair| pair.combined_errors().abs() > 4.0) {
            cx.warn(format!(
                "the zero at {:.0} Hz moves by {:.1} combined standard errors on contact",
                pair.free.value_hz,
                pair.combined_errors()
            ));
        }
        let summary = Document::new(&json!({
            "zeros": pairs.iter().map(zero_document).collect::<Vec<Value>>(),
            "pole_shifts": shifts.iter().map(shift_document).collect::<Vec<Value>>(),
        }))?;
        Ok(Ports::new().with(&ZEROS, zero_table(&pairs)).with(&SHIFTS, shift_table(&shifts)).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::zeros()
    }
}

impl Zeros {
    /// Rows that are sharp and well known, ascending.
    fn sharp(&self, table: &Table, chosen: fn(&RootRow) -> bool) -> Result<Vec<Frequency>, StageError> {
        let rows = roots(table)?;
        let sharp = |row: &&RootRow| {
            row.quality_factor.abs() >= self.min_quality_factor
                && row.frequency_std_hz <= self.max_frequency_error * row.frequency_hz
        };
        let wanted = rows.iter().filter(|row| chosen(row)).filter(sharp);
        let mut found: Vec<Frequency> =
            wanted.map(|row| Frequency { value_hz: row.frequency_hz, std_hz: row.frequency_std_hz }).collect();
        found.sort_by(|x, y| x.value_hz.total_cmp(&y.value_hz));
        Ok(found)
    }
}

fn zero_document(pair: &ZeroPair) -> Value {
    json!({
        "free_hz": pair.free.value_hz,
        "free_std_hz": pair.free.std_hz,
        "coupled_hz": pair.coupled.map(|coupled| coupled.value_hz),
        "coupled_std_hz": pair.coupled.map(|coupled| coupled.std_hz),
        "relative_difference": pair.coupled.map(|_| pair.relative_difference()),
        "combined_errors": pair.coupled.map(|_| pair.combined_errors()),
    })
}

fn shift_document(shift: &PoleShift) -> Value {
    let (value, std) = shift.shift_hz();
    json!({
        "free_hz": shift.free.value_hz,
        "coupled_hz": shift.coupled.map(|coupled| coupled.value_hz),
        "shift_hz": shift.coupled.map(|_| value),
        "shift_std_hz": shift.coupled.map(|_| std),
    })
}

/// A number that may be missing.
fn or_unknown(found: Option<Frequency>) -> (f64, f64) {
    found.map_or((f64::NAN, f64::NAN), |zero| (zero.value_hz, zero.std_hz))
}

fn zero_table(pairs: &[ZeroPair]) -> Table {
    Table::of(pairs)
        .with_std(["free_hz", "free_std_hz"], "Hz", "zero of the free lever", |p| (p.free.value_hz, p.free.std_hz))
        .with_std(["coupled_hz", "coupled_std_hz"], "Hz", "zero of the coupled lever", |p| or_unknown(p.coupled))
        .with("relative_difference", "1", "coupled over free, minus one", ZeroPair::relative_difference)
        .with("combined_errors", "1", "difference in combined standard errors", ZeroPair::combined_errors)
        .table()
}

fn shift_table(shifts: &[PoleShift]) -> Table {
    Table::of(shifts)
        .with_std(["free_hz", "free_std_hz"], "Hz", "mode of the free lever", |s| (s.free.value_hz, s.free.std_hz))
        .with_std(["coupled_hz", "coupled_std_hz"], "Hz", "where the contact moves it", |s| or_unknown(s.coupled))
        .with_std(["shift_hz", "shift_std_hz"], "Hz", "coupled minus free", PoleShift::shift_hz)
        .table()
}
