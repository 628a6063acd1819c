//! What files state of time, through every reader: right, asked for or refused, never a wrong number.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::common::{self, ROOT, command, python_bin};

/// What came of a file.
#[derive(Debug)]
enum Outcome {
    /// `new pipeline` asks, or a run refuses, and says why.
    Asked(String),
    /// Modes, and what was warned of.
    Found(Value, String),
}

/// Runs a script that writes files into a folder; what it prints.
fn written(script: &str, folder: &Path) -> Value {
    let script = Path::new(ROOT).join("tests").join(script);
    let output = Command::new(python_bin().join("python")).arg(script).arg(folder).output().expect("python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// From a file to modes, as a user goes.
fn outcome(here: &Path, file: &str, arguments: &[String]) -> Outcome {
    let (config, result) = (format!("{file}.toml"), format!("{file}.result.h5"));
    let mut new = vec!["new", "pipeline", file, "-o", &config, "--goal", "decay"];
    new.extend(arguments.iter().map(String::as_str));
    let mut said = String::new();
    for arguments in [&new[..], &["run", &config, "-o", &result, "--cache", "cache"]] {
        let output = command(here, arguments).output().expect("afmid starts");
        said.push_str(&String::from_utf8_lossy(&output.stderr));
        if !output.status.success() {
            return Outcome::Asked(said);
        }
    }
    Outcome::Found(common::shown(here, &result, "modes")["modes"].clone(), said)
}

fn strings(value: &Value) -> Vec<String> {
    serde_json::from_value(value.clone()).expect("texts")
}

/// The modes are 95 and 240 Hz, the second sensor moves 0.8 times as far as the first in the first of them.
fn is_right(modes: &Value) -> bool {
    let modes = modes.as_array().expect("modes");
    let frequency = |mode: &Value| mode["frequency_hz"].as_f64().expect("a frequency");
    // a thousandth: a sample rate that is wrong is wrong by far more
    let frequencies = modes.len() == 2
        && modes.iter().zip([95.0, 240.0]).all(|(mode, truth)| (frequency(mode) / truth - 1.0).abs() < 1e-3);
    let part = |point: &Value, name: &str| point[name].as_f64().expect("a shape");
    let shape = match modes.first().and_then(|mode| mode["shape"].as_array()).map(Vec::as_slice) {
        Some([a, b]) => {
            let size = part(a, "re").powi(2) + part(a, "im").powi(2);
            let re = (part(a, "re") * part(b, "re") + part(a, "im") * part(b, "im")) / size;
            let im = (part(a, "re") * part(b, "im") - part(a, "im") * part(b, "re")) / size;
            // a start that is overlooked turns it by 100 degrees
            (re - 0.8).abs() < 0.01 && im.abs() < 0.01
        }
        _ => true,
    };
    frequencies && shape
}

#[test]
fn every_reader_keeps_the_rules_of_clocks() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let files = written("clock_files.py", here);
    let mut rows: Vec<(String, Vec<(String, &str)>)> = Vec::new();
    for file in files.as_array().expect("files") {
        let text = |name: &str| file[name].as_str().expect("a text").to_owned();
        let (rule, format, name) = (text("rule"), text("format"), text("file"));
        let cell = match outcome(here, &name, &strings(&file["arguments"])) {
            Outcome::Asked(said) => {
                assert!(said.contains("error: ") && said.len() > 40, "{name}: {said}");
                assert!(["whole numbers", "two rates", "contradiction"].contains(&rule.as_str()), "{name}: {said}");
                "asked"
            }
            Outcome::Found(modes, said) => {
                assert!(is_right(&modes), "{name}: {modes}\n{said}");
                let asked = ["whole numbers", "contradiction"].contains(&rule.as_str());
                assert!(!asked, "{name}: {rule} gave a rate\n{said}");
                assert!(rule != "wrong rate" || said.contains("holds, though the file states 8000"), "{name}: {said}");
                assert!(rule != "jump" || said.contains("gap"), "{name}: {said}");
                match (rule.as_str(), modes[0]["shape"].is_array()) {
                    ("two rates" | "start" | "stated start", false) => "one sensor",
                    _ => "right",
                }
            }
        };
        match rows.iter_mut().find(|(known, _)| *known == rule) {
            Some((_, cells)) => cells.push((format, cell)),
            None => rows.push((rule, vec![(format, cell)])),
        }
    }
    compare_with_page(&rows);
}

/// The table of docs/archives.md.
fn compare_with_page(rows: &[(String, Vec<(String, &str)>)]) {
    let mut formats: Vec<&str> = Vec::new();
    for (format, _) in rows.iter().flat_map(|(_, cells)| cells) {
        if !formats.contains(&format.as_str()) {
            formats.push(format);
        }
    }
    let mut table = format!("| rule | {} |\n|---|{}\n", formats.join(" | "), "---|".repeat(formats.len()));
    for (rule, cells) in rows {
        let cell = |format: &&str| cells.iter().find(|(own, _)| own == format).map_or("", |(_, cell)| cell);
        let cells: Vec<&str> = formats.iter().map(cell).collect();
        let _ = writeln!(table, "| {rule} | {} |", cells.join(" | "));
    }
    let path = Path::new(ROOT).join("docs/archives.md");
    let page = std::fs::read_to_string(&path).expect("docs/archives.md");
    let (head, rest) = page.split_once("<!-- clocks -->\n").expect("a place for the table");
    let (there, tail) = rest.split_once("<!-- end of clocks -->").expect("its end");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        std::fs::write(&path, format!("{head}<!-- clocks -->\n{table}<!-- end of clocks -->{tail}")).expect("written");
        return;
    }
    assert!(there == table, "docs/archives.md differs; UPDATE_EXPECTED=1 writes it:\n{table}");
}

/// One decay as some fifty programs write it: the same modes from each, and a rate is given only where the file has none.
#[test]
fn one_decay_gives_the_same_modes_from_every_program() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let files = written("program_files.py", here);
    let truth: Vec<f64> = serde_json::from_value(files["frequencies_hz"].clone()).expect("frequencies");
    let mut first: Option<Vec<[f64; 2]>> = None;
    for (file, arguments) in files["files"].as_object().expect("files") {
        let Outcome::Found(modes, said) = outcome(here, file, &strings(arguments)) else {
            panic!("{file} gives no modes");
        };
        let number = |mode: &Value, name: &str| mode[name].as_f64().expect("a number");
        let modes: Vec<[f64; 2]> = modes
            .as_array()
            .expect("modes")
            .iter()
            .map(|mode| [number(mode, "frequency_hz"), number(mode, "frequency_std_hz")])
            .collect();
        assert_eq!(modes.len(), truth.len(), "{file}: {modes:?}\n{said}");
        let first = first.get_or_insert_with(|| modes.clone());
        for ((own, other), truth) in modes.iter().zip(first).zip(&truth) {
            // printed values and quarters of full scale are rounded far below the noise
            assert!((own[0] - other[0]).abs() < 0.05 * other[1], "{file}: {own:?} {other:?}\n{said}");
            // of 3 modes one may be 4 sigma off in 5000 tries
            assert!((own[0] - truth).abs() < 4.0 * own[1], "{file}: {own:?} {truth}");
        }
    }
}
