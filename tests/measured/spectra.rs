//! Thermal spectra, frequency responses and reconstructed forces: whole runs of the shipped configs.

use std::path::Path;

use crate::common::{self, afmid, config, files, lever_a, number, numbers, shown};

/// The measured thermal spectrum, or none.
fn stored_spectrum() -> Option<String> {
    let data = std::env::var_os("AFMID_DATA")
        .map_or_else(|| Path::new(common::ROOT).join("../shared/data"), std::path::PathBuf::from);
    let file = data.join("thermal/brownian-red.h5");
    file.is_file().then(|| file.display().to_string())
}

#[test]
fn a_stored_thermal_spectrum_gives_resonance_and_quality_factor() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (mut arguments, stand_in) =
        (vec!["run".to_owned(), config("thermal-spectrum.toml")], stored_spectrum().is_none());
    if stand_in {
        println!("stand-in: 1 spectrum in closed form in place of brownian-red");
        write_stand_in(&here.join("spectrum.h5"));
        let set = [format!("density.file='{}'", here.join("spectrum.h5").display()), "density.averages=32".to_owned()];
        set.into_iter().for_each(|set| arguments.extend(["--set".to_owned(), set]));
    }
    arguments.extend(["-o", "thermal.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &arguments.iter().map(String::as_str).collect::<Vec<&str>>());
    let fit = shown(here, "thermal.h5", "thermal");
    let (f, q) = (number(&fit, "/frequency/value"), number(&fit, "/quality_factor/value"));
    let (f_std, q_std) = (number(&fit, "/frequency/std"), number(&fit, "/quality_factor/std"));
    println!(
        "f0 {f:.3} +- {f_std:.3} Hz, Q {q:.0} +- {q_std:.0}, window {}, dispersion {}",
        fit["window"], fit["dispersion"]
    );
    // published with the data: 70561.29 +- 0.04 Hz, Q 29210 +- 3.3 %; two combined errors
    assert!((f - 70_561.29).abs() < 2.0 * f_std.hypot(0.04), "{f} +- {f_std}");
    assert!((q - 29_210.0).abs() < 2.0 * q_std.hypot(0.033 * 29_210.0), "{q} +- {q_std}");
}

/// The published fit itself, with the ripple of 32 averages in place of chance.
fn write_stand_in(path: &Path) {
    use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
    let frequency: Vec<f64> = (0..8000).map(|k| 69_500.0 + 0.25 * f64::from(k)).collect();
    let at = |(k, f): (usize, &f64)| {
        let (f0, q) = (70_561.29_f64, 29_210.0);
        let peak = 1.1e-7 * f0.powi(3) / q / ((f0 * f0 - f * f).powi(2) + (f * f0 / q).powi(2));
        (peak + 8.2e-9) * (1.0 + 0.25 * (k as f64 * 0.9).sin())
    };
    let density = frequency.iter().enumerate().map(at).collect();
    let dataset = |location: &str, values: Vec<f64>, unit: &str| NativeChannel {
        location: location.to_owned(),
        codes: Codes::Float64(values),
        unit: unit.to_owned(),
        scale_factor: 1.0,
        add_offset: 0.0,
        long_name: String::new(),
    };
    let channels = vec![dataset("x", frequency, "Hz"), dataset("y", density, "nm^2/Hz")];
    let record = NativeRecord { sample_rate_hz: 1.0, started_at: String::new(), channels };
    write_native(path, &record, RecordStorage::Deflate(1)).expect("a spectrum is written");
}

#[test]
fn forces_spectra_and_responses_come_from_one_archive() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = lever_a(here);
    let set = files(&archive.folder);
    afmid(here, &["run", &config("reconstruction.toml"), "--set", &set, "-o", "r.h5", "--cache", "cache"]);
    let force = shown(here, "r.h5", "reconstruction");
    let (load, rise) = (number(&force, "/load/mean"), number(&force, "/rise_time/mean"));
    println!("load {load:.4} V, rise time {rise:.2e} s, {}", force);
    // 330 nN at 3.8 N/m and 1e7 V/m: -0.87 V with 6 % of scatter over four events; a sudden release through poles of
    // 1.3 to 2.4 MHz
    assert!((load + 0.87).abs() < 0.15, "{load}");
    assert!(rise > 0.0 && rise < 4e-6, "{rise}");
    let thermal = shown(here, "r.h5", "thermal");
    let (f, q) = (number(&thermal, "/frequency/value"), number(&thermal, "/quality_factor/value"));
    let (f_std, q_std) = (number(&thermal, "/frequency/std"), number(&thermal, "/quality_factor/std"));
    println!("thermal f {f:.1} +- {f_std:.1} Hz, Q {q:.2} +- {q_std:.2}; lines {}", thermal["lines"]);
    assert!((f - archive.truth.frequency_hz[0]).abs() < 4.0 * f_std, "{f} +- {f_std}");
    assert!((q - archive.truth.quality_factor[0]).abs() < 4.0 * q_std, "{q} +- {q_std}");
    let frf = shown(here, "r.h5", "frf");
    println!("{frf}");
    // a linear lever: distortion in no more bins than chance makes, and five standard deviations
    let expected = number(&frf, "/distorted_bins_by_chance");
    assert!(number(&frf, "/distorted_bins") < expected + 5.0 * expected.sqrt() + 3.0, "{frf}");
    assert!(numbers(&frf["distorted_hz"]).len() < 50);
}
