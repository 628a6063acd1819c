//! How often modes that move are right: equations of motion integrated, fitted, compared with the truth.
//!
//! cargo run --release -p afmid-kernels --example moving -- [--kind A,B] [--first SEED] [--n N] [--noise LEVEL] [--alone]
//! [--verbose]
//!
//! By `follow_channels`, as `model.decay` does; with `--alone` by `follow_moving` from one perturbed pole of each mode.
//!
//! Right: as many modes as there are; each frequency within the range passed through (0.1 % more either way); each quality
//! factor within 10 % of that range or three of its errors, its error at most 30 %. z: difference from the truth at the same
//! amplitude over the stated error, of frequency and of damping.

mod cases;
mod judged;
mod systems;

use std::time::Instant;

use afmid_kernels::ringdown::moving::{Options, follow_moving};
use afmid_kernels::ringdown::{ChannelOptions, Motion, follow_channels};

use cases::{KINDS, case};
use judged::{Row, Tally};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let option =
        |name: &str| arguments.iter().position(|own| own == name).and_then(|at| arguments.get(at + 1)).cloned();
    let number = |name: &str, default: u64| option(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let has = |name: &str| arguments.iter().any(|own| own == name);
    let (first, count) = (number("--first", 300), number("--n", 20));
    let level = option("--noise").and_then(|text| text.parse().ok()).unwrap_or(0.003);
    let kinds = option("--kind").unwrap_or_default();
    for kind in KINDS.into_iter().filter(|kind| kinds.is_empty() || kinds.split(',').any(|own| own == *kind)) {
        let mut tally = Tally::default();
        for seed in first..first + count {
            let case = case(kind, seed, level);
            let hits: Vec<Vec<&[f64]>> = case.hits.iter().map(|hit| hit.iter().map(Vec::as_slice).collect()).collect();
            let begun = Instant::now();
            let rows = if has("--alone") {
                let found = follow_moving(&hits, 1.0 / case.fs, &case.lines, &Options::default());
                found.map(|found| Row::of_lines(&found))
            } else {
                let options = ChannelOptions::default();
                let found = follow_channels(&hits, &[], 1.0 / case.fs, &options, Motion::Laws);
                found.map(|found| Row::of_decay(&found))
            };
            tally.took(begun.elapsed(), case.hits.iter().flatten().map(Vec::len).sum());
            let right = rows.as_ref().is_ok_and(|rows| tally.take(&case, rows, kind));
            if has("--verbose") || !right {
                let rows: Vec<String> = match rows {
                    Ok(rows) => rows.iter().map(Row::text).collect(),
                    Err(error) => vec![error.to_string()],
                };
                println!("{} {kind}-{seed}: {}", if right { "right" } else { "WRONG" }, rows.join("; "));
            }
        }
        tally.print(kind);
    }
}
