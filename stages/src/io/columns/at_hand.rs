//! The stage without its file.

use afmid_pipeline::{Array, StageError};

use super::part::Part;
use super::selection::Column;
use super::series::Series;
use super::stage::Columns;
use crate::artifacts::Sensor as Named;

/// What the stage hands on of these inputs and outputs with these of its parameters (`remove`, ...), and what it warns
/// of. Errors: a parameter that is none; as the stage.
pub fn pair_of_series(
    inputs: Vec<Vec<f64>>,
    outputs: Vec<Vec<f64>>,
    names: [&[Named]; 2],
    sample_rate_hz: f64,
    params: serde_json::Value,
) -> Result<(Array, Vec<String>), StageError> {
    let given: Columns = serde_json::from_value(params).map_err(StageError::from_error)?;
    let numbers = |from: usize, count: usize| (from..from + count).map(Column::Number).collect::<Vec<_>>();
    let wanted = Columns {
        inputs: numbers(1, inputs.len()),
        outputs: numbers(1 + inputs.len(), outputs.len()),
        sample_rate_hz: Some(sample_rate_hz),
        ..given
    };
    let series = Series::of(&wanted, vec![Part::at_hand(inputs, outputs, names, sample_rate_hz)?])?;
    let (pair, _) = series.split(&wanted)?;
    Ok((pair, series.warnings()))
}
