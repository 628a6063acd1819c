use std::sync::Arc;

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{Artifact, Values};

use super::*;
use crate::events::curves::{Curve, LSB, RATE, quantised};
use crate::fixture::white_noise;
use crate::io::{memory_channel, memory_record};

struct Outcome {
    ensemble: Array,
    table: Table,
    summary: serde_json::Value,
    warnings: Vec<String>,
}

impl Outcome {
    fn reasons(&self) -> Vec<(String, String)> {
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        let rejected = self.summary["events"]["rejected"].as_array().unwrap();
        rejected.iter().map(|row| (text(&row["record"]), text(&row["reason"]))).collect()
    }
}

fn run(stage: &Correlation, records: Vec<Record>) -> Result<Outcome, StageError> {
    let mut ports = Ports::new();
    ports.insert("records", Artifact::Recording(Arc::new(Recording { records })));
    run_on(stage, &ports)
}

fn run_on(stage: &Correlation, ports: &Ports) -> Result<Outcome, StageError> {
    afmid_pipeline::stage::check(stage)?;
    let context = Context::alone(1);
    let outputs = stage.run(ports, &context)?;
    let (ensemble, table) = (outputs.get(&ENSEMBLE)?.clone(), outputs.get(&EVENTS)?.clone());
    ensemble.validate()?;
    table.validate()?;
    let summary = outputs.get(&SUMMARY)?.0.clone();
    Ok(Outcome { ensemble, table, summary, warnings: context.into_warnings() })
}

fn record(name: &str, codes: Vec<i16>) -> Record {
    memory_record(name, RATE, vec![memory_channel("deflection", Raw::Int16(codes), LSB)])
}

fn curve(load: f64, fraction: f64) -> Curve {
    Curve { cycle: 100_000, cycles: 1, rupture: true, load, fraction }
}

/// Twelve curves with hum, drift, a spike, loads that scatter by 30 %, and known fractions of a sample.
fn archive() -> (Vec<f64>, Vec<Record>) {
    let draws = white_noise(12, 0.3, 42);
    let ruptures: Vec<Curve> =
        (0..12).map(|k| curve(-0.7 * (1.0 + draws[k]).clamp(0.3, 2.0), (k as f64 * 0.37).fract())).collect();
    let records = ruptures.iter().enumerate().map(|(number, curve)| {
        let hum =
            |k: f64| 0.05 * (std::f64::consts::TAU * 50.0 * k / RATE + number as f64).sin() + 1e-3 * number as f64;
        let signal: Vec<f64> = (0..).zip(curve.signal()).map(|(k, y)| y + hum(f64::from(k))).collect();
        let mut codes = quantised(&signal, 1.2e-3, number as u64);
        codes[5_000 + 3_000 * number] = 2000;
        record(&format!("record_{number:02}.h5"), codes)
    });
    (ruptures.iter().map(|curve| curve.snap_off(0) as f64 + curve.fraction).collect(), records.collect())
}

#[test]
fn the_example_runs_and_reaches_its_truth() {
    for example in Correlation::examples() {
        let stage: Correlation = afmid_pipeline::toml::from_str(example.params).unwrap();
        let inputs = (example.inputs)().unwrap();
        println!("{}", (example.expect)(&stage.run(&inputs, &Context::alone(1)).unwrap()).unwrap());
        let outcome = run_on(&stage, &inputs).unwrap();
        assert!(outcome.warnings.is_empty());
        assert_eq!(outcome.summary["events"]["found"], 3);
        assert_eq!(outcome.reasons(), [("record_2.h5".to_owned(), "no rupture".to_owned())]);
    }
}

#[test]
fn all_events_of_a_disturbed_archive_are_found_and_aligned() {
    let (truth, records) = archive();
    let outcome = run(&Correlation::default(), records.clone()).unwrap();
    assert_eq!((outcome.summary["events"]["found"].as_u64(), outcome.reasons().len()), (Some(12), 0));
    let late: Vec<f64> =
        outcome.ensemble.real("onset").unwrap().iter().zip(&truth).map(|(onset, t0)| onset * RATE - t0).collect();
    let mean = late.iter().sum::<f64>() / 12.0;
    // the average's noise is 0.35 mV: the release leaves it within two samples
    assert!((0.0..2.5).contains(&mean), "{mean}");
    for late in late {
        // 0.0024 rms at 0.9 V (shift_refinement), up to four times that at a quarter of it, four sigma
        assert!((late - mean).abs() < 0.04, "{late} against {mean}");
    }
    let snap_ins = run(&Correlation { kind: EventKind::SnapIn, ..Correlation::default() }, records).unwrap();
    assert_eq!((snap_ins.summary["events"]["found"].as_u64(), snap_ins.reasons().len()), (Some(12), 0));
    let jumps = snap_ins.ensemble.real("amplitude").unwrap();
    // 40 mV; lines through 1024 and 4096 samples of noise and hum (0.05 V: 0.5 mV over the window)
    assert!(jumps.iter().all(|jump| (jump + 0.04).abs() < 4e-3), "{jumps:?}");
}

