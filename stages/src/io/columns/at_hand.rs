//! The stage without its file.

use afmid_pipeline::{Array, StageError};

use super::part::Part;
use super::selection::Column;
use super::series::Series;
use super::stage::Columns;
use crate::artifacts::Sensor as Named;

/// Inputs and outputs that were recorded at once, each a series of as many samples.
pub type Recorded = [Vec<Vec<f64>>; 2];

/// What the stage hands on of these records of the same inputs and outputs with these of its parameters (`remove`, ...),
/// and what it warns of. Errors: a parameter that is none; a record of other channels; as the stage.
pub fn pair_of_series(
    records: Vec<Recorded>,
    names: [&[Named]; 2],
    sample_rate_hz: f64,
    params: serde_json::Value,
) -> Result<(Array, Vec<String>), StageError> {
    let given: Columns = serde_json::from_value(params).map_err(StageError::from_error)?;
    let numbers = |from: usize, count: usize| (from..from + count).map(Column::Number).collect::<Vec<_>>();
    let wanted = Columns {
        inputs: numbers(1, names[0].len()),
        outputs: numbers(1 + names[0].len(), names[1].len()),
        sample_rate_hz: Some(sample_rate_hz),
        ..given
    };
    let part = |[inputs, outputs]: Recorded| match [inputs.len(), outputs.len()] == names.map(<[Named]>::len) {
        true => Part::at_hand(inputs, outputs, names, sample_rate_hz),
        false => Err(StageError::new(format!(
            "a record of {} inputs and {} outputs, wanted {} and {} as there are names",
            inputs.len(),
            outputs.len(),
            names[0].len(),
            names[1].len()
        ))),
    };
    let series = Series::of(&wanted, records.into_iter().map(part).collect::<Result<_, _>>()?)?;
    let (pair, _) = series.split(&wanted)?;
    Ok((pair, series.warnings()))
}
