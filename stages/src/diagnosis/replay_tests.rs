//! Closing the loop: found, handed on, simulated again, found again.

use std::path::{Path, PathBuf};

use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Array, Axis, Context, Document, Port, Ports, Recording, Stage};
use serde_json::Value;

use super::replay::Replayer;
use super::{ReleaseDiagnose, ReleaseReplay};
use crate::causes::find;
use crate::simulate::{Afm, AfmOfModel, Hidden, LeverModel, MODEL};
use afmid_kernels::diagnosis::release::{Cut, EventWindow};
use afmid_kernels::effects::Instant;
use afmid_kernels::simulate::{Cut as SimulatedCut, Place};

const RECORDS: Port<Recording> = Port::new("records", "records", "records");
const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "events");
const TRUTH: Port<Document> = Port::new("truth", "truth", "truth");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "summary");
const RATE_HZ: f64 = 5e6;

/// Records of a simulation and its counted snap-offs, each placed to half a sample.
fn wired(simulated: &Ports) -> Ports {
    let truth = &simulated.get(&TRUTH).expect("truth").0;
    let (mut records, mut onsets) = (Vec::new(), Vec::new());
    for (number, record) in truth["records"].as_array().expect("records").iter().enumerate() {
        let counted = |event: &&Value| event["kind"] == "snap-off" && event["counted"] == true;
        for event in record["events"].as_array().expect("events").iter().filter(counted) {
            records.push(number as i64);
            onsets.push((event["sample"].as_f64().expect("a sample").round()) / RATE_HZ);
        }
    }
    let events = (0..records.len()).map(|k| k as f64).collect();
    let ensemble = Array::over(vec![Axis::new("event", "1", "event", events)])
        .with("onset", "s", "time of the onset in its record", &["event"], onsets)
        .with("record", "1", "number of the record", &["event"], records)
        .attribute("sample_rate_hz", RATE_HZ);
    let recording = simulated.get(&RECORDS).expect("records").clone();
    Ports::new().with(&RECORDS, recording).with(&ENSEMBLE, ensemble)
}

fn context(base: &Path) -> Context<'_> {
    Context::new(base, 3, &NoProgress)
}

/// Diagnosis and replay of an archive: summaries of both, and the model.
fn closed(ports: Ports, base: &Path) -> (Value, Value, LeverModel) {
    let stage = ReleaseDiagnose { modes: crate::model::ModeNumber::Fixed(4), ..ReleaseDiagnose::default() };
    let found = stage.run(&ports, &context(base)).expect("a diagnosis");
    let model = found.get(&MODEL).expect("a model").clone();
    let read = LeverModel::read(&model).expect("a valid model");
    let replayed = ReleaseReplay::default().run(&ports.with(&MODEL, model), &context(base)).expect("a replay");
    let summary = |ports: &Ports| ports.get(&SUMMARY).expect("a summary").0.clone();
    (summary(&found), summary(&replayed), read)
}

fn ratio(replay: &Value, part: &str, of: &str) -> f64 {
    replay[part][of].as_f64().unwrap_or(f64::NAN)
}

#[test]
fn a_hidden_bend_is_found_simulated_again_and_found_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let afm = Afm {
        out: PathBuf::from("first"),
        records: 10,
        samples: 200_000,
        snap_offs: Some(10),
        ramp_hz: 2.79,
        ramp_m: 400e-9,
        surface_m: -100e-9,
        compression: 0,
        seed: Some(71),
        hidden: vec![Hidden::new(find("quadratic-detector").expect("a cause").about(), &[0.012])],
        ..Afm::default()
    };
    let simulated = afm.run(&Ports::new(), &context(folder.path())).expect("an archive");
    let (found, replay, model) = closed(wired(&simulated), folder.path());
    println!("{:#}", replay);
    assert_eq!(found["verdict"], "named", "{found:#}");
    assert_eq!(model.causes.len(), 1);
    assert_eq!(model.causes[0].id, "quadratic-detector");
    let first = model.causes[0].parameters["a2"];
    // single events: 80,000 samples, 0.25 %; thermal and 1/f noise of ten windows scatter by some per cent of their
    // small part
    assert!((ratio(&replay, "after", "over_noise") - 1.0).abs() < 0.04, "{replay:#}");
    assert!(ratio(&replay, "before", "over_noise") > 1.1, "{replay:#}");
    // 8000 samples of the mean: 0.8 %, thermal and 1/f parts more
    assert!((ratio(&replay, "after", "mean_over_noise") - 1.0).abs() < 0.08, "{replay:#}");
    assert!(ratio(&replay, "before", "mean_over_noise") > 1.8, "{replay:#}");

    let again = AfmOfModel { out: PathBuf::from("again"), seed: Some(72), drift_v: 0.0, ..AfmOfModel::default() };
    let ports = Ports::new().with(&MODEL, Document::new(&model).expect("a document"));
    let simulated = again.run(&ports, &context(folder.path())).expect("an archive of the model");
    let (found, replay, model) = closed(wired(&simulated), folder.path());
    assert_eq!(found["verdict"], "named", "{found:#}");
    assert_eq!(model.causes.len(), 1, "{found:#}");
    let second = model.causes[0].parameters["a2"];
    println!("a2 {first:?}, again {second:?}");
    // three standard errors of the second archive's estimate: the first one is its truth
    assert!((second.value - first.value).abs() < 3.0 * second.std.expect("an error"), "{first:?} {second:?}");
    assert!((ratio(&replay, "after", "over_noise") - 1.0).abs() < 0.04, "{replay:#}");
}

/// A release torn off on the moving ramp, without noise, against the same one let go: instant and load are fitted,
/// lever and cause are the truth.
#[test]
fn a_release_that_tears_off_by_itself_is_simulated_again() {
    let place = Place { record: 0, records: 2, samples: 200_000, margin_samples: 0, seed: 1 };
    let at = Instant { record: 0, place: 0.0, time_s: 0.0, piezo_m: 0.0 };
    let cut = Cut { before: 16, samples: 4000, interval_s: 1.0 / RATE_HZ };
    for (id, values) in [
        ("quadratic-detector", vec![0.02]),
        ("tether-tail", vec![0.02, 8e-5]),
        ("duffing", vec![0.001]),
        ("finite-rupture", vec![1.28e-6]),
        ("photodiode-tail", vec![0.02, 8e-5]),
    ] {
        let hidden = vec![Hidden::new(find(id).expect("a cause").about(), &values)];
        let afm = Afm { ramp_hz: 2.0, hidden, ..Afm::default() };
        let model = LeverModel::of(&afm);
        let effects = model.effects().expect("effects");
        let wide = SimulatedCut { before: 100, samples: 4400 };
        let values = afm.microscope().quiet_release(330e-9, &effects, place, wide).expect("a release");
        let event = EventWindow { values, onset: 100.0, first: at };
        let before = Replayer::baseline(&model, cut).replay(&event, &[]).expect("a fit");
        let after = Replayer::extended(&model, cut).expect("a model").replay(&event, &[]).expect("a fit");
        println!("{id}: {:.2e} before, {:.2e} after", before.rms_v, after.rms_v);
        // the base moves by 0.8 um/s: 6 mV of 0.87 V while the lever rings, and 1.5 % of what a map adds to it
        assert!(after.rms_v < 0.05 * before.rms_v, "{id}: {:.2e} of {:.2e}", after.rms_v, before.rms_v);
    }
}
