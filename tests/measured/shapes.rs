//! Mode shapes in a program of others.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use crate::common::{self, afmid, config, shapes_read_by_pyuff};

/// Frequency, damping ratio and shape over three channels.
const MODES: [(f64, f64, [f64; 3]); 2] = [(60.0, 0.01, [1.0, 0.7, 0.2]), (170.0, 0.008, [0.8, -0.6, -0.5])];
const RATE_HZ: f64 = 2000.0;

/// A table of three channels that ring after 0.1 s of quiet.
fn three_channels(file: &Path) {
    // a linear congruential generator (Numerical Recipes)
    let mut state = 2463_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX) - 0.5
    };
    let mut text = "time [s],a [V],b [V],c [V]\n".to_owned();
    for k in 0..2000 {
        let since = f64::from(k) / RATE_HZ - 0.1;
        let ringing = |channel: usize| {
            let mode = |(f, damping, shape): &(f64, f64, [f64; 3])| {
                shape[channel] * (-damping * TAU * f * since).exp() * (TAU * f * since).sin()
            };
            if since < 0.0 { 0.0 } else { MODES.iter().map(mode).sum::<f64>() }
        };
        let value = |channel| ringing(channel) + 0.01 * noise();
        let [a, b, c] = [0, 1, 2].map(value);
        writeln!(text, "{:.4},{a:.6},{b:.6},{c:.6}", f64::from(k) / RATE_HZ).expect("text takes text");
    }
    std::fs::write(file, text).expect("a table");
}

#[test]
fn pyuff_reads_the_shapes_of_a_decay_as_show_states_them() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let file = here.join("decay.csv");
    three_channels(&file);
    let files = format!("records.files=['{}']", file.display());
    let set = [
        "--set",
        &files,
        "--set",
        "records.channel='a'",
        "--set",
        "records.channels=['a', 'b', 'c']",
        "--set",
        "records.unit='V'",
    ];
    afmid(here, &[&["run", &config("decay.toml"), "-o", "decay.h5", "--cache", "cache"], &set[..]].concat());
    assert_eq!(shapes_read_by_pyuff(here, "decay.h5"), "2 modes over 3 nodes, positions not known\n");
    // afmid's own reader finds the datasets, and no samples in them
    let inspected = common::command(here, &["inspect", "decay-modes.unv"]).output().expect("afmid starts");
    let text = String::from_utf8_lossy(&inspected.stdout);
    assert!(text.contains("2 datasets 55"), "{text}{}", String::from_utf8_lossy(&inspected.stderr));
}
