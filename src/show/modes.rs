//! Modes in a few lines.

use serde_json::{Value, json};

use super::grid::grid;
use super::number::{named_with_std, number};
use crate::determined::says;
use crate::printable::one_line;

/// Rows that are shown: with what stands around them they fit a window.
const ROWS: usize = 12;

/// Factor of a variance from which on a row is doubtful: an error twice that of the noise.
const WIDENED: f64 = 4.0;

/// A mode as a stage's summary has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Of which record and channel, where there are several.
    pub of: String,
    /// Frequency in Hz, quality factor, damping in per cent, each with its standard error.
    pub numbers: [[Option<f64>; 2]; 3],
    /// The factor by which its variance is larger than that of noise.
    pub lack_of_fit: f64,
}

/// A stage's modes as a table, a line each; the doubtful rows have a mark, which is explained below them. Oscillations that
/// do not die away have a frequency alone.
pub fn mode_lines(summary: &Value) -> Vec<String> {
    let rows = rows(summary);
    if rows.is_empty() {
        return vec!["no mode that these data bear out".to_owned()];
    }
    let several = rows.iter().any(|row| row.of != rows[0].of);
    let mut cells = vec![["mode", "", "frequency (Hz)", "Q", "damping (%)"].map(str::to_owned).to_vec()];
    let mut doubtful = false;
    for (number, row) in rows.iter().take(ROWS).enumerate() {
        doubtful |= row.is_doubtful();
        let mut line = vec![(number + 1).to_string(), if row.is_doubtful() { "?" } else { "" }.to_owned()];
        line.extend(NAMES.iter().zip(&row.numbers).map(|(name, number)| cell(name, number)));
        line.extend(several.then(|| one_line(&row.of)));
        cells.push(line);
    }
    if several {
        cells[0].push("of".to_owned());
    }
    let mut lines: Vec<String> = grid(&cells).lines().map(str::to_owned).collect();
    if rows.len() > ROWS {
        lines.push(format!("... {} more", rows.len() - ROWS));
    }
    if doubtful {
        lines.push("? not determined, or its errors at least doubled for what the fit leaves there".to_owned());
    }
    if summary.get("converged") == Some(&Value::Bool(false)) {
        lines.push("the fit has not settled: errors may be too small".to_owned());
    }
    lines
}

/// Whether a mode moves while it dies away.
pub fn moves(summary: &Value) -> bool {
    let course = summary.get("course").and_then(Value::as_array);
    course.into_iter().flatten().any(|mode| mode.get("moves") == Some(&Value::Bool(true)))
}

/// What the numbers of a row are, for whether they say anything.
pub const NAMES: [&str; 3] = ["frequency_hz", "quality_factor", "damping_ratio"];

impl Row {
    /// As a summary lists a mode.
    pub fn as_json(&self) -> Value {
        let [f, q, damping] = self.numbers;
        json!({
            "frequency_hz": f[0],
            "frequency_std_hz": f[1],
            "quality_factor": q[0],
            "quality_factor_std": q[1],
            "damping_ratio": damping[0].map(|percent| 0.01 * percent),
            "damping_ratio_std": damping[1].map(|percent| 0.01 * percent),
        })
    }

    /// Whether the data do not bear it out: a number is not determined, or an error is widened far beyond noise.
    pub fn is_doubtful(&self) -> bool {
        let known = |(name, [value, std]): (&&str, &[Option<f64>; 2])| {
            value.is_none_or(|value| says(name, value, std.unwrap_or(f64::NAN)))
        };
        self.lack_of_fit >= WIDENED || !NAMES.iter().zip(&self.numbers).all(known)
    }
}

/// A number of that name with its error.
pub fn cell(name: &str, [value, std]: &[Option<f64>; 2]) -> String {
    match (value, std) {
        (Some(value), Some(std)) => named_with_std(name, *value, *std),
        (value, _) => value.map_or_else(|| "-".to_owned(), number),
    }
}

