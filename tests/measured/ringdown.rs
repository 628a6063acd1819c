//! The joint fit through configs: one event, the noise of its own record.

use crate::common::{afmid, config, lever_a, number, shown};

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
