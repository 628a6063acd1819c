//! Modes of several results beside one another.

use serde_json::{Value, json};

use super::grid::grid;
use super::modes::{NAMES, Row, cell};
use super::number::number;
use crate::printable::one_line;

/// Largest distance of two frequencies of one mode, as a share of either. Why: what moves further between two days is
/// another structure, and neighbours of a plate are closer than that only where the nearer one is there as well.
const ONE_MODE: f64 = 0.1;

/// A result with its modes.
pub struct Compared {
    /// What it is called by.
    pub name: String,
    /// Its verdict, where it has one.
    pub verdict: Option<String>,
    pub modes: Vec<Row>,
}

/// One mode in all results: of each the number of its row, none where it has no such mode.
type Line = Vec<Option<usize>>;

/// Modes beside one another, those of the first result first; of each later result the pairs that are nearest.
fn lines(results: &[&Compared]) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    for (place, result) in results.iter().enumerate() {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (line, members) in lines.iter().enumerate() {
            let Some(known) = frequency_of(results, members) else { continue };
            for (mode, row) in result.modes.iter().enumerate() {
                let distance = row.numbers[0][0].map_or(f64::INFINITY, |own| (own / known).ln().abs());
                if distance < ONE_MODE {
                    pairs.push((distance, line, mode));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut taken = vec![false; result.modes.len()];
        lines.iter_mut().for_each(|line| line.push(None));
        for (_, line, mode) in pairs {
            if lines[line][place].is_none() && !taken[mode] {
                (lines[line][place], taken[mode]) = (Some(mode), true);
            }
        }
        for mode in (0..taken.len()).filter(|mode| !taken[*mode]) {
            lines.push((0..=place).map(|of| (of == place).then_some(mode)).collect());
        }
    }
    let at = |line: &Line| frequency_of(results, line).unwrap_or(f64::INFINITY);
    lines.sort_by(|a, b| at(a).total_cmp(&at(b)));
    lines
}

/// The frequency of a mode in the first result that has it.
fn frequency_of(results: &[&Compared], line: &Line) -> Option<f64> {
    let (result, mode) = results.iter().zip(line).find_map(|(result, mode)| mode.map(|mode| (result, mode)))?;
    result.modes[mode].numbers[0][0]
}

impl Row {
    /// Whether a difference of the two says anything: what is not borne out has none.
    fn is_comparable(&self, other: &Self) -> bool {
        !self.is_doubtful() && !other.is_doubtful()
    }
}

/// Difference of two numbers over its standard error, both errors independent; none where one is not known.
fn in_errors([from, from_std]: [Option<f64>; 2], [to, to_std]: [Option<f64>; 2]) -> Option<f64> {
    let z = (to? - from?) / from_std?.hypot(to_std?);
    z.is_finite().then_some(z)
}

/// A table with a line for each mode of each result: its numbers, and how far they are from those of the first result that
/// has the mode, in standard errors; then verdicts, and what has no modes.
pub fn compared_text(results: &[Compared]) -> String {
    let head = ["mode", "result", "", "frequency (Hz)", "change", "in errors", "Q", "change in errors"];
    let (with, without): (Vec<&Compared>, Vec<&Compared>) = results.iter().partition(|result| !result.modes.is_empty());
    let mut doubtful = false;
    let mut cells = vec![head.map(str::to_owned).to_vec()];
    for (number_of, line) in lines(&with).iter().enumerate() {
        let mut first: Option<&Row> = None;
        for (result, mode) in with.iter().zip(line) {
            let name = one_line(&result.name);
            let mut row = vec![(number_of + 1).to_string(), name];
            match mode.map(|mode| &result.modes[mode]) {
                None => row.extend(["", "none", "", "", "", ""].map(str::to_owned)),
                Some(own) => {
                    let [f, q] = [0, 1].map(|k| cell(NAMES[k], &own.numbers[k]));
                    let from = first.filter(|first| first.is_comparable(own));
                    let errors = |k: usize| {
                        let z = from.and_then(|from| in_errors(from.numbers[k], own.numbers[k]));
                        z.map_or_else(String::new, |z| format!("{z:+.1}"))
                    };
                    doubtful |= own.is_doubtful();
                    let mark = if own.is_doubtful() { "?" } else { "" }.to_owned();
                    row.extend([mark, f, change(from, own), errors(0), q, errors(1)]);
                    first = first.or(Some(own));
                }
            }
            cells.push(row);
        }
    }
    let mut text = if cells.len() == 1 { "no mode in any of them\n".to_owned() } else { grid(&cells) };
    if cells.len() > 1 {
        text.push_str("change: from the first result that has the mode, in errors of both together\n");
    }
    if doubtful {
        text.push_str("? not determined, or its errors at least doubled for what the fit leaves there\n");
    }
    for result in without {
        text.push_str(&format!("{}: lists no modes\n", one_line(&result.name)));
    }
    for result in results {
        if let Some(verdict) = &result.verdict {
            text.push_str(&format!("{}: {}\n", one_line(&result.name), one_line(verdict)));
        }
    }
    text
}

/// By how much a frequency is above that of the first, in per cent.
fn change(first: Option<&Row>, own: &Row) -> String {
    let of = |row: &Row| row.numbers[0][0];
    match first.and_then(of).zip(of(own)) {
        Some((from, to)) if from > 0.0 => format!("{} %", signed(100.0 * (to / from - 1.0))),
        _ => String::new(),
    }
}

/// Three digits with a sign.
fn signed(value: f64) -> String {
    let text = number(format!("{value:.2e}").parse().unwrap_or(value));
    if value < 0.0 { text } else { format!("+{text}") }
}

/// The same for scripts: of each mode a list with an entry per result, null where it has none.
pub fn compared_json(results: &[Compared]) -> Value {
    let lines = lines(&results.iter().collect::<Vec<&Compared>>());
    let mode = |line: &Line| {
        let first = results.iter().zip(line).find_map(|(result, mode)| mode.map(|mode| &result.modes[mode]));
        let one = |(result, mode): (&Compared, &Option<usize>)| {
            let Some(own) = mode.map(|mode| &result.modes[mode]) else { return Value::Null };
            let from = first.filter(|first| first.is_comparable(own));
            let z = |k: usize| from.and_then(|from| in_errors(from.numbers[k], own.numbers[k]));
            json!({
                "frequency_hz": own.numbers[0][0],
                "frequency_std_hz": own.numbers[0][1],
                "quality_factor": own.numbers[1][0],
                "quality_factor_std": own.numbers[1][1],
                "frequency_z": z(0),
                "quality_factor_z": z(1),
                "doubtful": own.is_doubtful(),
            })
        };
        Value::Array(results.iter().zip(line).map(one).collect())
    };
    json!({
        "results": results.iter().map(|result| &result.name).collect::<Vec<&String>>(),
        "verdicts": results.iter().map(|result| &result.verdict).collect::<Vec<&Option<String>>>(),
        "modes": lines.iter().map(mode).collect::<Vec<Value>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(name: &str, modes: &[(f64, f64)]) -> Compared {
        let row = |&(f, q): &(f64, f64)| Row {
            of: String::new(),
            numbers: [[Some(f), Some(0.1)], [Some(q), Some(1.0)], [Some(50.0 / q), None]],
            lack_of_fit: 1.0,
        };
        Compared { name: name.to_owned(), verdict: None, modes: modes.iter().map(row).collect() }
    }

    #[test]
    fn each_mode_stands_beside_the_nearest_of_the_others() {
        let results = [
            result("a", &[(100.0, 50.0), (104.0, 60.0), (300.0, 80.0)]),
            result("b", &[(101.0, 50.0), (105.0, 70.0), (500.0, 90.0)]),
            result("c", &[(305.0, 80.0), (501.0, 90.0)]),
        ];
        assert_eq!(
            lines(&results.iter().collect::<Vec<&Compared>>()),
            [
                vec![Some(0), Some(0), None],
                vec![Some(1), Some(1), None],
                vec![Some(2), None, Some(0)],
                vec![None, Some(2), Some(1)],
            ]
        );
        let found = compared_json(&results);
        let z = &found["modes"][1][1];
        // 1 Hz and 10 over errors of 0.1 and 1 in either
        assert!((z["frequency_z"].as_f64().unwrap() - 1.0 / 0.02f64.sqrt()).abs() < 1e-9, "{found:#}");
        assert!((z["quality_factor_z"].as_f64().unwrap() - 10.0 / 2f64.sqrt()).abs() < 1e-9);
        assert!(found["modes"][3][0].is_null() && found["modes"][0][2].is_null());
    }

    #[test]
    fn a_line_says_how_far_a_mode_is_from_the_first_one() {
        let mut results = [result("a.h5", &[(100.0, 50.0)]), result("b.h5", &[(99.9, 51.0)])];
        results[1].verdict = Some("named: duffing".to_owned());
        let text = compared_text(&results);
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[1], ["1", "a.h5", "100.00(10)", "50.0(10)"]);
        assert_eq!(lines[2], ["1", "b.h5", "99.90(10)", "-0.1", "%", "-0.7", "51.0(10)", "+0.7"]);
        assert_eq!(text.lines().last(), Some("b.h5: named: duffing"));
        let none = compared_text(&[result("a", &[]), result("b", &[])]);
        assert_eq!(none, "no mode in any of them\na: lists no modes\nb: lists no modes\n");
        assert!(text.contains("\nchange: from the first result that has the mode"), "{text}");
    }
}
