//! Archives with something hidden in them, diagnosed by the shipped config: the right names, the right numbers, and nothing where nothing is.

use std::path::{Path, PathBuf};

use crate::common::{ROOT, afmid, config, files, lever_a, number, shown};
use serde_json::Value;

/// A recorded archive, or one that afmid's own simulator makes with the same cause hidden, counted in the output.
fn archive(scratch: &Path, name: &str, hidden: &str) -> PathBuf {
    let data = std::env::var_os("AFMID_DATA").map_or_else(|| Path::new(ROOT).join("../shared/data"), PathBuf::from);
    let folder = data.join("afm").join(name);
    if folder.is_dir() {
        return folder;
    }
    println!("stand-in: 1 archive simulated in place of {name}");
    let folder = scratch.join("stand-in");
    let (out, hidden) = (format!("archive.out='{}'", folder.display()), format!("archive.hidden={hidden}"));
    afmid(
        scratch,
        &["run", &config("simulate-demo.toml"), "--set", &out, "--set", &hidden, "-o", "s.h5", "--cache", "cache"],
    );
    folder
}

fn diagnosed(scratch: &Path, folder: &Path) -> Value {
    afmid(scratch, &["run", &config("diagnose.toml"), "--set", &files(folder), "-o", "d.h5", "--cache", "cache"]);
    shown(scratch, "d.h5", "diagnosis")
}

/// The classes of the named causes, in order.
fn named(found: &Value) -> Vec<Vec<&str>> {
    let causes = found["causes"].as_array().into_iter().flatten();
    causes.map(|cause| cause["class"].as_array().into_iter().flatten().filter_map(Value::as_str).collect()).collect()
}

/// The parameter of the only cause of that class.
fn parameter<'a>(found: &'a Value, id: &str, name: &str) -> &'a Value {
    let causes = found["causes"].as_array().expect("causes");
    let of_class = |cause: &&Value| cause["class"].as_array().into_iter().flatten().any(|c| c == id);
    &causes.iter().find(of_class).expect("the cause")["parameters"][name]
}

fn near(found: &Value, truth: f64) {
    let (value, std) = (number(found, "/value"), number(found, "/std"));
    // four of its own standard errors: by chance once in 16,000
    assert!((value - truth).abs() < 4.0 * std, "{value} +- {std}, truth {truth}");
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let scratch = tempfile::tempdir().expect("a folder");
    let found = diagnosed(scratch.path(), &lever_a(scratch.path()).folder);
    assert_eq!(found["verdict"], "clean", "{found:#}");
    assert_eq!(found["causes"].as_array().map(Vec::len), Some(0));
    assert!(number(&found, "/p_value") > 0.01);
}

/// A pole that decays within a sample acts as a delay and a little feedthrough: the model's third pole, far from its
/// nominal value, takes it, and no cause is named for it.
#[test]
fn a_detector_pole_beyond_the_nyquist_frequency_is_no_cause() {
    let scratch = tempfile::tempdir().expect("a folder");
    for (seed, pole_hz) in [(31, "3.2e6"), (32, "6e6")] {
        let archive = format!(
            "[pipeline]\nname = 'archive'\n[[stage]]\nid = 'archive'\nuses = 'simulate.afm'\n[stage.params]\n\
             out = 'archive-{seed}'\nseed = {seed}\nrecords = 10\nsamples = 200000\nsnap_offs = 10\nramp_hz = 2.79\n\
             ramp_m = 4e-7\nsurface_m = -1e-7\ndetector_poles_hz = [1.3e6, 1.9e6, {pole_hz}]\n"
        );
        std::fs::write(scratch.path().join("archive.toml"), archive).expect("a config");
        afmid(scratch.path(), &["run", "archive.toml", "-o", "s.h5", "--cache", "cache"]);
        let found = diagnosed(scratch.path(), &scratch.path().join(format!("archive-{seed}")));
        assert_eq!(found["verdict"], "clean", "{pole_hz} Hz: {found:#}");
    }
}

#[test]
fn a_bent_photodiode_is_named_with_its_strength() {
    let scratch = tempfile::tempdir().expect("a folder");
    let hidden = "[{cause='quadratic-detector',a2=0.012}]";
    let found = diagnosed(scratch.path(), &archive(scratch.path(), "hidden-quadratic-detector", hidden));
    assert_eq!(found["verdict"], "named", "{found:#}");
    assert_eq!(named(&found), [["quadratic-detector"]]);
    near(parameter(&found, "quadratic-detector", "a2"), 0.012);
    let (before, after) = (number(&found, "/causes/0/gain/rms_before"), number(&found, "/causes/0/gain/rms_after"));
    // held-out events of 1.2 mV, five of them averaged: 0.6 mV is noise
    assert!(after < 0.6 * before, "{before} {after}");
    // the second mode of a fit without a mode for the line: f and Q have moved, and are back
    assert_eq!(found["modes_after"].as_array().map(Vec::len), Some(4));
}

