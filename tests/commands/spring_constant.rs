//! A spring constant from force curves: what no file says is asked for, and stands in the config.

use crate::common::{afmid, command, number, shown, simulated};

#[test]
fn a_spring_constant_asks_for_travel_and_contact_and_its_error_holds() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    simulated(here, "archive", 8, 3);
    let new = ["new", "pipeline", "archive", "--goal", "spring-constant"];
    let refused = |arguments: &[&str]| {
        let output = command(here, arguments).output().expect("afmid starts");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let asked = refused(&new);
    assert!(asked.contains("--piezo M_PER_V") && asked.contains("--contact N_PER_M"), "{asked}");
    let asked = refused(&[&new[..], &["--piezo", "25e-9"]].concat());
    assert!(!asked.contains("--piezo") && asked.contains("--contact N_PER_M"), "{asked}");
    let stray = refused(&["new", "pipeline", "archive", "--contact", "60"]);
    assert!(stray.contains("wanted --goal spring-constant"), "{stray}");
    let no_mode = refused(&["modes", "archive", "--goal", "spring-constant"]);
    assert!(no_mode.contains("is no mode"), "{no_mode}");
    let negative = refused(&[&new[..], &["--piezo", "-25e-9", "--contact", "60"]].concat());
    assert!(negative.contains("wanted a number above 0"), "{negative}");
    let of = |contact: &str| {
        let (config, result) = (format!("{contact}.toml"), format!("{contact}.h5"));
        afmid(here, &[&new[..], &["--piezo", "25e-9", "--contact", contact, "-o", &config]].concat());
        afmid(here, &["run", &config, "-o", &result, "--cache", "cache"]);
        let summary = shown(here, &result, "stiffness");
        let stiffness = |which: &str| number(&summary, &format!("/stiffness_n_per_m/{which}"));
        (stiffness("value"), stiffness("std"))
    };
    let (k, std) = of("60");
    // the simulated lever; its shape's factor is 0.83, the uniform beam's 0.8175 has an error of 0.01 for that
    assert!((k - 3.8).abs() < 3.0 * std && std < 0.1 * k, "{k} +- {std}");
    let (rigid, _) = of("rigid");
    // a contact that is much stiffer is as good as rigid, to rounding of the config's numbers
    let (stiff, stiff_std) = of("1e12");
    assert!((stiff / rigid - 1.0).abs() < 1e-9 && stiff_std > 0.0, "{stiff} +- {stiff_std}, {rigid}");
    // what gives way under the lever takes (60 / 63.8)^2
    assert!((rigid / k - 0.884).abs() < 0.01, "{rigid} of {k}");
}
