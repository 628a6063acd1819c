//! The paper's archive, 26 files of 3 MS, through the paper's pipeline: every figure's numbers against what was put in.

use crate::common::{afmid, config, files, number, shown};
use serde_json::Value;

#[test]
fn the_papers_archive_gives_the_papers_table() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let folder = here.join("paper");
    let out = format!("archive.out='{}'", folder.display());
    afmid(here, &["run", &config("simulate-paper.toml"), "--set", &out, "-o", "archive.h5", "--cache", "cache"]);
    let set = files(&folder);
    afmid(here, &["run", &config("paper.toml"), "--set", &set, "-o", "paper.h5", "--cache", "cache"]);

    let truth = std::fs::read_to_string(here.join("paper.truth.json")).expect("the truth beside the archive");
    let truth: Value = serde_json::from_str(&truth).expect("JSON");
    for (id, wanted) in [("events", 84), ("coupled_events", 89)] {
        let events = shown(here, "paper.h5", id);
        assert_eq!(events["events"]["found"], wanted, "{id}");
        assert_eq!(events["events"]["rejected"].as_array().map(Vec::len), Some(0), "{id}");
        assert_eq!(misplaced(&events, &truth, if id == "events" { "snap-off" } else { "snap-in" }), 0, "{id}");
    }
    let modes = shown(here, "paper.h5", "modes");
    let lever = [(46.3e3, 40.8), (247.4e3, 193.2), (580.8e3, 358.0), (1051.2e3, 503.8)];
    assert_eq!(modes["modes"].as_array().map(Vec::len), Some(lever.len()));
    for (n, (f, q)) in lever.into_iter().enumerate() {
        for (name, std, truth) in [("frequency_hz", "frequency_std_hz", f), ("quality_factor", "quality_factor_std", q)]
        {
            let of = |name: &str| number(&modes, &format!("/modes/{n}/{name}"));
            // 4 of its own standard errors
            assert!((of(name) - truth).abs() < 4.0 * of(std), "mode {}: {name} {} +- {}", n + 1, of(name), of(std));
        }
    }
    // what the events of this archive bear on average, whatever its seed: the load by the truth file
    let loads: Vec<f64> = events_of(&truth, "snap-off").map(|(_, event)| number(event, "/load_n")).collect();
    let load = loads.iter().sum::<f64>() / loads.len() as f64;
    let forces = shown(here, "paper.h5", "force");
    // calibrated by the archive's own stiffness, which is known to 2 % and enters as it is; 2 % is wanted
    assert!((number(&forces, "/force/value") / load - 1.0).abs() < 0.02, "{forces} against {load} N");
    // the figures: 330 nN within 2 %, k within 2 of its own errors and these at most 5 %
    let force = number(&shown(here, "paper.h5", "force"), "/force/value");
    assert!((force / -330e-9 - 1.0).abs() < 0.02, "force {force} N");
    let stiffness = shown(here, "paper.h5", "stiffness");
    let of = |name: &str| number(&stiffness, &format!("/stiffness_n_per_m/{name}"));
    assert!((of("value") - 3.8).abs() < 2.0 * of("std") && of("std") < 0.05 * 3.8, "{stiffness}");

    let report = afmid(here, &["report", "paper.h5", "-o", "paper.html"]);
    let page = std::fs::read_to_string(here.join("paper.html")).expect(&report);
    for figure in ["Fig. 2", "Fig. 3", "Fig. 4", "Fig. 5"] {
        assert!(page.contains(figure), "{figure} is missing");
    }
}

/// Counted events of one kind with their record's file, in the truth.
fn events_of<'a>(truth: &'a Value, kind: &'a str) -> impl Iterator<Item = (&'a str, &'a Value)> {
    let records = truth["records"].as_array().map_or(&[][..], Vec::as_slice);
    records.iter().flat_map(move |record| {
        let events = record["events"].as_array().map_or(&[][..], Vec::as_slice);
        let counted = move |event: &&Value| event["kind"] == kind && event["counted"] == true;
        events.iter().filter(counted).map(|event| (record["file"].as_str().unwrap_or_default(), event))
    })
}

/// How many true events have no found one within four samples, and how many found ones no true one.
fn misplaced(found: &Value, truth: &Value, kind: &str) -> usize {
    // a snap-off's onset is seen one to three samples late
    let near = |file: &str, sample: f64, event: &Value| {
        event["record"] == file && (number(event, "/index") - sample).abs() <= 4.0
    };
    let kept = found["events"]["kept"].as_array().expect("the events that were kept");
    let missed = events_of(truth, kind)
        .filter(|(file, event)| kept.iter().filter(|k| near(file, number(event, "/sample"), k)).count() != 1);
    let invented = kept.iter().filter(|k| !events_of(truth, kind).any(|(file, e)| near(file, number(e, "/sample"), k)));
    missed.count() + invented.count()
}
