//! What is left of a run that failed: the stages that went through, and the words that say what is missing.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn afmid(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_afmid")).current_dir(folder).args(arguments).output().expect("afmid starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Reads a table and fits it, with more block rows than the record has samples where `broken`.
fn config(broken: bool) -> String {
    let block_rows = if broken { 300 } else { 20 };
    format!(
        "[pipeline]\nname = \"a\"\nseed = 1\n[[stage]]\nid = \"data\"\nuses = \"io.columns\"\n\
         params = {{ file = \"data.csv\", sample_rate_hz = 100.0 }}\n\
         [[stage]]\nid = \"model\"\nuses = \"model.pem\"\ninputs = {{ pair = \"data.pair\" }}\n\
         params = {{ order = 2, block_rows = {block_rows}, set = \"identification\" }}\n\
         [[stage]]\nid = \"modes\"\nuses = \"model.modes\"\ninputs = {{ model = \"model.model\" }}\n"
    )
}

#[test]
fn what_succeeded_is_kept_beside_the_output_which_is_not_touched() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let mut y = [0.0_f64; 2];
    let rows: String = (0..600_u32)
        .map(|k| {
            let u = f64::from((k * 7919 + 13) % 31) / 31.0 - 0.5;
            y = [1.6 * y[0] - 0.8 * y[1] + u, y[0]];
            format!("{u},{}\n", y[0])
        })
        .collect();
    fs::write(path("data.csv"), format!("u,y\n{rows}")).expect("data");
    fs::write(path("whole.toml"), config(false)).expect("a config");
    fs::write(path("broken.toml"), config(true)).expect("a config");
    let run = |name: &str| afmid(folder.path(), &["run", name, "-o", "out.h5", "--cache", "cache"]);
    let whole = run("whole.toml");
    assert_eq!(whole.status.code(), Some(0), "{}", text(&whole.stderr));
    let before = fs::read(path("out.h5")).expect("a result");
    let broken = run("broken.toml");
    assert_eq!(broken.status.code(), Some(1));
    assert!(text(&broken.stderr).contains("afmid show out.failed.h5"), "{}", text(&broken.stderr));
    assert!(fs::read(path("out.h5")).expect("a result") == before);
    let shown = text(&afmid(folder.path(), &["show", "out.failed.h5"]).stdout);
    assert!(
        shown.contains("data") && shown.contains("incomplete") && shown.contains("modes (model.modes) was not run")
    );
    let json = afmid(folder.path(), &["show", "out.failed.h5", "--json"]).stdout;
    let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    assert_eq!((json["complete"].as_bool(), json["unfinished"][0]["id"].as_str()), (Some(false), Some("model")));
    assert_eq!(json["unfinished"][1]["reason"], serde_json::Value::Null);
    let data = afmid(folder.path(), &["show", "out.failed.h5", "data", "--json"]);
    assert_eq!(data.status.code(), Some(0), "{}", text(&data.stderr));
    let missing = afmid(folder.path(), &["show", "out.failed.h5", "model"]);
    assert!(missing.status.code() == Some(2) && text(&missing.stderr).contains("incomplete"));
    assert_eq!(afmid(folder.path(), &["report", "out.failed.h5", "-o", "a.html"]).status.code(), Some(0));
    assert!(fs::read_to_string(path("a.html")).expect("a page").contains("Incomplete: the run failed"));
    // a run that goes through leaves nothing that says otherwise
    assert_eq!(run("whole.toml").status.code(), Some(0));
    assert!(!path("out.failed.h5").exists());
    // what is somebody else's stays
    fs::write(path("out.failed.h5"), "mine").expect("a file");
    let again = run("broken.toml");
    assert!(text(&again.stderr).contains("are not kept"), "{}", text(&again.stderr));
    assert_eq!(fs::read_to_string(path("out.failed.h5")).expect("the file"), "mine");
}