#[test]
fn what_cannot_be_used_is_listed_with_its_reason() {
    let (_, mut records) = archive();
    let whole = curve(-0.8, 0.3);
    let codes = |signal: &[f64]| quantised(signal, 1.2e-3, 99);
    let put = |records: &mut Vec<Record>, name: &str, codes: Vec<i16>| records.push(record(name, codes));
    put(&mut records, "free.h5", codes(&vec![0.0; 100_000]));
    put(&mut records, "clinging.h5", codes(&Curve { rupture: false, ..curve(-0.5, 0.0) }.signal()));
    put(&mut records, "late.h5", codes(&whole.signal()[..83_000]));
    put(&mut records, "early.h5", codes(&whole.signal()[79_500..]));
    let clipped: Vec<i16> = codes(&whole.signal()).iter().map(|&code| code.min(512)).collect();
    put(&mut records, "clipped.h5", clipped.clone());
    put(&mut records, "inverted.h5", codes(&whole.signal()[40_000..].iter().map(|y| -y).collect::<Vec<_>>()));
    let mut gap = codes(&whole.signal());
    gap[82_000..82_010].fill(i16::MIN);
    put(&mut records, "gap.h5", gap);
    // another thing: a step without ringing
    put(&mut records, "step.h5", codes(&(0..100_000).map(|k| if k < 50_000 { -0.8 } else { 0.0 }).collect::<Vec<_>>()));
    let outcome = run(&Correlation::default(), records).unwrap();
    assert_eq!(outcome.summary["events"]["found"], 12, "{:?}", outcome.reasons());
    let wanted = [
        ("free.h5", "no rupture"),
        ("clinging.h5", "no rupture"),
        ("late.h5", "too near the end: 29"),
        ("early.h5", "too near the start: 50"),
        ("clipped.h5", "saturated: "),
        ("inverted.h5", "no rupture (at sample 39"),
        ("gap.h5", "10 samples of its window are at the ends of the 16-bit range"),
        ("step.h5", "unlike the others: correlation 0."),
    ];
    let reasons = outcome.reasons();
    assert_eq!(reasons.len(), wanted.len(), "{reasons:?}");
    for ((record, reason), (name, start)) in reasons.iter().zip(wanted) {
        assert!(record == name && reason.starts_with(start), "{record}: {reason}");
    }
    assert_eq!(outcome.table.rows(), 20);
    let keep = Correlation { keep_saturated: true, ..Correlation::default() };
    let outcome = run(&keep, vec![record("a", clipped.clone()), record("b", clipped)]).unwrap();
    assert!(outcome.table.integer("saturated").unwrap().iter().all(|&count| count > 50));
}

#[test]
fn several_cycles_in_a_record_and_samples_as_floats() {
    let curve = Curve { cycle: 80_000, cycles: 3, rupture: true, load: -0.9, fraction: 0.4 };
    let mut volts: Vec<f64> = curve.signal().iter().zip(white_noise(240_000, 1.2e-3, 3)).map(|(y, e)| y + e).collect();
    let channel = |volts: Vec<f64>| vec![memory_channel("deflection", Raw::Float64(volts), 1.0)];
    let found =
        |volts: Vec<f64>| run(&Correlation::default(), vec![memory_record("r.h5", RATE, channel(volts))]).unwrap();
    let outcome = found(volts.clone());
    let Values::Integer(records) = &outcome.ensemble.variable("record").unwrap().values else { panic!("not whole") };
    assert_eq!(records, &[0, 0, 0]);
    volts[curve.snap_off(1) + 3000] = f64::NAN;
    let outcome = found(volts);
    assert_eq!(outcome.summary["events"]["found"], 2);
    assert_eq!(outcome.reasons()[0].1, "1 samples of its window are missing");
}

#[test]
fn an_archive_without_events_is_an_error_with_reasons() {
    let records = (0..7).map(|k| record(&format!("r{k}.h5"), quantised(&vec![0.0; 50_000], 1e-3, k))).collect();
    let error = run(&Correlation::default(), records).err().unwrap().to_string();
    assert!(
        error.contains("no usable event in 7 records: r0.h5: no rupture; ") && error.contains("and 2 more"),
        "{error}"
    );
    assert!(run(&Correlation::default(), vec![]).err().unwrap().to_string().contains("no record"));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (_, records) = archive();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&Correlation::default(), records.clone()).unwrap())
    };
    let (one, many) = (on(1), on(3));
    assert_eq!(one.ensemble, many.ensemble);
    assert_eq!(one.summary, many.summary);
}

