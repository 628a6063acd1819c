//! A folder with a stage of one's own: the examples of this repository under another name, so that what it begins with
//! is compiled and run by the tests.

use std::path::Path;

/// A file of the folder: its path there, and its text.
pub type File = (String, String);

/// The examples' name, in a file and as a type.
const NAME: [&str; 2] = ["new_stage", "NewStage"];

/// A plugin: the script, the module that speaks the protocol, a config.
pub fn python(name: &str) -> Vec<File> {
    let script = renamed(include_str!("../../examples/plugins/new_stage.py"), name);
    // the module lies beside it
    let beside = |line: &&str| {
        !line.starts_with("sys.path.insert") && !matches!(*line, "import sys" | "from pathlib import Path")
    };
    let script: String = script.lines().filter(beside).map(|line| format!("{line}\n")).collect();
    let config = renamed(include_str!("../../examples/new_stage.toml"), name)
        .replace(
            "\n[[stage]]\nid = \"archive\"",
            &format!("\n[plugins]\n{name} = \"python3 {name}.py\"\n\n[[stage]]\nid = \"archive\""),
        )
        .replace(&format!("custom.{name}"), &format!("exec:{name}"));
    vec![
        (format!("{name}.py"), script.replace("\n\n\nimport numpy", "\nimport numpy")),
        ("afmid_stage.py".to_owned(), include_str!("../../python/afmid_stage/afmid_stage.py").to_owned()),
        (format!("{name}.toml"), config),
    ]
}

/// A crate: its manifest, the stage with its test and a main of ten lines, a config. `sources`: the clone that it
/// depends on, as the manifest says it.
pub fn rust(name: &str, sources: &Path) -> Vec<File> {
    let program = renamed(include_str!("../../examples/new_stage.rs"), name);
    let config = renamed(include_str!("../../examples/new_stage.toml"), name);
    vec![
        ("Cargo.toml".to_owned(), manifest(name, sources, &DEPENDENCIES, &OTHERS)),
        ("src/main.rs".to_owned(), program),
        (format!("{name}.toml"), config),
    ]
}

/// Crates of the clone that a stage depends on: what for, name, folder.
const DEPENDENCIES: [(&str, &str, &str); 2] =
    [("the command line and the built-in stages", "afmid", ""), ("what a stage is", "afmid-pipeline", "pipeline")];

/// The others, line by line.
const OTHERS: [&str; 4] = [
    "# parameters and documents",
    "schemars = \"1.2\"",
    "serde = { version = \"1\", features = [\"derive\"] }",
    "serde_json = \"1\"",
];

/// The manifest of a crate that depends on crates of a clone (what for, name, folder) and on others.
pub(super) fn manifest(name: &str, sources: &Path, own: &[(&str, &str, &str)], others: &[&str]) -> String {
    let path = |folder: &str| format!("{:?}", sources.join(folder).display().to_string().trim_end_matches('/'));
    let own = own.iter().map(|(what, name, folder)| format!("# {what}\n{name} = {{ path = {} }}\n", path(folder)));
    let others = others.iter().map(|line| format!("{line}\n"));
    let dependencies: String = own.chain(others).collect();
    format!(
        "[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\n{dependencies}"
    )
}

fn renamed(text: &str, name: &str) -> String {
    let [file, type_name] = NAME;
    text.replace(file, name).replace(type_name, &type_of(name))
}

/// `my_stage` as a type: `MyStage`.
pub(super) fn type_of(name: &str) -> String {
    let word =
        |word: &str| word.chars().take(1).flat_map(char::to_uppercase).chain(word.chars().skip(1)).collect::<String>();
    name.split('_').map(word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text<'a>(files: &'a [File], name: &str) -> &'a str {
        files.iter().find(|(file, _)| file == name).map(|(_, text)| text.as_str()).expect("the file")
    }

    #[test]
    fn nothing_of_the_examples_name_is_left() {
        for files in [python("end_noise"), rust("end_noise", Path::new("../afmid"))] {
            for (file, text) in files {
                assert!(!text.contains("new_stage") && !text.contains("NewStage"), "{file}");
            }
        }
        let files = rust("end_noise", Path::new("../afmid"));
        assert!(text(&files, "src/main.rs").contains("struct EndNoise"));
        assert!(text(&files, "Cargo.toml").contains("afmid-pipeline = { path = \"../afmid/pipeline\" }"));
        let files = python("end_noise");
        assert!(!text(&files, "end_noise.py").contains("sys.path"), "the module lies beside it");
        assert!(text(&files, "end_noise.toml").contains("end_noise = \"python3 end_noise.py\""));
        assert!(text(&files, "end_noise.toml").contains("uses = \"exec:end_noise\""));
    }
}
