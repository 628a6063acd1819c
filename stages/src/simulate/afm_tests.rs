//! The stage `simulate.afm`: files, truth, determinism.

use super::*;
use afmid_pipeline::stage::NoProgress;

fn run(afm: &Afm, base: &Path, threads: usize) -> Result<Ports, StageError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| afm.run(&Ports::new(), &Context::new(base, 3, &NoProgress)))
}

fn small() -> Afm {
    Afm {
        out: PathBuf::from("archive/small"),
        records: 2,
        samples: 220_000,
        ramp_hz: 25.0,
        margin_samples: 10_000,
        snap_ins: Some(2),
        snap_offs: Some(2),
        ..Afm::default()
    }
}

#[test]
fn same_seed_gives_the_same_bytes_on_one_thread_and_on_three() {
    let (one, three) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let outputs = run(&small(), one.path(), 1).unwrap();
    run(&small(), three.path(), 3).unwrap();
    for name in ["small/record_0000.h5", "small/record_0001.h5", "small.truth.json"] {
        let read = |base: &Path| std::fs::read(base.join("archive").join(name)).unwrap();
        assert!(read(one.path()) == read(three.path()), "{name} differs");
    }
    // and again over the old files
    let again = run(&small(), one.path(), 2).unwrap();
    let hashes = |ports: &Ports| -> Vec<String> {
        ports.get(&RECORDS).unwrap().records.iter().map(|record| record.blake3.clone()).collect()
    };
    assert_eq!(hashes(&outputs), hashes(&again));
    let other = Afm { seed: Some(99), ..small() };
    assert_ne!(hashes(&outputs), hashes(&run(&other, one.path(), 2).unwrap()));
}

#[test]
fn truth_counts_what_was_asked_for_and_the_record_shows_it() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = run(&small(), folder.path(), 2).unwrap();
    let truth = &outputs.get(&TRUTH).unwrap().0;
    assert_eq!(truth["counts"]["snap_off"], 2);
    assert_eq!(truth["counts"]["snap_in"], 2);
    assert_eq!(truth["counts"]["not_counted"], 0);
    let records = &outputs.get(&RECORDS).unwrap().records;
    for (record, truth) in records.iter().zip(truth["records"].as_array().unwrap()) {
        let off = truth["events"].as_array().unwrap().iter().find(|e| e["kind"] == "snap-off").unwrap();
        let sample = off["sample"].as_f64().unwrap() as usize;
        assert!((10_000..=210_000).contains(&sample));
        let values = record.channel("deflection").unwrap().read(sample - 20, 100).unwrap();
        // pulled down by 0.6 to 1.1 V before, swinging up after half a period (54 samples)
        assert!(values[10] < -0.6 && values[74] > 0.3, "{} {}", values[10], values[74]);
        assert_eq!(record.channel("piezo").unwrap().samples, 220_000);
    }
}

#[test]
fn a_folder_with_other_records_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("archive/small")).unwrap();
    std::fs::write(folder.path().join("archive/small/record_0007.h5"), "old").unwrap();
    let error = run(&small(), folder.path(), 1).unwrap_err();
    assert!(error.to_string().contains("record_0007.h5"), "{error}");
}

#[test]
fn lists_of_unequal_length_are_refused() {
    let error = afmid_pipeline::stage::check(&Afm { quality_factors: vec![40.0], ..Afm::default() }).unwrap_err();
    assert!(error.to_string().contains("one per mode"), "{error}");
    assert!(afmid_pipeline::stage::check(&Afm::default()).is_ok());
}

#[test]
fn the_example_holds() {
    let folder = tempfile::tempdir().unwrap();
    for example in Afm::examples() {
        let afm: Afm = afmid_pipeline::toml::from_str(example.params).unwrap();
        let outputs = run(&afm, folder.path(), 2).unwrap();
        (example.expect)(&outputs).unwrap();
    }
}
