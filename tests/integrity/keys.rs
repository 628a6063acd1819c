//! What a key knows: processor, build, the whole command of a plugin.

use std::fs;
use std::path::Path;

use afmid_pipeline::cache::{Cache, Origin, arithmetic};
use afmid_pipeline::graph::load;
use afmid_pipeline::runner::{Change, Decision, Explanation, Surroundings, explain};

use super::common::afmid;
use super::small::{CONFIG, cached, folder, run};

/// What a run on a processor, or of a build, with this arithmetic would do.
fn explained(here: &Path, arithmetic: &str) -> Vec<Explanation> {
    let text = fs::read_to_string(here.join(CONFIG)).expect("the config");
    let registry = afmid::registry().expect("stages");
    let plan = load(&here.join(CONFIG).display().to_string(), &text, &[], &registry).expect("a config");
    let cache = Cache::open(&here.join("cache"));
    let files = cache.input_files(false);
    explain(&plan, &Surroundings { base: here, program: "afmid test", arithmetic, files: &files }, &cache)
}

#[test]
fn what_another_processor_or_build_computed_is_not_reused() {
    let scratch = folder(1, 20_000);
    let here = scratch.path();
    assert_eq!(run(here, "a.h5", "cache", &[]).code, Some(0));
    let own = arithmetic();
    let kept = |rows: &[Explanation]| rows.iter().filter(|row| row.decision == Decision::Reuse).count();
    // this test was built as the program was
    assert_eq!(kept(&explained(here, &own)), 3);
    let (level, checks) = if cfg!(debug_assertions) { ("checked", "unchecked") } else { ("unchecked", "checked") };
    let others = [
        own.replacen(level, checks, 1),
        own.replacen("opt-level ", "opt-level 1", 1),
        own.replacen("rustc 1.", "rustc 2.", 1),
        own.replacen('[', "[another ", 1),
        own.replacen("functions ", "functions 0", 1),
    ];
    for other in &others {
        assert_ne!(*other, own);
        let rows = explained(here, other);
        assert_eq!(kept(&rows), 0, "{other}");
        let changes = rows.iter().filter_map(|row| row.nearest.as_ref()).flat_map(|nearest| &nearest.changes);
        let told =
            changes.filter(|change| matches!(change, Change::Arithmetic { was, is } if *was == own && is == other));
        assert_eq!(told.count(), 3, "each stage says so: {rows:?}");
    }
}

#[test]
fn explain_says_which_processor_or_build_made_what_is_there() {
    let scratch = folder(1, 20_000);
    let here = scratch.path();
    assert_eq!(run(here, "a.h5", "cache", &[]).code, Some(0));
    // as if a node with other vector units had made it
    for path in cached(&here.join("cache"), "json") {
        let mut origin: Origin = serde_json::from_slice(&fs::read(&path).expect("bytes")).expect("an origin");
        assert_eq!(origin.arithmetic, arithmetic(), "the cache states it");
        let other = origin.key.chars().rev().collect::<String>();
        (origin.key, origin.arithmetic) = (other.clone(), "x86_64 [sse4.1]".to_owned());
        let to = here.join("cache").join(&other);
        fs::write(to.with_extension("json"), serde_json::to_vec(&origin).expect("JSON")).expect("written");
        fs::rename(path.with_extension("h5"), to.with_extension("h5")).expect("renamed");
        fs::remove_file(path).expect("removed");
    }
    let told = afmid(here, &["explain", CONFIG, "--cache", "cache"]);
    assert_eq!(told.matches("processor or build was x86_64 [sse4.1], is").count(), 3, "{told}");
    let json: serde_json::Value =
        serde_json::from_str(&afmid(here, &["explain", CONFIG, "--cache", "cache", "--json"])).expect("JSON");
    assert!(json.to_string().contains("\"arithmetic\""), "{json}");
    let ran = run(here, "b.h5", "cache", &[]);
    assert!(ran.code == Some(0) && !ran.stdout.contains("reused"), "{ran:?}");
}
