//! `frf`: frequency responses that were measured, a row for each pair of output and input.

use afmid_pipeline::{Array, Attribute, Axis, StageError};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::{RateError, SAMPLE_RATE_HZ};

const FREQUENCY_HZ: &str = "frequency_hz";
const RESPONSE: &str = "response";
const FRF: &str = "frf";
const VARIANCE: &str = "variance";
const COHERENCE: &str = "coherence";
const INPUT_NOISE: &str = "input_noise";
const RESPONSES: &str = "responses";
const QUANTITY: &str = "quantity";
const DRIVING_POINT: &str = "driving_point";
const AVERAGES: &str = "averages";
const ADDED_DECAY_PER_S: &str = "added_decay_per_s";

pub use afmid_kernels::frf_modes::FrfQuantity as Quantity;

/// Errors: an artifact's text that is no quantity.
fn quantity_of(name: &str) -> Result<Quantity, StageError> {
    let all = [Quantity::Receptance, Quantity::Mobility, Quantity::Accelerance, Quantity::Transfer];
    all.into_iter().find(|quantity| quantity.name() == name).ok_or_else(|| {
        let wanted = all.map(Quantity::name).join(", ");
        StageError::new(format!("attribute `{QUANTITY}` is `{name}`, wanted one of {wanted}"))
    })
}

/// A point with the direction in which it moves or is pushed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Point {
    /// As the file names it; equal names are one point.
    pub name: String,
    /// `x`, `y`, `z`, `rx`, `ry`, `rz`; empty where it is not stated.
    #[serde(default)]
    pub direction: String,
    /// Whether it was mounted, or struck, against the direction: the values have been turned round already.
    #[serde(default)]
    pub turned: bool,
    /// Along the structure; none where it is not stated.
    #[serde(default)]
    pub position_m: Option<f64>,
}

impl Point {
    /// Its name with its direction.
    pub fn label(&self) -> String {
        format!("{}{}", self.name, self.direction)
    }

    /// Whether both are one point in one direction.
    pub fn is(&self, other: &Self) -> bool {
        self.name == other.name && self.direction == other.direction
    }
}

/// What a row is from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ResponseOf {
    pub output: Point,
    pub input: Point,
    /// Responses of equal number were measured at once, from the same input.
    #[serde(default)]
    pub run: usize,
}

/// Frequency responses: `frf` over `response` and `frequency_hz`, ascending, NaN where it is not known; with `variance`,
/// the expected squared error of the complex value, `coherence` and `input_noise`, the part of the relative squared error
/// that responses of one run have in common, where these are known.
#[derive(Debug, Clone)]
pub(crate) struct Frf<'a> {
    pub frequency_hz: &'a [f64],
    /// What each row is from.
    pub responses: Vec<ResponseOf>,
    /// Response by response.
    pub frf: &'a [Complex64],
    pub variance: Option<&'a [f64]>,
    pub coherence: Option<&'a [f64]>,
    pub input_noise: Option<&'a [f64]>,
    pub quantity: Quantity,
    /// Output over input.
    pub unit: &'a str,
    /// The row whose output and input are one point in one direction.
    pub driving_point: Option<usize>,
    /// Samples per second of what it was measured from.
    pub sample_rate_hz: Option<f64>,
    /// How well that is known, and with it the frequencies.
    pub rate_error: RateError,
    /// Records, hits or segments that were averaged.
    pub averages: Option<f64>,
    /// What an exponential window added to the decay rate of every mode, 1/s; to be subtracted from `-Re(s)`.
    pub added_decay_per_s: f64,
}

impl<'a> Frf<'a> {
    /// Reads an artifact. Errors: not one of these.
    pub fn new(array: &'a Array) -> Result<Self, StageError> {
        let text = |name: &str| array.attributes.get(name).and_then(Attribute::as_str).unwrap_or_default();
        let responses: Vec<ResponseOf> = serde_json::from_str(text(RESPONSES))
            .map_err(|error| StageError::new(format!("attribute `{RESPONSES}` does not list responses: {error}")))?;
        let frequency_hz = &array.axis(FREQUENCY_HZ)?.values;
        let values = responses.len() * frequency_hz.len();
        let whole = |name: &str, found: usize| match found == values {
            true => Ok(()),
            false => Err(StageError::new(format!(
                "`{name}` has {found} values, wanted {values}: {} of each of {} responses",
                frequency_hz.len(),
                responses.len()
            ))),
        };
        let real = |name: &str| -> Result<Option<&'a [f64]>, StageError> {
            let Some(variable) = array.variables.iter().find(|variable| variable.name == name) else { return Ok(None) };
            whole(name, variable.values.len())?;
            array.real(name).map(Some)
        };
        let number = |name: &str| array.attributes.get(name).and_then(Attribute::as_f64);
        let frf = array.complex(FRF)?;
        whole(FRF, frf.len())?;
        let driving_point = number(DRIVING_POINT).map(|row| row as usize);
        if let Some(row) = driving_point.filter(|row| *row >= responses.len()) {
            let problem = format!("`{DRIVING_POINT}` is row {row}, there are {} responses", responses.len());
            return Err(StageError::new(problem));
        }
        Ok(Self {
            frequency_hz,
            frf,
            variance: real(VARIANCE)?,
            coherence: real(COHERENCE)?,
            input_noise: real(INPUT_NOISE)?,
            quantity: quantity_of(text(QUANTITY))?,
            unit: &array.variable(FRF)?.unit,
            driving_point,
            sample_rate_hz: number(SAMPLE_RATE_HZ),
            rate_error: RateError::of(array),
            averages: number(AVERAGES),
            added_decay_per_s: number(ADDED_DECAY_PER_S).unwrap_or(0.0),
            responses,
        })
    }

    /// The values of one response; none where there is no such.
    pub fn row(&self, response: usize) -> &'a [Complex64] {
        row_of(self.frf, response, self.frequency_hz.len())
    }

    /// The expected squared errors of one response; none where they are not known.
    pub fn row_variance(&self, response: usize) -> Option<&'a [f64]> {
        self.variance.map(|values| row_of(values, response, self.frequency_hz.len()))
    }
}