/// The modes of a stage's summary, the resonance of a thermal spectrum, or oscillations.
pub fn rows(summary: &Value) -> Vec<Row> {
    let list = |name: &str| summary.get(name).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let lack = list("lack_of_fit");
    let row = |(number, mode): (usize, &Value)| {
        let real = |name: &str| mode.get(name).and_then(Value::as_f64);
        let quality = [real("quality_factor"), real("quality_factor_std")];
        let damping = match real("damping_ratio") {
            Some(ratio) => [Some(100.0 * ratio), real("damping_ratio_std").map(|std| 100.0 * std)],
            None => damping_of(quality),
        };
        Row {
            of: ["record", "channel"].map(|name| mode.get(name).and_then(Value::as_str).unwrap_or_default()).join(" "),
            numbers: [[real("frequency_hz"), real("frequency_std_hz")], quality, damping],
            lack_of_fit: lack.get(number).and_then(Value::as_f64).unwrap_or(1.0),
        }
    };
    let resonance = || {
        let estimate = |name: &str| {
            let of = |part: &str| summary.get(name)?.get(part)?.as_f64();
            Some([Some(of("value")?), of("robust_std").or_else(|| of("std"))])
        };
        let (frequency, quality) = (estimate("frequency")?, estimate("quality_factor")?);
        Some(Row { of: String::new(), numbers: [frequency, quality, damping_of(quality)], lack_of_fit: 1.0 })
    };
    let modes = list("modes").iter().chain(list("oscillations"));
    modes.enumerate().map(row).chain(resonance()).collect()
}

/// The damping in per cent that a quality factor is.
fn damping_of([quality, std]: [Option<f64>; 2]) -> [Option<f64>; 2] {
    [quality.map(|quality| 50.0 / quality), quality.zip(std).map(|(quality, std)| 50.0 * std / (quality * quality))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_the_data_do_not_bear_out_are_marked() {
        let mode = |f: f64, q: f64, std: f64| {
            json!({ "frequency_hz": f, "frequency_std_hz": 0.1, "quality_factor": q, "quality_factor_std": std,
                    "damping_ratio": 0.5 / q, "damping_ratio_std": 0.5 * std / (q * q) })
        };
        let summary = json!({ "modes": [mode(100.0, 50.0, 1.0), mode(200.0, 50.0, 80.0), mode(300.0, 25.0, 1.0)],
                              "lack_of_fit": [1.0, 1.0, 5.2], "course": [{ "moves": false }] });
        let lines = mode_lines(&summary);
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<String>>();
        assert_eq!(words(&lines[0]), ["mode", "frequency", "(Hz)", "Q", "damping", "(%)"]);
        assert_eq!(words(&lines[1]), ["1", "100.00(10)", "50.0(10)", "1.000(20)"]);
        assert!(lines[2].contains('?') && lines[2].contains("undetermined") && lines[3].contains('?'), "{lines:?}");
        assert!(lines[4].starts_with("? ") && !moves(&summary));
    }

    #[test]
    fn a_resonance_and_oscillations_are_rows_too() {
        let estimate = |value: f64, std: f64| json!({ "value": value, "std": std, "robust_std": 2.0 * std });
        let lines = mode_lines(&json!({ "frequency": estimate(1000.0, 0.5), "quality_factor": estimate(50.0, 1.0) }));
        assert!(lines.len() == 2 && lines[1].contains("1000.0(10)") && lines[1].contains("50.0(20)"), "{lines:?}");
        let one =
            |record: &str| json!({ "record": record, "channel": "x", "frequency_hz": 50.0, "frequency_std_hz": 0.1 });
        let lines = mode_lines(&json!({ "oscillations": [one("a"), one("b")] }));
        assert!(lines.len() == 3 && lines[1].contains("50.00(10)") && lines[2].ends_with("b x"), "{lines:?}");
        assert_eq!(mode_lines(&json!({ "modes": [] })), ["no mode that these data bear out"]);
    }
}