#[test]
fn parameters_out_of_range_are_named() {
    let default = Correlation::default;
    for (stage, named) in [
        (Correlation { window_samples: 100, ..default() }, "window_samples"),
        (Correlation { pre_share: 0.95, ..default() }, "pre_share"),
        (Correlation { pre_share: f64::NAN, ..default() }, "pre_share"),
        (Correlation { block_samples: 0, ..default() }, "block_samples"),
        (Correlation { level_samples: 100, ..default() }, "level_samples"),
        (Correlation { significance: 1.0, ..default() }, "significance"),
        (
            Correlation {
                averaging: AveragingSettings { max_iterations: 0, ..AveragingSettings::default() },
                ..default()
            },
            "max_iterations",
        ),
        (
            Correlation {
                averaging: AveragingSettings { min_correlation: 1.5, ..AveragingSettings::default() },
                ..default()
            },
            "min_correlation",
        ),
    ] {
        assert!(afmid_pipeline::stage::check(&stage).unwrap_err().to_string().contains(named), "{named}");
    }
    let stage: Correlation = afmid_pipeline::toml::from_str("kind = \"snap-to-contact\"").unwrap();
    assert_eq!(stage.kind, EventKind::SnapIn);
}

#[test]
fn windows_in_a_file_are_those_in_memory_bit_for_bit_on_any_number_of_threads() {
    let (_, mut records) = archive();
    // one that the qualities reject, so that windows are cut twice
    let signal: Vec<f64> = (0..).zip(curve(-0.8, 0.3).signal()).map(|(k, y)| y + ripple(k)).collect();
    records.push(record("ripple.h5", quantised(&signal, 1.2e-3, 98)));
    let mut ports = Ports::new();
    ports.insert("records", Artifact::Recording(Arc::new(Recording { records })));
    let outputs = |limit_bytes: usize, threads: usize| {
        let scratch = afmid_pipeline::rows::Scratch::default().with_limit_bytes(limit_bytes);
        let context = Context::alone(1).with_scratch(scratch);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Correlation::default().run(&ports, &context)).unwrap()
    };
    let memory = outputs(usize::MAX, 1);
    assert!(matches!(memory.get(&ENSEMBLE).unwrap().variables[0].values, Values::Real(_)));
    let summary = &memory.get(&SUMMARY).unwrap().0;
    assert!(summary.to_string().contains("times the noise"), "nothing was rejected by its quality: {summary}");
    // no room at all, and room for half of the segments
    for (limit_bytes, threads) in [(0, 1), (0, 4), (6 * 8192 * 8, 4)] {
        let file = outputs(limit_bytes, threads);
        assert!(matches!(file.get(&ENSEMBLE).unwrap().variables[0].values, Values::Stored(_)));
        assert_eq!(afmid_pipeline::outcome::difference(&memory, &file), None, "{limit_bytes} bytes, {threads}");
    }
}

/// 100 mV, long after what the alignment looks at; too fast for the scan to see.
fn ripple(k: u32) -> f64 {
    if k > 83_000 { 0.1 * (f64::from(k) * 1.5).sin() } else { 0.0 }
}

#[test]
fn the_alignment_has_the_same_bits_from_what_it_looks_at_as_from_whole_segments() {
    let lever = crate::fixture::Lever::paper();
    let stage = Correlation {
        averaging: AveragingSettings { max_shift_samples: 8, ..AveragingSettings::default() },
        ..Correlation::default()
    };
    let (averaging, extraction) = (stage.averaging, stage.extraction());
    let count = extraction.before + extraction.after;
    let stretch = Stretch::new(&averaging, extraction.before, extraction.after);
    // some at the largest shift, some beyond it, one of noise alone
    let segments: Vec<Vec<f64>> = [-7.9, -7.5, 6.0, 7.7, 7.9, 7.95, 9.0, 30.0]
        .iter()
        .zip(0..)
        .map(|(shift, seed)| {
            let signal = lever.release(count, extraction.before as f64 + shift, if seed == 7 { 0.0 } else { -0.9 });
            signal.iter().zip(white_noise(count, 1.2e-3, seed)).map(|(y, e)| y + e).collect()
        })
        .collect();
    let whole = correlation_average(&segments, extraction.before, &averaging);
    let cut: Vec<Vec<f64>> = segments.iter().map(|segment| stretch.of(segment)).collect();
    let part = correlation_average(&cut, stretch.onset, &averaging);
    assert!(cut[0].len() < 600 && whole.events.iter().any(Result::is_ok) && whole.events.iter().any(Result::is_err));
    // debug text has every digit of a number
    assert_eq!(format!("{whole:?}"), format!("{part:?}"));
}
