//! `afmid docs`: the generated documentation, written or compared.

use std::fs;
use std::path::{Path, PathBuf};

use afmid_pipeline::Registry;
use afmid_pipeline::reference::files;
use afmid_stages::causes::{catalogue, index, page};

use super::schema;
use crate::failure::Failure;
use crate::output::print;

/// Pages of the book that are written by hand: title and file.
const CHAPTERS: [(&str, &str); 13] = [
    ("The paper, figure by figure", "paper.md"),
    ("Diagnosis", "diagnosis.md"),
    ("Archives", "archives.md"),
    ("Models for other programs", "export.md"),
    ("Accuracy", "accuracy.md"),
    ("Performance", "performance.md"),
    ("Reliability", "reliability.md"),
    ("Conventions", "conventions.md"),
    ("Glossary", "glossary.md"),
    ("Architecture", "architecture.md"),
    ("Plugins", "plugins.md"),
    ("What a stage must keep", "stage-spec.md"),
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
const TUTORIALS: [(&str, &str); 4] = [
    ("The paper in ten minutes", "paper.md"),
    ("My own recordings", "recordings.md"),
    ("Find what my model misses", "diagnosis.md"),
    ("My own stage", "stage.md"),
];

/// Writes `FOLDER/stages/*.md`, `FOLDER/causes/*.md`, `FOLDER/SUMMARY.md` and `FOLDER/pipeline.schema.json`, or says what would change. Pages of what is gone are removed.
pub fn run(folder: &Path, check: bool, registry: &Registry) -> Result<(), Failure> {
    let stages = folder.join("stages");
    let pages = files(registry).map_err(|error| Failure::failed(error, None))?;
    let mut wanted: Vec<(PathBuf, String)> = pages.into_iter().map(|(name, text)| (stages.join(name), text)).collect();
    let causes = folder.join("causes");
    let all = catalogue();
    wanted.push((causes.join("README.md"), index(&all)));
    wanted.extend(all.iter().map(|cause| (causes.join(format!("{}.md", cause.about().id)), page(*cause))));
    wanted.push((folder.join("SUMMARY.md"), contents(registry)));
    wanted.push((folder.join("pipeline.schema.json"), schema::text(registry)?));
    let mut stale = stale(&stages, &wanted);
    stale.extend(self::stale(&causes, &wanted));
    let changed: Vec<&(PathBuf, String)> =
        wanted.iter().filter(|(path, text)| fs::read_to_string(path).ok().as_ref() != Some(text)).collect();
    if check {
        let names: Vec<String> =
            changed.iter().map(|(path, _)| path).chain(&stale).map(|path| path.display().to_string()).collect();
        if names.is_empty() {
            return Ok(());
        }
        let help = "write them with `cargo run -- docs`".to_owned();
        return Err(Failure::failed(format!("the generated documentation is old: {}", names.join(", ")), Some(help)));
    }
    let known = folder.join("pipeline.schema.json");
    if let Some((there, _)) = changed.iter().find(|(path, _)| path.exists()).filter(|_| !known.is_file()) {
        let problem = format!("{} exists, and {} holds no book of afmid's", there.display(), folder.display());
        return Err(Failure::usage(
            problem,
            Some("give the folder of afmid's documentation, or an empty one".to_owned()),
        ));
    }
    if let Some(there) = stale.first().filter(|_| !known.is_file()) {
        let problem = format!("{} is no page of afmid's, and would be removed", there.display());
        return Err(Failure::usage(
            problem,
            Some("give the folder of afmid's documentation, or an empty one".to_owned()),
        ));
    }
    let fail = |path: &Path, error| Failure::failed(format!("{} cannot be written: {error}", path.display()), None);
    for folder in [&stages, &causes] {
        fs::create_dir_all(folder).map_err(|error| fail(folder, error))?;
    }
    let mut done = String::new();
    for (path, text) in changed {
        fs::write(path, text).map_err(|error| fail(path, error))?;
        done.push_str(&format!("wrote {}\n", path.display()));
    }
    for path in stale {
        fs::remove_file(&path).map_err(|error| fail(&path, error))?;
        done.push_str(&format!("removed {}\n", path.display()));
    }
    print(&done)
}

/// Pages that no stage or cause has any more.
fn stale(folder: &Path, wanted: &[(PathBuf, String)]) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut stale: Vec<PathBuf> = entries.filter(|path| wanted.iter().all(|(wanted, _)| wanted != path)).collect();
    stale.sort();
    stale
}
