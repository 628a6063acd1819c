//! The main job on an archive of an independent simulator: free lever and surface-coupled lever against the truth.

use crate::common::{afmid, config, files, lever_a, number, shown};

#[test]
fn the_free_lever_comes_out_of_ordinary_force_curves() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = lever_a(here);
    afmid(
        here,
        &["run", &config("free-lever.toml"), "--set", &files(&archive.folder), "-o", "a.h5", "--cache", "cache"],
    );

    let events = shown(here, "a.h5", "events");
    assert_eq!(events["events"]["found"], archive.truth.snap_offs);
    assert_eq!(events["events"]["rejected"].as_array().map(Vec::len), Some(0));

    let modes = shown(here, "a.h5", "modes");
    assert_eq!(modes["modes"].as_array().map(Vec::len), Some(archive.truth.frequency_hz.len()));
    for (n, (f, q)) in archive.truth.frequency_hz.iter().zip(&archive.truth.quality_factor).enumerate() {
        for (name, std, truth) in [("frequency_hz", "frequency_std_hz", f), ("quality_factor", "quality_factor_std", q)]
        {
            let (found, std) =
                (number(&modes, &format!("/modes/{n}/{name}")), number(&modes, &format!("/modes/{n}/{std}")));
            // 4 of its own standard errors: one of the eight numbers misses by chance once in 2000 archives
            assert!((found - truth).abs() < 4.0 * std, "mode {}: {name} {found} +- {std}, truth {truth}", n + 1);
            // and the errors mean something: f within 100 ppm, Q within 6 % even of the weakest mode
            assert!(std < truth * if name == "frequency_hz" { 1e-4 } else { 0.06 }, "mode {}: {name} +- {std}", n + 1);
        }
    }
    let (held_out, ceiling) = (number(&modes, "/fit_percent/held_out"), number(&modes, "/fit_percent/noise_ceiling"));
    // the figure: within 0.1 percentage points of what the noise allows
    assert!(held_out > ceiling - 0.1, "held out {held_out} %, ceiling {ceiling} %");
    assert!(held_out < ceiling + 0.1, "held out {held_out} %, ceiling {ceiling} %: better than the noise allows");
}

#[test]
fn the_grey_form_gives_modes_gains_and_delay_of_the_free_lever() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = lever_a(here);
    afmid(
        here,
        &["run", &config("grey-lever.toml"), "--set", &files(&archive.folder), "-o", "g.h5", "--cache", "cache"],
    );

    let grey = shown(here, "g.h5", "model");
    assert_eq!(grey["converged"], true);
    for (n, (f, q)) in archive.truth.frequency_hz.iter().zip(&archive.truth.quality_factor).enumerate() {
        for (name, std, truth) in [("frequency_hz", "frequency_std_hz", f), ("quality_factor", "quality_factor_std", q)]
        {
            let (found, std) =
                (number(&grey, &format!("/modes/{n}/{name}")), number(&grey, &format!("/modes/{n}/{std}")));
            // 4 of its own standard errors, which follow the residual's spectrum: one real pole and a delay stand for
            // three poles
            assert!((found - truth).abs() < 4.0 * std, "mode {}: {name} {found} +- {std}, truth {truth}", n + 1);
        }
    }
    let gain = number(&grey, "/static_gain/value");
    // the force is given as the static deflection that it causes
    assert!((gain - 1.0).abs() < 1e-3, "{gain}");
    // the same poles through the state-space model
    let modes = shown(here, "g.h5", "modes");
    let (ours, theirs) = (number(&grey, "/modes/0/frequency_hz"), number(&modes, "/modes/0/frequency_hz"));
    assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
}

#[test]
fn the_coupled_lever_keeps_the_zeros_and_moves_the_resonances_up() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = lever_a(here);
    afmid(
        here,
        &["run", &config("coupled-lever.toml"), "--set", &files(&archive.folder), "-o", "c.h5", "--cache", "cache"],
    );

    assert_eq!(shown(here, "c.h5", "events")["events"]["found"], archive.truth.snap_ins);
    let comparison = shown(here, "c.h5", "zeros");
    let zeros = comparison["zeros"].as_array().expect("zeros");
    assert!(zeros.len() >= 2, "{comparison}");
    for (n, zero) in zeros.iter().enumerate() {
        let distance = number(zero, "/combined_errors");
        // 3 combined standard errors
        assert!(distance.abs() < 3.0, "zero {}: {distance} combined standard errors in {zero}", n + 1);
        assert!(number(zero, "/coupled_std_hz") > 0.0 && number(zero, "/free_std_hz") > 0.0);
    }
    // the second zero (near 470 kHz on lever-a) within 1 %
    assert!(number(&comparison, "/zeros/1/relative_difference").abs() < 0.01, "{comparison}");
    for shift in comparison["pole_shifts"].as_array().expect("pole shifts") {
        assert!(number(shift, "/shift_hz") > 0.0, "contact stiffens: {shift}");
    }
    let contact = shown(here, "c.h5", "contact");
    let (found, std) =
        (number(&contact, "/contact_stiffness_n_per_m"), number(&contact, "/contact_stiffness_std_n_per_m"));
    let truth = archive.truth.contact_stiffness_n_per_m;
    // 3.5 standard errors, and these within a per cent: 24 events
    assert!((found - truth).abs() < 3.5 * std && std < 0.01 * truth, "{found} +- {std}, {truth}: {contact}");
    assert!(number(&contact, "/p_value") > 1e-3, "poles and residues agree: {contact}");
}
