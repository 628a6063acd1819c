//! The eleven header records of dataset 58.

use super::fixed::{digits, number, stated, text};
use crate::Degree;
use crate::FormatError;
use crate::fail;
use crate::rate::roundest_step;

/// Number of header records.
pub(super) const RECORDS: usize = 11;

/// Digits of the step in the standard's format E13.5. Fewer are those of a number that ends with zeros.
const STEP_DIGITS: usize = 6;
/// A printed number is off by half a unit of its last digit at most; a bit more, for 1/51200 = 1.953125E-05 ends there.
const HALF_UNIT: f64 = 0.500_01;

/// A header record and its byte.
#[derive(Debug, Clone)]
pub(super) struct Record {
    pub(super) line: Vec<u8>,
    pub(super) at: u64,
}

/// What the header says.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) function: i64,
    /// Name of the response, or its node and direction.
    pub(super) response: String,
    /// What responds, and what is excited, where it is stated.
    pub(super) degrees: [Option<Degree>; 2],
    /// The lines of identification that say something.
    pub(super) identification: Vec<String>,
    /// When, as ISO 8601, if the third line of identification is a date.
    pub(super) started_at: Option<String>,
    pub(super) complex: bool,
    pub(super) double: bool,
    pub(super) points: u64,
    pub(super) even: bool,
    pub(super) abscissa_start: f64,
    pub(super) abscissa_step: f64,
    /// Digits that the step is printed to; a format of FORTRAN prints six.
    step_digits: usize,
    pub(super) abscissa: Axis,
    pub(super) ordinate: Axis,
    /// What the ordinate is divided by.
    pub(super) denominator: Axis,
}

/// What runs along an axis.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    /// 17 is time, 18 frequency, 0 unknown.
    pub(super) quantity: i64,
    pub(super) label: String,
    pub(super) unit: String,
}

impl Header {
    /// Reads the records.
    pub(super) fn read(records: &[Record]) -> Result<Self, FormatError> {
        let [id1, id2, id3, id4, id5, dof, form, abscissa, ordinate, denominator, ..] = records else {
            let at = records.last().map_or(0, |r| r.at);
            return Err(fail::at(
                at,
                format!("{} header records, {RECORDS} were wanted", records.len()),
                fail::COPY_AGAIN,
            ));
        };
        let ([kind, points, spacing, start, step], step_digits) = form_fields(form)?;
        let (complex, double) = match kind as i64 {
            2 => (false, false),
            4 => (false, true),
            5 => (true, false),
            6 => (true, true),
            _ => {
                let problem = format!("the ordinate's type is {kind}, 2, 4, 5 or 6 was wanted");
                return Err(fail::at(form.at, problem, fail::COPY_AGAIN));
            }
        };
        Ok(Self {
            function: integer(dof, 0, 5),
            response: response(dof),
            degrees: [degree(dof, 31), degree(dof, 56)],
            identification: [id1, id2, id4, id5].iter().filter_map(|r| stated(&r.line, 0, 80)).collect(),
            started_at: moment(&text(&id3.line, 0, 80)),
            complex,
            double,
            points: points as u64,
            even: spacing as i64 != 0,
            abscissa_start: start,
            abscissa_step: step,
            step_digits,
            abscissa: axis(abscissa),
            ordinate: axis(ordinate),
            denominator: axis(denominator),
        })
    }

    /// What the function is, for people.
    pub(super) fn function_name(&self) -> &'static str {
        const NAMES: [&str; 13] = [
            "function",
            "time response",
            "auto spectrum",
            "cross spectrum",
            "frequency response",
            "transmissibility",
            "coherence",
            "auto correlation",
            "cross correlation",
            "power spectral density",
            "energy spectral density",
            "probability density",
            "spectrum",
        ];
        usize::try_from(self.function).ok().and_then(|f| NAMES.get(f).copied()).unwrap_or("function")
    }

    /// What runs along the abscissa, for people.
    pub(super) fn abscissa_name(&self) -> &str {
        if self.abscissa.label.is_empty() { "its abscissa" } else { &self.abscissa.label }
    }

    /// Whether it is output over input: a frequency response or a transmissibility.
    pub(super) fn is_response(&self) -> bool {
        matches!(self.function, 4 | 5)
    }

    /// Numbers of one value.
    pub(super) fn numbers(&self) -> usize {
        if self.complex { 2 } else { 1 }
    }

    /// The step of an even abscissa: of the numbers that are printed like it, that which is rounder, or whose inverse is.
    /// A step of 1/51200 is printed as 1.95313E-05.
    pub(super) fn step(&self) -> f64 {
        let step = self.abscissa_step;
        if !(step.is_finite() && step > 0.0) {
            return step;
        }
        // digits behind the first, and half a unit of the last of them
        let behind = self.step_digits.clamp(STEP_DIGITS, 17) - 1;
        let unit = 10_f64.powi(step.log10().floor() as i32 - behind as i32);
        roundest_step(step, HALF_UNIT * unit / step)
    }

    /// Seconds in the abscissa's unit, if it is time.
    pub(super) fn seconds(&self) -> Option<f64> {
        let unit = match self.abscissa.unit.to_ascii_lowercase().as_str() {
            "" | "s" | "sec" | "second" | "seconds" => 1.0,
            "ms" | "msec" => 1e-3,
            "us" | "usec" => 1e-6,
            "min" => 60.0,
            _ => return None,
        };
        let unit_says = !self.abscissa.unit.is_empty();
        // Without a quantity, a function of time or a unit of time will do; both can't be seconds of frequency.
        let is_time = match self.abscissa.quantity {
            17 => true,
            0 | 1 => self.function == 1 || unit_says,
            _ => false,
        };
        is_time.then_some(unit)
    }
}

