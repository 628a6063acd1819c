//! `afmid docs`: the generated documentation, written or compared.

use std::fs;
use std::path::Path;

use afmid_pipeline::Registry;
use afmid_pipeline::error::StoreError;
use afmid_pipeline::files::{FilledFolder, read_regular};
use afmid_pipeline::reference::files;
use afmid_stages::causes::{catalogue, index, page};

use super::schema;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::shown;

/// Pages of the book that are written by hand: title and file.
const CHAPTERS: [(&str, &str); 13] = [
    ("The paper, figure by figure", "paper.md"),
    ("Diagnosis", "diagnosis.md"),
    ("Archives", "archives.md"),
    ("Models and mode shapes in other programs", "export.md"),
    ("Accuracy", "accuracy.md"),
    ("Performance", "performance.md"),
    ("Reliability", "reliability.md"),
    ("Conventions", "conventions.md"),
    ("Glossary", "glossary.md"),
    ("Architecture", "architecture.md"),
    ("Plugins", "plugins.md"),
    ("What a stage must do", "stage-spec.md"),
    ("Decisions", "decisions/README.md"),
];

/// The book's table of contents, in mdBook's form.
fn contents(registry: &Registry) -> String {
    let mut text = "# Contents\n\n- [Tutorials](tutorials/README.md)\n".to_owned();
    for (title, file) in TUTORIALS {
        text.push_str(&format!("  - [{title}](tutorials/{file})\n"));
    }
    for (title, file) in CHAPTERS {
        text.push_str(&format!("- [{title}]({file})\n"));
    }
    text.push_str("- [Results](results/README.md)\n");
    for (title, file) in RESULTS {
        text.push_str(&format!("  - [{title}](results/{file})\n"));
    }
    text.push_str("- [Stages](stages/README.md)\n");
    for entry in registry.entries() {
        text.push_str(&format!("  - [{0}](stages/{0}.md)\n", entry.spec.name));
    }
    text.push_str("- [Causes](causes/README.md)\n");
    for cause in catalogue() {
        text.push_str(&format!("  - [{0}](causes/{0}.md)\n", cause.about().id));
    }
    text
}

/// The tutorials, in reading order.
const TUTORIALS: [(&str, &str); 6] = [
    ("The paper in ten minutes", "paper.md"),
    ("My own recordings", "recordings.md"),
    ("A hammer's hit", "vibration.md"),
    ("Find what my model misses", "diagnosis.md"),
    ("From Python", "python.md"),
    ("My own stage", "stage.md"),
];

/// What was measured: accuracy, performance, diagnosis.
const RESULTS: [(&str, &str); 18] = [
    ("Modes from ringdowns", "ringdown.md"),
    ("Free decays in several channels", "decay.md"),
    ("Modes from frequency responses", "frf.md"),
    ("Models from a frequency response", "frequency-response.md"),
    ("The grey modal form", "grey.md"),
    ("Contact stiffness", "contact.md"),
    ("Measured input-output data", "daisy.md"),
    ("Simulated vibration records", "peers.md"),
    ("Spectra, responses, forces", "spectra.md"),
    ("Time per kernel, estimator and plugin call", "timings.md"),
    ("The main job", "main-job.md"),
    ("Time against the number of items", "scaling.md"),
    ("One free decay", "free-decay.md"),
    ("Exam of the diagnosis", "exam.md"),
    ("Diagnosis of releases", "releases.md"),
    ("Diagnosis of releases: method", "release-method.md"),
    ("Replay of diagnosed events", "replay.md"),
    ("Diagnosis of input and output", "input-output.md"),
];

/// The largest page that is compared.
const MOST_BYTES: u64 = 64 << 20;

/// Writes `FOLDER/stages/*.md`, `FOLDER/causes/*.md`, `FOLDER/SUMMARY.md` and `FOLDER/pipeline.schema.json`, or says
/// what would change. What was written is in the folder's list of files: nothing else is replaced. Pages of what is
/// gone are removed if they are as they were written.
pub fn run(folder: &Path, check: bool, registry: &Registry) -> Result<(), Failure> {
    update(folder, check, &wanted(registry)?)
}

