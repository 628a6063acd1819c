//! A folder with a cause of one's own: the examples of this repository under another name.

use std::path::Path;

use super::stage::{File, manifest, type_of};

/// A script with a cause, and a test of it.
pub fn python(name: &str) -> Vec<File> {
    let script = include_str!("../../examples/new_cause.py").replace("new_cause", name);
    vec![(format!("{name}.py"), script)]
}

/// A crate: its manifest, the cause with a main of ten lines, a config that hides and finds it. `sources`: the clone that
/// it depends on.
pub fn rust(name: &str, sources: &Path) -> Vec<File> {
    let renamed = |text: &str| {
        text.replace("cargo run --example custom_cause --", "cargo run --")
            .replace("examples/custom_cause.toml", &format!("{name}.toml"))
            .replace("UnequalSegments", &type_of(name))
            .replace("unequal-segments", &name.replace('_', "-"))
            .replace("custom-cause", name)
            .replace("\"../archive/", "\"archive/")
    };
    let dependencies = [("the command line", "afmid", ""), ("what a cause is", "afmid-stages", "stages")];
    vec![
        ("Cargo.toml".to_owned(), manifest(name, sources, &dependencies, &[])),
        ("src/main.rs".to_owned(), renamed(include_str!("../../examples/custom_cause.rs"))),
        (format!("{name}.toml"), renamed(include_str!("../../examples/custom_cause.toml"))),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_the_examples_name_is_left() {
        let old = ["new_cause", "unequal-segments", "UnequalSegments", "custom_cause", "custom-cause", "--example"];
        for files in [python("end_stop"), rust("end_stop", Path::new("../afmid"))] {
            for (file, text) in files {
                assert!(old.iter().all(|old| !text.contains(old)), "{file}: {text}");
                assert!(text.contains("end_stop") || text.contains("end-stop"), "{file}");
            }
        }
        let files = rust("end_stop", Path::new("../afmid"));
        assert!(files[0].1.contains("afmid-stages = { path = \"../afmid/stages\" }"), "{}", files[0].1);
        assert!(files[1].1.contains("struct EndStop") && files[1].1.contains("id: \"end-stop\""), "{}", files[1].1);
    }
}
