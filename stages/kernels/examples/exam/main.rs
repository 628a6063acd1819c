//! The exam of the diagnosis on decays and forced records: causes hidden by numerics of their own, the answers judged.
//!
//! `cargo run --release -p afmid-kernels --example exam -- decays|forced one|clean|left-out SEEDS [FIRST] [WEAKEST]`

mod draw;
mod limit;
mod rivals;
mod score;
mod system;

use std::process::ExitCode;
use std::time::Instant;

use afmid_kernels::causes::{CATALOGUE, Cause};
use afmid_kernels::diagnosis::verdict::Diagnosis;
use afmid_kernels::diagnosis::{DiagnosisOptions, Record, Stretch, diagnose};
use afmid_kernels::effects::Effects;
use draw::{Hidden, Measured, hide, system};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use score::{Asked, Sat, table};
use system::System;

const USAGE: &str = "usage: exam decays|forced one|clean|left-out SEEDS [FIRST] [WEAKEST]";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let (measured, asked, rest) = match words[..] {
        ["decays", asked, ref rest @ ..] => (Measured::Decays, Asked::of(asked), rest),
        ["forced", asked, ref rest @ ..] => (Measured::Forced, Asked::of(asked), rest),
        _ => (Measured::Decays, None, &[][..]),
    };
    let number = |i: usize, default: f64| rest.get(i).map_or(Some(default), |text| text.parse().ok());
    let (Some(asked), Some(seeds), Some(first), Some(weakest)) =
        (asked, number(0, 20.0), number(1, 1.0), number(2, draw::WEAKEST))
    else {
        eprintln!("{USAGE}");
        return ExitCode::FAILURE;
    };
    let (first, seeds) = (first as u64, seeds as u64);
    let sat: Vec<Sat> =
        (first..first + seeds).into_par_iter().filter_map(|seed| sit(measured, asked, seed, weakest)).collect();
    println!("{}", table(asked, &sat));
    ExitCode::SUCCESS
}

/// Draws a system, hides a cause, has it diagnosed.
fn sit(measured: Measured, asked: Asked, seed: u64, weakest: f64) -> Option<Sat> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let system = system(measured, &mut rng);
    let hidden = if asked == Asked::Clean {
        None
    } else {
        Some(hide(measured, &system, weakest, asked == Asked::LeftOut, &mut rng)?)
    };
    let effects = hidden.as_ref().map_or_else(Effects::default, Hidden::effects);
    let mut outputs: Vec<Vec<Vec<f64>>> = system.motion(&effects).into_iter().map(|moved| moved.outputs).collect();
    for output in outputs.iter_mut().flatten().flatten() {
        let white: f64 = StandardNormal.sample(&mut rng);
        *output += system.noise[0] * white;
    }
    let input = system.input();
    let begin = Instant::now();
    let diagnosis = diagnosed(&system, &input, &outputs, hidden.as_ref().filter(|_| asked == Asked::LeftOut));
    let seconds = begin.elapsed().as_secs_f64();
    let sat = Sat::new(seed, &system, hidden.as_ref(), asked, diagnosis, seconds);
    eprintln!("{}", sat.line());
    Some(sat)
}

fn diagnosed(
    system: &System,
    input: &[f64],
    outputs: &[Vec<Vec<f64>>],
    without: Option<&Hidden>,
) -> Result<Diagnosis, String> {
    let records: Vec<Record<'_>> = outputs
        .iter()
        .map(|channels| Record { input, outputs: channels.iter().map(Vec::as_slice).collect() })
        .collect();
    let training = (0..records.len()).map(|record| Stretch { record, first: 0, end: system.samples }).collect();
    let left_out = without.map_or(Vec::new(), |hidden| draw::left_out(hidden.cause));
    let candidates: Vec<&'static dyn Cause> =
        CATALOGUE.iter().copied().filter(|cause| !left_out.contains(&cause.about().id)).collect();
    let options = DiagnosisOptions {
        training,
        candidates,
        free_offsets: system.drive.is_none(),
        sensed: vec![system.sensed; system.channels()],
        ..DiagnosisOptions::default()
    };
    diagnose(&records, 1.0 / system.rate_hz, &options).map(|found| found.diagnosis).map_err(|error| error.to_string())
}