fn update(folder: &Path, check: bool, wanted: &[(String, String)]) -> Result<(), Failure> {
    let filled = FilledFolder::open(folder).map_err(failed)?;
    let path = |name: &str| folder.join(name);
    let same = |name: &str, text: &str| read_regular(&path(name), MOST_BYTES).is_ok_and(|now| now == text.as_bytes());
    let changed: Vec<&(String, String)> = wanted.iter().filter(|(name, text)| !same(name, text)).collect();
    let stale = stale(&filled, wanted);
    if check {
        let names: Vec<String> =
            changed.iter().map(|(name, _)| name).chain(&stale).map(|name| path(name).display().to_string()).collect();
        if names.is_empty() {
            return Ok(());
        }
        let help = "write them with `cargo run -- docs`".to_owned();
        return Err(Failure::failed(format!("the generated documentation is old: {}", names.join(", ")), Some(help)));
    }
    // all of them first: nothing is written where one is another's
    changed.iter().try_for_each(|(name, _)| filled.require_own(name, nobody)).map_err(failed)?;
    for folder in FOLDERS.map(path) {
        fs::create_dir_all(&folder).map_err(|error| cannot("written", &folder, &error))?;
    }
    let mut done = String::new();
    for (name, text) in changed {
        filled.write(name, nobody, text.as_bytes()).map_err(failed)?;
        done.push_str(&format!("wrote {}\n", shown(&path(name))));
    }
    for path in stale.iter().map(|name| path(name)) {
        fs::remove_file(&path).map_err(|error| cannot("removed", &path, &error))?;
        done.push_str(&format!("removed {}\n", shown(&path)));
    }
    print(&done)
}

/// Folders that hold generated pages alone.
const FOLDERS: [&str; 2] = ["stages", "causes"];

/// All files by their names in the folder. Errors: a page cannot be made.
fn wanted(registry: &Registry) -> Result<Vec<(String, String)>, Failure> {
    let pages = files(registry).map_err(|error| Failure::failed(error, None))?;
    let mut wanted: Vec<(String, String)> =
        pages.into_iter().map(|(name, text)| (format!("stages/{name}"), text)).collect();
    let all = catalogue();
    wanted.push(("causes/README.md".to_owned(), index(&all)));
    wanted.extend(all.iter().map(|cause| (format!("causes/{}.md", cause.about().id), page(*cause))));
    wanted.push(("SUMMARY.md".to_owned(), contents(registry)));
    wanted.push(("pipeline.schema.json".to_owned(), schema::text(registry)?));
    Ok(wanted)
}

/// Every version that wrote pages lists them.
fn nobody(_: &Path) -> bool {
    false
}

fn failed(error: StoreError) -> Failure {
    Failure::failed(&error, error.help.clone())
}

fn cannot(what: &str, path: &Path, error: &std::io::Error) -> Failure {
    Failure::failed(format!("{} cannot be {what}: {error}", path.display()), None)
}

/// Pages that no stage or cause has any more, and that are as they were written here.
fn stale(filled: &FilledFolder, wanted: &[(String, String)]) -> Vec<String> {
    let mut stale = Vec::new();
    for inner in FOLDERS {
        let entries = fs::read_dir(filled.folder().join(inner)).into_iter().flatten().flatten();
        // an empty file is nobody's, as far as the list goes
        let full =
            entries.filter(|entry| entry.metadata().is_ok_and(|metadata| metadata.is_file() && metadata.len() > 0));
        let names = full.filter_map(|entry| Some(format!("{inner}/{}", entry.file_name().to_str()?)));
        let gone = names.filter(|name| wanted.iter().all(|(wanted, _)| wanted != name));
        stale.extend(gone.filter(|name| filled.require_own(name, nobody).is_ok()));
    }
    stale.sort();
    stale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_of_others_are_neither_replaced_nor_removed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let wanted = ["stages/a.md", "causes/b.md", "SUMMARY.md"].map(|name| (name.to_owned(), format!("page {name}")));
        let update = |check: bool| update(folder.path(), check, &wanted);
        update(false).unwrap();
        assert!(update(true).is_ok());
        let filled = FilledFolder::open(folder.path()).unwrap();
        filled.write("stages/gone.md", nobody, b"a page of a stage that is gone").unwrap();
        filled.write("stages/a.md", nobody, b"of an earlier version").unwrap();
        fs::write(at("stages/mine.md"), "mine").unwrap();
        fs::write(at("causes/empty.md"), "").unwrap();
        assert!(update(true).is_err());
        update(false).unwrap();
        assert!(!at("stages/gone.md").exists() && at("stages/mine.md").exists() && at("causes/empty.md").exists());
        assert_eq!(fs::read_to_string(at("stages/a.md")).unwrap(), "page stages/a.md");
        fs::write(at("SUMMARY.md"), "mine").unwrap();
        fs::remove_file(at("causes/b.md")).unwrap();
        let (text, _) = update(false).unwrap_err().text_and_code();
        assert!(text.contains("SUMMARY.md") && text.contains("not replaced"), "{text}");
        assert_eq!(fs::read(at("SUMMARY.md")).unwrap(), b"mine");
        assert!(!at("causes/b.md").exists(), "nothing is written where one file is another's");
    }
}
