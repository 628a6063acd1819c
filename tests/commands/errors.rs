//! Every error as people see it: `tests/errors/NAME.toml` is a command with its files, `NAME.txt` what it says
//! (`UPDATE_EXPECTED=1` writes these again: read them).

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::sets::write_record;
use serde::Deserialize;

/// A command that goes wrong, and what lies in its folder.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// The arguments.
    command: Vec<String>,
    /// Commands that go well before it.
    #[serde(default)]
    before: Vec<Vec<String>>,
    /// Records.
    #[serde(default)]
    whole: Vec<String>,
    /// Records of which the second half is lost.
    #[serde(default)]
    half: Vec<String>,
    /// The first half of another file, taken after `before`.
    #[serde(default)]
    halve: BTreeMap<String, String>,
    /// Texts.
    #[serde(default)]
    files: BTreeMap<String, String>,
}

impl Case {
    fn prepare(&self, here: &Path) {
        let place = |name: &str| {
            let path = here.join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            path
        };
        self.files.iter().for_each(|(name, text)| std::fs::write(place(name), text).expect("a file"));
        self.whole.iter().for_each(|name| write_record(&place(name), 0, 3000));
        for name in &self.half {
            write_record(&place(name), 0, 3000);
            keep_half(&place(name), &place(name));
        }
        for command in &self.before {
            let output = afmid(here, command);
            assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
        }
        self.halve.iter().for_each(|(name, of)| keep_half(&place(of), &place(name)));
    }

    /// Exit code and stderr, the folder's name left out.
    fn run(&self) -> (String, Output) {
        let scratch = tempfile::tempdir().expect("a folder");
        // the folder's name as the system gives it: links followed
        let here = scratch.path().canonicalize().expect("a folder");
        self.prepare(&here);
        let output = afmid(&here, &self.command);
        let stderr =
            without_times(&String::from_utf8_lossy(&output.stderr).replace(&here.display().to_string(), "HERE"));
        let code = output.status.code().expect("it ended by itself");
        (format!("$ afmid {}\nexit code {code}\n{stderr}", self.command.join(" ")), output)
    }
}

/// Seconds such as `0.02 s` at the end of a line are another number every time.
fn without_times(text: &str) -> String {
    let line = |line: &str| match line.strip_suffix(" s").map(|rest| rest.rsplit_once(' ')) {
        Some(Some((rest, number))) if number.parse::<f64>().is_ok() => format!("{rest} SECONDS s\n"),
        _ => format!("{line}\n"),
    };
    text.lines().map(line).collect()
}

fn keep_half(from: &Path, to: &Path) {
    let bytes = std::fs::read(from).expect("a file");
    std::fs::write(to, &bytes[..bytes.len() / 2]).expect("a file cut short");
}

fn afmid(here: &Path, arguments: &[String]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
    command.current_dir(here).args(arguments).env_remove("AFMID_CACHE").env_remove("AFMID_DATA");
    command.output().expect("afmid starts")
}

#[test]
fn every_error_reads_as_expected() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/errors");
    let entries = std::fs::read_dir(&folder).expect("the folder");
    let mut cases: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    cases.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    cases.sort();
    assert!(cases.len() >= 40, "{} cases", cases.len());
    let mut wrong = Vec::new();
    for path in cases {
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).expect("a case");
        let case: Case = afmid_pipeline::toml::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let (report, output) = case.run();
        if output.status.success() || output.stderr.is_empty() || report.contains("panicked") {
            wrong.push(format!("{name} is no error:\n{report}"));
        }
        let expected = path.with_extension("txt");
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            std::fs::write(&expected, &report).expect("the expected text");
        }
        if std::fs::read_to_string(&expected).unwrap_or_default() != report {
            wrong.push(format!("{name} gives:\n{report}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