/// Type, points, spacing, first abscissa and step, and the digits of the step: at their columns, or else between blanks.
fn form_fields(record: &Record) -> Result<([f64; 5], usize), FormatError> {
    let columns = [(0, 10), (10, 20), (20, 30), (30, 43), (43, 56)];
    let at_columns = columns.map(|(from, to)| record.line.get(from..to.min(record.line.len())).unwrap_or_default());
    let mut words = record.line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    let between_blanks = [(); 5].map(|()| words.next().unwrap_or_default());
    for fields in [at_columns, between_blanks] {
        if let [Some(kind), Some(points), Some(spacing), Some(start), Some(step)] = fields.map(number)
            // Exact in float64, and far more than a file holds.
            && (0.0..9e15).contains(&points)
        {
            let [.., printed] = fields;
            return Ok(([kind, points, spacing, start, step], digits(printed)));
        }
    }
    let found = text(&record.line, 0, 80);
    let problem = format!("«{found}» was found, type, number of points, spacing, first abscissa and step were wanted");
    Err(fail::at(record.at, problem, fail::COPY_AGAIN))
}

fn integer(record: &Record, from: usize, to: usize) -> i64 {
    text(&record.line, from, to).parse().unwrap_or(0)
}

/// The axis of a direction, by its number.
fn direction_name(direction: i64) -> &'static str {
    const AXES: [&str; 7] = ["", "X", "Y", "Z", "RX", "RY", "RZ"];
    usize::try_from(direction.unsigned_abs()).ok().and_then(|d| AXES.get(d).copied()).unwrap_or("")
}

/// The degree of freedom whose name is at column `from`, its node and direction behind; none where neither name nor
/// node is stated. The node tells points apart, names may repeat.
fn degree(record: &Record, from: usize) -> Option<Degree> {
    let (node, direction) = (integer(record, from + 10, from + 20), integer(record, from + 20, from + 24));
    let name = stated(&record.line, from, from + 10);
    let name = if node == 0 { name? } else { node.to_string() };
    let direction_name = direction_name(direction).to_lowercase();
    Some(Degree { name, direction: direction_name, against: direction < 0 })
}

fn response(record: &Record) -> String {
    if let Some(name) = stated(&record.line, 31, 41) {
        return name;
    }
    let direction = integer(record, 51, 55);
    let axis = direction_name(direction);
    let sign = match direction {
        0 => "",
        d if d < 0 => "-",
        _ => "+",
    };
    format!("{}{sign}{axis}", integer(record, 41, 51))
}

fn axis(record: &Record) -> Axis {
    Axis {
        quantity: integer(record, 0, 10),
        label: stated(&record.line, 26, 46).unwrap_or_default(),
        unit: stated(&record.line, 47, 67).unwrap_or_default(),
    }
}

/// `18-Apr-16 13:49:58` as ISO 8601; years of two digits are those from 1970 to 2069.
fn moment(text: &str) -> Option<String> {
    const MONTHS: [&str; 12] = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];
    let (date, time) = text.split_once(' ')?;
    let mut date = date.split('-');
    let day: u32 = date.next()?.parse().ok()?;
    let month = date.next()?.to_ascii_lowercase();
    let month = MONTHS.iter().position(|m| *m == month)? + 1;
    let year: u32 = date.next()?.parse().ok()?;
    let year = match year {
        0..70 => 2000 + year,
        70..100 => 1900 + year,
        _ => year,
    };
    let mut time = time.trim().split(':').map(|p| p.parse::<u32>().ok());
    let (hour, minute, second) = (time.next()??, time.next()??, time.next().flatten().unwrap_or(0));
    let valid = (1..=31).contains(&day) && year <= 9999 && hour < 24 && minute < 60 && second <= 60;
    valid.then(|| format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"))
}

#[cfg(test)]
mod tests {
    use super::moment;

    #[test]
    fn dates_become_iso_8601() {
        assert_eq!(moment("18-Apr-16 13:49:58").as_deref(), Some("2016-04-18T13:49:58"));
        assert_eq!(moment("01-JAN-1999 00:00").as_deref(), Some("1999-01-01T00:00:00"));
        for none in ["NONE", "", "18-Apr-16", "99-Apr-16 1:1:1", "18-Foo-16 13:49:58"] {
            assert_eq!(moment(none), None, "{none}");
        }
    }
}
