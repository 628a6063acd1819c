//! A config that `afmid new pipeline` writes reads the recordings that it was made for, wherever it lies.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use afmid_pipeline::toml::Value;

use super::common::{afmid, shown};
use super::small::record;

/// The first pattern of the config's stage `records`.
fn pattern(config: &Path) -> String {
    let text = fs::read_to_string(config).expect("the config");
    let value: Value = afmid_pipeline::toml::from_str(&text).expect("TOML");
    let stages = value["stage"].as_array().expect("stages");
    let records = stages.iter().find(|stage| stage["uses"].as_str() == Some("io.records")).expect("records");
    records["params"]["files"][0].as_str().expect("a pattern").to_owned()
}

#[test]
fn a_config_in_any_folder_finds_the_recordings_that_it_was_made_for() {
    let scratch = tempfile::tempdir().expect("a folder");
    let top = scratch.path();
    let here = top.join("above/lab");
    for folder in ["above/lab/archive", "above/lab/sub", "above/lab/od[d]", "far/deep", "above/archive", "archive"] {
        fs::create_dir_all(top.join(folder)).expect("a folder");
    }
    for (folder, seed) in [("archive", 1), ("od[d]", 2)] {
        record(&here.join(folder).join("r.h5"), 3000, seed);
    }
    // others, where paths that are wrong lead
    record(&top.join("above/archive/r.h5"), 4000, 3);
    record(&top.join("archive/r.h5"), 5000, 4);
    symlink("../../far/deep", here.join("link")).expect("a link");
    symlink("archive", here.join("same")).expect("a link");
    let absolute = here.join("link/absolute.toml").display().to_string();
    let places = ["x.toml", "./y.toml", "../x.toml", "../../x.toml", "sub/x.toml", "link/x.toml", "link/../y.toml"];
    for place in places.into_iter().chain([absolute.as_str()]) {
        for (number, folder) in
            ["archive", "./archive", "../lab/archive", "same", "od[d]", "archive/r.h5"].iter().enumerate()
        {
            let config = place.replace(".toml", &format!("{number}.toml"));
            afmid(&here, &["new", "pipeline", folder, "--goal", "decay", "-o", &config]);
            let written = here.join(&config);
            let base = written.parent().and_then(|folder| folder.canonicalize().ok()).expect("its folder");
            let wanted = pattern(&written);
            // a run from another folder, of the reader alone
            let text = format!(
                "[pipeline]\nname = \"a\"\n\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
                 params = {{ files = ['{wanted}'] }}\n\n\
                 [[stage]]\nid = \"census\"\nuses = \"io.census\"\ninputs = {{ records = \"records\" }}\n"
            );
            fs::write(base.join("reads.toml"), text).expect("a config");
            let reads = written.with_file_name("reads.toml").display().to_string();
            afmid(top, &["run", &reads, "-o", "out.h5", "--cache", "cache"]);
            let samples = shown(top, "out.h5", "records.summary")["samples"].clone();
            let shown = samples.to_string();
            assert!(shown.contains("3000"), "{folder} for {config}: `{wanted}` leads to records of {shown}");
        }
    }
    assert_eq!(pattern(&here.join("x0.toml")), "archive/*.h5");
    assert_eq!(pattern(&here.join("../x0.toml")), "lab/archive/*.h5");
    assert_eq!(pattern(&here.join("link/x0.toml")), "../../above/lab/archive/*.h5");
}
