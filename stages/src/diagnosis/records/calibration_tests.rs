//! False alarms, power and coverage over seeds.
//!
//! Clean, 200 archives of 10 records, 4 channels at 1 %: 8 alarms in 800 (1.0 %; Clopper-Pearson, 95 %: 0.43 to 1.96 %): slow lines 2, fast lines 3,
//! position 3, clipping 0. Found in half of 16 archives of that kind: hum 1.8e-4 V, crosstalk 3.5e3 V/m, fringe 4e-4 to 5e-4 V.

use super::archive::Archive;
use super::{JudgeOptions, RecordSign, judge};

fn signs(archive: &Archive, seed: u64) -> Vec<RecordSign> {
    judge(&archive.summaries(seed), &JudgeOptions::default())
}

/// Whether the cause is found in each of four archives, its parameter within 4 of its standard errors (and a per cent) of the truth.
fn finds(archive: Archive, id: &str, parameter: &str, truth: f64) {
    for seed in 0..4 {
        let all = signs(&archive, seed);
        let sign =
            all.iter().find(|sign| sign.id == id).unwrap_or_else(|| panic!("{id} not found, seed {seed}: {all:?}"));
        let found = &sign.parameters.iter().find(|(name, _)| *name == parameter).unwrap().1;
        let (value, std) = (found.value.unwrap(), found.std.unwrap());
        // jackknife errors of ten records are good to a quarter; block means and the window's lobe cost up to a per cent
        assert!((value.abs() - truth).abs() < 4.0 * std + 0.01 * truth, "{id} seed {seed}: {value} +- {std}");
        if let (Some(before), Some(after)) = (sign.gain.rms_before, sign.gain.rms_after) {
            assert!(after < before, "{id} seed {seed}: {before} {after}");
        }
    }
}

#[test]
fn a_hidden_hum_is_named_with_its_amplitude() {
    finds(Archive { line: (2e-3, 50.0), ..Archive::CLEAN }, "mains-hum", "amplitude_v", 2e-3);
}

#[test]
fn a_hidden_line_is_named_with_its_frequency() {
    finds(Archive { line: (1e-3, 31_234.0), ..Archive::CLEAN }, "spurious-line", "frequency_hz", 31_234.0);
    finds(Archive { line: (1e-3, 333.0), ..Archive::CLEAN }, "spurious-line", "frequency_hz", 333.0);
}

#[test]
fn a_hidden_crosstalk_is_named_with_its_slope() {
    finds(Archive { crosstalk: 3e4, ..Archive::CLEAN }, "piezo-crosstalk", "kappa_v_per_m", 3e4);
}

#[test]
fn a_hidden_fringe_is_named_with_its_wavelength() {
    finds(Archive { fringe: (5e-3, 6.33e-7), ..Archive::CLEAN }, "interference-fringe", "wavelength_m", 6.33e-7);
}

#[test]
fn a_hidden_limit_is_named_with_its_level() {
    finds(Archive { limit: 0.7, ..Archive::CLEAN }, "clipping", "limit_v", 0.7);
}

#[test]
fn clean_archives_raise_few_alarms() {
    let alarms: Vec<&str> = (0..24).flat_map(|seed| signs(&Archive::CLEAN, 100 + seed)).map(|sign| sign.id).collect();
    // four channels at 1 %: one alarm expected in 24 archives, five or more with a probability of 0.3 %
    assert!(alarms.len() < 5, "{alarms:?}");
}

/// Power and coverage, printed: `SEEDS=200 WHICH=chlxfk cargo test -p afmid-stages --lib -- --ignored --nocapture power_over_strengths`.
#[test]
#[ignore]
fn power_over_strengths() {
    use rayon::prelude::*;
    let seeds: u64 = std::env::var("SEEDS").map_or(200, |s| s.parse().unwrap());
    let show = |what: &str, archive: Archive, id: &str, parameter: usize, truth: f64| {
        let all: Vec<Vec<RecordSign>> = (0..seeds).into_par_iter().map(|seed| signs(&archive, 1000 + seed)).collect();
        let mut counts = std::collections::BTreeMap::new();
        all.iter().flatten().for_each(|s| *counts.entry(s.id).or_insert(0) += 1);
        let hits: Vec<&RecordSign> = all.iter().flatten().filter(|s| s.id == id).collect();
        let within = hits
            .iter()
            .filter(|s| {
                let v = &s.parameters[parameter].1;
                (v.value.unwrap_or(9e9).abs() - truth.abs()).abs() < 3.0 * v.std.unwrap_or(0.0)
            })
            .count();
        let tied = hits.iter().filter(|s| s.tied).count();
        let mean =
            hits.iter().filter_map(|s| s.parameters[parameter].1.value).map(f64::abs).sum::<f64>() / hits.len() as f64;
        println!(
            "{what}: {counts:?} of {seeds}; within 3 sigma {within}/{} tied {tied} mean {mean:e} truth {truth:e}",
            hits.len()
        );
        if id.is_empty() {
            for s in all.iter().flatten() {
                println!(
                    "    {} p {:.1e} {} {}",
                    s.id,
                    s.p_value,
                    s.parameters[0].1.value.unwrap_or(f64::NAN),
                    s.evidence
                );
            }
        }
    };
    let c = Archive::CLEAN;
    let which = std::env::var("WHICH").unwrap_or_default();
    if which.contains('c') {
        show("clean", c, "", 0, 0.0);
        show("clean, snap-ins not given, 24", Archive { records: 24, snap_ins_given: false, ..c }, "", 0, 0.0);
    }
    if which.contains('h') {
        for a in [5e-5, 1e-4, 2e-4, 4e-4, 1e-3, 5e-3] {
            show(&format!("hum {a:e}"), Archive { line: (a, 50.0), ..c }, "mains-hum", 0, a);
        }
        for a in [1e-4, 3e-4] {
            show(&format!("slow 333 {a:e}"), Archive { line: (a, 333.0), ..c }, "spurious-line", 1, 333.0);
        }
    }
    if which.contains('l') {
        for a in [2e-5, 4e-5, 6e-5, 1e-4, 3e-4, 3e-3] {
            show(&format!("line {a:e}"), Archive { line: (a, 31_234.0), ..c }, "spurious-line", 0, a);
            show(&format!("line f {a:e}"), Archive { line: (a, 31_234.0), ..c }, "spurious-line", 1, 31_234.0);
        }
    }
    if which.contains('x') {
        for a in [500.0, 1e3, 2e3, 4e3, 1e4, 1e5] {
            show(&format!("crosstalk {a:e}"), Archive { crosstalk: a, ..c }, "piezo-crosstalk", 0, a);
        }
    }
    if which.contains('f') {
        for a in [3e-5, 1e-4, 2e-4, 4e-4, 1e-3, 1e-2] {
            show(&format!("fringe {a:e}"), Archive { fringe: (a, 6.33e-7), ..c }, "interference-fringe", 0, a);
            show(&format!("fringe wl {a:e}"), Archive { fringe: (a, 6.33e-7), ..c }, "interference-fringe", 1, 6.33e-7);
        }
    }
    if which.contains('k') {
        for a in [1.2, 1.0, 0.95, 0.9, 0.7, 0.5] {
            show(&format!("clip {a:e}"), Archive { limit: a, ..c }, "clipping", 0, a);
        }
    }
}
