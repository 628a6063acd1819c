//! Same program, config and data: the same bits on one thread and on many.

use crate::common::{afmid, config, files, simulated};

#[test]
fn a_result_is_the_same_bit_for_bit_on_one_thread_and_on_four() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = simulated(here, "archive", 8, 5);
    let set = files(&archive.folder);
    for (threads, result) in [("1", "one.h5"), ("4", "four.h5")] {
        let cache = format!("cache-{threads}");
        afmid(here, &["run", &config("paper.toml"), "--set", &set, "-j", threads, "-o", result, "--cache", &cache]);
    }
    let differences = afmid_pipeline::store::compare(&here.join("one.h5"), &here.join("four.h5")).expect("two results");
    assert!(differences.is_empty(), "{differences:?}");
}