/// The rows of a variable, response by response.
pub(crate) fn rows_of<T>(values: &[T], rows: usize) -> Vec<&[T]> {
    let length = values.len() / rows.max(1);
    (0..rows).map(|row| row_of(values, row, length)).collect()
}

fn row_of<T>(values: &[T], row: usize, length: usize) -> &[T] {
    values.get(row * length..(row + 1) * length).unwrap_or_default()
}

/// Measured frequency responses to be made; the parts are those of [`Frf`].
#[derive(Debug, Clone, Default)]
pub(crate) struct NewFrf {
    pub frequency_hz: Vec<f64>,
    pub responses: Vec<ResponseOf>,
    pub frf: Vec<Complex64>,
    pub variance: Option<Vec<f64>>,
    pub coherence: Option<Vec<f64>>,
    pub input_noise: Option<Vec<f64>>,
    pub quantity: Quantity,
    pub unit: String,
    pub driving_point: Option<usize>,
    pub sample_rate_hz: Option<f64>,
    /// How well that is known, and with it the frequencies.
    pub rate_error: RateError,
    pub averages: Option<f64>,
    pub added_decay_per_s: f64,
}

impl NewFrf {
    /// Leaves out rows, each with the earlier one that it is a copy of, ascending: of a driving point that is left out
    /// the other one takes the place.
    pub fn leave_out(&mut self, copies: &[(usize, usize)]) {
        let is_copy = |row: usize| copies.iter().any(|(copy, _)| *copy == row);
        if copies.is_empty() {
            return;
        }
        let width = self.frequency_hz.len().max(1);
        keep_rows(&mut self.frf, width, is_copy);
        [&mut self.variance, &mut self.coherence, &mut self.input_noise]
            .into_iter()
            .flatten()
            .for_each(|values| keep_rows(values, width, is_copy));
        keep_rows(&mut self.responses, 1, is_copy);
        if let Some(row) = &mut self.driving_point {
            *row = copies.iter().find(|(copy, _)| copy == row).map_or(*row, |(_, of)| *of);
            *row -= copies.iter().filter(|(copy, _)| copy < row).count();
        }
    }

    /// The artifact.
    pub fn array(self) -> Result<Array, StageError> {
        let names = serde_json::to_string(&self.responses).map_err(StageError::from_error)?;
        let numbers = (1..=self.responses.len()).map(|row| row as f64).collect();
        let axes = vec![
            Axis::new(RESPONSE, "1", "number of the response", numbers),
            Axis::new(FREQUENCY_HZ, "Hz", "frequency", self.frequency_hz),
        ];
        let over = &[RESPONSE, FREQUENCY_HZ];
        let mut array = Array::over(axes)
            .with(FRF, &self.unit, "measured frequency response", over, self.frf)
            .attribute(RESPONSES, names)
            .attribute(QUANTITY, self.quantity.name())
            .attribute(ADDED_DECAY_PER_S, self.added_decay_per_s);
        if let Some(variance) = self.variance {
            array = array.with(VARIANCE, &squared(&self.unit), "expected squared error", over, variance);
        }
        if let Some(coherence) = self.coherence {
            let what = "share of the output's power that all inputs explain: of one the ordinary coherence";
            array = array.with(COHERENCE, "1", what, over, coherence);
        }
        if let Some(noise) = self.input_noise {
            let what = "squared error relative to the response that all of one run have in common: the input's noise";
            array = array.with(INPUT_NOISE, "1", what, over, noise);
        }
        if let Some(row) = self.driving_point {
            array = array.attribute(DRIVING_POINT, row);
        }
        for (name, value) in [(SAMPLE_RATE_HZ, self.sample_rate_hz), (AVERAGES, self.averages)] {
            array = value.into_iter().fold(array, |array, value| array.attribute(name, value));
        }
        Ok(self.rate_error.stated_by(array))
    }
}

