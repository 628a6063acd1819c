//! The tutorials' commands run as they stand there, in the order of `docs/tutorials/README.md`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{ROOT, path_with, python_bin};

/// The files that the tutorials' first page refers to, in its order.
fn pages() -> Vec<PathBuf> {
    let folder = Path::new(ROOT).join("docs/tutorials");
    let index = std::fs::read_to_string(folder.join("README.md")).expect("the first page");
    let links = index.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    links.filter(|link| link.ends_with(".md")).map(|link| folder.join(link)).collect()
}

/// The lines of all blocks of shell commands.
fn commands(text: &str) -> Vec<String> {
    let mut inside = false;
    let mut commands = Vec::new();
    for line in text.lines() {
        match line {
            "```sh" => inside = true,
            "```" => inside = false,
            line if inside && !line.trim().is_empty() => commands.push(line.to_owned()),
            _ => {}
        }
    }
    commands
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        std::fs::copy(&path, to.join(path.file_name().expect("a name"))).expect("a copy");
    }
}

#[test]
fn every_command_of_the_tutorials_runs() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    copy(&Path::new(ROOT).join("configs"), &here.join("configs"));
    let program = Path::new(env!("CARGO_BIN_EXE_afmid")).parent().expect("a folder");
    // the python3 of `make test-deps` comes first
    let path = path_with(&[program.to_owned(), python_bin()]);
    let mut count = 0;
    for page in pages() {
        for line in commands(&std::fs::read_to_string(&page).expect("a tutorial")) {
            let mut shell = Command::new("sh");
            shell.current_dir(here).args(["-c", &line]).env("PATH", &path).env("AFMID_CACHE", here.join("cache"));
            shell.env("AFMID_TRUST", here.join("trust"));
            let output = shell.output().expect("sh starts");
            assert!(output.status.success(), "{}: {line}\n{}", page.display(), String::from_utf8_lossy(&output.stderr));
            let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
            assert_promised(&line, &stdout);
            count += 1;
        }
    }
    assert!(count >= 20, "{count} commands");
}

/// What the text promises of a command's output.
fn assert_promised(line: &str, stdout: &str) {
    let promised = match line {
        "afmid show results/diagnosis.h5 diagnosis --json" => ["\"named\"", "quadratic-detector"],
        "afmid show results/without.h5 diagnosis" => ["unexplained", "nearest"],
        "afmid show results/paper.h5 modes" | "afmid show results/mine.h5 modes" => ["frequency_hz", "static_share"],
        "afmid show results/hit.h5 modes" => ["damping_ratio", "shapes"],
        "afmid show results/end-noise.h5 end_noise" => ["rms", "samples"],
        _ => return,
    };
    for word in promised {
        assert!(stdout.contains(word), "{line}: no {word} in\n{stdout}");
    }
}
