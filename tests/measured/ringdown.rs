//! The joint fit through configs: one event, the noise of its own record.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::common::{self, afmid, config, lever_a, number, shown};

#[test]
fn one_event_of_a_record_gives_its_modes_with_errors_that_hold() {
    let scratch = tempfile::tempdir().expect("a folder");
    let archive = lever_a(scratch.path());
    let mut records: Vec<_> = std::fs::read_dir(&archive.folder)
        .expect("the archive")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "h5"))
        .collect();
    records.sort();
    let (mut square, mut count) = (0.0, 0);
    for record in records.iter().take(4) {
        let file = format!("records.files=['{}']", record.display());
        let config = config("one-event.toml");
        afmid(scratch.path(), &["run", &config, "-o", "one.h5", "--cache", "cache", "--set", &file]);
        let summary = shown(scratch.path(), "one.h5", "modes");
        assert!(number(&summary, "/free_windows") > 0.0, "{summary}");
        assert_eq!(number(&summary, "/events"), 1.0);
        for (i, (f, q)) in archive.truth.frequency_hz.iter().zip(&archive.truth.quality_factor).enumerate() {
            for (name, std, truth) in
                [("frequency_hz", "frequency_std_hz", f), ("quality_factor", "quality_factor_std", q)]
            {
                let value = |name: &str| number(&summary, &format!("/modes/{i}/{name}"));
                square += ((value(name) - truth) / value(std)).powi(2);
                count += 1;
            }
        }
    }
    let rms = (square / f64::from(count)).sqrt();
    println!("{count} numbers of single events: rms z {rms:.2}");
    // 32 unit normal numbers: 12.5 %; four of these
    assert!((0.5..1.5).contains(&rms), "{rms}");
}

/// The circuit board's acceleration after a shock, or a line in its place that moves as its line does: 801 to 805.4 Hz
/// while it dies away.
fn shocked_board(scratch: &Path) -> (PathBuf, bool) {
    let data = std::env::var_os("AFMID_DATA")
        .map_or_else(|| Path::new(common::ROOT).join("../shared/data"), std::path::PathBuf::from);
    let file = data.join("unseen/acc_pcb_a0.txt");
    if file.is_file() {
        return (file, false);
    }
    println!("stand-in: 1 line that moves in place of a shocked circuit board");
    let (mut phase, mut level, mut text) = (0.3_f64, 0.0_f64, "# time(s), acceleration(g)\n".to_owned());
    for k in 0..5500 {
        let since = if k < 660 { 0.0 } else { 650.0 * level.exp() * phase.cos() };
        let noise = 0.06 * (f64::from(k * k % 1009) / 504.5 - 1.0);
        writeln!(text, "{:.6e} {:.6e}", f64::from(k) * 2e-5, since + noise).expect("text takes text");
        if k >= 660 {
            // per neper half a hertz
            let turn = std::f64::consts::TAU * (801.0 - 0.55 * level.max(-8.0)) * 2e-5;
            (phase, level) = (phase + turn, level - 0.009 * turn);
        }
    }
    let file = scratch.join("board.txt");
    std::fs::write(&file, text).expect("a table");
    (file, true)
}

#[test]
fn a_line_that_moves_is_one_row_whether_laws_describe_it_or_not() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = shocked_board(here);
    afmid(here, &["new", "pipeline", &file.display().to_string(), "--goal", "decay", "-o", "board.toml"]);
    afmid(here, &["run", "board.toml", "-o", "board.h5", "--cache", "cache"]);
    let summary = shown(here, "board.h5", "modes");
    let modes = summary["modes"].as_array().expect("modes");
    let value = |mode: &serde_json::Value, name: &str| mode[name].as_f64().unwrap_or(f64::NAN);
    let own: Vec<_> = modes.iter().filter(|mode| (760.0..860.0).contains(&value(mode, "frequency_hz"))).collect();
    let [line] = own[..] else { panic!("{} rows about 805 Hz: {modes:?}", own.len()) };
    let (f, std) = (value(line, "frequency_hz"), value(line, "frequency_std_hz"));
    println!("{f:.2} +- {std:.2} Hz, damping {:.4}", value(line, "damping_ratio"));
    // both ends of its course by its zero crossings
    assert!((801.0 - 3.0 * std..805.4 + 3.0 * std).contains(&f), "{f} +- {std}");
    // of what follows no law the error counts the motion
    assert!(stand_in || std > 0.5, "{std}");
}
