//! The floors of every crate: a folder uses only those below it.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use super::common::ROOT;
use super::paths::{arrows, sources, without_tests};

/// A crate and its folders, from the ground up. What stands in one row may not know of each other.
struct Crate {
    name: &'static str,
    src: &'static str,
    floors: &'static [&'static [&'static str]],
}

const CRATES: [Crate; 5] = [
    Crate {
        name: "afmid-formats",
        src: "pipeline/formats/src",
        floors: &[
            &["facts"],
            &["budget", "calendar", "fail", "frequency", "guess", "half", "lanes", "printed", "regular", "straight"],
            &["number", "text"],
            &["time_units"],
            &["rate"],
            &["evenness"],
            &["pinned"],
            &["fields", "inflating", "opened", "raw"],
            &["packed"],
            &["grid"],
            &["together"],
            &["archive", "axes", "joined", "measurement", "responses"],
            &["columnar", "labels", "resample"],
            &["listing"],
            &["readers"],
        ],
    },
    Crate {
        name: "afmid-pipeline",
        src: "pipeline/src",
        floors: &[
            &["error", "own_command"],
            &["files"],
            &["hdf5_files", "rows"],
            &["recording"],
            &["artifact"],
            &["outcome"],
            &["stage"],
            &["config"],
            &["reference", "store"],
            &["cache", "conformance"],
            &["graph"],
            &["plugin"],
            &["runner"],
        ],
    },
    Crate {
        name: "afmid-kernels",
        src: "stages/kernels/src",
        floors: &[
            &["fixture", "draws", "linear_algebra", "signal", "statistics", "effects", "monitor"],
            &["optimise"],
            &["events"],
            &["calibration", "causes", "force", "harmonics", "model", "simulate"],
            &["spectra", "modes", "ringdown", "subspace", "vector_fitting", "phase_sign"],
            &["contact", "pem"],
            &["block_oriented", "grey", "stabilisation", "validation"],
            &["diagnosis", "frf_modes"],
        ],
    },
    Crate {
        name: "afmid-stages",
        src: "stages/src",
        floors: &[
            &["artifacts", "watched"],
            &["io", "causes"],
            &["at_hand", "events", "simulate"],
            &["ensemble", "calibration"],
            &["force", "spectrum"],
            &["model"],
            &["diagnosis"],
            &["exam"],
        ],
    },
    Crate {
        name: "afmid",
        src: "src",
        floors: &[
            &["address_space", "determined", "printable", "relative", "export"],
            &["failure", "diagnostic"],
            &["output"],
            &["interrupt", "show"],
            &["provenance", "inspect", "doctor"],
            &["batch"],
            &["cli", "progress", "sweep", "report"],
            &["scaffold"],
            &["commands"],
        ],
    },
];

fn floor_of(own: &Crate, folder: &str) -> Option<usize> {
    own.floors.iter().position(|floor| floor.contains(&folder))
}

#[test]
fn no_folder_names_one_that_lies_beside_or_above_it() {
    let mut wrong = String::new();
    for own in &CRATES {
        for ((from, to), places) in arrows(&Path::new(ROOT).join(own.src)) {
            let listed = places.iter().take(4).cloned().collect::<Vec<_>>().join("; ");
            match (floor_of(own, &from), floor_of(own, &to)) {
                (Some(a), Some(b)) if a > b => {}
                (Some(_), Some(_)) => {
                    let _ = writeln!(wrong, "{}: {from} uses {to}, which does not lie below it: {listed}", own.name);
                }
                (None, _) => {
                    let _ = writeln!(wrong, "{}: the folder {from} has no floor in this test", own.name);
                }
                (_, None) => {
                    let _ = writeln!(wrong, "{}: the folder {to} has no floor in this test", own.name);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

/// Readers of files stand in one folder, each by itself.
#[test]
fn no_reader_of_a_format_names_another() {
    let found = arrows(&Path::new(ROOT).join("pipeline/formats/src/readers"));
    let wrong: Vec<String> = found
        .iter()
        .flat_map(|((from, to), places)| {
            // the front door of the readers is found by its path from the crate
            let named = places.iter().filter(move |_| to != "mod");
            named.map(move |place| format!("{from} uses {to}: {place}"))
        })
        .collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    for file in sources(&Path::new(ROOT).join("pipeline/formats/src/readers")) {
        let code = without_tests(&fs::read_to_string(&file).expect("a source file"));
        assert!(!code.contains("crate::readers"), "{} names a reader", file.display());
    }
}

#[test]
fn every_folder_has_a_floor_and_every_floor_is_there() {
    for own in &CRATES {
        let entries = fs::read_dir(Path::new(ROOT).join(own.src)).expect("a crate");
        let there: BTreeSet<String> = entries
            .filter_map(|entry| {
                let path = entry.ok()?.path();
                let name = path.file_stem()?.to_string_lossy().into_owned();
                let code = path.is_dir() || path.extension().is_some_and(|extension| extension == "rs");
                (code && !matches!(name.as_str(), "lib" | "main") && !name.ends_with("tests")).then_some(name)
            })
            .collect();
        let listed: BTreeSet<String> =
            own.floors.iter().flat_map(|floor| floor.iter()).map(|&name| name.to_owned()).collect();
        assert_eq!(there, listed, "{}", own.name);
    }
}

#[test]
fn docs_architecture_shows_these_floors() {
    let mut drawn = String::new();
    for own in CRATES.iter().rev() {
        let _ = writeln!(drawn, "{} ({}/)", own.name, own.src);
        for floor in own.floors.iter().rev() {
            let _ = writeln!(drawn, "    {}", floor.join("  "));
        }
        drawn.push('\n');
    }
    let drawn = format!("```text\n{}\n```", drawn.trim_end());
    let path = Path::new(ROOT).join("docs/architecture.md");
    let page = fs::read_to_string(&path).expect("docs/architecture.md");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        let (head, rest) = page.split_once("<!-- floors -->\n").expect("a place for the floors");
        let (_, tail) = rest.split_once("\n<!-- end of floors -->").expect("its end");
        fs::write(&path, format!("{head}<!-- floors -->\n{drawn}\n<!-- end of floors -->{tail}")).expect("written");
        return;
    }
    assert!(page.contains(&drawn), "docs/architecture.md differs; UPDATE_EXPECTED=1 writes it:\n{drawn}");
}
