//! Archives of an independent simulator, with their truth; force curves of our own where they are missing.

use std::path::PathBuf;

use afmid_pipeline::{Artifact, Context, Ports, Stage, Table};

use super::Correlation;
use crate::events::curves::{Curve, LSB, RATE, quantised};
use crate::io::{Records, memory_channel, memory_record};
use afmid_kernels::events::EventKind;

const SNAP_IN: u64 = 1;
const SNAP_OFF: u64 = 2;

/// Records on their port, and for each its events: sample and kind.
struct Archive {
    records: Ports,
    truth: Vec<Vec<(f64, u64)>>,
}

fn shared(name: &str) -> Option<Archive> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/afm").join(name);
    let text = std::fs::read_to_string(folder.with_extension("truth.json")).ok()?;
    let truth: serde_json::Value = serde_json::from_str(&text).ok()?;
    let event = |event: &serde_json::Value| Some((event.get(0)?.as_f64()?, event.get(1)?.as_f64()? as u64));
    let truth = truth["events"]
        .as_array()?
        .iter()
        .map(|record| record.as_array()?.iter().map(event).collect())
        .collect::<Option<_>>()?;
    let stage = Records { files: vec![folder.display().to_string()], ..Records::default() };
    let records = stage.run(&Ports::new(), &Context::alone(1)).unwrap();
    Some(Archive { records, truth })
}

fn stand_in(count: usize) -> Archive {
    let curves: Vec<Curve> = (0..count)
        .map(|k| Curve {
            cycle: 100_000 + 160 * k,
            cycles: 1,
            rupture: true,
            load: -0.8 - 0.01 * k as f64,
            fraction: 0.0,
        })
        .collect();
    let records = curves.iter().enumerate().map(|(k, curve)| {
        let codes = quantised(&curve.signal(), 1.2e-3, k as u64);
        memory_record(
            &format!("record_{k:04}.h5"),
            RATE,
            vec![memory_channel("deflection", afmid_pipeline::recording::Raw::Int16(codes), LSB)],
        )
    });
    let recording = afmid_pipeline::Recording { records: records.collect() };
    let mut ports = Ports::new();
    ports.insert("records", Artifact::Recording(std::sync::Arc::new(recording)));
    let truth =
        curves.iter().map(|curve| vec![(curve.snap_in(0) as f64, SNAP_IN), (curve.snap_off(0) as f64, SNAP_OFF)]);
    Archive { records: ports, truth: truth.collect() }
}

fn table(archive: &Archive, kind: EventKind) -> Table {
    let stage = Correlation { kind, ..Correlation::default() };
    let outputs = stage.run(&archive.records, &Context::alone(1)).unwrap();
    let Some(Artifact::Table(table)) = outputs.artifact("events") else { panic!("no table") };
    Table::clone(table)
}

#[test]
fn every_event_of_the_archives_is_found_and_none_is_false() {
    let mut missing = 0;
    for (name, records) in [
        ("lever-a", 24),
        ("hidden-drift-and-hum", 10),
        ("hidden-finite-rupture", 10),
        ("hidden-quadratic-detector", 10),
        ("hidden-tether-tail", 10),
    ] {
        // one stand-in is enough: they are all alike
        let archive = match shared(name) {
            Some(archive) => archive,
            None => {
                missing += 1;
                if missing > 1 {
                    continue;
                }
                stand_in(records)
            }
        };
        for (kind, code) in [(EventKind::SnapOff, SNAP_OFF), (EventKind::SnapIn, SNAP_IN)] {
            let table = table(&archive, kind);
            let truth: Vec<f64> =
                archive.truth.iter().flatten().filter(|event| event.1 == code).map(|event| event.0).collect();
            assert!(table.text("rejected").unwrap().iter().all(String::is_empty), "{name}: {table:?}");
            let (index, shift) = (table.integer("index").unwrap(), table.real("shift").unwrap());
            assert_eq!(index.len(), truth.len(), "{name} {kind:?}");
            for ((index, shift), truth) in index.iter().zip(shift).zip(truth) {
                let late = *index as f64 + shift - truth;
                // the truth is the first sample after the event; a rupture over 1.3 us and the detector's poles are
                // seen two samples late
                assert!((-1.0..3.0).contains(&late), "{name} {kind:?}: {late} samples after {truth}");
            }
        }
    }
    println!("stand-in: {missing} archives of events missing, simulated force curves used instead");
}
