//! Frequency responses, read and estimated: whole runs.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::common::{self, afmid, config, measured_page, number, shown};

/// A pole driven by noise in a table, with noise on the output.
fn columns(folder: &Path) {
    // a linear congruential generator (Numerical Recipes): noise enough to excite
    let mut state = 12345_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX) - 0.5
    };
    let (mut y, mut text) = (0.0, "u,y\n".to_owned());
    for _ in 0..4096 {
        let u = noise();
        y = 0.5 * y + u;
        writeln!(text, "{u},{}", y + 0.3 * noise()).expect("text takes text");
    }
    std::fs::write(folder.join("columns.csv"), text).expect("a table");
}

const COLUMNS: &str = r#"
[pipeline]
name = "columns"
seed = 1

[[stage]]
id = "data"
uses = "io.columns"
params = { file = "columns.csv", sample_rate_hz = 100.0 }

[[stage]]
id = "etfe"
uses = "spectrum.etfe"
inputs = { pair = "data.pair" }
params = { bandwidth_hz = 50.0, intersample = "sampled", normalise = false }

[[stage]]
id = "smooth"
uses = "spectrum.smoothing"
inputs = { etfe = "etfe.etfe" }

[[stage]]
id = "averaged"
uses = "spectrum.measured_frf"
inputs = { pair = "data.pair" }
params = { block_samples = 256 }
"#;

#[test]
fn columns_without_a_standard_error_give_an_etfe_and_an_averaged_response() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    columns(here);
    std::fs::write(here.join("columns.toml"), COLUMNS).expect("a config");
    afmid(here, &["check", "columns.toml"]);
    afmid(here, &["run", "columns.toml", "-o", "out.h5", "--cache", "cache"]);
    let etfe = shown(here, "out.h5", "etfe");
    assert_eq!(etfe["noise"], "scatter of neighbouring bins");
    assert!(number(&etfe, "/defined") > 1900.0, "{etfe}");
    let averaged = shown(here, "out.h5", "averaged");
    // 31 half-overlapping segments: 31^2 / (31 + 30 / 18)
    assert!((number(&averaged, "/averages") - 29.418).abs() < 0.001, "{averaged}");
    assert!(averaged["force_window_found"] == false && number(&averaged, "/median_coherence") > 0.8);
    let page = measured_page(here, "out.h5");
    for words in ["<h2>Transfer function</h2>", ">y / u<", ">Coherence<"] {
        assert!(page.contains(words), "{words}");
    }
}

/// The folder of measured responses, or none.
fn stored() -> Option<PathBuf> {
    let data =
        std::env::var_os("AFMID_DATA").map_or_else(|| Path::new(common::ROOT).join("../shared/data"), PathBuf::from);
    let folder = data.join("hammer/free-beam");
    folder.is_dir().then_some(folder)
}

/// Responses of an oscillator in place of the measured ones.
fn stand_in(here: &Path) -> PathBuf {
    println!("stand-in: 9 responses in closed form in place of free-beam");
    for point in 1..=9 {
        let mut text = "Frequency\t Real\t Imaginary\n\nUnits:\nHz\t(m/s\u{b2})(N)\t \n".to_owned();
        for k in 0..1000 {
            let f = f64::from(k);
            let (re, im) = (12_544.0 - f * f, 10.0 * f);
            let scale = -f * f * f64::from(point) / (re * re + im * im);
            writeln!(text, "{f:e}\t{}\t{}", scale * re, -scale * im).expect("text takes text");
        }
        std::fs::write(here.join(format!("Hxysv0000{point}.txt")), text).expect("a table");
    }
    here.to_owned()
}

#[test]
fn the_shipped_config_reads_nine_points_of_a_beam() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (files, pattern) = stored().map_or_else(|| (stand_in(here), "*.txt"), |folder| (folder, "*.txt.gz"));
    let set = format!("frf.files=['{}']", files.join(pattern).display());
    afmid(here, &["run", &config("frf.toml"), "--set", &set, "-o", "frf.h5", "--cache", "cache"]);
    let found = shown(here, "frf.h5", "frf");
    assert_eq!((number(&found, "/responses"), number(&found, "/driving_point")), (9.0, 4.0));
    assert_eq!(found["quantity"], "accelerance");
    let page = measured_page(here, "frf.h5");
    // nine responses with magnitude and phase each, and the shapes over the beam
    assert_eq!(page.matches(">Accelerance ((m/s²)/N)<").count(), 9);
    assert_eq!(page.matches(">Phase (°)<").count(), 9);
    assert!(
        page.contains(">fitted<") && page.contains("magnitude of the responses") && page.contains(">Position (m)<")
    );
    shown_in_order(here);
    let read = common::shapes_read_by_pyuff(here, "frf.h5");
    assert!(read.ends_with("modes over 9 nodes, positions known\n"), "{read}");
    // what afmid wrote is replaced
    common::shapes_read_by_pyuff(here, "frf.h5");
}

/// Modes and shapes come first; the stabilisation diagram is a line with the command that shows it.
fn shown_in_order(here: &Path) {
    let text = afmid(here, &["show", "frf.h5", "modes", "--all"]);
    let place = |what: &str| text.find(what).unwrap_or_else(|| panic!("no {what}: {text}"));
    assert!(place("\nmodes (table)") < place("\nsummary (document)") && place("shape:") < place("\nfit (array)"));
    assert!(place("\nfit (array)") < place("\ndiagram (table)"), "{text}");
    let (_, line) = text.split_once("\ndiagram (table)\n").expect("a diagram");
    let command = line.trim_end().split_once("rows: afmid ").expect("a command").1;
    let diagram = afmid(here, &command.split(' ').collect::<Vec<&str>>());
    assert!(diagram.starts_with("modes.diagram (table)\norder  "), "{diagram}");
    let rows = serde_json::from_str::<serde_json::Value>(&afmid(here, &["show", "frf.h5", "modes.diagram", "--json"]));
    assert!(rows.expect("JSON").as_array().is_some_and(|rows| line.starts_with(&format!("{} rows", rows.len()))));
}
