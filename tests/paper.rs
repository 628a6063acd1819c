//! The paper's archive, 26 files of 3 MS, through the paper's pipeline: every figure's numbers against what was put in.

mod common;

use common::{afmid, config, files, number, shown};

#[test]
fn the_papers_archive_gives_the_papers_table() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let folder = here.join("paper");
    let out = format!("archive.out='{}'", folder.display());
    afmid(here, &["run", &config("simulate-paper.toml"), "--set", &out, "-o", "archive.h5", "--cache", "cache"]);
    let set = files(&folder);
    afmid(here, &["run", &config("paper.toml"), "--set", &set, "-o", "paper.h5", "--cache", "cache"]);

    for (id, wanted) in [("events", 84), ("coupled_events", 89)] {
        let events = shown(here, "paper.h5", id);
        assert_eq!(events["events"]["found"], wanted, "{id}");
        assert_eq!(events["events"]["rejected"].as_array().map(Vec::len), Some(0), "{id}");
    }
    let modes = shown(here, "paper.h5", "modes");
    let truth = [(46.3e3, 40.8), (247.4e3, 193.2), (580.8e3, 358.0), (1051.2e3, 503.8)];
    assert_eq!(modes["modes"].as_array().map(Vec::len), Some(truth.len()));
    for (n, (f, q)) in truth.into_iter().enumerate() {
        for (name, std, truth) in [("frequency_hz", "frequency_std_hz", f), ("quality_factor", "quality_factor_std", q)]
        {
            let of = |name: &str| number(&modes, &format!("/modes/{n}/{name}"));
            // 4 of its own standard errors
            assert!((of(name) - truth).abs() < 4.0 * of(std), "mode {}: {name} {} +- {}", n + 1, of(name), of(std));
        }
    }
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