#[test]
fn a_slow_rupture_is_named_with_its_duration() {
    let scratch = tempfile::tempdir().expect("a folder");
    let hidden = "[{cause='finite-rupture',rupture_time_s=1.28e-6}]";
    let found = diagnosed(scratch.path(), &archive(scratch.path(), "hidden-finite-rupture", hidden));
    assert_eq!(found["verdict"], "named", "{found:#}");
    assert_eq!(named(&found), [["finite-rupture"]]);
    // the detector's free poles share the edge with the rupture: its standard error, 0.4 %, does not count their valley's bend
    let duration = number(parameter(&found, "finite-rupture", "rupture_time_s"), "/value");
    assert!((duration / 1.28e-6 - 1.0).abs() < 0.05, "{duration}");
}

#[test]
fn a_tail_is_named_by_its_class() {
    let scratch = tempfile::tempdir().expect("a folder");
    let hidden = "[{cause='tether-tail',fraction=0.012,tau_s=8e-5}]";
    let found = diagnosed(scratch.path(), &archive(scratch.path(), "hidden-tether-tail", hidden));
    assert_eq!(found["verdict"], "named", "{found:#}");
    assert_eq!(named(&found).len(), 1);
    assert!(named(&found)[0].contains(&"tether-tail"), "{found:#}");
}

#[test]
fn two_causes_of_different_kinds_are_both_named() {
    let scratch = tempfile::tempdir().expect("a folder");
    let hidden =
        "[{cause='frequency-drift',relative_drift=0.0018},{cause='mains-hum',amplitude_v=0.0045,frequency_hz=50}]";
    let found = diagnosed(scratch.path(), &archive(scratch.path(), "hidden-drift-and-hum", hidden));
    assert_eq!(found["verdict"], "named", "{found:#}");
    let classes = named(&found);
    assert_eq!(classes.len(), 2, "{found:#}");
    assert!(classes.iter().any(|c| c.contains(&"frequency-drift")));
    assert!(classes.iter().any(|c| c.contains(&"mains-hum")));
    near(parameter(&found, "frequency-drift", "relative_drift"), 0.0018);
    near(parameter(&found, "mains-hum", "amplitude_v"), 0.0045);
}

#[test]
fn a_cause_that_may_not_be_used_is_not_explained_away() {
    let scratch = tempfile::tempdir().expect("a folder");
    let hidden = "[{cause='quadratic-detector',a2=0.012}]";
    let folder = archive(scratch.path(), "hidden-quadratic-detector", hidden);
    let here = scratch.path();
    let without = "diagnosis.without=['quadratic-detector']";
    let arguments =
        ["run", &config("diagnose.toml"), "--set", &files(&folder), "--set", without, "-o", "d.h5", "--cache", "cache"];
    afmid(here, &arguments);
    let found = shown(here, "d.h5", "diagnosis");
    assert_eq!(found["verdict"], "unexplained", "{found:#}");
    assert_eq!(found["causes"].as_array().map(Vec::len), Some(0));
    assert!(!found["evidence"].as_array().expect("evidence").is_empty());
}

#[test]
fn measured_events_are_simulated_again_down_to_the_noise() {
    let scratch = tempfile::tempdir().expect("a folder");
    let hidden = "[{cause='quadratic-detector',a2=0.012}]";
    let folder = archive(scratch.path(), "hidden-quadratic-detector", hidden);
    let (here, out) = (scratch.path(), format!("archive.out='{}'", scratch.path().join("again").display()));
    let config = config("resimulate.toml");
    afmid(here, &["run", &config, "--set", &files(&folder), "--set", &out, "-o", "r.h5", "--cache", "cache"]);
    let replay = shown(here, "r.h5", "replay");
    let mean = |part: &str| number(&replay, &format!("/{part}/mean_over_noise"));
    // ten events, 8000 samples: 0.8 %, thermal and 1/f parts more; before: twice what noise leaves
    assert!((mean("after") - 1.0).abs() < 0.08 && mean("before") > 1.8, "{replay:#}");
    let again = shown(here, "r.h5", "archive");
    assert_eq!(again["events"]["snap_off"], again["records"]);
}