fn keep_rows<T>(values: &mut Vec<T>, width: usize, is_copy: impl Fn(usize) -> bool) {
    let mut place = 0;
    values.retain(|_| {
        let row = place / width;
        place += 1;
        !is_copy(row)
    });
}

fn squared(unit: &str) -> String {
    match unit {
        "" | "1" => unit.to_owned(),
        _ => format!("({unit})^2"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(name: &str, position_m: Option<f64>) -> Point {
        Point { name: name.to_owned(), direction: "z".to_owned(), turned: name == "2", position_m }
    }

    fn two_responses() -> NewFrf {
        let response = |output: &str| ResponseOf { output: point(output, Some(0.5)), input: point("1", None), run: 0 };
        NewFrf {
            frequency_hz: vec![1.0, 2.5, 3.0],
            responses: vec![response("1"), response("2")],
            frf: (0..6).map(|k| Complex64::new(f64::from(k), -1.0)).collect(),
            unit: "m/N".to_owned(),
            quantity: Quantity::Receptance,
            driving_point: Some(0),
            ..NewFrf::default()
        }
    }

    #[test]
    fn rows_that_are_left_out_take_all_their_parts_with_them() {
        let rows = |rows: &[f64]| rows.iter().flat_map(|row| [*row; 3]).collect::<Vec<f64>>();
        let response = |output: &str| ResponseOf { output: point(output, None), input: point("1", None), run: 0 };
        let mut frf = NewFrf {
            responses: ["1", "2", "3", "4"].map(response).to_vec(),
            frf: rows(&[1.0, 2.0, 3.0, 4.0]).into_iter().map(Complex64::from).collect(),
            variance: Some(rows(&[1.0, 2.0, 3.0, 4.0])),
            driving_point: Some(3),
            ..two_responses()
        };
        frf.leave_out(&[(1, 0), (3, 2)]);
        let left: Vec<Complex64> = rows(&[1.0, 3.0]).into_iter().map(Complex64::from).collect();
        assert_eq!((frf.frf, frf.variance), (left, Some(rows(&[1.0, 3.0]))));
        assert_eq!((frf.responses[1].output.name.as_str(), frf.driving_point), ("3", Some(1)));
    }

    #[test]
    fn responses_come_back_as_they_were_written_with_what_is_known_and_nothing_else() {
        let array = two_responses().array().unwrap();
        array.validate().unwrap();
        let read = Frf::new(&array).unwrap();
        assert_eq!(read.responses, two_responses().responses);
        assert_eq!((read.quantity, read.unit, read.driving_point), (Quantity::Receptance, "m/N", Some(0)));
        assert_eq!(read.row(1), &two_responses().frf[3..]);
        assert!(read.row(2).is_empty() && read.variance.is_none() && read.coherence.is_none());
        assert_eq!((read.sample_rate_hz, read.averages, read.added_decay_per_s), (None, None, 0.0));
        assert!(read.responses[0].output.is(&read.responses[0].input));

        let array = NewFrf {
            variance: Some((0..6).map(f64::from).collect()),
            coherence: Some(vec![0.5; 6]),
            sample_rate_hz: Some(10.0),
            averages: Some(4.0),
            added_decay_per_s: 3.0,
            ..two_responses()
        }
        .array()
        .unwrap();
        array.validate().unwrap();
        let read = Frf::new(&array).unwrap();
        assert_eq!(read.row_variance(1).unwrap(), [3.0, 4.0, 5.0]);
        assert_eq!((read.sample_rate_hz, read.averages, read.added_decay_per_s), (Some(10.0), Some(4.0), 3.0));
        assert_eq!(array.variable(VARIANCE).unwrap().unit, "(m/N)^2");
    }

    #[test]
    fn what_is_no_set_of_responses_is_refused_with_the_reason() {
        let error = |new: NewFrf| Frf::new(&new.array().unwrap()).unwrap_err().to_string();
        assert!(error(NewFrf { frequency_hz: vec![1.0], ..two_responses() }).contains("wanted 2: 1 of each of 2"));
        assert!(error(NewFrf { variance: Some(vec![1.0]), ..two_responses() }).contains("`variance` has 1 values"));
        assert!(error(NewFrf { driving_point: Some(2), ..two_responses() }).contains("row 2"));
        let other = two_responses().array().unwrap().attribute(QUANTITY, "stiffness");
        assert!(Frf::new(&other).unwrap_err().to_string().contains("`stiffness`, wanted one of receptance"));
        assert!(Frf::new(&Array::default()).unwrap_err().to_string().contains("does not list responses"));
    }
}
