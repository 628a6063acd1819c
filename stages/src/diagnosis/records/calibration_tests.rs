//! False alarms, power and coverage over seeds.

use super::archive::Archive;
use super::{JudgeOptions, RecordSign, judge};

fn signs(archive: &Archive, seed: u64) -> Vec<RecordSign> {
    judge(&archive.summaries(seed), &JudgeOptions::default())
}

/// Names found in the archives of these seeds.
fn found(archive: &Archive, seeds: std::ops::Range<u64>) -> Vec<Vec<RecordSign>> {
    seeds.map(|seed| signs(archive, seed)).collect()
}

#[test]
#[ignore]
fn scan() {
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
